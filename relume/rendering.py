"""`relume render`: a session with progress, dumps, limits and safe output."""

import signal
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

import translator
from relume import output
from relume.application import prepared, read, resized

DUMP_INTERVAL = 60.0
"""With a time limit the picture so far is written each minute, as the manual says [s]."""


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
        console: `rich.console.Console` for progress and notes.

    Returns:
        Paths of the files written, the picture first.
    """
    document = resized(read(path), size, spp)
    translation = translator.translate(document, dialect, asset_path)
    report(translation, console)
    if time_limit is None and document.time_limit >= 0:
        time_limit = document.time_limit * 3600
    destination = Destination(document, out)
    destination.check()
    with prepared(translation, seed, integrator, variant) as session, interruptible() as stop:
        start = time.perf_counter()
        why = run(session, Dumps(document, destination, time_limit), time_limit, stop, console)
        seconds = time.perf_counter() - start
        picture = session.image()
        spectral = "spectral" in translation.plan.variant
        spp = session.accumulator.spp
        written = destination.write(document, picture, seconds, spp, spectral)
    if why:
        console.print(f"[yellow]{why}[/] after {spp} of {session.spp} samples a pixel")
    if written.repaired:
        why = "colours that RGB cannot hold, or noise" if spectral else "this should not happen"
        console.print(f"[yellow]{written.repaired} pixels below 0 or not finite: {why}[/]")
    for note in destination.notes:
        console.print(f"[yellow]{note}[/]", highlight=False)
    return written.paths


def report(translation, console):
    """Say what of the scene is not rendered as written."""
    for outcome, style in (("unsupported", "red"), ("approximated", "yellow")):
        lines = [r for r in translation.document.source.all if r.outcome == outcome and r.note]
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

    def check(self):
        """Raise `OutputError` if the picture could not be written."""
        probe = self.exact or output.safe_path(self.stem + self.extension, self.folder)[0]
        output.check_writable(probe)

    def write(self, document, picture, seconds, spp, spectral):
        """Write the finished picture and the BMP beside it; returns `output.Written`."""
        path = self.exact
        if path is None:
            name = output.output_name(
                self.stem,
                self.extension,
                document.sampling,
                document.supersampling,
                seconds,
                spp,
                nes=document.next_event_estimation,
                spectrum=spectral,
                suffix=document.suffix,
            )
            path, note = output.safe_path(name, self.folder)
            self.notes += [note] if note else []
        return output.write_outputs(path, picture, document.gamma_offset)

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

    def offer(self, session, seconds):
        """Write the picture so far if it is time."""
        if seconds < self.next:
            return
        self.count += 1
        self.next = seconds + self.interval
        output.write_image(self.destination.dump_path(self.count), session.image(), self.gamma)


def run(session, dumps, time_limit, stop, console):
    """Render all passes, or until the time is up or somebody interrupts.

    Returns:
        Why it ended early, or an empty string.
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
    pixels = session.width * session.height
    quiet = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=quiet) as bar:
        task = bar.add_task("render", total=None, rate="")
        last = 0.0
        for progress in session.run():
            rate = f"{progress.spp * pixels / progress.seconds / 1e6:.2f} M samples/s"
            bar.update(task, completed=progress.passes, total=progress.all_passes, rate=rate)
            if progress.passes == progress.all_passes:
                return ""
            dumps.offer(session, progress.seconds)
            if stop:
                return "interrupted"
            pass_time, last = progress.seconds - last, progress.seconds
            # Half a pass late on average rather than a whole one early.
            if time_limit is not None and progress.seconds + pass_time / 2 > time_limit:
                return "time limit reached"
    return ""


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
