"""`relume compare`: one scene rendered by two methods, or by one against a picture; do they agree?

Each method makes many short independent renders of the same loaded scene, in turn, with seeds of
their own. Their scatter gives every error its interval. The verdict is `differ` if any of the
tests of `statistics.all_levels` rejects (whole picture, blocks, pixels, together at a stated rate
of false alarms) or a value is no finite number, else `agree`.
"""

import shlex
from pathlib import Path

import mitsuba as mi
import numpy as np
from relume.translator.plan import samples
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from relume import passes_file, translator
from relume.application import read, ready, resized
from relume.output import OutputError, check_writable
from relume.rendering import interruptible
from relume.session import CannotRender, reason, two_threads, variant
from relume.workbench import estimate_files, estimates, measures, methods, renders, statistics
from relume.workbench.compare_page import page
from relume.workbench.comparison import FALSE_ALARMS, Comparison, Side

RUNS = 32
FEWEST_RUNS = 8
"""Below, the scatter of the runs says too little of a variance."""

PICTURES = (".exr", ".hdr")


def run(scene, out, console, **options):
    """Compare with progress and write the page.

    Args:
        scene: as `compare`.
        out: file of the page, or None.
        console: `rich.console.Console` for the progress.
        options: as `compare`.

    Returns:
        `Comparison`.

    Raises:
        OutputError: the page cannot be written; and what `compare` raises.
    """
    if out is not None:
        if Path(out).is_dir():
            raise OutputError(f"cannot write {out}: it is a folder")
        check_writable(out)
    columns = (TextColumn("run"), MofNCompleteColumn(), BarColumn(), TimeRemainingColumn())
    quiet = not console.is_terminal
    with (
        Progress(*columns, console=console, transient=True, disable=quiet) as bar,
        interruptible() as stop,
    ):
        task = bar.add_task("compare")

        def watch(done, runs):
            bar.update(task, completed=done, total=runs)
            return bool(stop)

        found = compare(scene, watch=watch, **options)
    if out is not None:
        Path(out).write_text(page(found), encoding="utf-8")
    return found


