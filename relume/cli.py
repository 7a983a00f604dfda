"""The command line: `relume check | merge | convert | scenes | doctor`, pictures, the workbench."""

from __future__ import annotations

import json
import sys
import warnings
from typing import Any, TextIO

import click

from relume.cli_pictures import develop, render
from relume.command_errors import readable_errors
from relume.command_options import (
    not_nan,
    render_option,
    scene_options,
)
from relume.completion import completing, example_names, method_names
from relume.consoles import console


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="relume")
def main() -> None:
    """Legacy scene files, lit again."""
    warnings.showwarning = _show_warning


@main.command()
@click.argument("paths", nargs=-1, type=click.Path(), metavar="PATH...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--brief", is_flag=True, help="Leave out lines that are simply translated.")
@click.option("-v", "--verbose", is_flag=True, help="List all lines of files in folders, too.")
@click.option("--explain", "code", metavar="CODE", help="Explain the code of a note, and stop.")
@scene_options
def check(
    paths: tuple[str, ...],
    as_json: bool,
    brief: bool,
    verbose: bool,
    code: str | None,
    dialect: str,
    asset_path: tuple[str, ...],
    stand_ins: bool,
) -> None:
    """Report what every line of scene files becomes, and how they would be rendered.

    PATH is a scene file or a folder of them, whose files have a line each. The exit status is 0 if
    everything is translated, 1 if there are errors and 3 if something is unsupported.
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
    results = [
        checking.check_file(file, dialect, asset_path, stand_ins=stand_ins) for file in files
    ]
    if as_json:
        click.echo(json.dumps(results, indent=1, ensure_ascii=False))
    else:
        if checking.has_folder(paths) and not (verbose or brief):
            checking.print_overview(results, console())
        else:
            checking.print_results(results, console(), every_line=not brief)
        if not results:
            click.echo("no scene files found", err=True)
    sys.exit(checking.exit_status(results) if results else 1)


main.add_command(render)
main.add_command(develop)


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
def merge(parts: tuple[str, ...], out: str) -> None:
    """Merge passes that `relume render --passes` wrote into one picture.

    The exit status is 3 if passes are missing: the picture has fewer samples then.
    """
    from relume import merging

    with readable_errors():
        written, missing = merging.merge(parts, out, console(stderr=True))
        for path in written:
            click.echo(path)
        sys.exit(3 if missing else 0)


@main.command()
@click.argument("scene", type=click.Path())
@click.option("-o", "--output", "out", metavar="FILE.xml", help="XML file; its files go beside it.")
@click.option("--python", "as_python", is_flag=True, help="Print the scene's Python dictionary.")
@scene_options
def convert(scene: str, out: str | None, as_python: bool, **options: Any) -> None:
    """Convert a scene file to Mitsuba XML, or print its Python dictionary."""
    from relume import convert as converter

    if (out is None) == (not as_python):
        raise click.UsageError("give either -o FILE.xml or --python")
    notes: list[str] = []
    with readable_errors():
        if out is None:
            click.echo(converter.python_source(scene, tell=notes.append, **options))
        else:
            for path in converter.write_xml(scene, out, tell=notes.append, **options):
                click.echo(path)
            click.echo(f"render it by: {converter.render_command(out)}", err=True)
    for note in notes:
        click.echo(f"note: {note}", err=True)


@main.command()
@click.argument("scene", type=click.Path())
@click.option(
    "--with",
    "with_",
    default="volpath",
    show_default=True,
    metavar="ID|FILE",
    shell_complete=completing(method_names),
    help="The reference: an integrator plugin, or a linear picture (.exr .hdr).",
)
@render_option("integrator", help="The first side, instead of the planned one.")
@render_option("variant")
@click.option("--spp", type=click.IntRange(min=1), help="Samples of a pixel in all runs together.")
@render_option("size")
@click.option(
    "--runs",
    type=click.IntRange(min=8),
    default=32,
    show_default=True,
    help="Independent renders of each side.",
)
@render_option("sampler")
@render_option("seed", help="The same seed gives the same comparison, but for the times.")
@click.option("-o", "--output", "out", metavar="FILE.html", help="Write a page with the pictures.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@scene_options
def compare(scene: str, out: str | None, as_json: bool, **options: Any) -> None:
    """Tell whether a scene looks the same by another integrator, or as in a picture.

    SCENE is a scene file, or a Mitsuba scene (.xml).

    Both sides are rendered many times, so that every error has its interval. The exit status is 0
    if they agree, 4 if they differ and 1 after an error. Ctrl-C keeps the runs so far.
    """
    from relume.workbench import compare_table, comparing

    with readable_errors():
        found = comparing.run(scene, out, console(stderr=True), **options)
        if as_json:
            click.echo(json.dumps(found.report(), indent=1, ensure_ascii=False))
        else:
            compare_table.print_report(found.report(), console())
            if out:
                click.echo(f"\n{out}")
        sys.exit(0 if found.agree else 4)


@main.command()
@click.option(
    "--method",
    "methods",
    multiple=True,
    metavar="ID",
    shell_complete=completing(method_names),
    help="Only this (repeatable).",
)
@click.option(
    "--cell",
    "cells",
    multiple=True,
    metavar="PATTERN",
    help="Only cells such as 'grey ball/*' (repeatable).",
)
@render_option("seed", help="The same seed gives the same verdicts.")
@click.option("-o", "--output", "out", metavar="DIR", help="Keep results; write a page.")
@click.option("--resume", is_flag=True, help="Only what DIR lacks of this version.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def stability(as_json: bool, **options: Any) -> None:
    """Measure every method at the inputs where it may fail, against known answers.

    DIR/stability.json keeps each cell as soon as it is measured; page and heat map show all that it
    has, also of earlier calls. The exit status is 0 if no cell fails without saying so, 4 if one
    does and 1 after an error. Ctrl-C keeps the cells so far.
    """
    from relume.workbench import stability as grid

    with readable_errors():
        found = grid.run(console(stderr=True), **options)
        if as_json:
            click.echo(json.dumps(found.report(), indent=1, ensure_ascii=False))
        else:
            grid.print_report(found, console())
        sys.exit(4 if found.silent else 0)


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
    "methods",
    multiple=True,
    metavar="ID",
    shell_complete=completing(method_names),
    help="A method or integrator plugin (repeatable); by default all that differ for the scene.",
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
@render_option("size", help="Size of the pictures; by default at most 160 across.")
@render_option("sampler")
@render_option("seed", help="The same seed gives the same pictures, but not their times.")
@click.option("--reference", metavar="ID", help="Method of the reference; by default unbiased.")
@render_option("variant")
@click.option("--cache", metavar="DIR", help="Folder of references instead of the user's cache.")
@scene_options
def chart(scenes: tuple[str, ...], out: str, **options: Any) -> None:
    """Chart the error of methods over time: who is how accurate after how many seconds?

    SCENE is a scene file, or a Mitsuba scene (.xml).

    Every method renders independent pictures of growing numbers of samples, in turn with the
    others. The reference is kept for the next time. Ctrl-C keeps what is done. The exit status is 1
    if a scene has no chart.
    """
    from relume.workbench import chart_files, chart_table

    with readable_errors():
        charts, written, failed = chart_files.run(scenes, out, console(stderr=True), **options)
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
@click.argument("names", nargs=-1, metavar="[NAME...]", shell_complete=completing(example_names))
@click.option("-o", "--output", "out", metavar="DIR", help="Folder to copy them to.")
def scenes(names: tuple[str, ...], out: str | None) -> None:
    """List the example scenes, or copy some with the files that they name.

    With NAMEs alone they are copied to the working directory, with -o DIR alone all are.
    """
    from relume import examples

    if not names and out is None:
        examples.print_names(console())
        return
    with readable_errors():
        for path in examples.copy(names or examples.names(), out or "."):
            click.echo(path)


@main.command()
def doctor() -> None:
    """Tell what this machine renders with, and what to do if it does not."""
    from relume import doctor as examination

    sys.exit(examination.run())


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    click.echo(f"warning: {message}", err=True)
