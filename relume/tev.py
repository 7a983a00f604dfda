"""The picture so far in the viewer tev, by its protocol.

A packet is its length in bytes, that included, as 32-bit integer, then one byte for its kind and
its fields; all numbers are little-endian, texts end with a zero byte.

Source: T. Müller, tev, https://github.com/Tom94/tev, section "Inter-process communication" of its
README (packets `CreateImage`, and `UpdateImage` of one channel).
"""

from __future__ import annotations

import socket
import struct
import time
from typing import TYPE_CHECKING

import numpy as np
from rich.markup import escape

from relume.accumulator import Accumulator
from relume.progress import Progress
from relume.translator import Translation

if TYPE_CHECKING:
    from rich.console import Console

CREATE, UPDATE = 4, 3
CHANNELS = "RGB"
TIMEOUT = 5.0
"""Time for the viewer to take what it is sent [s]."""

INTERVAL, SHARE = 0.5, 0.05
"""Least time between two pictures [s], and share of the time that they may take."""


class Tev:
    """Sends the picture of a render to tev; a viewer that is gone does not end the render.

    Args:
        translation: the scene.
        stop: taken for the sake of other viewers: tev stops no render.
        address: host and port of tev.
        console: for notes.
    """

    def __init__(
        self, translation: Translation, stop: list[int], address: tuple[str, int], console: Console
    ) -> None:
        self._name = translation.document.path or "relume"
        self._size = translation.plan.width, translation.plan.height
        self._address, self._console = address, console
        self._socket: socket.socket | None = None
        self._next = 0.0

    def start(self) -> None:
        """Connect, and make the picture."""
        try:
            self._socket = socket.create_connection(self._address, TIMEOUT)
        except OSError as error:
            self._give_up(error)
            return
        self._send(create(self._name, *self._size))

    def progress(self, progress: Progress) -> None:
        """tev shows pictures alone."""

    def offer(self, accumulator: Accumulator, seconds: float) -> None:
        """Send the picture so far, if it is time."""
        if seconds >= self._next and self._socket:
            start = time.perf_counter()
            self._picture(accumulator)
            took = time.perf_counter() - start
            self._next = seconds + max(INTERVAL, took / SHARE)

    def end(self, accumulator: Accumulator, seconds: float, said: str) -> None:
        """Send the last picture."""
        self._picture(accumulator)

    def close(self) -> None:
        """Disconnect."""
        if self._socket:
            self._socket.close()

    def _picture(self, accumulator: Accumulator) -> None:
        image = np.nan_to_num(accumulator.image())
        for index, channel in enumerate(CHANNELS):
            self._send(update(self._name, channel, image[..., index]))

    def _send(self, packet: bytes) -> None:
        if self._socket:
            try:
                self._socket.sendall(packet)
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        host, port = self._address
        why = error.strerror or str(error)
        said = escape(f"no tev at {host}:{port}: {why}")
        self._console.print(f"[yellow]{said}[/]", highlight=False)
        self.close()
        self._socket = None


def create(name: str, width: int, height: int) -> bytes:
    """The packet that makes a picture of the channels R, G, B."""
    channels = b"".join(text(channel) for channel in CHANNELS)
    return packet(
        CREATE, struct.pack("<B", 1) + text(name) + struct.pack("<iii", width, height, 3) + channels
    )


def update(name: str, channel: str, values: np.ndarray) -> bytes:
    """The packet that sets a channel: `values` (height, width)."""
    height, width = values.shape
    return packet(
        UPDATE,
        struct.pack("<B", 0)
        + text(name)
        + text(channel)
        + struct.pack("<iiii", 0, 0, width, height)
        + np.ascontiguousarray(values, "<f4").tobytes(),
    )


def text(value: str) -> bytes:
    """A text as tev reads it."""
    return value.replace("\0", "").encode() + b"\0"


def packet(kind: int, fields: bytes) -> bytes:
    """A whole packet."""
    return struct.pack("<IB", 5 + len(fields), kind) + fields
