"""`relume render`: a session with progress, dumps, limits and safe output."""

import math
import signal
import sys
from contextlib import closing, contextmanager
from pathlib import Path

from relume.translator.plan import metropolis, mutations
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from relume import cluster as clusters
from relume import fingerprint, output, translator
from relume.application import prepared, read, resized, usable_variant
from relume.checkpoint import Checkpoint
from relume.passes import PassPlan
from relume.passes_file import Header
from relume.session import CannotRender, add_up

DUMP_INTERVAL = 60.0
"""With a time limit the picture so far is written each minute, as the manual says [s]."""


PASSES = ".passes.exr"
"""Ending of the file of passes beside a picture."""


def render_file(
    path,
    *,
    out=None,
    size=None,
    spp=None,
    seed=0,
    integrator=None,
    variant=None,
    dialect="manual",
    asset_path=(),
    time_limit=None,
    resume=False,
    keep=False,
    passes=None,
    per_pass=None,
    cluster=None,
    console,
):
    """Render a scene file and write its picture.

    Args:
        path: the scene file.
        out: picture file, or a folder (existing, or with a trailing slash) for the name that the
            scene gives; None for the scene's name below the working directory.
        size: as `relume.render`, and so are the others up to `asset_path`.
        spp: samples of a pixel.
        seed: seed of the session.
        integrator: plugin id.
        variant: Mitsuba variant.
        dialect: `manual` or `prender`.
        asset_path: folders of the scene's files.
        time_limit: seconds after which rendering stops with what it has; None for the scene's.
        resume: go on with the passes that an earlier render left beside the picture.
        keep: leave the passes there even if the render is finished.
        passes: (start, stop) to render these passes alone, and write them, not a picture.
        per_pass: samples of a pixel in a pass; None for the usual number. Others give another
            picture, as good.
        cluster: `relume.cluster.Cluster` that renders, or None for this process.
        console: `rich.console.Console` for progress and notes.

    Returns:
        Paths of the files written, the picture first.

    Raises:
        CannotRender: as `relume.render`; and the passes left there are of another render, or of
            this one and `resume` is not set.
        OutputError: a file cannot be written.
        ValueError: a number out of range.
    """
    document = resized(read(path), size, spp)
    translation = translator.translate(document, dialect, asset_path)
    report(translation, console)
    if time_limit is None and document.time_limit >= 0:
        time_limit = document.time_limit * 3600
    destination = Destination(document, out)
    destination.check(passes)
    planned = translation.plan
    plan = PassPlan.of(planned.width, planned.height, planned.spp, per_pass)
    name = usable_variant(planned, variant)
    header = Header(
        render=fingerprint.of_render(translation, name, seed, integrator, plan.per_pass),
        spp=plan.spp,
        seconds=0.0,
        gamma=document.gamma_offset,
    )
    keeper = Checkpoint(destination.passes_path(), header, console)
    accumulator = keeper.begin(planned.width, planned.height, resume)
    to_do = chosen(plan, accumulator.done, passes)
    asked = accumulator.spp + to_do.spp
    seconds, why = 0.0, ""
    with interruptible() as stop:
        if len(to_do):
            dumps = Dumps(document, destination, time_limit)
            if cluster is None:
                rendering = prepared(translation, seed, integrator, name)
            else:
                job = translation, header.render, integrator
                rendering = clusters.opened(cluster, *job, keeper.note)
            with rendering as renderer, closing(renderer.render(to_do)) as found:
                steps = add_up(found, accumulator, len(to_do), asked)
                seconds, why = run(steps, accumulator, (keeper, dumps), time_limit, stop, console)
                if cluster is None:
                    for line in getattr(renderer.integrator, "report", list)():
                        console.print(line, highlight=False)
        if not accumulator.done:
            raise CannotRender(f"{why} before the first pass was done")
        if why or keep:
            keeper.save(accumulator, seconds)
        spectral = "spectral" in planned.variant
        if passes:
            keeper.write(destination.exact, accumulator, seconds)
            written = output.Written((destination.exact,), 0)
        else:
            written = destination.write(document, accumulator, keeper.seconds + seconds, spectral)
        if not (why or keep):
            keeper.discard()
    if math.isfinite(noise := accumulator.noise()):
        console.print(f"noise of a pixel: {100 * noise:.2g} % of the mean", highlight=False)
    if why:
        how_far = f"after {accumulator.spp} of {asked} samples a pixel; --resume goes on"
        console.print(f"[yellow]{why}[/] {how_far}")
    if written.repaired:
        why = "colours that RGB cannot hold, or noise" if spectral else "this should not happen"
        console.print(f"[yellow]{written.repaired} pixels below 0 or not finite: {why}[/]")
    for note in destination.notes:
        console.print(f"[yellow]{note}[/]", highlight=False)
    return written.paths


def chosen(plan, done, passes=None):
    """The `PassSet` to render.

    Args:
        plan: `PassPlan`.
        done: `PassSet` of those that are there.
        passes: (start, stop) of the only ones wanted, or None.

    Raises:
        ValueError: the plan has no such passes.
    """
    if passes is None:
        return plan.to_do(done)
    whole = plan.passes()
    start, stop = passes
    if not 0 <= start < stop <= len(whole):
        raise ValueError(f"passes {start}:{stop}: expected some of 0:{len(whole)}")
    return whole.between(start, stop).without(done)


