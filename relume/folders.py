"""`relume render` of many scenes: one after the other in one process, and a contact sheet.

Each scene becomes an OpenEXR picture, which says in its metadata of which render it is, and a PNG.
So that a render of a folder can go on, a scene is left alone of which there is such a picture.
"""

from __future__ import annotations

import dataclasses
import json
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.markup import escape

from relume import developing, fingerprint, metadata, output, pilot
from relume.checking import files_below
from relume.contact_sheet import write_sheet
from relume.denoising import MARK, marked
from relume.loading import translated_with_inputs, usable_variant
from relume.options import RenderOptions
from relume.passes import PassPlan
from relume.render_reports import report_look
from relume.rendering import (
    PLAIN_PICTURE,
    PassOptions,
    PictureOptions,
    header_of,
    render_scene,
)
from relume.session import CannotRender
from relume.tone import AS_IT_IS
from relume.translator.diagnostics import SceneError

if TYPE_CHECKING:
    from rich.console import Console

TIMES = "times.json"
"""File of the seconds that each picture took, by its name: pictures themselves tell no times."""

READABLE = (SceneError, CannotRender, output.OutputError, ValueError, OSError)
"""Errors that are a scene's; their text is for its reader."""


@dataclass(frozen=True)
class Row:
    """What became of a scene.

    Attributes:
        scene: its file.
        name: of its pictures below the folder, without extension, with `/`.
        error: why there is no picture; empty if there is one.
        size: width and height [pixel].
        spp: samples of a pixel.
        noise: relative to the mean; NaN where it is unknown.
        seconds: that it took.
        why: it ended early; empty if it did not.
        losses: what is not rendered as written.
        kept: whether the picture was there already.
        denoised: whether it has a denoised one beside it, which is shown.
    """

    scene: Path
    name: str
    error: str = ""
    size: tuple[int, int] = (0, 0)
    spp: int = 0
    noise: float = math.nan
    seconds: float = 0.0
    why: str = ""
    losses: tuple[str, ...] = ()
    kept: bool = False
    denoised: bool = False

    @property
    def linear(self) -> str:
        """Name of the OpenEXR picture below the folder."""
        return f"{self.name}.exr"

    @property
    def picture(self) -> str:
        """Name of the PNG below the folder."""
        return f"{self.name}{MARK if self.denoised else ''}.png"


def render_folder(
    paths: Sequence[str | Path],
    out: str | Path,
    options: RenderOptions | None = None,
    *,
    passes: PassOptions | None = None,
    picture: PictureOptions = PLAIN_PICTURE,
    console: Console,
    **settings: Any,
) -> list[Row]:
    """Render scenes one after the other, whatever becomes of one of them.

    Args:
        paths: scene files, Mitsuba scenes (.xml), and folders of scene files.
        out: folder that takes `NAME.exr` and `NAME.png` of each, `index.html` and `index.png`.
        options: as `relume.render`.
        passes: with `resume`, pictures of the very same renders are kept and others gone on with.
        picture: what becomes of each picture; its look is that of the PNGs.
        console: for progress and notes.
        settings: `time_limit` and `cluster` as `relume.rendering.render_scene`, for each scene; and
            fields of `RenderOptions`.

    Returns:
        A `Row` for each scene, in order.

    Raises:
        OutputError: the folder cannot be written to.
    """
    own = {field.name for field in dataclasses.fields(RenderOptions)} & settings.keys()
    options = RenderOptions.of(options, **{name: settings.pop(name) for name in own})
    passes = passes or PassOptions()
    folder = Path(out)
    check_folder(folder)
    scenes = list(named(paths))
    times = read_times(folder / TIMES)
    rows: list[Row] = []
    try:
        for index, (scene, name) in enumerate(scenes, 1):
            at = f"[bold]{index} of {len(scenes)}[/] {escape(str(scene))}"
            console.print(at, highlight=False)
            row = None
            if passes.resume:
                row = finished(scene, folder, name, options, passes, picture, times, console)
            if row is None:
                row = rendered(scene, folder, name, options, passes, picture, console, **settings)
            rows.append(row)
            if row.error:
                console.print(f"[red]{escape(row.error)}[/]", highlight=False)
            times[row.name] = row.seconds
            write_times(folder / TIMES, times)
            if row.why == "interrupted":
                break
    except KeyboardInterrupt:
        console.print("[yellow]interrupted[/]")
    write_sheet(rows, folder)
    return rows


def check_folder(folder: Path) -> None:
    """Check that pictures and a contact sheet can be written into a folder.

    Raises:
        OutputError: they cannot, or there is an `index.html` that is none of ours.
    """
    output.check_writable(folder / TIMES)
    if (folder / "index.html").exists() and not (folder / TIMES).exists():
        raise output.OutputError(f"{folder} has an index.html of something else: give another one")


