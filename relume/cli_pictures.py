"""The commands that make pictures: `relume render | develop`."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

import click

from relume.command_errors import readable_errors
from relume.command_options import (
    Address,
    Layers,
    Noise,
    Passes,
    cluster_options,
    look_options,
    not_nan,
    render_option,
    scene_options,
)
from relume.consoles import console
from relume.layer_names import LAYERS
from relume.tone import Look


@click.command()
@click.argument("paths", nargs=-1, required=True, type=click.Path(), metavar="SCENE...")
@click.option(
    "-o",
    "--output",
    "out",
    metavar="FILE",
    help="Picture file (.exr .hdr .png .bmp .ppm), or a folder.",
)
@render_option("spp")
@render_option("size")
@render_option("integrator")
@render_option("variant")
@render_option("sampler")
@render_option("seed")
@click.option(
    "--noise",
    type=Noise(),
    metavar="PERCENT",
    help="Render until the noise of a pixel is so low, such as 5%, whatever samples it takes.",
)
@click.option(
    "--time-limit",
    type=click.FloatRange(min=0),
    metavar="SECONDS",
    callback=not_nan,
    help="Stop then, with what there is; of many scenes, each.",
)
@click.option("--resume", is_flag=True, help="Go on with the passes that FILE.passes.exr holds.")
@click.option("--keep", is_flag=True, help="Leave them there for a later --resume with more --spp.")
@click.option(
    "--passes",
    "only",
    type=Passes(),
    help="Render passes START to STOP - 1 alone, into -o PART.exr for relume merge.",
)
@click.option(
    "--per-pass",
    type=click.IntRange(min=1),
    metavar="SPP",
    help="Samples of a pixel in a pass: more for many workers, see docs/scaling.md.",
)
@click.option(
    "--aov",
    "layers",
    type=Layers(),
    default=(),
    metavar="NAME,...",
    help=f"Layers of the OpenEXR picture: {', '.join(LAYERS)}.",
)
@click.option("--denoise", is_flag=True, help="Write a denoised picture beside the rendered one.")
@click.option(
    "--live", is_flag=True, help="Serve a page that shows the render; its address is told."
)
@click.option("--open", "opened", is_flag=True, help="Open that page in the browser.")
@click.option(
    "--tev", type=Address(), metavar="HOST:PORT", help="Send the picture so far to the viewer tev."
)
@click.option("--show", is_flag=True, help="Print the picture, in a terminal that shows pictures.")
@look_options
@cluster_options
@scene_options
def render(
    paths: tuple[str, ...],
    out: str | None,
    noise: float | None,
    resume: bool,
    keep: bool,
    only: tuple[int, int] | None,
    per_pass: int | None,
    look: Look,
    layers: tuple[str, ...],
    denoise: bool,
    live: bool,
    opened: bool,
    tev: tuple[str, int] | None,
    show: bool,
    **options: Any,
) -> None:
    """Render a scene file, or a Mitsuba scene (.xml); Ctrl-C keeps the picture so far.

    Of several files, and of folders, each scene is rendered into the folder -o, in one process and
    whatever becomes of the others; index.html and index.png show them all. The exit status is 1 if
    one has no picture. With --resume, pictures that are there are left alone.
    """
    from relume.rendering import PassOptions, PictureOptions, render_scene

    passes = PassOptions(resume, keep, only, per_pass, noise)
    options["picture"] = PictureOptions(look, layers, denoise)
    options["viewers"] = _viewers(live or opened, opened, tev)
    with readable_errors():
        if len(paths) > 1 or Path(paths[0]).is_dir():
            sys.exit(_render_folder(paths, out, passes, options))
        found = render_scene(
            paths[0], out=out, passes=passes, console=console(stderr=True), **options
        )
        for path in found.paths:
            click.echo(path)
        if show:
            _show(found.paths[-1 if denoise else 0], look)


def _viewers(live: bool, opened: bool, tev: tuple[str, int] | None) -> list[Any]:
    """What makes those who look at the render."""
    found: list[Any] = []
    if live:
        from relume.live import LivePage

        def announce(url: str) -> None:
            click.echo(f"live: {url}", err=True)
            if opened:
                click.launch(url)

        found.append(partial(LivePage, announce=announce))
    if tev:
        from relume.tev import Tev

        found.append(partial(Tev, address=tev, console=console(stderr=True)))
    return found


def _show(path: Path, look: Look) -> None:
    """Print a picture in the terminal."""
    from relume import terminal_pictures

    if not terminal_pictures.show(path, look, console()):
        click.echo("--show: no terminal that shows pictures (kitty, iTerm2, sixel)", err=True)


def _render_folder(
    paths: tuple[str, ...], out: str | None, passes: Any, options: dict[str, Any]
) -> int:
    """Render many scenes; the exit status."""
    from relume import contact_sheet, folders

    if out is None or (Path(out).suffix and not Path(out).is_dir()):
        raise click.UsageError("several scenes need a folder for their pictures: -o OUT/")
    if passes.only:
        raise click.UsageError("--passes is for one scene")
    rows = folders.render_folder(paths, out, passes=passes, console=console(stderr=True), **options)
    contact_sheet.print_table(rows, console(stderr=True))
    if not rows:
        click.echo("no scene files found", err=True)
    click.echo(Path(out, "index.html"))
    return 1 if not rows or any(row.error for row in rows) else 0


@click.command()
@click.argument("picture", type=click.Path(), metavar="FILE.exr")
@click.option(
    "-o",
    "--output",
    "out",
    required=True,
    metavar="FILE.png",
    help="The picture to look at (.png .bmp .ppm), or a linear one (.exr .hdr).",
)
@click.option(
    "--denoise",
    is_flag=True,
    help="Denoise it first, with the guides that it holds; the name says so.",
)
@look_options
def develop(picture: str, out: str, look: Look, denoise: bool) -> None:
    """Make a picture to look at of a linear one (.exr .hdr), of any renderer."""
    from relume import developing, render_reports

    with readable_errors():
        found, target = developing.read(picture), Path(out)
        if denoise:
            found, target = developing.denoised(found, target)
        written = developing.write(found, picture, target, look)
        gamma = developing.gamma_of(found)
        render_reports.report_look(written, found.image, look, gamma, console(stderr=True))
        for path in written.paths:
            click.echo(path)
