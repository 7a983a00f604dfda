"""How relume's plugins are registered under every Mitsuba variant.

Mitsuba resolves ``mi.BSDF``, ``mi.Emitter`` and the like to the classes of the variant in use, so
a plugin class can only be defined while a variant is set, and once for each variant. A plugin file
therefore defines its class in a function `define`. Nothing is imported or defined before a scene
uses the plugin, so that a change of variant costs next to nothing.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any

import mitsuba as mi

_DEFINING = threading.RLock()
"""Mitsuba loads the objects of a scene in several threads; each class is to be defined once."""


def on_every_variant(define: Callable[[], None]) -> None:
    """Call `define()` once under each variant: now, if one is set, and whenever a new one gets set.

    Args:
        define: function without arguments that registers plugins.
    """
    defined = set()

    def visit(_old: str | None, new: str) -> None:
        if new not in defined:
            defined.add(new)
            define()

    mi.detail.add_variant_callback(visit)
    if mi.variant():
        visit(None, mi.variant())


def register_plugins(kind: str, package: str, names: tuple[str, ...]) -> None:
    """Register the plugins of a package under every variant that is or gets set.

    Args:
        kind: as in ``mi.register_bsdf``, ``mi.register_emitter`` and the like.
        package: dotted name of the package.
        names: ids of the plugins; each is defined by a module of that name, whose `define()`
            returns the class for the variant in use.
    """

    def register() -> None:
        add = getattr(mi, f"register_{kind}")
        for name in names:
            add(name, functools.partial(_make, f"{package}.{name}", mi.variant()))

    on_every_variant(register)


def _make(module: str, variant: str, props: Any) -> Any:
    with _DEFINING:
        _check_variant(module, variant)
        plugin = _plugin_class(module, variant)
    return plugin(props)


def runs_under(module: str, variant: str) -> bool:
    """Whether the plugin of a module works under a variant.

    A plugin works under ``llvm_ad_*`` and ``cuda_ad_*``. It is to say so if it also works under
    others: ``RUNS_UNDER = ("scalar", "polarized")`` in its module, or one of the two.
    """
    also = getattr(import_module(module), "RUNS_UNDER", ())
    return all(kind in also for kind in ("scalar", "polarized") if kind in variant)


def _check_variant(module: str, variant: str) -> None:
    """Raise ValueError with the variants that work if the plugin of a module does not run here."""
    if not runs_under(module, variant):
        works = ", ".join(name for name in mi.variants() if runs_under(module, name))
        name = module.rpartition(".")[2]
        raise ValueError(f"{name} does not work under {variant}; it works under {works}")


@functools.cache
def _plugin_class(module: str, _variant: str) -> Any:
    return import_module(module).define()
