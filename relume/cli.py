"""The command line: `relume check | render | merge | convert`, the workbench, and `doctor`."""

import functools
import json
import sys
import warnings

import click
from relume.translator.dialects import DIALECTS
from rich.console import Console

SIZE = "WIDTHxHEIGHT"


class Size(click.ParamType):
    """A size such as 640x480."""

    name = SIZE

    def convert(self, value, param, ctx):
        """The pair (width, height)."""
        width, _, height = value.lower().partition("x")
        if not (width.isdigit() and height.isdigit()):
            self.fail(f"expected {SIZE}, such as 640x480, found '{value}'", param, ctx)
        return int(width), int(height)


class Passes(click.ParamType):
    """A range of passes such as 10:20."""

    name = "START:STOP"

    def convert(self, value, param, ctx):
        """The pair (start, stop)."""
        start, _, stop = value.partition(":")
        if not (start.isdecimal() and stop.isdecimal() and int(start) < int(stop)):
            self.fail(f"expected START:STOP, such as 10:20, found '{value}'", param, ctx)
        return int(start), int(stop)


def scene_options(command):
    """Options of every command that translates a scene."""
    for option in (
        click.option(
            "--asset-path",
            "asset_path",
            multiple=True,
            metavar="DIR",
            type=click.Path(exists=True, file_okay=False),
            help="Look for the scene's files below DIR, too (repeatable).",
        ),
        click.option(
            "--dialect",
            type=click.Choice(DIALECTS),
            default="manual",
            show_default=True,
            help="Follow the manual, or the original program where the two differ.",
        ),
    ):
        command = option(command)
    return command


def cluster_options(command):
    """Options of a command that renders on several processes; it gets `cluster`."""

    @functools.wraps(command)
    def with_cluster(workers, address, tls_ca, tls_cert, tls_key, **options):
        from relume.cluster import MPI, Cluster

        tls = (tls_ca, tls_cert, tls_key)
        if workers is not None and address is not None:
            raise click.UsageError("give either --workers or --cluster")
        if any(tls) and not (all(tls) and (workers or address)):
            raise click.UsageError("--tls-ca, --tls-cert and --tls-key go together, with a cluster")
        if address == MPI and any(tls):
            raise click.UsageError("--cluster mpi takes certificates from dask's own settings")
        if address == MPI:
            with readable_errors():
                from relume.cluster.opening import join_mpi

                join_mpi()
        cluster = Cluster(workers, address, tls if all(tls) else None)
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


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="relume")
def main():
    """Legacy scene files, lit again."""
    warnings.showwarning = _show_warning


@main.command()
@click.argument("paths", nargs=-1, metavar="PATH...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--brief", is_flag=True, help="Leave out lines that are simply translated.")
@click.option("--explain", "code", metavar="CODE", help="Explain the code of a note, and stop.")
@scene_options
def check(
    paths: tuple[str, ...],
    as_json: bool,
    brief: bool,
    code: str | None,
    dialect: str,
    asset_path: tuple[str, ...],
) -> None:
    """Report what every line of scene files becomes, and how they would be rendered.

    PATH is a scene file or a folder of them. The exit status is 0 if everything is translated, 1
    if there are errors and 3 if something is unsupported.
    """
    from relume import checking

    if code is not None:
        try:
            click.echo(checking.explained(code))
        except KeyError as error:
            raise click.BadParameter(str(error), param_hint="--explain") from None
        return
    if not paths:
        raise click.UsageError("Missing argument 'PATH...'.")
    files = list(checking.files_below(paths))
    results = [checking.check_file(file, dialect, asset_path) for file in files]
    if as_json:
        click.echo(json.dumps(results, indent=1, ensure_ascii=False))
    else:
        checking.print_results(results, Console(), every_line=not brief)
        if not results:
            click.echo("no scene files found", err=True)
    sys.exit(checking.exit_status(results) if results else 1)


def not_nan(_ctx, _param, value):
    """Refuse NaN, which compares with nothing."""
    if value is not None and value != value:
        raise click.BadParameter("nan is no number of seconds")
    return value