def report(translation, console):
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


class Destination:
    """Where the picture of a scene goes.

    Args:
        document: the scene's document.
        out: as `render_file`.
    """

    def __init__(self, document, out=None):
        self.notes = []
        named = str(out) if out is not None else None
        self.exact = None
        self.folder = Path.cwd()
        if named is not None and (named.endswith(("/", "\\")) or Path(named).is_dir()):
            self.folder = Path(named)
            self.folder.mkdir(parents=True, exist_ok=True)
        elif named is not None:
            self.exact = Path(named)
        stem, self.extension = output.split_extension(document.output)
        self.stem = stem
        if self.extension.lower() not in output.WRITERS:
            self.extension = ".ppm"
            if self.exact is None:
                self.notes.append(f"'{document.output}' has no known extension: written as .ppm")

    def check(self, passes=None):
        """Raise `OutputError` if the picture, or the file of some passes, could not be written."""
        if passes and (self.exact is None or self.exact.suffix.lower() != ".exr"):
            raise output.OutputError("passes are written to a file that -o names, such as part.exr")
        probe = self.exact or output.safe_path(self.stem + self.extension, self.folder)[0]
        output.check_writable(probe)

    def passes_path(self):
        """Path of the passes while they are rendered: `<stem>.passes.exr` beside the picture."""
        if self.exact is not None:
            return self.exact.with_name(output.split_extension(self.exact.name)[0] + PASSES)
        return output.safe_path(self.stem + PASSES, self.folder)[0]

    def write(self, document, accumulator, seconds, spectral):
        """Write the picture and the BMP beside it; returns `output.Written`."""
        path = self.exact
        if path is None:
            method = metropolis(document)
            name = output.output_name(
                self.stem,
                self.extension,
                document.sampling,
                mutations(document) if method else document.supersampling,
                seconds,
                accumulator.spp,
                method=method or "",
                nes=document.next_event_estimation,
                spectrum=spectral,
                suffix=document.suffix,
            )
            path, note = output.safe_path(name, self.folder)
            self.notes += [note] if note else []
        return output.write_outputs(path, accumulator.image(), document.gamma_offset)

    def dump_path(self, index):
        """Path of a picture of the progress: `image/output_W000001.bmp` beside the picture."""
        if self.exact is not None:
            name, folder = f"image/output_W{index:06d}.bmp", self.exact.parent
        else:
            inner = self.stem.replace("\\", "/").rpartition("/")[0]
            name, folder = f"{inner}/image/output_W{index:06d}.bmp", self.folder
        return output.safe_path(name, folder)[0]


class Dumps:
    """Writes the picture so far at the scene's interval.

    Args:
        document: gives `IMAGEDUMP` [s] and the gamma.
        destination: where pictures go.
        time_limit: seconds, or None; with a limit the interval is at most a minute.
    """

    def __init__(self, document, destination, time_limit):
        self.interval = document.image_dump or float("inf")
        if time_limit is not None:
            self.interval = min(self.interval, DUMP_INTERVAL)
        self.gamma = document.gamma_offset
        self.destination = destination
        self.next = self.interval
        self.count = 0

    def offer(self, accumulator, seconds):
        """Write the picture so far if it is time."""
        if seconds < self.next:
            return
        self.count += 1
        self.next = seconds + self.interval
        output.write_image(self.destination.dump_path(self.count), accumulator.image(), self.gamma)


def run(steps, accumulator, keepers, time_limit, stop, console):
    """Render all passes, or until the time is up or somebody interrupts.

    Args:
        steps: iterator of `Progress`.
        accumulator: the `Accumulator` that they fill.
        keepers: objects with a method `offer(accumulator, seconds)`.
        time_limit: seconds, or None.
        stop: list that is not empty once somebody interrupts.
        console: for the progress.

    Returns:
        Seconds, and why it ended early or an empty string.
    """
    columns = (
        TextColumn("pass"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    pixels = accumulator.width * accumulator.height
    quiet = not console.is_terminal
    before, last, pass_time = accumulator.spp, 0.0, 0.0
    with Progress(*columns, console=console, transient=True, disable=quiet) as bar:
        task = bar.add_task("render", total=None, completed=len(accumulator.done), rate="")
        known = len(accumulator.done)
        for progress in steps:
            rate = (progress.spp - before) * pixels / progress.seconds / 1e6
            rate = f"{rate:.2f} M samples/s"
            bar.update(task, completed=progress.passes, total=progress.all_passes, rate=rate)
            if progress.passes == progress.all_passes:
                return progress.seconds, ""
            if progress.passes != known:
                known, pass_time, last = progress.passes, progress.seconds - last, progress.seconds
                for keeper in keepers:
                    keeper.offer(accumulator, progress.seconds)
            if stop:
                return progress.seconds, "interrupted"
            # Half a pass late on average rather than a whole one early.
            if time_limit is not None and progress.seconds + pass_time / 2 > time_limit:
                return progress.seconds, "time limit reached"
    raise AssertionError("a render ends with its last pass")


@contextmanager
def interruptible():
    """Context in which SIGINT and SIGTERM fill a list instead of ending the process.

    The second signal ends it.
    """
    stop = []

    def handle(number, _frame):
        if stop:
            sys.exit(128 + number)
        stop.append(number)

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
