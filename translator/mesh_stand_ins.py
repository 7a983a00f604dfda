"""What stands in for meshes that are missing: a hall around the camera, or a block in its view.

The name tells which; the camera and the mesh's transformation tell where it is and how large, so
that the scene shows something of it. Whether the camera looks at where the mesh has its origin is
taken for whether the mesh is centred there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from relume.translator import camera, geometry
from relume.translator.document import Document
from relume.translator.objects import SceneObject

HALLS = re.compile(
    r"hall|sponza|miguel|museum|room|church|cathedral|house|villa|interior|corridor|building",
    re.IGNORECASE,
)
"""Parts of the names of meshes that surround the camera."""

HALL, BLOCK = "a hall with columns", "a block"

SHARE = 0.4
"""Height of a block, in units of the picture's at its distance."""

ASIDE = 0.8
"""A block stands at the mesh's origin if that is no farther from the middle of the picture than
this share of half its size; else in the middle."""

FAR = 8.0
"""Distance of a block that the camera has no target for, in units of the screen's height."""

HALF_HALL = np.array([1.2, 0.5, 1.2])
"""From the middle of a hall to its walls, in units of the distance to what the camera looks at."""

Make = Callable[[Path], None]


def stand_in(document: Document, block: SceneObject, file: str) -> tuple[str, Make]:
    """What stands in for the mesh of an object, in words, and what writes it as OBJ file.

    Args:
        document: tells the camera.
        block: the object, whose transformations the stand-in undoes.
        file: name of the mesh.
    """
    view = camera.view(document)
    matrix = geometry.compose(block.transforms)
    distance = distance_of(document, view)
    if HALLS.search(file.replace("\\", "/").rpartition("/")[2]) or HALLS.search(file):
        return HALL, lambda path: write(path, hall(view, distance), matrix)
    return BLOCK, lambda path: write(path, block_in(view, matrix, distance), matrix)


def distance_of(document: Document, view: camera.View) -> float:
    """Distance to what the camera looks at: its target, where that is not just a direction."""
    if document.target_pos is None or not camera.has_target(document):
        return FAR / max(view.height, 1e-6)
    found = float(np.linalg.norm(np.subtract(document.target_pos, document.camera_pos)))
    return found if found > 1.5 else FAR / max(view.height, 1e-6)


def block_in(view: camera.View, matrix: np.ndarray, distance: float) -> list[np.ndarray]:
    """The boxes of a block on a plinth, upright in the view: corners (2, 3) in its axes, placed."""
    origin = matrix[:3, 3]
    to = origin - view.origin
    depth = float(to @ view.direction)
    sides = (view.right, view.width), (view.up, view.height)
    seen = depth > 0 and all(abs(to @ axis) < ASIDE * depth * size / 2 for axis, size in sides)
    middle = origin if seen else view.origin + distance * view.direction
    height = SHARE * view.height * (depth if seen else distance)
    unit = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]])
    parts = (((1.0, 0.2, 1.0), -0.4), ((0.7, 0.6, 0.7), 0.0), ((0.4, 0.2, 0.4), 0.4))
    return [middle + height * (unit * size + np.array([0, y, 0])) for size, y in parts]


def hall(view: camera.View, distance: float) -> list[np.ndarray]:
    """The boxes of a hall around the camera: floor, walls, columns and beams, open at the top."""
    middle = view.origin + 0.5 * distance * np.array([view.direction[0], 0, view.direction[2]])
    half = HALF_HALL * distance
    low, high = middle - half, middle + half
    wall = 0.03 * distance
    boxes = [_between(low - [0, wall, 0], [high[0], low[1], high[2]])]
    for axis in (0, 2):
        for side, sign in ((low, -1), (high, 1)):
            a, b = low.copy(), high.copy()
            a[axis], b[axis] = side[axis], side[axis] + sign * wall
            boxes.append(_between(a, b))
    for x in np.linspace(low[0], high[0], 6)[1:-1]:
        for z in (low[2] + 0.25 * half[2], high[2] - 0.25 * half[2]):
            boxes.append(_between([x - wall, low[1], z - wall], [x + wall, high[1], z + wall]))
    return boxes


def _between(a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray) -> np.ndarray:
    corners = np.array([a, b], float)
    return np.sort(corners, axis=0)


QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
"""Faces of a box whose corner k has the upper x where bit 0 of k is set, and so on."""


def write(path: Path, boxes: Sequence[np.ndarray], matrix: np.ndarray) -> None:
    """Write boxes as an OBJ file that a matrix brings where they are.

    Args:
        path: the file.
        boxes: corners in the world, (2, 3) each.
        matrix: of the object, (4, 4); one that cannot be undone is left out.
    """
    invertible = abs(np.linalg.det(matrix[:3, :3])) > 1e-30
    undo = np.linalg.inv(matrix) if invertible else np.eye(4)
    lines = []
    for box in boxes:
        for k in range(8):
            corner = np.array([box[k >> axis & 1, axis] for axis in range(3)])
            x, y, z = geometry.point(undo, corner)
            lines.append(f"v {x:.9g} {y:.9g} {z:.9g}")
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    for index in range(len(boxes)):
        for quad in QUADS:
            corners = (f"{8 * index + k + 1}/{n + 1}" for n, k in enumerate(quad))
            lines.append(f"f {' '.join(corners)}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