def check_ours(*pictures: Path) -> None:
    """Check that pictures which are to be replaced were rendered by relume: no texture is lost.

    Raises:
        OutputError: one was not.
    """
    for path in pictures:
        if path.exists() and metadata.RENDER not in metadata.of_file(path):
            raise output.OutputError(f"{path} is no picture rendered by relume: not replaced")


def named(paths: Iterable[str | Path]) -> Iterator[tuple[Path, str]]:
    """Scene files with the names of their pictures, each once: below a folder as they lie there."""
    taken: set[str] = set()
    for path in map(Path, paths):
        for scene in files_below([path]):
            place = scene.relative_to(path) if path.is_dir() else Path(scene.name)
            name = stem = place.with_suffix("").as_posix()
            count = 1
            while name in taken:
                count += 1
                name = f"{stem}_{count}"
            taken.add(name)
            yield scene, name


# ---- one scene


def rendered(
    scene: Path,
    folder: Path,
    name: str,
    options: RenderOptions,
    passes: PassOptions,
    wishes: PictureOptions,
    console: Console,
    **settings: Any,
) -> Row:
    """The row of a scene that is rendered now; of an error, too."""
    start = time.perf_counter()
    picture, shown = folder / f"{name}.exr", folder / f"{name}.png"
    try:
        check_ours(picture, shown, marked(picture), marked(shown))
        # There is nothing to go on with where the picture is missing, or that of another render.
        if passes.resume and not passes_of(picture).exists():
            passes = dataclasses.replace(passes, resume=False)
        linear = dataclasses.replace(wishes, look=AS_IT_IS)
        found = render_scene(
            scene, options, out=picture, passes=passes, picture=linear, console=console, **settings
        )
        show(folder, name, wishes, console)
    except READABLE as error:
        return Row(scene, name, error=str(error), seconds=time.perf_counter() - start)
    except Exception as error:  # a defect of ours in one scene is no reason to leave out the others
        return Row(scene, name, error=f"{type(error).__name__}: {error}")
    return Row(
        scene,
        name,
        size=found.size,
        spp=found.spp,
        noise=found.noise,
        seconds=found.seconds,
        why=found.why,
        losses=found.losses,
        denoised=wishes.denoise,
    )


def show(folder: Path, name: str, wishes: PictureOptions, console: Console) -> None:
    """Develop the pictures of a scene, and say which exposure would show it."""
    for stem in (name, f"{name}{MARK}") if wishes.denoise else (name,):
        source = folder / f"{stem}.exr"
        found = developing.read(source)
        written = developing.write(found, source, folder / f"{stem}.png", wishes.look)
    report_look(written, found.image, wishes.look, developing.gamma_of(found), console)


def passes_of(picture: Path) -> Path:
    """File of the passes of a picture that is not finished."""
    return picture.with_name(picture.stem + ".passes.exr")


def finished(
    scene: Path,
    folder: Path,
    name: str,
    options: RenderOptions,
    passes: PassOptions,
    wishes: PictureOptions,
    times: dict[str, float],
    console: Console,
) -> Row | None:
    """The row of a scene whose picture is there already; None if it is not, or is another one."""
    picture = folder / f"{name}.exr"
    if not picture.exists():
        return None
    if wishes.denoise and not marked(picture).exists():
        return None
    try:
        translation, _ = translated_with_inputs(scene, options)
        planned = translation.plan
        options = RenderOptions.of(options, variant=usable_variant(planned, options.variant))
        facts = metadata.of_file(picture)
        there = json.loads(facts.get(metadata.RENDER, "{}"))
        before = str(there.get("integrator")), facts.get(metadata.CHOICE, "")
        choice = pilot.choice(translation, options, before)
    except READABLE:
        return None
    translation, options = choice.translation, choice.options
    plan = PassPlan.of(planned.width, planned.height, planned.spp, passes.per_pass)
    header = header_of(translation, options, plan)
    spp, noise = int(facts.get(metadata.SPP, 0)), float(facts.get(metadata.NOISE, "nan"))
    enough = spp >= planned.spp if passes.noise is None else noise <= passes.noise
    if not enough or any(fingerprint.differences(there, header.render)):
        return None
    show(folder, name, wishes, console)
    return Row(
        scene,
        name,
        size=(planned.width, planned.height),
        spp=spp,
        noise=noise,
        seconds=times.get(name, 0.0),
        losses=tuple(metadata.losses(translation)),
        kept=True,
        denoised=wishes.denoise,
    )


# ---- times


def read_times(path: Path) -> dict[str, float]:
    """Seconds by picture; none where the file is missing or damaged."""
    try:
        return {str(name): float(value) for name, value in json.loads(path.read_text()).items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def write_times(path: Path, times: dict[str, float]) -> None:
    """Write what `read_times` reads."""
    with output.replacing(path) as temporary:
        temporary.write_text(json.dumps(times, indent=1))
