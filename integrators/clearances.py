r"""How far it is at least from a point to the next surface or lamp of a scene.

Spheres, and lamps that are points, by their equations. Flat faces by a grid: a point of them lies
in each voxel that they are marked in, a Euclidean distance transform tells how far it is from the
middle of every voxel to that of the next one marked, and what the two may be off their middles is
taken off. What is nearer than about three voxels to a flat face counts as near to it.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import ndimage

from relume.integrators.boundaries import corners_of, sphere_of
from relume.integrators.translucentmaterials import shapes_below

SIDE = 96
"""Voxels along the longest side of the grid."""

MOST_BALLS = 64
"""Spheres beyond which no distances are known."""


class Clearances:
    """Distances to what is in a scene, as it is before it is rendered.

    Args:
        scene: `mi.Scene`.
        wanted: whether they are worth while.

    Attributes:
        known: whether there are any: not with instances, and shapes that are neither spheres nor
            flat.
    """

    def __init__(self, scene: mi.Scene, wanted: bool) -> None:
        self.known = wanted
        if not wanted:
            return
        balls: list[np.ndarray] = []
        faces: list[np.ndarray] = []
        for shape in shapes_below(scene):
            if shape.class_name() == "Sphere":
                balls.append(sphere_of(shape))
            elif (corners := corners_of(shape)) is not None:
                faces.append(corners)
            else:
                self.known = False
        for emitter in scene.emitters():
            if hasattr(emitter, "to_beam"):  # its light comes from a parallelogram
                a, u, v = (
                    np.array(part, float).ravel()
                    for part in (emitter.origin, emitter.edge_u, emitter.edge_v)
                )
                faces.append(np.array([[a, a + u, a + v], [a + u, a + v, a + u + v]]))
                continue
            box = emitter.bbox()
            if emitter.is_environment() or not box.valid() or emitter.get_shape() is not None:
                continue
            low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
            balls.append(np.append(0.5 * (low + high), 0.5 * np.linalg.norm(high - low)))
        self.known &= len(balls) <= MOST_BALLS
        self._balls = [mi.ScalarPoint4f(*ball.tolist()) for ball in balls]
        self._grid = grid_of(np.concatenate(faces)) if faces and self.known else None

    def at(self, p: mi.Point3f, active: mi.Bool) -> mi.Float:
        """Distances at points [scene unit]; 0 where something may be."""
        return self.two(p, active)[0]

    def two(self, p: mi.Point3f, active: mi.Bool) -> tuple[mi.Float, mi.Float]:
        """The two least distances at points [scene unit]: of points of a sphere, 0 and the rest."""
        first, second = mi.Float(dr.inf), mi.Float(dr.inf)
        for x, y, z, R in self._balls:
            t = dr.abs(dr.norm(p - mi.Point3f(x, y, z)) - R)
            second = dr.minimum(second, dr.maximum(first, t))
            first = dr.minimum(first, t)
        if self._grid is not None:
            t = self._grid.at(p, active)
            second = dr.minimum(second, dr.maximum(first, t))
            first = dr.minimum(first, t)
        return first, second


_grids: dict[tuple[str, int, int], Grid] = {}
"""The grid made last: each pass of a render asks for it anew."""


def grid_of(faces: np.ndarray) -> Grid:
    """The `Grid` of triangles (N, 3, 3)."""
    key = mi.variant(), len(faces), zlib.crc32(faces.tobytes())
    if key not in _grids:
        _grids.clear()
        _grids[key] = Grid(faces)
    return _grids[key]


class Grid:
    """Lower bounds of distances to triangles.

    Args:
        faces: their corners, (N, 3, 3).
    """

    def __init__(self, faces: np.ndarray) -> None:
        low, high = faces.min(axis=(0, 1)), faces.max(axis=(0, 1))
        h = float(max((high - low).max() / SIDE, 1e-30))
        size = np.maximum(np.ceil((high - low) / h).astype(int), 1)
        free = np.ones(size[::-1], bool)
        for points in samples(faces, 0.5 * h):
            x, y, z = np.minimum(((points - low) / h).astype(int), size - 1).T
            free[z, y, x] = False
        away = ndimage.distance_transform_edt(free)
        # Off their middles are the face's point, its distance from a sample, and what is asked for.
        bound = np.maximum(away - np.sqrt(3.0) - 0.5, 0) * h
        self._bound = mi.Float(bound.astype(np.float32).ravel())
        self._low, self._high = (mi.ScalarPoint3f(*corner.tolist()) for corner in (low, high))
        self._size = mi.ScalarVector3i(*size.tolist())
        self._scale = 1 / h

    def at(self, p: mi.Point3f, active: mi.Bool) -> mi.Float:
        """Bounds at points; outside of the grid at most the distance from its box."""
        within = dr.clip(p, mi.Point3f(self._low), mi.Point3f(self._high))
        cell = mi.Vector3i((within - mi.Point3f(self._low)) * self._scale)
        x, y, z = dr.clip(cell, 0, mi.Vector3i(self._size) - 1)
        index = mi.UInt32((z * self._size[1] + y) * self._size[0] + x)
        outside = dr.norm(p - within)
        return dr.select(outside > 0, outside, dr.gather(mi.Float, self._bound, index, active))


def samples(faces: np.ndarray, spacing: float) -> Sequence[np.ndarray]:
    """Points of triangles (N, 3, 3), no point of which is farther than `spacing` from one of them.

    Each array has shape (M, 3).
    """
    edges = np.linalg.norm(faces - np.roll(faces, 1, axis=1), axis=2).max(axis=1)
    steps = np.maximum(np.ceil(edges / spacing).astype(int), 1)
    found = []
    for count in np.unique(steps):
        i, j = np.mgrid[0 : count + 1, 0 : count + 1] / count
        inside = i + j <= 1 + 1e-9
        u, v = i[inside], j[inside]
        a, b, c = np.moveaxis(faces[steps == count], 1, 0)
        lattice = a + u[:, None, None] * (b - a) + v[:, None, None] * (c - a)
        found.append(lattice.reshape(-1, 3))
    return found
