"""Vertices of the camera merged with light vertices near them: light on matt surfaces that mirrors
or glass hide from both sides.

A vertex is merged if neither of its two edges can be connected, so that all that is left is to hit
a lamp by chance: its dVCM of `misweights` is 0 on both sides.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.hashes import hash_u32
from relume.integrators import misweights
from relume.integrators.lightvertices import DISPERSED, FIRST, SLOTS, LightVertex, LightVertices
from relume.integrators.misweights import Subpath
from relume.integrators.scattering import towards
from relume.integrators.sensorconnections import sensor_rays
from relume.integrators.subpaths import Transport

SHRINKS = 1 / 8
"""Radii fall as (launches so far) to this power: both the bias and the noise of the mean of all
launches vanish (C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach",
ACM Transactions on Graphics 2011, with alpha = 3/4)."""

LEAST_ENTRIES = 2**10
"""Least size of the table of cells."""

SAME_SIDE = 0.8
"""Least cosine between the normals of two vertices that are merged."""

ROWS = 4
"""Rows of four numbers that a vertex has in the grid."""


def pixel_width(sensor: mi.Sensor, vertices: LightVertices, stored: mi.UInt32) -> float:
    """Width that a pixel in the middle of a sensor's film sees, as far away as light vertices are.

    Args:
        sensor: the sensor.
        vertices: what was stored.
        stored: ``mi.UInt32``, smooth vertices of each subpath.

    Returns:
        The width at their median distance; 0 if there are none.
    """
    next_pixel = 0.5 + 1 / int(sensor.film().crop_size()[0])
    o, d, _ = sensor_rays(sensor, np.array([[0.5, 0.5], [next_pixel, 0.5]]))
    numbers = vertices.numbers.numpy().reshape(-1, SLOTS, vertices.rows, 4)
    kept = np.arange(SLOTS) < stored.numpy()[:, None]
    p = numbers[..., 0, :3][kept].astype(float)
    if not len(p):
        return 0.0
    distance = float(np.median(np.linalg.norm(p - o[0], axis=1)))
    ends = o + distance * d
    return float(np.linalg.norm(ends[1] - ends[0]))


def radius_of(first: float, launch: int) -> float:
    """The radius of a launch.

    Args:
        first: that of the first one.
        launch: which, from 0 on.
    """
    return float(first * (launch + 1) ** -SHRINKS)


def unconnected(m: Subpath) -> mi.Bool:
    """Whether the last edge of a subpath cannot be connected."""
    return m.dVCM == 0


def unconnected_light(m: Subpath, edges: mi.UInt32) -> mi.Bool:
    """`unconnected` of a light subpath, whose first edge emitter sampling finds."""
    return unconnected(m) & (edges >= 2)


class LightGrid:
    """The light vertices that can be merged, in the cells of a grid: sorted by the hash of theirs.

    No dataclass, whose fields Dr.Jit would take for state of the loops that use it.

    Args:
        vertices: what was stored.
        stored: ``mi.UInt32``, smooth vertices of each subpath.
        slots: ``mi.UInt32``, the places that are filled.
        groups: into how many the subpaths are divided.
        radius: in which vertices are merged.

    Attributes:
        numbers: per vertex p, edges | direction to the lamp, dVC | throughput | normal.
        first: ``mi.UInt32``, where in these each entry of the table begins.
    """

    def __init__(
        self,
        vertices: LightVertices,
        stored: mi.UInt32,
        slots: mi.UInt32,
        groups: int,
        radius: float,
    ) -> None:
        paths = vertices.paths // groups
        self.radius2 = dr.opaque(mi.Float, radius**2)
        self.density = dr.opaque(mi.Float, 1 / (paths * math.pi * radius**2))
        self.per_cell = dr.opaque(mi.Float, 0.5 / radius)
        y = at(vertices, slots)
        filled = slots - slots // SLOTS * SLOTS < dr.gather(mi.UInt32, stored, slots // SLOTS)
        merges = filled & unconnected_light(y.subpath, y.edges)
        slots = dr.gather(mi.UInt32, slots, dr.compress(merges))
        count = len(slots)
        entries = 1 << max(count, LEAST_ENTRIES).bit_length()
        self.last = dr.opaque(mi.UInt32, entries - 1)
        in_entry = dr.zeros(mi.UInt32, entries + 1)
        self.numbers = dr.zeros(mi.Float, 4 * ROWS * max(count, 1))
        if count:
            group = slots // SLOTS // dr.opaque(mi.UInt32, paths)
            entry = self.entry(self.cell(at(vertices, slots).si.p), group)
            dr.scatter_add(in_entry, mi.UInt32(1), entry, mode=dr.ReduceMode.Direct)
            self.store(vertices, stored, dr.gather(mi.UInt32, slots, dr.argsort(entry)))
        self.first = dr.prefix_sum(in_entry)
        dr.eval(self.first, self.numbers)

    def store(self, vertices: LightVertices, stored: mi.UInt32, slots: mi.UInt32) -> None:
        """Write the vertices at places, in their order."""
        y, lane = at(vertices, slots), slots // SLOTS
        stands_for = mi.Float(dr.gather(mi.UInt32, stored, lane) - (SLOTS - 1))
        T = y.throughput * dr.select(slots - lane * SLOTS == SLOTS - 1, stands_for, 1)
        edges = y.edges | dr.select(y.dispersed, mi.UInt32(DISPERSED), 0)
        rows = [
            mi.Vector4f(*y.si.p, dr.reinterpret_array(mi.Float, edges)),
            mi.Vector4f(*y.si.to_world(y.si.wi), y.subpath.dVC),
            mi.Vector4f(*T, *[mi.Float(0)] * (4 - len(T))),
            mi.Vector4f(*y.si.n, 0),
        ]
        index = dr.arange(mi.UInt32, len(slots))
        for i, row in enumerate(rows):
            dr.scatter(self.numbers, row, index * ROWS + i)

    def cell(self, p: mi.Point3f) -> mi.Vector3i:
        """The cell of a point: cells are as wide as the disk in which vertices are merged."""
        return mi.Vector3i(dr.floor(p * self.per_cell))

    def entry(self, cell: mi.Vector3i, group: mi.UInt32) -> mi.UInt32:
        """The entry of the table in which the vertices of a cell are, and those of others."""
        hashed = group
        for x in cell:
            hashed = hash_u32(hashed ^ dr.reinterpret_array(mi.UInt32, x))
        return hashed & self.last


def at(vertices: LightVertices, slots: mi.UInt32) -> LightVertex:
    """The vertices at places."""
    wavelengths = dr.zeros(mi.Ray3f).wavelengths
    return vertices.read(slots, mi.Float(1), wavelengths, mi.Bool(True))


@dr.syntax
def merged(
    t: Transport,
    grid: LightGrid,
    si: Any,
    m: Any,
    path: Any,
    group: Any,
    active: Any,
) -> Any:
    """What a vertex of the camera reflects of the light that has arrived near it.

    Args:
        t: `Transport`.
        grid: `LightGrid`.
        si: ``mi.SurfaceInteraction3f``, the vertex.
        m: `Subpath` there.
        path: `EyePath` that has reached it.
        group: ``mi.UInt32``, part of the cache of the same wavelengths.
        active: lanes.

    Returns:
        ``mi.Spectrum``.
    """
    L = mi.Spectrum(0)
    lowest = grid.cell(si.p - 0.5 / grid.per_cell)  # of the 8 cells that the disk can reach
    corner, index, end = mi.UInt32(0), mi.UInt32(0), mi.UInt32(0)
    depth, dispersed, active = mi.UInt32(path.depth), mi.Bool(path.dispersed), mi.Bool(active)
    while dr.hint(active, label="Merging"):
        turns = active & (index == end)
        corner[turns] += 1
        bits = corner - 1
        cell = lowest + mi.Vector3i(bits & 1, (bits >> 1) & 1, (bits >> 2) & 1)
        entry = grid.entry(cell, group)
        index = dr.select(turns, dr.gather(mi.UInt32, grid.first, entry, turns), index)
        end = dr.select(turns, dr.gather(mi.UInt32, grid.first, entry + 1, turns), end)

        near = active & (index < end)
        p, d, T, n = (
            dr.gather(mi.Vector4f, grid.numbers, index * ROWS + i, near) for i in range(ROWS)
        )
        index[near] += 1
        active &= (corner < 8) | (index < end)
        near &= (dr.squared_norm(p.xyz - si.p) < grid.radius2) & dr.all(grid.cell(p.xyz) == cell)
        near &= dr.dot(n.xyz, si.n) > SAME_SIDE
        stored = dr.reinterpret_array(mi.UInt32, p.w)
        edges = stored & (FIRST - 1)
        length = depth + 1 + edges
        near &= (length <= t.max_depth) & (length >= t.min_depth)

        wo = si.to_local(d.xyz)
        x = towards(t.radiance, si, wo, near)
        w = misweights.of_merge(
            t.ν,
            misweights.other_ways(Subpath(mi.Float(0), d.w), t.κ, x.pdf),
            misweights.other_ways(m, t.κ, x.pdf_back),
        )
        w = t.alone(w, s=edges + 1, t=depth + 2)
        value = x.f * mi.Spectrum([T[i] for i in range(len(L))]) * (w / dr.abs(wo.z))
        if t.surfaces.disperse:
            parts = ((stored & DISPERSED) != 0) & ~dispersed
            value *= dr.select(parts, mi.Float(len(L)), 1)
        near &= dr.all(dr.isfinite(value))
        L = dr.select(near, L + value, L)
    return L * grid.density
