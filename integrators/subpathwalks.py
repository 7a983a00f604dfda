"""Subpaths of a given number of edges, from a lamp or from the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators import misweights
from relume.integrators.lightstarts import LightStart
from relume.integrators.lightsubpaths import first_vertex
from relume.integrators.misweights import Subpath
from relume.integrators.scattering import drawn, without_shading_normal
from relume.integrators.subpaths import Transport

LEAST_CHANCE = 0.1
"""Least probability with which a subpath ends on a surface that light also crosses, or crosses."""


@dataclass
class Walk:
    """State of a subpath: its last ray, what that meets, and the last vertex that scattered.

    Attributes:
        ray: ``mi.Ray3f``.
        met: ``mi.PreliminaryIntersection3f``.
        β: ``mi.Spectrum``, without what scatters at the end.
        m: `Subpath`, where the last vertex has scattered.
        vertex: ``mi.Interaction3f``.
        edges: before the last ray.
        dispersed: whether all wavelengths but the first are dropped.
        delta: of the camera: whether the last event was a delta one; from a lamp: whether the
            last vertex sends no light on by mirrors and glass.
        active: which subpaths there are, and still are.
        ended: whether the end is decided.
    """

    ray: mi.Ray3f
    met: mi.PreliminaryIntersection3f
    β: mi.Spectrum
    m: Subpath
    vertex: mi.Interaction3f
    edges: mi.UInt32
    dispersed: mi.Bool
    delta: mi.Bool
    active: mi.Bool
    ended: mi.Bool


def started(t: Transport, ray: mi.Ray3f, β: Any, m: Subpath, vertex: Any, active: Any) -> Walk:
    """A subpath at its first vertex."""
    ray, active = mi.Ray3f(ray), mi.Bool(active)
    return Walk(
        ray=ray,
        met=t.scene.ray_intersect_preliminary(ray, False, active=active),
        β=mi.Spectrum(β),
        m=m,
        vertex=vertex,
        edges=mi.UInt32(0),
        dispersed=mi.Bool(False),
        delta=mi.Bool(True),
        active=active,
        ended=mi.Bool(False),
    )


@dr.syntax
def walk(
    t: Transport,
    sampler: mi.Sampler,
    path: Walk,
    edges: Any,
    to_lamp: Any,
    start: LightStart | None,
) -> None:
    """Go on until a subpath has its edges; `arrived` tells what it is like at the end.

    Args:
        t: `Transport`.
        sampler: of three numbers for each vertex, four in scenes with surfaces that light crosses.
        path: `started`.
        edges: ``mi.UInt32``, how many.
        to_lamp: ``mi.Bool``, whether it is to end on a lamp or in the sky.
        start: where it begins at a lamp; None if it does at the camera.
    """
    crosses = t.surfaces.see_through or (t.hide_emitters and start is None)
    going = path.active & path.met.is_valid()
    if not crosses:
        going &= path.edges + 1 < edges
    while dr.hint(going, label="Subpaths"):
        step(t, sampler, path, edges, to_lamp, start, crosses, going)
        going = path.active & path.met.is_valid() & ~path.ended
        if not crosses:
            going &= path.edges + 1 < edges
    path.active &= (path.edges + 1 == edges) & (path.met.is_valid() | to_lamp)


def step(
    t: Transport,
    sampler: mi.Sampler,
    path: Walk,
    edges: mi.UInt32,
    to_lamp: mi.Bool,
    start: LightStart | None,
    crosses: bool,
    going: mi.Bool,
) -> None:
    """Scatter where the last ray has ended, and trace the next one."""
    si, m, β = arrived(t, path, start, going)
    bsdf = si.bsdf()
    ctx = t.radiance if start is None else t.importance
    last = mi.Bool(False)
    if crosses:
        last = going & (path.edges + 1 >= edges)
        T, q = crossing(t, si, bsdf, path, to_lamp, start is None, going)
        crossed = last & (sampler.next_1d() < q)
        path.ended |= last & ~crossed
    scatters = going & ~last
    bs = drawn(ctx, si, sampler.next_1d(), sampler.next_2d(), scatters)
    d = si.to_world(bs.wo)
    delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    weight = bs.weight
    if start is not None:
        shading = without_shading_normal(si, path.ray.d)
        incoming = dr.select(shading > 0, dr.rcp(shading), 0)
        weight *= incoming * without_shading_normal(si, d)
    if t.surfaces.disperse:
        parts = scatters & ~path.dispersed & ((bs.sampled_type & HERO_WAVELENGTH) != 0)
        if start is None:
            weight *= dr.select(parts, mi.Float(len(mi.Spectrum())), 1)
        path.dispersed |= parts
    cos = dr.abs(dr.dot(si.n, d))
    after = misweights.scattered(m, mi.Float(1), bs.pdf, bs.pdf_back, cos, delta)
    unlit = t.surfaces.unlit(si.shape, mi.Bool(True))

    moves, alive = scatters, mi.Bool(True)
    if crosses:
        null = scatters & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null) & dr.any(T != 0)
        hidden = is_hidden(t, si, path) & going if start is None else mi.Bool(False)
        null &= ~hidden
        straight = crossed | hidden
        moves = scatters & ~null & ~hidden
        d = dr.select(straight, path.ray.d, d)
        # What is crossed by a sample of the BSDF has its weight, without a shading normal.
        weight = dr.select(null, bs.weight, weight)
        weight = dr.select(crossed, T / q, weight)
        weight = dr.select(hidden, 1, weight)
        weight = dr.select(last & ~crossed, dr.rcp(1 - q), weight)
        β = dr.select(moves, β, path.β)
    if start is None:
        alive = ~(moves & unlit & path.delta)
        path.delta = dr.select(moves, delta, path.delta)
    else:
        alive = ~(moves & delta & path.delta)
        path.delta = dr.select(moves, unlit, path.delta)
    path.β = dr.select(going, β * weight, path.β)
    path.m = dr.select(moves, after, path.m)
    path.vertex = dr.select(moves, mi.Interaction3f(si), path.vertex)
    path.edges = dr.select(moves, path.edges + 1, path.edges)
    path.active &= ~going | (alive & dr.any(path.β != 0))
    onward = going & path.active & ~path.ended
    path.ray = dr.select(onward, si.spawn_ray(d), path.ray)
    met = t.scene.ray_intersect_preliminary(path.ray, False, active=onward)
    path.met = dr.select(onward, met, path.met)


def is_hidden(t: Transport, si: mi.SurfaceInteraction3f, path: Walk) -> mi.Bool:
    """Whether a ray of the camera has met an emitter that is not to be seen."""
    if not t.hide_emitters:
        return mi.Bool(False)
    return (path.edges == 0) & (si.shape.emitter() != None)  # noqa: E711


def crossing(
    t: Transport,
    si: mi.SurfaceInteraction3f,
    bsdf: mi.BSDF,
    path: Walk,
    to_lamp: mi.Bool,
    from_camera: bool,
    active: mi.Bool,
) -> tuple[mi.Spectrum, mi.Float]:
    """What a surface lets straight through, and with which probability the last ray crosses it."""
    T = mi.Spectrum(0)
    if t.surfaces.see_through:
        T = bsdf.eval_null_transmission(si, active)
    ends = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth) & ~to_lamp
    ends |= to_lamp & (si.shape.emitter() != None)  # noqa: E711
    chance = dr.clip(dr.mean(T), LEAST_CHANCE, 1 - LEAST_CHANCE)
    q = dr.select(dr.any(T != 0), dr.select(ends, chance, 1), 0)
    if from_camera:
        hidden = is_hidden(t, si, path)
        T, q = dr.select(hidden, 1, T), dr.select(hidden, 1, q)
    return T, q


def arrived(
    t: Transport, path: Walk, start: LightStart | None, active: mi.Bool
) -> tuple[mi.SurfaceInteraction3f, Subpath, mi.Spectrum]:
    """The end of the last ray, and the sums and throughput of the subpath there."""
    si = path.met.compute_surface_interaction(path.ray, mi.RayFlags.All, active)
    d2 = dr.squared_norm(si.p - path.vertex.p)
    cos = dr.abs(dr.dot(si.n, path.ray.d))
    m, β = misweights.arrived(path.m, d2, cos), path.β
    if start is not None:
        first = active & si.is_valid() & (path.edges == 0)
        m, β = first_vertex(t, start, si, cos, m, β, first)
    return si, m, β
