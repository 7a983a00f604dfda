"""Walks inside media, from where a path goes in to the surface that it meets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.boundaries import FAR, Anchor
from relume.integrators.flightlights import Flight
from relume.integrators.seethrough import SHADOW_EPSILON

ROUNDING = 2e-6
"""How far off their place rays may start, in units of the coordinates."""

UNSURE = 0.2
"""How far behind a walk what it is to meet may be, in units of that."""


@dataclass
class Walk:
    """A walk inside a medium.

    Attributes:
        x: ``mi.Vector3f``, where it is, relative to the anchor.
        d: ``mi.Vector3f``, direction of travel.
        β: ``mi.Spectrum``, throughput of the path.
        L: ``mi.Spectrum``, what lamps have given it.
        depth: ``mi.UInt32``, of the path.
        left: ``mi.Float``, what is left of the flight; 0 where the next one is to be drawn.
        start: ``mi.Float``, where on the flight the next ray starts, if above 0.
        fresh: ``mi.Bool``, whether it is still at its anchor.
        n: ``mi.Vector3f``, where it has ended on a surface, the normal toward the outside.
        inside: ``mi.Bool``, whether it goes on.
        arrived: ``mi.Bool``, whether it has ended on a surface.
        o: ``mi.Point3f``, where the ray has started that has found the surface.
        pi: ``mi.PreliminaryIntersection3f``, what it has found, if any has.
        seen: ``mi.ShapePtr``, surface that was seen ahead last.
        outer: ``mi.Bool``, whether the walk is on the side that its normals point to.
        vertex: ``mi.Vector3f``, `x` of the last scattering.
        pdf: ``mi.Float``, density of the direction drawn there [1/sr].
        flight: `Flight` that has led there, relative to the anchor.
    """

    x: mi.Vector3f
    d: mi.Vector3f
    β: mi.Spectrum
    L: mi.Spectrum
    depth: mi.UInt32
    left: mi.Float
    start: mi.Float
    fresh: mi.Bool
    n: mi.Vector3f
    inside: mi.Bool
    arrived: mi.Bool
    o: mi.Point3f
    pi: mi.PreliminaryIntersection3f
    seen: mi.ShapePtr
    outer: mi.Bool
    vertex: mi.Vector3f
    pdf: mi.Float
    flight: Flight

    @classmethod
    def beginning(
        cls,
        anchor: Anchor,
        d: mi.Vector3f,
        throughput: mi.Spectrum,
        depth: mi.UInt32,
        inside: mi.Bool,
    ) -> Walk:
        """One that sets out from its anchor."""
        return cls(
            x=mi.Vector3f(0),
            d=mi.Vector3f(d),
            β=mi.Spectrum(throughput),
            L=mi.Spectrum(0),
            depth=mi.UInt32(depth),
            left=mi.Float(0),
            start=mi.Float(0),
            fresh=mi.Bool(True),
            n=mi.Vector3f(0),
            inside=mi.Bool(inside),
            arrived=mi.Bool(False),
            o=mi.Point3f(0),
            pi=nothing(),
            seen=mi.ShapePtr(anchor.shape),
            outer=mi.Bool(anchor.outer),
            vertex=mi.Vector3f(0),
            pdf=mi.Float(1),
            flight=Flight.none(),
        )


@dataclass
class FlightEnd:
    """What a flight comes to.

    Attributes:
        t: ``mi.Float``, distance to the surface that it meets, or `FAR`.
        n: ``mi.Vector3f``, normal of that toward the outside.
        stale: ``mi.Bool``, whether the ray has met a surface that the walk has left already.
        beyond: ``mi.Float``, distance beyond that surface.
        o: ``mi.Point3f``, where the ray has started.
        pi: ``mi.PreliminaryIntersection3f``, what it has found, where that tells all.
    """

    t: mi.Float
    n: mi.Vector3f
    stale: mi.Bool
    beyond: mi.Float
    o: mi.Point3f
    pi: mi.PreliminaryIntersection3f


def nothing() -> mi.PreliminaryIntersection3f:
    """An intersection with nothing."""
    found = dr.zeros(mi.PreliminaryIntersection3f)
    found.t = mi.Float(dr.inf)
    return found


def tolerance(p: mi.Point3f, extent: mi.Float) -> mi.Float:
    """How far off its place a ray may be at p, on a shape of some extent [scene unit]."""
    return ROUNDING * (dr.max(dr.abs(p)) + extent)


@dr.syntax
def flight_end(
    scene: mi.Scene, anchor: Anchor, medium: mi.MediumPtr, walk: Walk, s: mi.Float, active: mi.Bool
) -> FlightEnd:
    """Where flights of the length `s` meet a surface.

    Args:
        scene: the scene.
        anchor: where the walks have set out.
        medium: that they are in.
        walk: the walks.
        s: distances [scene unit].
        active: lanes.
    """
    own = dr.select(anchor.known, anchor.distance(walk.x, walk.d), FAR)
    n = anchor.normal(dr.fma(own, walk.d, walk.x))
    end = FlightEnd(own, n, mi.Bool(False), mi.Float(0), mi.Point3f(0), nothing())
    rays = active & ~anchor.alone
    if rays:
        p = anchor.p + walk.x
        off = tolerance(p, anchor.extent)
        # A walk leaves its own surface first; later it may be just off any, by rounding behind it.
        start = dr.select(walk.fresh, off, -off)
        start = dr.select(walk.start > 0, walk.start, start)
        ray = mi.Ray3f(dr.fma(start, walk.d, p), walk.d)
        ray.maxt = s + 4 * off - start
        pi = scene.ray_intersect_preliminary(ray, coherent=False, active=rays & (ray.maxt > 0))
        hit = pi.is_valid()
        si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal, hit)
        t = pi.t + start
        beyond = dr.maximum(t, 0) + off
        # Seen from where the walk is, a surface has the walk's medium on this side. Of what is
        # opaque the walk knows on which side of the one seen last it is.
        near = hit & (t < 2 * off)
        parts = si.is_medium_transition()
        outer = dr.dot(si.n, walk.d) < 0
        behind = (pi.shape == walk.seen) & (outer != walk.outer)
        behind |= t < -UNSURE * off
        other = dr.select(parts, si.target_medium(-walk.d) != medium, behind)
        stale = near & other
        walk.seen = dr.select(hit & ~near, pi.shape, walk.seen)
        walk.outer = dr.select(hit & ~near, outer, walk.outer)
        # Of its own face the walk knows better where it is.
        same = hit & anchor.known & (pi.shape == anchor.shape) & (pi.prim_index == anchor.prim)
        missed = ~hit & anchor.known & (own < s) & (anchor.depth(walk.x) < off)
        outward = dr.mulsign(mi.Vector3f(si.n), dr.dot(si.n, walk.d))
        n = dr.select(same | missed, end.n, outward)
        t = dr.select(same | missed, own, dr.select(hit, dr.maximum(t, 0), FAR))
        found = dr.select(same | missed | stale, nothing(), pi)
        end = FlightEnd(dr.select(stale, FAR, t), n, stale, beyond, mi.Point3f(ray.o), found)
    return end


@dr.syntax
def light_through(
    scene: mi.Scene,
    around: Any,
    medium: mi.MediumPtr,
    ray: mi.Ray3f,
    ds: mi.DirectionSample3f,
    off: mi.Float,
    own: mi.Float,
    active: mi.Bool,
) -> mi.Spectrum:
    """What media and surfaces leave of the light of a sampled point of a lamp.

    Args:
        scene: the scene.
        around: its media, and surfaces that light crosses straight on.
        medium: where the ray starts.
        ray: toward the lamp, with its length; it may start `off` too early.
        ds: the sampled point.
        off: how far off its place the ray may start; 0 on surfaces.
        own: distance to the surface that it meets first, if that is known, or `FAR`.
        active: lanes.

    Returns:
        ``mi.Spectrum``, times the share of its emission with which the lamp shines there.
    """
    T = mi.Spectrum(1)
    active = mi.Bool(active)
    ray = mi.Ray3f(ray)
    towards = mi.Vector3f(ray.d)
    lamp = ds.emitter.get_shape()
    medium = mi.MediumPtr(medium)
    before = mi.Float(off)  # part of the ray that does not count
    first = mi.Bool(True)
    while dr.hint(active, label="Shadow ray through media"):
        end = mi.Float(ray.maxt)
        ray.maxt = around.reach(lamp, end)
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        crosses = active & si.is_valid() & si.is_medium_transition()
        stale = crosses & first & (si.t < 3 * off) & (si.target_medium(-ray.d) != medium)
        way = dr.maximum(dr.minimum(si.t, end) - before, 0)
        way = dr.select(first & (own < FAR), own, way)
        inside = active & ~stale & (medium != None)  # noqa: E711
        T *= dr.select(inside, around.media.transmittance(medium, ray.wavelengths, way, inside), 1)
        T_here = si.bsdf().eval_null_transmission(si, active)
        active &= si.is_valid()
        at_lamp = active & (si.t >= end) & (si.shape == lamp)
        active &= si.t < end
        T *= dr.select(active & ~stale, T_here, 1)
        T *= dr.select(at_lamp, around.shining(si.shape, T_here), 1)
        medium = dr.select(active & crosses & ~stale, si.target_medium(ray.d), medium)
        # What the start of a ray skips belongs to its way.
        ahead = si.spawn_ray(ray.d)
        skipped = dr.select(stale, si.t + off - before, dr.dot(ahead.o - si.p, ray.d))
        before = -skipped
        ray.o = dr.select(stale, dr.fma(si.t + off, ray.d, ray.o), ahead.o)
        # Aimed anew, as in `Surfaces.transmittance`.
        aim = ds.p - ray.o
        distance = dr.norm(aim)
        ray.d, ray.maxt = aim / distance, distance * (1 - SHADOW_EPSILON)
        active &= dr.any(T != 0) & (dr.dot(aim, towards) > 0)
        first = mi.Bool(False)
    return T
