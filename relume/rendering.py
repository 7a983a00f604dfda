"""`relume render`: a session with progress, dumps, limits and safe output."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relume import cluster as clusters
from relume import fingerprint, output
from relume.accumulator import Accumulator
from relume.checkpoint import Checkpoint
from relume.destination import Destination, Dumps, Keep
from relume.loading import SceneSource, open_session, translated_with_inputs, usable_variant
from relume.options import RenderOptions
from relume.passes import Pass, PassPlan, PassSet
from relume.passes_file import Header
from relume.progress import Progress, TimeLimit, interruptible, progress_bar
from relume.session import CannotRender, Scene, accumulate, sees_nothing
from relume.translator import Document, Translation
from relume.translator.darkness import NOTHING_ARRIVES, NOTHING_SEEN, NOTHING_SHINES
from relume.translator.outcome_rows import Note

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True)
class PassOptions:
    """Which passes are rendered, and what becomes of them on disk.

    Attributes:
        resume: go on with the passes that an earlier render left beside the picture.
        keep: leave the passes there even if the render is finished.
        only: (start, stop) to render these passes alone, and write them, not a picture.
        per_pass: samples of a pixel in a pass, 1 or more; None for the usual number. Others give
            another picture, as good.
    """

    resume: bool = False
    keep: bool = False
    only: tuple[int, int] | None = None
    per_pass: int | None = None


EVERY_PASS = PassOptions()


class Ended(NamedTuple):
    """How a render ended: after how many seconds, and why early; an empty string if it did not."""

    seconds: float
    why: str


def render_file(
    scene: SceneSource,
    options: RenderOptions | None = None,
    *,
    out: str | Path | None = None,
    passes: PassOptions = EVERY_PASS,
    time_limit: float | None = None,
    cluster: clusters.Cluster | None = None,
    console: Console,
    **changes: Any,
) -> tuple[Path, ...]:
    """Render a scene and write its picture.

    Args:
        scene: a scene file or Mitsuba scene (.xml), or what `relume.read` returned.
        options: as `relume.render`.
        out: picture file, or a folder, as `Destination`.
        passes: which passes, and whether they are kept.
        time_limit: seconds after which rendering stops with what it has; None for the scene's.
        cluster: `relume.cluster.Cluster` that renders, or None for this process.
        console: `rich.console.Console` for progress and notes.
        changes: fields of `RenderOptions`, in place of those of `options`.

    Returns:
        Paths of the files written, the picture first.

    Raises:
        CannotRender: as `relume.render`; and the passes left there are of another render, or of
            this one and `passes.resume` is not set.
        OutputError: a file cannot be written, or is one that the scene reads.
        ValueError: a number out of range.
    """
    options = RenderOptions.of(options, **changes)
    translation, inputs = translated_with_inputs(scene, options)
    report_losses(translation, console)
    document, planned = translation.document, translation.plan
    options = RenderOptions.of(options, variant=usable_variant(planned, options.variant))
    destination = Destination(document, out, inputs)
    part = destination.part_path() if passes.only else None
    destination.check()
    plan = PassPlan.of(planned.width, planned.height, planned.spp, passes.per_pass)
    header = header_of(translation, options, plan)
    checkpoint = Checkpoint(destination.passes_path(), header, console)
    accumulator = checkpoint.begin(planned.width, planned.height, passes.resume)
    to_do = passes_to_render(plan, accumulator.done, passes.only)
    asked = accumulator.spp + to_do.spp
    limit = time_limit_of(document, time_limit)
    keeps = checkpoint.offer, Dumps(document, destination, limit).offer
    with interruptible() as stop:
        ended = Ended(0.0, "")
        if len(to_do):
            with rendered_passes(translation, options, to_do, cluster, checkpoint) as found:
                steps = accumulate(found, accumulator, len(to_do), asked)
                ended = run(steps, accumulator, keeps, limit, stop, console)
        if not accumulator.done:
            raise CannotRender(f"{ended.why} before the first pass was done")
        unfinished = bool(ended.why) or passes.keep
        if unfinished:
            checkpoint.save(accumulator, ended.seconds)
        spectral = "spectral" in planned.variant
        if part:
            checkpoint.write(part, accumulator, ended.seconds)
            written = output.Written((part,), 0)
        else:
            seconds = checkpoint.seconds + ended.seconds
            written = destination.write(document, accumulator, seconds, spectral)
        if not unfinished:
            checkpoint.discard()
    report_noise(accumulator, ended.why, asked, console)
    if not translation.picture_notes() and not accumulator.image().any():
        console.print(f"[yellow]{NOTHING_ARRIVES.text}[/]", highlight=False)
    report_repairs(written, spectral, console)
    for note in destination.notes:
        console.print(f"[yellow]{note}[/]", highlight=False)
    return written.paths


# ---- what is to do


def time_limit_of(document: Document, asked: float | None) -> float | None:
    """The seconds asked for, else those of the scene's `TIMELIMIT`, in hours; None for no limit."""
    if asked is None and document.time_limit >= 0:
        return document.time_limit * 3600
    return asked