def compare(
    scene,
    *,
    with_="volpath",
    integrator=None,
    size=None,
    spp=None,
    runs=RUNS,
    seed=0,
    dialect="manual",
    asset_path=(),
    watch=None,
):
    """Compare a scene's picture with that of another integrator, or with a picture.

    Args:
        scene: the scene file.
        with_: a method (see `methods`), which gets the same scene, depths and number of samples; or
            a linear picture, .exr or .hdr. It is the reference. An .exr that tells its variance
            (see `estimate_files`) is taken at its word; the noise of another picture is judged.
        integrator: the method of the first side; None for what is planned for the scene.
        size: (width, height) instead of the scene's; that of the picture if there is one.
        spp: samples of a pixel of each side in all its runs together, rounded up to a multiple of
            `runs`; by default the scene's.
        runs: independent renders of each side, `FEWEST_RUNS` or more.
        seed: non-negative integer; the same seed gives the same comparison but for the times.
        dialect: `manual` or `prender`.
        asset_path: folders in which files that the scene names are looked for.
        watch: called with the number of runs done and of all runs; rendering stops if it returns
            True.

    Returns:
        `Comparison`.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: an integrator does not work here, or too few runs were done.
        ValueError: a number out of range, or a picture that cannot be read or has another size.
    """
    if runs < FEWEST_RUNS:
        raise ValueError(f"runs {runs}: expected {FEWEST_RUNS} or more")
    if seed < 0:
        raise ValueError(f"seed {seed}: expected 0 or more")
    picture = stored = None
    if Path(with_).suffix:
        picture, stored = load_picture(with_)
        of_picture = (picture.shape[1], picture.shape[0])
        if size is not None and tuple(size) != of_picture:
            raise ValueError("size {}x{}: {} has {}x{}".format(*size, with_, *of_picture))
        size = of_picture
    document = read(scene)
    if spp is None:
        spp = samples(document)
    each = -(-spp // runs)
    # Translated for all samples: what depends on their number must be that of one long render.
    document = resized(document, size, each * runs)
    translation = translator.translate(document, dialect, asset_path)
    plan = translation.plan
    first = methods.find(integrator) if integrator else methods.planned(translation)
    wanted = [first] if picture is not None else [first, methods.find(with_)]
    with ready(translation):
        stage = methods.Stage(document, translation, dialect, asset_path)
        loaded = [(method.name, *stage.load(method)) for method in wanted]
        sides = render_in_turn(loaded, each, runs, seed, watch)
    if picture is not None:
        sides.append(picture_side(with_, picture, stored, sides[0].estimate))
    settings = {
        "scene": str(scene),
        "integrator": first.name,
        "with": str(with_),
        "size": [plan.width, plan.height],
        "spp": each * sides[0].runs,
        "runs": sides[0].runs,
        "seed": seed,
        "dialect": dialect,
        "variant": plan.variant,
    }
    settings["command"] = command_line(settings, integrator, asset_path)
    settings["notes"] = notes(translation.document)
    a, b = (side.estimate for side in sides)
    scores = statistics.all_levels(a, b, FALSE_ALARMS)
    flip = measures.flip(a.pixels.mean, b.pixels.mean)
    return Comparison(tuple(sides), scores, flip, settings)


def render_in_turn(methods, spp, runs, seed, watch=None):
    """Render by several methods, run by run.

    Args:
        methods: triples of a name, an `mi.Scene` and an `mi.Integrator`.
        spp: samples of a pixel in a run.
        runs: number of runs.
        seed: as `compare`.
        watch: as `compare`.

    Returns:
        A `Side` for each method.
    """
    taken = [estimates.Runs() for _ in methods]
    seconds = [[] for _ in methods]
    for run in range(runs):
        for side, (_, scene, integrator) in enumerate(methods):
            own = renders.own_seed(seed, renders.COMPARE, side, run)
            done = renders.render(scene, integrator, spp, own)
            seconds[side].append(done.wall)
            taken[side].add(done.picture)
        if watch and watch(run + 1, runs):
            break
    if run + 1 < FEWEST_RUNS:
        raise CannotRender(f"stopped after {run + 1} runs; {FEWEST_RUNS} are needed for a verdict")
    return [
        Side(name, t.estimate(), t.count, tuple(s), t.not_finite, t.negative)
        for (name, *_), t, s in zip(methods, taken, seconds, strict=True)
    ]


def load_picture(path):
    """Read a linear picture.

    Returns:
        Its pixels, (height, width, 3), and its `Estimate` if the file tells its variance, or None.

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
    with variant("scalar_rgb"), two_threads():
        try:
            bitmap = mi.Bitmap(str(path)).convert(
                mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False
            )
        except RuntimeError as error:
            raise ValueError(f"{path}: {reason(error)}") from None
        return np.array(bitmap), None


def picture_side(name, picture, stored, other):
    """The `Side` of a picture.

    Args:
        name: its path.
        picture: as `load_picture` returned it.
        stored: its estimate, if the file tells its variance; else None, and its noise is judged.
        other: estimate of the same scene.
    """
    finite = np.isfinite(picture)
    shown = np.where(finite, picture, 0)
    step = rgbe_step(shown) if Path(name).suffix.lower() == ".hdr" else 0.0
    estimate = stored or estimates.from_picture(shown, other, step)
    return Side(str(name), estimate, 0, (), int((~finite).sum()), int((picture < 0).sum()))


def rgbe_step(picture):
    """Step between RGBE numbers: 1/256 of the power of two above the brightest channel."""
    _, exponent = np.frexp(picture.max(axis=2, keepdims=True))
    return np.ldexp(1.0, exponent - 8)


def command_line(settings, integrator, asset_path):
    """The command that gives this comparison."""
    words = ["relume", "compare", settings["scene"]]
    words += ["--integrator", integrator] if integrator else []
    words += ["--with", settings["with"]]
    words += ["--size", "{}x{}".format(*settings["size"])]
    for name in ("spp", "runs", "seed", "dialect"):
        words += [f"--{name}", str(settings[name])]
    for folder in asset_path:
        words += ["--asset-path", str(folder)]
    return shlex.join(words)


def notes(document):
    """What of the scene is not rendered as written: a list of sentences."""
    told = (line for line in document.lines.all if line.outcome in ("unsupported", "approximated"))
    return [f"line {x.line}, {x.keyword}: {x.outcome}: {x.note}" for x in told if x.note]
