"""Faces of an OBJ file: polygons into triangles, and corners that lack an attribute."""

from __future__ import annotations

import numpy as np

from .obj_model import vertex_normals


def triangulated(
    corners: np.ndarray, counts: np.ndarray, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles of polygons of any shape.

    A polygon is a fan about its first corner, unless some triangle of the fan would be turned
    against the polygon's normal (Newell's): then it is concave, and ears are cut off it.

    Args:
        corners: corners of all faces, one behind the other, int64 (C, 3 attributes).
        counts: corners of each face, 3 or more, int64 (F,).
        positions: float64 (V, 3).

    Returns:
        Triangles (T, 3 corners, 3 attributes), the face that each belongs to (T,), and the faces
        that are no fan.
    """
    place, owner = _fan(counts)
    folded = _folded(corners[:, 0], counts, place, owner, positions)
    if not len(folded):
        return corners[place], owner, folded
    first = np.cumsum(counts) - counts
    kept = ~np.isin(owner, folded)
    places, owners = [place[kept]], [owner[kept]]
    for face in folded:
        around = first[face] + np.arange(counts[face])
        ears = around[_ears(positions[corners[around, 0]])]
        places.append(ears)
        owners.append(np.full(len(ears), face))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return corners[np.concatenate(places)[order]], owner[order], folded


def _fan(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of the corners of fans, (T, 3), and the face of each triangle."""
    first = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(counts)), counts - 2)
    base = first[owner]
    step = np.arange(len(owner)) - (first - 2 * np.arange(len(counts)))[owner]
    return np.stack([base, base + step + 1, base + step + 2], axis=1), owner


def _folded(
    vertex: np.ndarray,
    counts: np.ndarray,
    place: np.ndarray,
    owner: np.ndarray,
    positions: np.ndarray,
) -> np.ndarray:
    """Faces whose fan has a triangle that is turned against the whole."""
    polygon = counts[owner] > 3
    if not polygon.any():
        return np.zeros(0, np.int64)
    owner, place = owner[polygon], place[polygon]
    a, b, c = (positions[vertex[place[:, k]]] for k in range(3))
    area = np.cross(b - a, c - a)
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    whole = np.add.reduceat(area, first)
    share = np.repeat(whole, np.diff(first, append=len(owner)), axis=0)
    along, square = (area * share).sum(axis=1), (share * share).sum(axis=1)
    # Corners in a line give areas of either sign by rounding.
    return np.unique(owner[along < -1e-12 * square])


def _ears(points: np.ndarray) -> np.ndarray:
    """Triangles (T, 3) of one polygon (N, 3), flattened along its normal; its fan where it has no
    area.

    A hole that is joined to the outline by a bridge, an edge there and back, is left open.
    """
    import mapbox_earcut

    points = points - points[0]
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    # Dropping the longest component of the normal keeps the order of the corners, or reverses it.
    flat = points[:, [(axis + 1) % 3, (axis + 2) % 3]] * (1, np.sign(normal[axis]))
    ends = np.array([len(points)], np.uint32)
    found = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), ends).reshape(-1, 3)
    ears = found.astype(np.int64)
    if not len(ears):
        return _fan(np.array([len(points)]))[0]
    a, b, c = (flat[ears[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return np.where(area[:, None] < 0, ears[:, ::-1], ears)


class CornerTables:
    """Texture coordinates and unit normals of a file, completed where corners name none.

    Args:
        positions: float64 (V, 3).
        uv: float64 (N, 2).
        normals: of any length, float64 (M, 3).
        triangles: all triangles, int64 (T, 3, 3); -1 where a corner names nothing.

    Attributes:
        uv: the texture coordinates, and (0, 0) behind them.
        normals: the unit normals, and, once a corner needs one, those of the vertices.
    """

    def __init__(
        self, positions: np.ndarray, uv: np.ndarray, normals: np.ndarray, triangles: np.ndarray
    ) -> None:
        largest = np.abs(normals).max(axis=1, initial=0)
        normals = normals / np.where(largest > 0, largest, 1)[:, None]  # squares may overflow
        length = np.linalg.norm(normals, axis=1)
        self._origin, self._given = len(uv), len(normals)
        self._usable = np.append(length > 0, False)
        self._mesh = positions, triangles[:, :, 0]
        self.uv = np.concatenate((uv, np.zeros((1, 2))))
        self.normals = normals / np.where(length > 0, length, 1)[:, None]

    def complete_uv(self, triangles: np.ndarray) -> np.ndarray:
        """Let a triangle with a corner that names no texture coordinate name (0, 0) thrice.

        Args:
            triangles: of one material, int64 (T, 3, 3), changed in place.

        Returns:
            Indices of these triangles; none where no triangle names any.
        """
        lacks = (triangles[:, :, 1] < 0).any(axis=1)
        if lacks.all():
            triangles[:, :, 1] = -1
            return np.zeros(0, np.int64)
        triangles[lacks, :, 1] = self._origin
        return np.flatnonzero(lacks)

    def complete_normals(self, triangles: np.ndarray) -> np.ndarray:
        """Let a corner that names no normal, or one of length 0, name that of its vertex.

        Args:
            triangles: of one material, int64 (T, 3, 3), changed in place.

        Returns:
            Indices of the triangles of such corners; none where no corner names a normal at all.
        """
        usable = self._usable[triangles[:, :, 2]]
        if not usable.any():
            named = np.flatnonzero((triangles[:, :, 2] >= 0).any(axis=1))
            triangles[:, :, 2] = -1
            return named
        if usable.all():
            return np.zeros(0, np.int64)
        if len(self.normals) == self._given:
            self.normals = np.concatenate((self.normals, vertex_normals(*self._mesh)))
        vertex = self._given + triangles[:, :, 0]
        triangles[:, :, 2] = np.where(usable, triangles[:, :, 2], vertex)
        return np.flatnonzero(~usable.all(axis=1))