@main.command()
@click.argument("scene", type=click.Path())
@click.option(
    "-o",
    "--output",
    "out",
    metavar="FILE",
    help="Picture file (.exr .hdr .png .bmp .ppm), or a folder.",
)
@click.option("--spp", type=click.IntRange(min=1), help="Samples of a pixel.")
@click.option("--size", type=Size(), help="Size of the picture.")
@click.option("--integrator", metavar="ID", help="Integrator plugin instead of the planned one.")
@click.option("--variant", metavar="NAME", help="Mitsuba variant instead of the planned one.")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="The same seed gives the same picture.",
)
@click.option(
    "--time-limit",
    type=click.FloatRange(min=0),
    metavar="SECONDS",
    callback=not_nan,
    help="Stop then, with what there is.",
)
@click.option("--resume", is_flag=True, help="Go on with the passes that FILE.passes.exr holds.")
@click.option("--keep", is_flag=True, help="Leave them there for a later --resume with more --spp.")
@click.option(
    "--passes",
    type=Passes(),
    help="Render passes START to STOP - 1 alone, into -o PART.exr for relume merge.",
)
@click.option(
    "--per-pass",
    type=click.IntRange(min=1),
    metavar="SPP",
    help="Samples of a pixel in a pass: more for many workers, see docs/scaling.md.",
)
@cluster_options
@scene_options
def render(scene, **options):
    """Render a scene file; Ctrl-C keeps the picture so far."""
    from relume.rendering import render_file

    console = Console(stderr=True)
    with readable_errors():
        for path in render_file(scene, console=console, **options):
            click.echo(path)


@main.command()
@click.argument("parts", nargs=-1, required=True, metavar="PART.exr...", type=click.Path())
@click.option(
    "-o",
    "--output",
    "out",
    required=True,
    metavar="FILE",
    help="Picture file; FILE.passes.exr takes the passes themselves.",
)
def merge(parts, out):
    """Merge passes that `relume render --passes` wrote into one picture.

    The exit status is 3 if passes are missing: the picture has fewer samples then.
    """
    from relume import merging

    console = Console(stderr=True)
    with readable_errors():
        written, missing = merging.merge(parts, out, console)
        for path in written:
            click.echo(path)
        sys.exit(3 if missing else 0)


@main.command()
@click.argument("scene", type=click.Path())
@click.option("-o", "--output", "out", metavar="FILE.xml", help="XML file; its files go beside it.")
@click.option("--python", "as_python", is_flag=True, help="Print the scene's Python dictionary.")
@scene_options
def convert(scene, out, as_python, dialect, asset_path):
    """Convert a scene file to Mitsuba XML, or print its Python dictionary."""
    from relume import convert as converter

    if (out is None) == (not as_python):
        raise click.UsageError("give either -o FILE.xml or --python")
    with readable_errors():
        if as_python:
            click.echo(converter.python_source(scene, dialect, asset_path))
        else:
            for path in converter.write_xml(scene, out, dialect, asset_path):
                click.echo(path)


