"""`relume render`: a session with progress, dumps, limits and safe output."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.markup import escape

from relume import (
    aovs,
    denoising,
    fingerprint,
    metadata,
    noise,
    output,
    passes_file,
    pilot,
    render_reports,
)
from relume import cluster as clusters
from relume.accumulator import Accumulator
from relume.checkpoint import Checkpoint
from relume.destination import Destination, Dumps
from relume.loading import SceneSource, open_session, translated_with_inputs, usable_variant
from relume.options import RenderOptions
from relume.passes import PassPlan, PassSet
from relume.passes_file import Header
from relume.progress import Viewer, interruptible, looking
from relume.running import Ended, bends, rendered_passes, run
from relume.session import CannotRender, accumulate
from relume.tone import AS_IT_IS, Look
from relume.translator import Document, Translation

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
        noise: of the picture, relative to its mean, at which the render ends; without a number of
            samples in the options, the scene's own does not end it. None for no such end.
    """

    resume: bool = False
    keep: bool = False
    only: tuple[int, int] | None = None
    per_pass: int | None = None
    noise: float | None = None


EVERY_PASS = PassOptions()


@dataclass(frozen=True)
class PictureOptions:
    """What becomes of the picture.

    Attributes:
        look: exposure and tone curve, where it is encoded for display.
        layers: further layers of an OpenEXR picture, of `relume.aovs.LAYERS`.
        denoise: whether a denoised picture is written beside it.
    """

    look: Look = AS_IT_IS
    layers: tuple[str, ...] = ()
    denoise: bool = False

    def all_layers(self) -> tuple[str, ...]:
        """The layers to render: those asked for, and guides for denoising."""
        return self.layers + (aovs.GUIDES if self.denoise else ())


PLAIN_PICTURE = PictureOptions()


MakeViewer = Callable[[Translation, list[int]], Viewer]
"""Makes a viewer of a scene; an entry in the list stops the render."""


@dataclass(frozen=True)
class Rendered:
    """What a render came to.

    Attributes:
        paths: the files written, the picture first.
        size: width and height [pixel].
        spp: samples of a pixel in the picture.
        noise: of a pixel, relative to the mean; NaN where it is unknown.
        seconds: that all passes took.
        why: it ended early; an empty string if it did not.
        losses: what is not rendered as written.
    """

    paths: tuple[Path, ...]
    size: tuple[int, int]
    spp: int
    noise: float
    seconds: float
    why: str
    losses: tuple[str, ...]


def render_file(scene: SceneSource, *arguments: Any, **options: Any) -> tuple[Path, ...]:
    """Render a scene and write its picture; arguments and errors as `render_scene`.

    Returns:
        Paths of the files written, the picture first.
    """
    return render_scene(scene, *arguments, **options).paths


def render_scene(
    scene: SceneSource,
    options: RenderOptions | None = None,
    *,
    out: str | Path | None = None,
    passes: PassOptions = EVERY_PASS,
    time_limit: float | None = None,
    picture: PictureOptions = PLAIN_PICTURE,
    viewers: Sequence[MakeViewer] = (),
    cluster: clusters.Cluster | None = None,
    console: Console,
    **changes: Any,
) -> Rendered:
    """Render a scene and write its picture.

    Args:
        scene: a scene file or Mitsuba scene (.xml), or what `relume.read` returned.
        options: as `relume.render`.
        out: picture file, or a folder, as `Destination`.
        passes: which passes, and whether they are kept.
        time_limit: seconds after which rendering stops with what it has; None for the scene's.
        picture: what becomes of the picture.
        viewers: make those who look while it is rendered.
        cluster: `relume.cluster.Cluster` that renders, or None for this process.
        console: `rich.console.Console` for progress and notes.
        changes: fields of `RenderOptions`, in place of those of `options`.

    Returns:
        `Rendered`.

    Raises:
        CannotRender: as `relume.render`; and the passes left there are of another render, or of
            this one and `passes.resume` is not set.
        OutputError: a file cannot be written, or is one that the scene reads.
        ValueError: a number out of range.
    """
    options = RenderOptions.of(options, **changes)
    translation, inputs = translated_with_inputs(scene, options)
    translation = with_goal(translation, options, passes)
    goal = noise.Goal(passes.noise, translation.plan.spp)
    document, planned = translation.document, translation.plan
    options = RenderOptions.of(options, variant=usable_variant(planned, options.variant))
    destination = Destination(document, out, inputs)
    part = destination.part_path() if passes.only else None
    destination.check()
    check_layers(translation, destination, picture)
    before = chosen_before(destination.passes_path()) if passes.resume else None
    choice = pilot.choice(translation, options, before)
    translation, options = choice.translation, choice.options
    render_reports.report_losses(translation, console)
    render_reports.report_choice(choice, console)
    plan = PassPlan.of(planned.width, planned.height, planned.spp, passes.per_pass)
    header = header_of(translation, options, plan, choice.why)
    checkpoint = Checkpoint(destination.passes_path(), header, console)
    accumulator = checkpoint.begin(planned.width, planned.height, passes.resume)
    to_do = passes_to_render(plan, accumulator.done, passes.only)
    asked = accumulator.spp + to_do.spp
    limit = time_limit_of(document, time_limit)
    dumps = Dumps(document, destination, limit, output.Finish(picture.look))
    layers = aovs.Layers(() if part or bends(translation) else picture.all_layers())
    with interruptible() as stop:
        watching = [viewer(translation, stop) for viewer in viewers]
        ended = Ended(0.0, "")
        with looking(watching):
            if len(to_do) and not goal.reached(accumulator):
                with rendered_passes(choice, to_do, cluster, checkpoint, layers) as found:
                    steps = accumulate(found, accumulator, len(to_do), asked)
                    keeps = checkpoint.offer, dumps.offer, *(viewer.offer for viewer in watching)
                    tells = [viewer.progress for viewer in watching]
                    ended = run(steps, accumulator, keeps, tells, limit, stop, console, goal)
            if not accumulator.done:
                raise CannotRender(f"{ended.why} before the first pass was done")
            unfinished = bool(ended.why) or passes.keep
            if unfinished:
                checkpoint.save(accumulator, ended.seconds)
            seconds = checkpoint.seconds + ended.seconds
            if part:
                checkpoint.write(part, accumulator, ended.seconds)
                written = output.Written((part,), 0)
            else:
                if layers.missing:
                    with open_session(translation, options) as session:
                        layers.render(session)
                facts = metadata.of_picture(header, accumulator) | layers.facts
                finish = output.Finish(picture.look, facts, layers.planes)
                written = write(translation, destination, accumulator, seconds, picture, finish)
            if not unfinished:
                checkpoint.discard()
            for viewer in watching:
                viewer.end(accumulator, ended.seconds, f"{ended.why or 'done'}: {written.paths[0]}")
    reached = render_reports.report_noise(accumulator, seconds, passes.noise, console)
    render_reports.report_end(accumulator.spp, ended.why, None if passes.noise else asked, console)
    render_reports.report_repairs(written, "spectral" in planned.variant, console)
    if not translation.picture_notes():
        render_reports.report_darkness(accumulator.image(), console)
    if not part:
        render_reports.report_look(
            written, accumulator.image(), picture.look, document.gamma_offset, console
        )
    for note in destination.notes:
        console.print(f"[yellow]{escape(note)}[/]", highlight=False)
    size, losses = (planned.width, planned.height), metadata.losses(translation)
    return Rendered(
        written.paths, size, accumulator.spp, reached, seconds, ended.why, tuple(losses)
    )


