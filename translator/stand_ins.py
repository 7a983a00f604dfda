"""What stands in for files that a scene names and that are missing: `--stand-ins`.

A row of `STAND_INS` says what is shown for the missing file of a keyword. A new kind is a function
that makes its file, and a row.
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

CELLS = 24
"""Cells of the grid of a sky around its axis, of 15 degrees each."""


@dataclass(frozen=True)
class StandIn:
    """What stands in for the files of some keywords.

    Attributes:
        what: in words, such as `a checkerboard`.
        suffix: of the file that is made.
        make: writes it.
    """

    what: str
    suffix: str
    make: Callable[[Path], None]


def sky(path: Path) -> None:
    """A grid of latitude and longitude: hue tells the longitude, brightness the latitude."""
    rows, columns = 512, 1024
    y, x = np.mgrid[0:rows, 0:columns]
    hues = np.array([colorsys.hsv_to_rgb(k / CELLS, 0.6, 1) for k in range(CELLS)])
    cell, row = x * CELLS // columns, y * (CELLS // 2) // rows
    bright = np.where((cell + row) % 2, 0.3, 0.8) * (1 - 0.6 * row / (CELLS // 2))
    pixels = hues[cell] * bright[..., None]
    line = (x * CELLS % columns < 2 * CELLS) | (y * (CELLS // 2) % rows < CELLS)
    pixels[line] = 0.95
    save(path, pixels)


def ring(path: Path) -> None:
    """A disk of tiles in twelve sectors, one of them marked, that fade out at the rim."""
    size = 512
    y, x = (np.mgrid[0:size, 0:size] - (size - 1) / 2) / (size / 2)
    radius, turn = np.hypot(x, y), np.arctan2(-y, x) / (2 * np.pi) % 1
    tile = np.floor(8 * radius) + np.floor(12 * turn)
    warm = np.array([[1.0, 0.85, 0.6], [0.95, 0.5, 0.2]])[(tile % 2).astype(int)]
    warm[turn < 1 / 12] *= [0.6, 0.9, 1.2]
    alpha = np.clip((1 - radius) / 0.15, 0, 1)
    save(path, np.concatenate([np.clip(warm, 0, 1), alpha[..., None]], axis=2))


def checkerboard(path: Path) -> None:
    """Squares of two greys."""
    y, x = np.mgrid[0:256, 0:256] // 32
    save(path, np.repeat(np.where((x + y) % 2, 0.35, 0.65)[..., None], 3, axis=2))


def save(path: Path, pixels: np.ndarray) -> None:
    """Write values from 0 to 1, (height, width, channels), as bytes."""
    Image.fromarray(np.round(255 * pixels).astype(np.uint8)).save(path)


SKY = StandIn("a grid of latitude and longitude", ".png", sky)
RING = StandIn("a ring of tiles", ".png", ring)
CHECKERBOARD = StandIn("a checkerboard", ".png", checkerboard)

STAND_INS = {
    "background_texture": SKY,
    "background_texture1": SKY,
    "background_texture2": SKY,
    "ibl_texture": SKY,
    "accretion_disk_texture": RING,
    "texture": CHECKERBOARD,
    "bump_texture": CHECKERBOARD,
}
"""What stands in for the missing file of a keyword."""


class Workshop:
    """Makes stand-ins in a folder, each kind once.

    Args:
        folder: where to.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._made: dict[StandIn, Path] = {}
        self._meshes = 0

    def make(self, field: str) -> tuple[Path, str] | None:
        """The file that stands in for that of a keyword, and what it is; None if nothing does."""
        kind = STAND_INS.get(field)
        if kind is None:
            return None
        if kind not in self._made:
            path = self.folder / f"stand-in-{len(self._made)}{kind.suffix}"
            kind.make(path)
            self._made[kind] = path
        return self._made[kind], kind.what

    def make_mesh(self, what: str, make: Callable[[Path], None]) -> tuple[Path, str]:
        """The file that stands in for a mesh: each has its own; and what it is, in words."""
        self._meshes += 1
        path = self.folder / f"stand-in-mesh-{self._meshes}.obj"
        make(path)
        return path, what
