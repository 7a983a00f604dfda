"""The cache of light vertices: what a connection needs of each, in rows of four numbers.

A light subpath has `SLOTS` places. The last one keeps one of all its vertices from there on, each
with the same chance (reservoir sampling), and stands for as many as these are, so that the cache
needs no bound on the length of paths.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.integrators.misweights import Subpath

SLOTS = 6
"""Places for the vertices of a light subpath."""

DISPERSED, FIRST = 1 << 31, 1 << 30
"""Bits of what is stored with the number of edges."""


def surface_frame(si: mi.SurfaceInteraction3f) -> mi.Vector4f:
    """A shading frame as its normal and the angle of its tangent."""
    n, s = si.sh_frame.n, si.sh_frame.s
    a, b = mi.coordinate_system(n)
    return mi.Vector4f(n.x, n.y, n.z, dr.atan2(dr.dot(s, b), dr.dot(s, a)))


def frame_from(stored: mi.Vector4f) -> mi.Frame3f:
    """The frame that `surface_frame` stored."""
    n = mi.Normal3f(stored.x, stored.y, stored.z)
    a, b = mi.coordinate_system(n)
    sine, cosine = dr.sincos(stored.w)
    s = mi.Vector3f(a) * cosine + mi.Vector3f(b) * sine
    return mi.Frame3f(s, dr.cross(n, s), n)


@dataclass
class LightVertex:
    """A vertex of a light subpath.

    Attributes:
        si: ``mi.SurfaceInteraction3f``, seen from the vertex before.
        throughput: ``mi.Spectrum``, what arrives, times the cosine to the shading normal over that
            to the geometric one (E. Veach 1997, section 5.3).
        subpath: `Subpath`.
        g: relative number of connections of its last edge.
        edges: ``mi.UInt32``, edges from the lamp.
        dispersed: whether all wavelengths but the first are dropped.
    """

    si: mi.SurfaceInteraction3f
    throughput: mi.Spectrum
    subpath: Subpath
    g: mi.Float
    edges: mi.UInt32
    dispersed: mi.Bool


class LightVertices:
    """The cache of some light subpaths.

    Args:
        paths: how many subpaths.
        partials: whether derivatives of the surface are kept, which bump maps need.
    """

    def __init__(self, paths: int, partials: bool) -> None:
        self.paths, self.partials = paths, partials
        self.rows = 8 if partials else 6
        self.numbers = dr.empty(mi.Float, 4 * self.rows * paths * SLOTS)

    def store(self, slot: mi.UInt32, vertex: LightVertex, active: mi.Bool) -> None:
        """Write a vertex."""
        si, m = vertex.si, vertex.subpath
        shape = dr.reinterpret_array(mi.UInt32, si.shape)
        flags = dr.select(vertex.dispersed, mi.UInt32(DISPERSED), 0)
        flags |= dr.select(vertex.g == 1, mi.UInt32(FIRST), 0)
        edges = dr.minimum(vertex.edges, FIRST - 1) | flags
        T = [*vertex.throughput, *[mi.Float(0)] * (4 - len(vertex.throughput))]
        bits = [dr.reinterpret_array(mi.Float, x) for x in (shape, si.prim_index, edges)]
        rows = [
            mi.Vector4f(si.p.x, si.p.y, si.p.z, m.dVCM),
            mi.Vector4f(si.n.x, si.n.y, si.n.z, m.dVC),
            surface_frame(si),
            mi.Vector4f(si.wi.x, si.wi.y, si.wi.z, bits[0]),
            mi.Vector4f(*T),
            mi.Vector4f(si.uv.x, si.uv.y, bits[1], bits[2]),
        ]
        if self.partials:
            rows += [mi.Vector4f(*v, 0) for v in (si.dp_du, si.dp_dv)]
        for i, row in enumerate(rows):
            dr.scatter(self.numbers, row, slot * self.rows + i, active)

    def read(
        self, slot: mi.UInt32, κ: mi.Float, wavelengths: mi.Spectrum, active: mi.Bool
    ) -> LightVertex:
        """Read a vertex.

        Args:
            slot: which.
            κ: its `g`, if it is not the first of its subpath.
            wavelengths: of its subpath.
            active: lanes.
        """
        first = slot * self.rows
        rows = [dr.gather(mi.Vector4f, self.numbers, first + i, active) for i in range(self.rows)]
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p, si.n = mi.Point3f(rows[0].xyz), mi.Normal3f(rows[1].xyz)
        si.sh_frame, si.wi = frame_from(rows[2]), rows[3].xyz
        si.shape = dr.reinterpret_array(mi.ShapePtr, dr.reinterpret_array(mi.UInt32, rows[3].w))
        si.uv = mi.Point2f(rows[5].x, rows[5].y)
        si.prim_index = dr.reinterpret_array(mi.UInt32, rows[5].z)
        si.wavelengths = wavelengths
        if self.partials:
            si.dp_du, si.dp_dv = rows[6].xyz, rows[7].xyz
        edges = dr.reinterpret_array(mi.UInt32, rows[5].w)
        T = mi.Spectrum([rows[4][i] for i in range(len(mi.Spectrum()))])
        return LightVertex(
            si=si,
            throughput=T,
            subpath=Subpath(rows[0].w, rows[1].w),
            g=dr.select((edges & FIRST) != 0, 1, κ),
            edges=edges & (FIRST - 1),
            dispersed=(edges & DISPERSED) != 0,
        )


class LightCache:
    """A filled cache, its vertices in groups that share their wavelengths.

    No dataclass, whose fields Dr.Jit would take for state of the loops that use it.

    Args:
        vertices: what was stored.
        stored: ``mi.UInt32``, smooth vertices of each subpath.
        groups: into how many the subpaths are divided.

    Attributes:
        slots: ``mi.UInt32``, the places that are filled, in their order.
        start, count: ``mi.UInt32`` by group, which of `slots` are its.
        paths: ``mi.Float``, subpaths of a group.
    """

    def __init__(self, vertices: LightVertices, stored: mi.UInt32, groups: int) -> None:
        self.vertices, self.stored = vertices, stored
        place = dr.arange(mi.UInt32, vertices.paths * SLOTS)
        lane = place // SLOTS
        filled = place - lane * SLOTS < dr.gather(mi.UInt32, stored, lane)
        self.slots = dr.compress(filled)
        if not len(self.slots):
            self.slots = dr.zeros(mi.UInt32, 1)
        size = vertices.paths // groups
        self.paths = dr.opaque(mi.Float, size)
        self.count = dr.block_sum(dr.minimum(stored, SLOTS), size)
        self.start = dr.block_prefix_sum(self.count, groups)
        dr.eval(self.slots, self.count, self.start)

    def pick(
        self, group: mi.UInt32, sample: mi.Float, active: mi.Bool
    ) -> tuple[mi.UInt32, mi.Float, mi.Bool]:
        """Pick one vertex of a group.

        Args:
            group: which.
            sample: uniform variate.
            active: lanes.

        Returns:
            (place, vertices of the group for which it stands, over its subpaths; whether there is
            one).
        """
        count = dr.gather(mi.UInt32, self.count, group, active)
        active = active & (count > 0)
        index = dr.minimum(mi.UInt32(sample * mi.Float(count)), count - 1)
        index += dr.gather(mi.UInt32, self.start, group, active)
        slot = dr.gather(mi.UInt32, self.slots, index, active)
        path = slot // SLOTS
        last = active & (slot - path * SLOTS == SLOTS - 1)
        stored = dr.gather(mi.UInt32, self.stored, path, last)
        stands_for = dr.select(last, mi.Float(stored - (SLOTS - 1)), 1)
        return slot, stands_for * mi.Float(count) / self.paths, active