def write(
    translation: Translation,
    destination: Destination,
    accumulator: Accumulator,
    seconds: float,
    picture: PictureOptions,
    finish: output.Finish,
) -> output.Written:
    """Write the picture, and the denoised one beside it where that is wished for.

    Args:
        translation: the scene.
        destination: where it goes.
        accumulator: what was rendered.
        seconds: that it took.
        picture: what becomes of the picture.
        finish: what its file gets besides.

    Raises:
        OutputError: it cannot be written.
    """
    document, spectral = translation.document, "spectral" in translation.plan.variant
    written = destination.write(document, accumulator, seconds, spectral, finish)
    if not picture.denoise:
        return written
    image, variance = accumulator.image(), accumulator.variance()
    known = variance if np.isfinite(variance).all() else None
    clean = denoising.denoised(image, denoising.guides(finish.layers), known)
    path = denoising.write_marked(written.paths[0], clean, document.gamma_offset, finish)
    return output.Written((*written.paths, path), written.repaired)


# ---- what is to do


def with_goal(translation: Translation, options: RenderOptions, passes: PassOptions) -> Translation:
    """The translation, with samples enough for the noise that was asked for.

    Raises:
        ValueError: only some of the passes are asked for, too.
    """
    if passes.noise is None:
        return translation
    if passes.only:
        raise ValueError("give either a noise or passes: a part does not know that of the picture")
    spp = translation.plan.spp if options.spp else noise.MOST
    plan = dataclasses.replace(translation.plan, spp=spp)
    return dataclasses.replace(translation, plan=plan)


def check_layers(
    translation: Translation, destination: Destination, picture: PictureOptions
) -> None:
    """Check that layers can be rendered and have a file, and that there is what denoises.

    Raises:
        CannotRender, OutputError: they have none, or it cannot.
    """
    if picture.layers and not destination.extension_of_picture() == ".exr":
        raise output.OutputError("layers are for pictures in OpenEXR: give -o FILE.exr")
    if picture.layers and bends(translation):
        raise CannotRender("layers are of straight rays, and space bends them here")
    if picture.denoise:
        denoising.library()
        if destination.exact is not None:
            destination.inputs.refuse(denoising.marked(destination.exact))


def time_limit_of(document: Document, asked: float | None) -> float | None:
    """The seconds asked for, else those of the scene's `TIMELIMIT`, in hours; None for no limit."""
    if asked is None and document.time_limit >= 0:
        return document.time_limit * 3600
    return asked


def chosen_before(path: Path) -> tuple[str, str] | None:
    """The integrator of the passes in a file and why it was chosen; None where there is no file.

    Raises:
        NoPasses: it is damaged.
    """
    if not path.exists():
        return None
    header = passes_file.read_header(path)
    return str(header.render.get("integrator")), header.facts.get(metadata.CHOICE, "")


def header_of(
    translation: Translation, options: RenderOptions, plan: PassPlan, why: str = ""
) -> Header:
    """What the file of passes says of a render, before its first pass.

    Args:
        translation: the translated scene.
        options: with the integrator that was chosen.
        plan: its passes.
        why: it was chosen; empty where there was no choice.
    """
    return Header(
        render=fingerprint.of_render(translation, options, plan.per_pass),
        spp=plan.spp,
        seconds=0.0,
        gamma=translation.document.gamma_offset,
        facts=metadata.of_scene(translation, options.dialect) | metadata.of_choice(why),
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
