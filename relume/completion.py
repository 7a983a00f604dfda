"""What the shell's tab key offers for the values of options."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

Complete = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def completing(values: Callable[[], Iterable[str]]) -> Complete:
    """A completion of the values that a function returns, once it is asked for."""

    def complete(
        _ctx: click.Context, _param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        return [CompletionItem(value) for value in values() if value.startswith(incomplete)]

    return complete


STOCK = ("path", "volpath", "volpathmis", "direct", "ptracer", "prb", "prbvolpath", "aov", "depth")
"""Mitsuba's own integrators that render pictures to look at."""


def integrator_names() -> list[str]:
    """Names of integrators: relume's own, and Mitsuba's."""
    from relume.integrators import PLUGINS
    from relume.loading import VARIATIONS

    return sorted({*PLUGINS, *STOCK, *VARIATIONS})


def variant_names() -> list[str]:
    """Variants that this Mitsuba has."""
    import mitsuba as mi

    return sorted(mi.variants())


def method_names() -> list[str]:
    """Methods of the workbench, and integrators."""
    from relume.workbench.methods import METHODS

    return sorted({*(row.name for row in METHODS), *integrator_names()})


def example_names() -> list[str]:
    """Names of the example scenes."""
    from relume import examples

    return sorted(examples.names())
