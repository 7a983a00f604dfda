"""How far a render is: what it tells after each pass, the bar that shows it, and when it ends."""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from rich.console import Console

    from relume.accumulator import Accumulator


@dataclass(frozen=True)
class Progress:
    """How far a render is.

    Attributes:
        passes: passes that are done.
        all_passes: passes of the whole render.
        spp: samples of a pixel that are done.
        all_spp: samples of a pixel of the whole render.
        seconds: since it began, loading the scene not counted.
    """

    passes: int
    all_passes: int
    spp: int
    all_spp: int
    seconds: float


Tell = Callable[[Progress], Any]
"""Gets the `Progress` after each pass; what it returns is not looked at."""


class Viewer(Protocol):
    """Somebody who looks at a render while it runs."""

    def start(self) -> None:
        """Begin to look."""

    def progress(self, progress: Progress) -> None:
        """Take over how far the render is."""

    def offer(self, accumulator: Accumulator, seconds: float) -> None:
        """Take over the picture so far, or not."""

    def end(self, accumulator: Accumulator, seconds: float, said: str) -> None:
        """Take over the last picture, and how the render ended."""

    def close(self) -> None:
        """Look no more."""


@contextmanager
def looking(viewers: Sequence[Viewer]) -> Iterator[None]:
    """Context in which viewers look."""
    with ExitStack() as stack:
        for viewer in viewers:
            viewer.start()
            stack.callback(viewer.close)
        yield


class TimeLimit:
    """Tells when the time of a render is up.

    A pass is not broken off. So that renders are half a pass late on average, rather than a whole
    one, the time counts as up where less than half of the last pass's time is left.

    Args:
        seconds: the limit, 0 or more; None for none.
        passes: that were there before the render began.

    Raises:
        ValueError: the limit is below 0, or no number.
    """

    def __init__(self, seconds: float | None, passes: int = 0) -> None:
        if seconds is not None and not seconds >= 0:
            raise ValueError(f"time limit {seconds}: expected 0 seconds or more")
        self.seconds = math.inf if seconds is None else seconds
        self._passes, self._last, self._pass_time = passes, 0.0, 0.0

    def reached(self, progress: Progress) -> bool:
        """Whether the render is to end here; to be asked after each pass."""
        if progress.passes != self._passes:
            self._pass_time = progress.seconds - self._last
            self._passes, self._last = progress.passes, progress.seconds
        return progress.seconds + self._pass_time / 2 > self.seconds


@contextmanager
def progress_bar(accumulator: Accumulator, console: Console | None = None) -> Iterator[Tell]:
    """Context with a function that shows progress as a bar, where there is a terminal or notebook.

    Args:
        accumulator: what is rendered into, before the first pass.
        console: where the bar is shown; by default standard error.
    """
    from rich import progress as bars
    from rich.console import Console

    columns = (
        bars.TextColumn("pass"),
        bars.MofNCompleteColumn(),
        bars.BarColumn(),
        bars.TextColumn("{task.fields[rate]}"),
        bars.TimeElapsedColumn(),
        bars.TextColumn("left"),
        bars.TimeRemainingColumn(),
    )
    console = console or Console(stderr=True)
    quiet = not (console.is_terminal or console.is_jupyter)
    pixels, before = accumulator.width * accumulator.height, accumulator.spp
    with bars.Progress(*columns, console=console, transient=True, disable=quiet) as bar:
        task = bar.add_task("render", total=None, completed=len(accumulator.done), rate="")

        def tell(progress: Progress) -> None:
            rate = (progress.spp - before) * pixels / progress.seconds / 1e6
            shown = f"{rate:.2f} M samples/s"
            bar.update(task, completed=progress.passes, total=progress.all_passes, rate=shown)

        yield tell


@contextmanager
def interruptible() -> Iterator[list[int]]:
    """Context in which SIGINT and SIGTERM fill a list instead of ending the process.

    The second signal ends it.
    """
    stop: list[int] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        if stop:
            sys.exit(128 + number)
        stop.append(number)

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