@main.command()
@click.argument("scene", type=click.Path())
@click.option(
    "--with",
    "with_",
    default="volpath",
    show_default=True,
    metavar="ID|FILE",
    help="The reference: an integrator plugin, or a linear picture (.exr .hdr).",
)
@click.option("--integrator", metavar="ID", help="The first side, instead of the planned one.")
@click.option("--spp", type=click.IntRange(min=1), help="Samples of a pixel in all runs together.")
@click.option("--size", type=Size(), help="Size of the picture.")
@click.option(
    "--runs",
    type=click.IntRange(min=8),
    default=32,
    show_default=True,
    help="Independent renders of each side.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("-o", "--output", "out", metavar="FILE.html", help="Write a page with the pictures.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@scene_options
def compare(scene, out, as_json, **options):
    """Tell whether a scene looks the same by another integrator, or as in a picture.

    Both sides are rendered many times, so that every error has its interval. The exit status is 0
    if they agree, 4 if they differ and 1 after an error. Ctrl-C keeps the runs so far.
    """
    from relume.workbench import compare_table, comparing

    with readable_errors():
        found = comparing.run(scene, out, Console(stderr=True), **options)
        if as_json:
            click.echo(json.dumps(found.report(), indent=1, ensure_ascii=False))
        else:
            compare_table.print_report(found.report(), Console())
            if out:
                click.echo(f"\n{out}")
        sys.exit(0 if found.agree else 4)


@main.command()
@click.option("--method", "methods", multiple=True, metavar="ID", help="Only this (repeatable).")
@click.option(
    "--cell",
    "patterns",
    multiple=True,
    metavar="PATTERN",
    help="Only cells such as 'grey ball/*' (repeatable).",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("-o", "--output", "out", metavar="DIR", help="Write a page and a heat map.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def stability(as_json, **options):
    """Measure every method at the inputs where it may fail, against known answers.

    The exit status is 0 if no cell fails without saying so, 4 if one does and 1 after an error.
    Ctrl-C keeps the cells so far.
    """
    from relume.workbench import stability as grid

    with readable_errors():
        found = grid.run(Console(stderr=True), **options)
        if as_json:
            click.echo(json.dumps(found, indent=1, ensure_ascii=False))
        else:
            grid.print_report(found, Console())
        sys.exit(4 if any(cell["silent"] for cell in found["cells"]) else 0)


@main.command()
@click.argument("scenes", nargs=-1, required=True, type=click.Path(), metavar="SCENE...")
@click.option(
    "-o",
    "--output",
    "out",
    default="charts",
    show_default=True,
    metavar="DIR",
    help="Folder for figures (SVG, PNG) and data (CSV).",
)
@click.option(
    "--method",
    multiple=True,
    metavar="ID",
    help="A method or integrator plugin (repeatable); by default all that can render the scene.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    default=60.0,
    show_default=True,
    callback=not_nan,
    help="Time of all measured renders of a scene, about.",
)
@click.option(
    "--runs",
    type=click.IntRange(min=4),
    default=8,
    show_default=True,
    help="Independent renders at each number of samples.",
)
@click.option("--size", type=Size(), help="Size of the pictures; by default at most 160 across.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--reference", metavar="ID", help="Method of the reference; by default unbiased.")
@click.option("--cache", metavar="DIR", help="Folder of references instead of the user's cache.")
@scene_options
def chart(scenes, out, **options):
    """Chart the error of methods over time: who is how accurate after how many seconds?

    Every method renders independent pictures of growing numbers of samples, in turn with the
    others. The reference is kept for the next time. Ctrl-C keeps what is done. The exit status is 1
    if a scene has no chart.
    """
    from relume.workbench import chart_files, chart_table

    with readable_errors():
        charts, written, failed = chart_files.run(scenes, out, Console(stderr=True), **options)
    for made in charts:
        click.echo("\n".join([*chart_table.lines(made), ""]))
    for line in chart_table.explanations(charts[-1]) if charts else ():
        click.echo(line)
    for path in written:
        click.echo(path)
    for scene, why in failed.items():
        click.echo(f"relume: {scene}: {why}", err=True)
    sys.exit(1 if failed else 0)


@main.command()
def doctor():
    """Tell what this machine renders with, and what to do if it does not."""
    from relume import doctor as examination

    sys.exit(examination.run())


class readable_errors:
    """Context that turns expected failures into messages and exit status 1."""

    def __enter__(self):
        return self

    def __exit__(self, _kind, error, _trace):
        from relume.translator.diagnostics import SceneError

        from relume.output import OutputError
        from relume.session import CannotRender

        if isinstance(error, SceneError):
            for line in error.described():
                click.echo(line, err=True)
            sys.exit(1)
        if isinstance(error, OSError) and error.strerror:
            error = f"{error.filename}: {error.strerror}"
        if isinstance(error, CannotRender | OutputError | ValueError | OSError | str):
            click.echo(f"relume: {error}", err=True)
            sys.exit(1)
        return False


def _show_warning(message, *_):
    click.echo(f"warning: {message}", err=True)
