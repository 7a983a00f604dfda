"""`relume compare`: one scene rendered by two methods, or by one against a picture; do they agree?

Each method makes many short independent renders of the same loaded scene, in turn, with seeds of
their own. Their scatter gives every error its interval. The verdict is `differ` if any of the
tests of `statistics.all_levels` rejects (whole picture, blocks, pixels, together at a stated rate
of false alarms) or a value is no finite number, else `agree`.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from relume import developing, metadata, passes_file
from relume.inputs import Inputs
from relume.loading import (
    SceneSource,
    resized,
    samples_of,
    source_of,
    translated_with_inputs,
    translation_of,
    variant_and_threads,
)
from relume.options import SAMPLERS, RenderOptions
from relume.output import OutputError, check_writable, replacing
from relume.progress import interruptible
from relume.session import CannotRender, exr_threads, reason, variant_context
from relume.workbench import estimate_files, estimates, measures, methods, renders, statistics
from relume.workbench.compare_page import page
from relume.workbench.comparison import FALSE_ALARMS, Comparison, Side
from relume.workbench.estimates import Estimate
from relume.workbench.renders import MitsubaIntegrator, MitsubaScene
from relume.workbench.scenes import Progress, name_of, notes, option_words

RUNS = 32
FEWEST_RUNS = 8
"""Below, the scatter of the runs says too little of a variance."""

PAGES = (".html", ".htm")
PICTURES = (".exr", ".hdr")


def run(
    scene: SceneSource, out: str | Path | None, console: Console, **arguments: Any
) -> Comparison:
    """Compare with a progress bar and write the page.

    Args:
        scene: as `compare`.
        out: file of the page, or None.
        console: for the progress bar.
        arguments: as `compare`.

    Raises:
        OutputError: the page cannot be written; and what `compare` raises.
    """
    if out is not None:
        of_scene = ("dialect", "asset_path", "stand_ins")
        options = {k: v for k, v in arguments.items() if k in of_scene}
        _, inputs = translated_with_inputs(scene, RenderOptions(**options))
        check_page(Path(out), inputs.and_(arguments.get("with_", "")))
    columns = (TextColumn("run"), MofNCompleteColumn(), BarColumn(), TimeRemainingColumn())
    quiet = not console.is_terminal
    with (
        Bar(*columns, console=console, transient=True, disable=quiet) as bar,
        interruptible() as stop,
    ):
        task = bar.add_task("compare")

        def progress(done: int, runs: int) -> bool:
            bar.update(task, completed=done, total=runs)
            return bool(stop)

        found = compare(scene, progress=progress, **arguments)
    if out is not None:
        text = page(found)
        with replacing(Path(out)) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return found


def check_page(out: Path, inputs: Inputs) -> None:
    """Check that the page of a comparison can be written.

    Raises:
        OutputError: it cannot, or would go over one of the files that are read.
    """
    if out.is_dir():
        raise OutputError(f"cannot write {out}: it is a folder")
    if out.suffix.lower() not in PAGES:
        raise OutputError(f"cannot write {out}: the name of a page ends with .html")
    inputs.refuse(out)
    check_writable(out)


def compare(
    scene: SceneSource,
    options: RenderOptions | None = None,
    *,
    with_: str = "volpath",
    runs: int = RUNS,
    progress: Progress | None = None,
    **changes: Any,
) -> Comparison:
    """Compare a scene's picture with that of another integrator, or with a picture.

    Args:
        scene: a scene file or Mitsuba scene (.xml), or what `relume.read` returned.
        options: how the first side is rendered; `integrator` is its method (see `methods`), by
            default the planned one, and `spp` the samples of a pixel of each side in all its runs
            together, rounded up to a multiple of `runs`, by default the scene's. The same `seed`
            gives the same comparison but for the times.
        with_: the reference: a method, which gets the same scene, depths and number of samples; or
            a linear picture, .exr or .hdr, whose size is taken. An .exr that holds its variance
            (see `estimate_files`) is taken at its word; the noise of another picture is estimated.
        runs: independent renders of each side, `FEWEST_RUNS` or more.
        progress: called with the number of runs done and of all runs; rendering stops if it returns
            True.
        changes: fields of `options` by name.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: an integrator does not work here, or too few runs were done.
        ValueError: a number out of range, or a picture that cannot be read or has another size.
    """
    options = RenderOptions.of(options, **changes)
    seed, size = options.seed, options.size
    if runs < FEWEST_RUNS:
        raise ValueError(f"runs {runs}: expected {FEWEST_RUNS} or more")
    if seed < 0:
        raise ValueError(f"seed {seed}: expected 0 or more")
    picture: np.ndarray | None = None
    stored: Estimate | None = None
    if Path(with_).suffix:
        picture, stored = load_picture(with_)
        of_picture = (picture.shape[1], picture.shape[0])
        if size is not None and tuple(size) != of_picture:
            raise ValueError("size {}x{}: {} has {}x{}".format(*size, with_, *of_picture))
        size = of_picture
    document = source_of(scene, options)
    each = -(-(samples_of(document) if options.spp is None else options.spp) // runs)
    # Translated for all samples: what depends on their number must be that of one long render.
    document = resized(document, size, each * runs)
    translation = translation_of(document, options)
    plan, integrator = translation.plan, options.integrator
    first = methods.find(integrator) if integrator else methods.planned(translation)
    wanted = [first] if picture is not None else [first, methods.find(with_)]
    for method in wanted if methods.bends(translation) else ():
        if why := methods.obstacle(method, translation):
            raise CannotRender(f"{method.name}: {why}; --with also takes a picture")
    with variant_and_threads(translation, options.variant):
        stage = methods.Stage(document, translation, options)
        loaded = [(method.name, *stage.load(method)) for method in wanted]
        sides = render_in_turn(loaded, each, runs, seed, progress, options.sampler)
    if picture is not None:
        sides.append(picture_side(with_, picture, stored, sides[0].estimate))
    settings = {
        "scene": name_of(translation.document),
        "integrator": first.name,
        "with": str(with_),
        "size": [plan.width, plan.height],
        "spp": each * sides[0].runs,
        "runs": sides[0].runs,
        "seed": seed,
        "dialect": options.dialect,
        "variant": options.variant or plan.variant,
    }
    settings["command"] = command_line(settings, options)
    settings["notes"] = notes(translation.document)
    a, b = (side.estimate for side in sides)
    scores = statistics.all_levels(a, b, FALSE_ALARMS)
    flip = measures.flip(a.pixels.mean, b.pixels.mean)
    return Comparison((sides[0], sides[1]), scores, flip, settings)


def render_in_turn(
    sides: Sequence[tuple[str, MitsubaScene, MitsubaIntegrator]],
    spp: int,
    runs: int,
    seed: int,
    progress: Progress | None = None,
    sampler: str = SAMPLERS[0],
) -> list[Side]:
    """Render by several methods, run by run.

    Args:
        sides: triples of a name, an `mi.Scene` and an `mi.Integrator`.
        spp: samples of a pixel in a run.
        runs: number of runs.
        seed: as `compare`.
        progress: as `compare`.
        sampler: of both.

    Returns:
        A `Side` for each method.
    """
    taken = [estimates.Runs() for _ in sides]
    seconds: list[list[float]] = [[] for _ in sides]
    for run in range(runs):
        for side, (_, scene, integrator) in enumerate(sides):
            own = renders.own_seed(seed, renders.COMPARE, side, run)
            done = renders.render(scene, integrator, spp, own, sampler)
            seconds[side].append(done.wall)
            taken[side].add(done.picture)
        if progress and progress(run + 1, runs):
            break
    if run + 1 < FEWEST_RUNS:
        raise CannotRender(f"stopped after {run + 1} runs; {FEWEST_RUNS} are needed for a verdict")
    return [
        Side(name, t.estimate(), t.count, tuple(s), t.not_finite, t.negative)
        for (name, *_), t, s in zip(sides, taken, seconds, strict=True)
    ]


def load_picture(path: str | Path) -> tuple[np.ndarray, Estimate | None]:
    """Read a linear picture.

    Returns:
        Its pixels, (height, width, 3), and its `Estimate` if the file holds its variance, or None.

    Raises:
        ValueError: it is of another format, or cannot be read.
    """
    if Path(path).suffix.lower() not in PICTURES:
        raise ValueError(f"{path}: expected an integrator's id or a linear picture, .exr or .hdr")
    if not Path(path).is_file():
        raise ValueError(f"{path}: no such file")
    if passes_file.holds_passes(path):
        kept = passes_file.read(path)
        return kept.image(), estimate_files.from_passes(kept)
    if estimate_files.holds_estimate(path):
        stored, _ = estimate_files.read(path)
        return stored.pixels.mean, stored
    if metadata.DENOISED in metadata.of_file(path):
        raise ValueError(f"{path} is denoised: a guess is no picture to compare with")
    if Path(path).suffix.lower() == ".exr":
        try:
            return developing.read(path).image, None
        except OutputError as error:
            raise ValueError(str(error)) from None
    with variant_context("scalar_rgb"), exr_threads():
        try:
            bitmap = mi.Bitmap(str(path)).convert(
                mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False
            )
        except RuntimeError as error:
            raise ValueError(f"{path}: {reason(error)}") from None
        return np.array(bitmap), None


def picture_side(
    name: str | Path, picture: np.ndarray, stored: Estimate | None, other: Estimate
) -> Side:
    """The `Side` of a picture.

    Args:
        name: its path.
        picture: as `load_picture` returned it.
        stored: its estimate, if the file holds its variance; else None: its noise is estimated.
        other: estimate of the same scene.
    """
    finite = np.isfinite(picture)
    shown = np.where(finite, picture, 0)
    step = rgbe_step(shown) if Path(name).suffix.lower() == ".hdr" else 0.0
    estimate = stored or estimates.from_picture(shown, other, step)
    return Side(str(name), estimate, 0, (), int((~finite).sum()), int((picture < 0).sum()))


def rgbe_step(picture: np.ndarray) -> np.ndarray:
    """Step between RGBE numbers: 1/256 of the power of two above the brightest channel."""
    _, exponent = np.frexp(picture.max(axis=2, keepdims=True))
    return np.ldexp(1.0, exponent - 8)


def command_line(settings: dict[str, Any], options: RenderOptions) -> str:
    """The command that gives this comparison."""
    words = ["relume", "compare", settings["scene"]]
    words += ["--integrator", options.integrator] if options.integrator else []
    words += ["--with", settings["with"]]
    words += ["--size", "{}x{}".format(*settings["size"])]
    for name in ("spp", "runs", "seed"):
        words += [f"--{name}", str(settings[name])]
    return shlex.join([*words, *option_words(options, "variant", "sampler", "dialect")])
