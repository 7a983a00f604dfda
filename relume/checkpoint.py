"""The passes of a running render on disk, so that it can be resumed where it was stopped."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

from rich.console import Console

from relume import fingerprint, passes_file
from relume.accumulator import Accumulator
from relume.output import OutputError, clear_leftovers
from relume.passes_file import Header
from relume.session import CannotRender

INTERVAL = 2.0
"""Least time between two saves [s]."""

SHARE = 0.02
"""Share of the time that saving may take: large pictures are saved less often."""

EXPECTED = 0.5e-6
"""Time of the first save for each pixel, until it is measured [s]."""


class Checkpoint:
    """Saves an accumulator from time to time, and restores it.

    Args:
        path: file of the passes.
        header: that of this render, with 0 seconds.
        console: for notes.

    Attributes:
        seconds: time that earlier renders spent on the passes that were restored.
    """

    def __init__(self, path: Path, header: Header, console: Console) -> None:
        self.path = path
        self.header = header
        self.console = console
        self.seconds = 0.0
        self._next = INTERVAL
        self._saved: tuple[int, int] | None = None
        self._failed = False

    def begin(self, width: int, height: int, resume: bool) -> Accumulator:
        """The accumulator to go on with: a new one, or with `resume` that of the file.

        Raises:
            CannotRender: the file is of another render; or it is of this one, and would be lost
                without `resume`.
            NoPasses: the file that `resume` asks for is damaged.
        """
        self._next = max(INTERVAL, width * height * EXPECTED / SHARE)
        if not resume:
            self._protect()
        elif not self.path.exists():
            self.note(f"no passes in {self.path}: beginning with the first")
        else:
            header = passes_file.read_header(self.path)
            found = list(fingerprint.differences(header.render, self.header.render))
            if found:
                raise CannotRender(f"cannot go on with {self.path}: {'; '.join(found)}")
            clear_leftovers(self.path)
            self.seconds = header.seconds
            self._saved = self._stamp()
            return passes_file.read(self.path)
        return Accumulator(width, height)

    def offer(self, accumulator: Accumulator, seconds: float) -> None:
        """Save if it is time; a failure is reported once and does not end the render.

        Args:
            accumulator: the passes so far.
            seconds: since the render began.
        """
        if seconds < self._next:
            return
        start = time.perf_counter()
        try:
            self.save(accumulator, seconds)
        except OutputError as error:
            if not self._failed:
                self.note(f"{error}; the render goes on, but could not be resumed")
            self._failed = True
        took = time.perf_counter() - start
        self._next = seconds + max(INTERVAL, took / SHARE)

    def save(self, accumulator: Accumulator, seconds: float) -> None:
        """Save now.

        Raises:
            OutputError: the file cannot be written.
        """
        self.write(self.path, accumulator, seconds)
        self._saved = self._stamp()

    def write(self, path: Path, accumulator: Accumulator, seconds: float) -> None:
        """Write the passes to any file; as `save`."""
        header = dataclasses.replace(self.header, seconds=self.seconds + seconds)
        passes_file.write(path, accumulator, header)

    def discard(self) -> None:
        """Remove the file if it is as this render left it."""
        if self._saved is not None and self._stamp() == self._saved:
            self.path.unlink(missing_ok=True)

    def _protect(self) -> None:
        """Refuse to render from the beginning what the file holds a part of."""
        try:
            there = passes_file.read_header(self.path)
        except passes_file.NoPasses:
            return
        if any(fingerprint.differences(there.render, self.header.render)):
            self.note(f"{self.path} is of another render and will be replaced")
            return
        raise CannotRender(
            f"{self.path} holds {there.done.spp} samples per pixel of this render: go on with "
            "--resume, or remove it to begin again"
        )

    def _stamp(self) -> tuple[int, int] | None:
        try:
            status = self.path.stat()
        except OSError:
            return None
        return status.st_ino, status.st_mtime_ns

    def note(self, text: str) -> None:
        """Tell the user a sentence."""
        self.console.print(text, style="yellow", markup=False, highlight=False)
