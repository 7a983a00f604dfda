"""Options that several commands of the command line share, and the forms of their values."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, TypeVar

import click

from relume.command_errors import readable_errors
from relume.options import SAMPLERS, RenderOptions
from relume.translator.dialects import DIALECTS

SIZE = "WIDTHxHEIGHT"

Command = TypeVar("Command", bound=Callable[..., Any])


class Size(click.ParamType):
    """A size such as 640x480."""

    name = SIZE

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """The pair (width, height)."""
        width, _, height = value.lower().partition("x")
        if not (width.isdigit() and height.isdigit()):
            self.fail(f"expected {SIZE}, such as 640x480, found '{value}'", param, ctx)
        return int(width), int(height)


class Passes(click.ParamType):
    """A range of passes such as 10:20."""

    name = "START:STOP"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """The pair (start, stop)."""
        start, _, stop = value.partition(":")
        if not (start.isdecimal() and stop.isdecimal() and int(start) < int(stop)):
            self.fail(f"expected START:STOP, such as 10:20, found '{value}'", param, ctx)
        return int(start), int(stop)


def not_nan(_ctx: click.Context, _param: click.Parameter, value: float | None) -> float | None:
    """Refuse NaN, which compares with nothing."""
    if value is not None and value != value:
        raise click.BadParameter("nan is no number of seconds")
    return value


# ---- how a scene is rendered

RENDER_OPTIONS: dict[str, dict[str, Any]] = {
    "size": {"type": Size(), "help": "Size of the picture."},
    "spp": {"type": click.IntRange(min=1), "help": "Samples of a pixel."},
    "seed": {
        "type": click.IntRange(min=0),
        "show_default": True,
        "help": "The same seed gives the same picture.",
    },
    "integrator": {"metavar": "ID", "help": "Integrator plugin instead of the planned one."},
    "variant": {"metavar": "NAME", "help": "Mitsuba variant instead of the planned one."},
    "sampler": {
        "type": click.Choice(SAMPLERS),
        "show_default": True,
        "help": "Numbers spread evenly in each pixel, or independent ones.",
    },
    "dialect": {
        "type": click.Choice(DIALECTS),
        "show_default": True,
        "help": "Follow the manual, or the original program where the two differ.",
    },
    "asset_path": {
        "multiple": True,
        "metavar": "DIR",
        "type": click.Path(exists=True, file_okay=False),
        "help": "Look for the scene's files below DIR, too (repeatable).",
    },
}
"""The option of each field of `RenderOptions`, which gives its default."""

DEFAULTS: dict[str, Any] = {
    field.name: field.default for field in dataclasses.fields(RenderOptions)
}


def render_option(field: str, **changes: Any) -> Callable[[Command], Command]:
    """The option of a field of `RenderOptions`.

    Args:
        field: name of the field; the command gets the value under it.
        changes: what is particular to the command, such as `help`.
    """
    name = "--" + field.replace("_", "-")
    settings: dict[str, Any] = {"default": DEFAULTS[field]} | RENDER_OPTIONS[field] | changes
    return click.option(name, field, **settings)


def scene_options(command: Command) -> Command:
    """Options of every command that translates a scene: `--dialect` and `--asset-path`."""
    return render_option("dialect")(render_option("asset_path")(command))


# ---- clusters


def cluster_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of a command that renders on several processes; it gets `cluster`."""

    @functools.wraps(command)
    def with_cluster(
        workers: int | None,
        address: str | None,
        tls_ca: str | None,
        tls_cert: str | None,
        tls_key: str | None,
        **options: Any,
    ) -> Any:
        from relume.cluster import MPI, Cluster

        given = (tls_ca, tls_cert, tls_key)
        tls = (tls_ca, tls_cert, tls_key) if tls_ca and tls_cert and tls_key else None
        if workers is not None and address is not None:
            raise click.UsageError("give either --workers or --cluster")
        if any(given) and not (tls and (workers or address)):
            raise click.UsageError("--tls-ca, --tls-cert and --tls-key go together, with a cluster")
        if address == MPI and tls:
            raise click.UsageError("--cluster mpi takes certificates from dask's own settings")
        if address == MPI:
            with readable_errors():
                from relume.cluster.opening import join_mpi

                join_mpi()
        cluster = Cluster(workers, address, tls)
        return command(cluster=cluster if workers or address else None, **options)

    file = click.Path(exists=True, dir_okay=False)
    for option in (
        click.option("--tls-key", type=file, metavar="FILE", help="Its private key (PEM)."),
        click.option("--tls-cert", type=file, metavar="FILE", help="Our certificate (PEM)."),
        click.option("--tls-ca", type=file, metavar="FILE", help="Encrypt; trust this authority."),
        click.option(
            "--cluster",
            "address",
            metavar="ADDRESS",
            help="Render on the workers of a dask scheduler, such as tcp://host:8786, or mpi.",
        ),
        click.option(
            "--workers",
            type=click.IntRange(1, 1024),
            metavar="N",
            help="Render in N processes of this machine.",
        ),
    ):
        with_cluster = option(with_cluster)
    return with_cluster