def header_of(translation: Translation, options: RenderOptions, plan: PassPlan) -> Header:
    """What the file of passes says of a render, before its first pass."""
    return Header(
        render=fingerprint.of_render(translation, options, plan.per_pass),
        spp=plan.spp,
        seconds=0.0,
        gamma=translation.document.gamma_offset,
    )


def passes_to_render(plan: PassPlan, done: PassSet, only: tuple[int, int] | None = None) -> PassSet:
    """The passes to render.

    Args:
        plan: `PassPlan`.
        done: those that are there.
        only: (start, stop) of the only ones wanted, or None.

    Raises:
        ValueError: the plan has no such passes.
    """
    if only is None:
        return plan.to_do(done)
    whole = plan.passes()
    start, stop = only
    if not 0 <= start < stop <= len(whole):
        raise ValueError(f"passes {start}:{stop}: expected some of 0:{len(whole)}")
    return whole.between(start, stop).without(done)


# ---- rendering


@contextmanager
def rendered_passes(
    translation: Translation,
    options: RenderOptions,
    to_do: PassSet,
    cluster: clusters.Cluster | None,
    checkpoint: Checkpoint,
) -> Iterator[Iterator[Pass | None]]:
    """Context with the passes of a scene as they come; None while there is none.

    Args:
        translation: the translated scene.
        options: with the variant to use.
        to_do: the passes to render.
        cluster: who renders; None for this process.
        checkpoint: tells workers which render it is, and the user what workers and, in the end, the
            integrator say.
    """
    if cluster is None:
        with open_session(translation, options) as session:
            if not translation.picture_notes() and (note := empty_picture_note(session.scene)):
                checkpoint.console.print(f"[yellow]{note.text}[/]", highlight=False)
            with closing(session.render(to_do)) as found:
                yield found
            for line in getattr(session.integrator, "report", list)():
                checkpoint.console.print(line, highlight=False)
        return
    render = checkpoint.header.render
    with (
        clusters.opened(cluster, translation, render, options, checkpoint.note) as farm,
        closing(farm.render(to_do)) as found,
    ):
        yield found


def run(
    steps: Iterator[Progress],
    accumulator: Accumulator,
    keeps: Sequence[Keep],
    time_limit: float | None,
    stop: list[int],
    console: Console,
) -> Ended:
    """Render all passes, or until the time is up or somebody interrupts.

    Args:
        steps: `Progress` after each pass, or while none is there.
        accumulator: what they fill.
        keeps: offered what there is after each pass but the last.
        time_limit: seconds, or None.
        stop: not empty once somebody interrupts.
        console: for the progress.
    """
    known = len(accumulator.done)
    limit = TimeLimit(time_limit, known)
    with progress_bar(accumulator, console) as tell:
        for progress in steps:
            tell(progress)
            if progress.passes == progress.all_passes:
                return Ended(progress.seconds, "")
            if progress.passes != known:
                known = progress.passes
                for keep in keeps:
                    keep(accumulator, progress.seconds)
            if stop:
                return Ended(progress.seconds, "interrupted")
            if limit.reached(progress):
                return Ended(progress.seconds, "time limit reached")
    raise AssertionError("a render ends with its last pass")


# ---- what is said


def report_losses(translation: Translation, console: Console) -> None:
    """Say what of the scene is not rendered as written."""
    for outcome, style in (("unsupported", "red"), ("approximated", "yellow")):
        lines = [r for r in translation.document.lines.all if r.outcome == outcome and r.note]
        for line in lines[:12]:
            console.print(
                f"[{style}]{outcome}[/] line {line.line}, {line.keyword}: {line.note}",
                highlight=False,
            )
        if len(lines) > 12:
            console.print(f"[{style}]{outcome}[/] {len(lines) - 12} more (see: relume check)")
    for note in translation.picture_notes():
        console.print(f"[yellow]{note.text}[/]", highlight=False)


def empty_picture_note(scene: Scene) -> Note | None:
    """What a loaded scene says of a picture that stays empty."""
    if not scene.emitters():
        return NOTHING_SHINES
    return NOTHING_SEEN if sees_nothing(scene) else None


def report_noise(accumulator: Accumulator, why: str, asked: int, console: Console) -> None:
    """Say how noisy the picture is, and where it has fewer samples than were asked for."""
    if math.isfinite(noise := accumulator.noise()):
        console.print(f"noise of a pixel: {in_words(noise)}", highlight=False)
    if why:
        how_far = f"after {accumulator.spp} of {asked} samples a pixel; --resume goes on"
        console.print(f"[yellow]{why}[/] {how_far}")


def in_words(ratio: float) -> str:
    """A ratio to the mean: in percent, or where it is large how many times the mean."""
    if ratio < 2:
        return f"{significant(100 * ratio)} % of the mean"
    return f"{significant(ratio)} times its mean"


def significant(value: float) -> str:
    """A number with two significant digits, and no exponent."""
    return np.format_float_positional(value, 2, unique=False, fractional=False, trim="-")


def report_repairs(written: output.Written, spectral: bool, console: Console) -> None:
    """Say how many pixels could not be written as they are."""
    if written.repaired:
        why = "colours that RGB cannot hold, or noise" if spectral else "this should not happen"
        console.print(f"[yellow]{written.repaired} pixels below 0 or not finite: {why}[/]")
