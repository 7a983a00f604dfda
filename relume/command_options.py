"""Options that several commands of the command line share, and the forms of their values."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from relume.command_errors import readable_errors
from relume.completion import completing, integrator_names, variant_names
from relume.layer_names import LAYERS
from relume.options import SAMPLERS, RenderOptions
from relume.tone import AUTO, MOST_STOPS, TONE_MAPS, Look
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


class Noise(click.ParamType):
    """A noise such as 5%."""

    name = "PERCENT"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The ratio to the mean."""
        number = str(value).removesuffix("%").strip()
        try:
            ratio = float(number) / 100
        except ValueError:
            ratio = -1.0
        if not (str(value).endswith("%") and 0 < ratio < math.inf):
            self.fail(f"expected a percentage such as 5%, found '{value}'", param, ctx)
        return ratio


class Address(click.ParamType):
    """A host and a port, such as localhost:14158."""

    name = "HOST:PORT"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        """The pair (host, port)."""
        host, _, port = value.rpartition(":")
        if not (host and port.isdecimal() and 0 < int(port) < 65536):
            self.fail(f"expected HOST:PORT, such as localhost:14158, found '{value}'", param, ctx)
        return host, int(port)


class Layers(click.ParamType):
    """Names of layers such as albedo,normal."""

    name = "NAME,..."

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        """The names."""
        names = value if isinstance(value, tuple) else tuple(value.split(","))
        for name in names:
            if name not in LAYERS:
                self.fail(f"no layer '{name}', expected some of {', '.join(LAYERS)}", param, ctx)
        return names

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The last of the names, after the others."""
        before, comma, last = incomplete.rpartition(",")
        found = (name for name in LAYERS if name.startswith(last))
        return [CompletionItem(before + comma + name) for name in found]


class Exposure(click.ParamType):
    """An exposure in stops such as -1.5, or `auto`."""

    name = "auto|EV"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float | str:
        """The number of stops, or `auto`."""
        if value == AUTO:
            return AUTO
        try:
            stops = float(value)
        except ValueError:
            stops = math.nan
        if not abs(stops) <= MOST_STOPS:
            self.fail(f"expected auto or stops such as -1.5, found '{value}'", param, ctx)
        return stops


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
    "integrator": {
        "metavar": "ID",
        "shell_complete": completing(integrator_names),
        "help": "Integrator plugin, or bdpt-merging, instead of the planned one.",
    },
    "variant": {
        "metavar": "NAME",
        "shell_complete": completing(variant_names),
        "help": "Mitsuba variant instead of the planned one.",
    },
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
    "stand_ins": {
        "is_flag": True,
        "help": "Show something in the place of pictures that are missing.",
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
    """Options of every command that translates a scene: how, and with which files."""
    for field in ("stand_ins", "asset_path", "dialect"):
        command = render_option(field)(command)
    return command


def look_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of a command that writes pictures to look at; it gets `look`."""

    @functools.wraps(command)
    def with_look(exposure: float | str, tone_map: str, **options: Any) -> Any:
        return command(look=Look(exposure, tone_map), **options)

    for option in (
        click.option(
            "--tone-map",
            type=click.Choice(list(TONE_MAPS)),
            default="linear",
            show_default=True,
            help="Curve of pictures encoded for display (.png .bmp .ppm).",
        ),
        click.option(
            "--exposure",
            type=Exposure(),
            default=0.0,
            help="Their exposure in stops, each a factor of 2, or auto.",
        ),
    ):
        with_look = option(with_look)
    return with_look


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
