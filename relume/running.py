"""A render while it runs: its passes as they come, from here or from a cluster, until it ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, NamedTuple

from relume import aovs, fingerprint, noise, render_reports
from relume import cluster as clusters
from relume.accumulator import Accumulator
from relume.checkpoint import Checkpoint
from relume.destination import Keep
from relume.loading import open_session
from relume.passes import Pass, PassSet
from relume.pilot import Choice
from relume.progress import Progress, Tell, TimeLimit, progress_bar
from relume.session import Integrator
from relume.translator import Translation

if TYPE_CHECKING:
    from rich.console import Console


class Ended(NamedTuple):
    """How a render ended: after how many seconds, and why early; an empty string if it did not."""

    seconds: float
    why: str


@contextmanager
def rendered_passes(
    choice: Choice,
    to_do: PassSet,
    cluster: clusters.Cluster | None,
    checkpoint: Checkpoint,
    layers: aovs.Layers,
) -> Iterator[Iterator[Pass | None]]:
    """Context with the passes of a scene as they come; None while there is none.

    Args:
        choice: the scene, and how it is rendered, with the variant to use.
        to_do: the passes to render.
        cluster: who renders; None for this process.
        checkpoint: tells workers which render it is, and the user what workers and, in the end, the
            integrator say.
        layers: rendered, too, while the scene is loaded here.
    """
    translation, options = choice.translation, choice.options
    if cluster is None:
        per_pass = checkpoint.header.render[fingerprint.PER_PASS]
        with open_session(translation, options, per_pass, choice.scene) as session:
            if layers.missing:
                layers.render(session)
            if not (translation.picture_notes() or bends(translation)):
                render_reports.report_emptiness(session.scene, checkpoint.console)
            render_reports.report_deep_starts(session, translation, checkpoint.console)
            with closing(session.render(to_do)) as found:
                yield found
            for line in getattr(session.integrator, "report", list)():
                checkpoint.console.print(line, highlight=False)
            if count := unfinished(session.integrator):
                text = f"{count} rays ran out of steps: geodesics_max_length allows too few"
                checkpoint.console.print(f"[yellow]{text}[/]", highlight=False)
        return
    render = checkpoint.header.render
    with (
        clusters.opened(cluster, translation, render, options, checkpoint.note) as farm,
        closing(farm.render(to_do)) as found,
    ):
        yield found


def bends(translation: Translation) -> bool:
    """Whether rays are bent."""
    return "curvedspace" in translation.plan.plugins


def unfinished(integrator: Integrator | None) -> int:
    """How many rays in curved space have run out of steps, by an integrator or one inside it."""
    while integrator is not None:
        if hasattr(integrator, "unfinished"):
            return int(integrator.unfinished())
        integrator = getattr(integrator, "nested", None)
    return 0


def run(
    steps: Iterator[Progress],
    accumulator: Accumulator,
    keeps: Sequence[Keep],
    tells: Sequence[Tell],
    time_limit: float | None,
    stop: list[int],
    console: Console,
    goal: noise.Goal,
) -> Ended:
    """Render all passes, or until the time is up or somebody interrupts.

    Args:
        steps: `Progress` after each pass, or while none is there.
        accumulator: what they fill.
        keeps: offered what there is after each pass but the last.
        tells: told how far the render is.
        time_limit: seconds, or None.
        stop: not empty once somebody interrupts.
        console: for the progress.
        goal: noise at which the render is done.
    """
    known = len(accumulator.done)
    limit = TimeLimit(time_limit, known)
    with progress_bar(accumulator, console) as tell:
        for progress in steps:
            changed = progress.passes != known
            done = progress.passes == progress.all_passes or (changed and goal.reached(accumulator))
            for listener in (tell, *tells):
                listener(goal.foreseen(progress))
            if done:
                return Ended(progress.seconds, "")
            if changed:
                known = progress.passes
                for keep in keeps:
                    keep(accumulator, progress.seconds)
            if stop:
                return Ended(progress.seconds, "interrupted")
            if limit.reached(progress):
                return Ended(progress.seconds, "time limit reached")
    raise AssertionError("a render ends with its last pass")
