"""What reading an OBJ file gives, and how it fails."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np

from . import files_read
from .outcome_rows import Note

MAX_BYTES = 1 << 30
"""Largest OBJ file that is read (1 GiB, about 25 million triangles)."""


class MeshError(Exception):
    """A mesh file that cannot be read.

    Attributes:
        path: the file, as it was given.
        line: line number from 1, or None where the whole file is meant.
        column: column in bytes from 1, or None.
        message: what is wrong, without the place.
    """

    def __init__(
        self, path: str | Path, line: int | None, column: int | None, message: str
    ) -> None:
        self.path, self.line, self.column, self.message = path, line, column, message
        place = [str(path)] + [str(n) for n in (line, column) if n is not None]
        super().__init__(f"{':'.join(place)}: {message}")


@dataclass
class Group:
    """The faces of one material, with one index per distinct (v, vt, vn) triple.

    Attributes:
        material: name after ``usemtl`` in its first spelling, None before any ``usemtl``.
        line: line of the first such ``usemtl``, None where there is none.
        vertices: float64 (V, 3), in file units.
        faces: int32 (F, 3) into `vertices`.
        normals: unit vectors float64 (V, 3), or None where no corner names one.
        uv: float64 (V, 2), v upwards, or None where no face names any.
        colors: linear RGB float64 (V, 3), or None.
        source: int64 (V,), index of the OBJ vertex behind each mesh vertex.
    """

    material: str | None
    line: int | None
    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    colors: np.ndarray | None
    source: np.ndarray


@dataclass
class ObjFile:
    """What an OBJ file holds.

    Attributes:
        groups: one `Group` per material that has faces, in order of appearance.
        mtllib: what stands after each ``mtllib``, with its line, in file order.
        notes: (line, `Note`) of what was read otherwise than written.
        positions: all vertices of the file, float64 (N, 3).
        triangles: all triangles as indices into `positions`, int64 (T, 3).
    """

    groups: list[Group]
    mtllib: list[tuple[int, str]]
    notes: list[tuple[int, Note]]
    positions: np.ndarray = field(repr=False)
    triangles: np.ndarray = field(repr=False)

    @cached_property
    def _normals(self) -> np.ndarray:
        return vertex_normals(self.positions, self.triangles)

    def smooth_normals(self, group: Group) -> np.ndarray:
        """Area-weighted normals of a group, float64 (V, 3), across texture seams and groups."""
        return self._normals[group.source]


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area-weighted averages of the normals of the adjacent faces.

    Args:
        vertices: float (V, 3).
        faces: int (F, 3).

    Returns:
        Unit vectors float64 (V, 3); (0, 0, 1) where the adjacent faces have no area.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    weighted = np.cross(b - a, c - a)
    total = np.zeros((len(vertices), 3))
    for axis in range(3):
        for corner in range(3):
            total[:, axis] += np.bincount(
                faces[:, corner], weights=weighted[:, axis], minlength=len(vertices)
            )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.where(length > 0, length, 1), (0.0, 0.0, 1.0))


def open_mesh(path: str | Path) -> BinaryIO:
    """A regular file of acceptable size, opened for reading bytes."""
    try:
        if not Path(path).is_file():
            what = "is not a regular file" if Path(path).exists() else "does not exist"
            raise MeshError(path, None, None, what)
        if Path(path).stat().st_size > MAX_BYTES:
            raise MeshError(path, None, None, f"is larger than {MAX_BYTES >> 20} MiB")
        files_read.record(path)
        return open(path, "rb", buffering=0)
    except (OSError, ValueError) as error:
        raise MeshError(path, None, None, f"cannot be read: {error}") from error


def keep_freed_memory() -> None:
    """Let the C library reuse freed blocks below 16 MiB instead of returning them to the system.

    The bulk readers allocate arrays of some 100 KiB by the thousand. glibc at first returns each to
    the system, which then clears its pages again: half the time of a scan. Its limit grows to the
    size of the largest block freed so far (mallopt(3), M_MMAP_THRESHOLD), so one is freed here; it
    is never touched, and takes no memory.
    """
    np.empty(1 << 24, np.uint8)
