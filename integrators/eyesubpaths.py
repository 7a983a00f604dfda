"""Subpaths from the camera: they hit lamps, sample emitters, are connected to light vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators import misweights
from relume.integrators.common import russian_roulette, usual_throughput
from relume.integrators.lightvertices import LightCache
from relume.integrators.merging import LightGrid, merged, unconnected
from relume.integrators.misweights import Subpath
from relume.integrators.scattering import Towards, scatter, towards, without_shading_normal
from relume.integrators.subpaths import Transport, unoccluded


@dataclass
class EyePath:
    """State of a path: its next ray, what it has found, and its last vertex that scattered."""

    ray: mi.Ray3f
    L: mi.Spectrum
    β: mi.Spectrum
    m: Subpath
    η: mi.Float
    usual: mi.Float
    depth: mi.UInt32
    seen: mi.Bool
    dispersed: mi.Bool
    active: mi.Bool
    vertex: mi.Interaction3f
    delta: mi.Bool


@dr.syntax
def trace_eye(
    transport: Transport,
    sampler: mi.Sampler,
    ray: Any,
    cache: LightCache,
    grid: LightGrid | None,
    group: Any,
) -> tuple[Any, Any]:
    """Find the radiance along rays of the camera, but for what light subpaths show to it.

    Args:
        transport: `Transport`.
        sampler: seeded for as many lanes.
        ray: ``mi.RayDifferential3f``.
        cache: `LightCache`.
        grid: `LightGrid`, or None where no vertices are merged.
        group: ``mi.UInt32``, its part of the same wavelengths.

    Returns:
        (radiance, whether the rays have met anything).
    """
    t = transport
    path = started(t, ray)
    while dr.hint(path.active, label="Camera subpaths"):
        step(t, sampler, cache, grid, group, path)
    return path.L, path.seen


def started(t: Transport, ray: mi.Ray3f) -> EyePath:
    """A path at its sensor."""
    origin = dr.zeros(mi.Interaction3f)
    origin.p = mi.Point3f(ray.o)
    dVCM = mi.Float(0)
    if t.pinhole:
        origin.p = mi.Point3f(t.pinhole.start(ray))
        pdf = t.pinhole.pdf(ray.d, origin.p)
        dVCM = dr.select(pdf > 0, t.r / pdf, 0)
    return EyePath(
        ray=mi.Ray3f(ray),
        L=mi.Spectrum(0),
        β=mi.Spectrum(1),
        m=Subpath(dVCM, mi.Float(0), t.no_merges()),
        η=mi.Float(1),
        usual=mi.Float(0),
        depth=mi.UInt32(0),
        seen=mi.Bool(t.scene.environment() is not None and not t.hide_emitters),
        dispersed=mi.Bool(False),
        active=mi.Bool(t.max_depth > 0),
        vertex=origin,
        delta=mi.Bool(True),
    )


def step(
    t: Transport,
    sampler: mi.Sampler,
    cache: LightCache,
    grid: LightGrid | None,
    group: mi.UInt32,
    path: EyePath,
) -> None:
    """Trace one ray and scatter where it ends."""
    # Embree's coherent traversal gains for neighbouring rays from the camera alone.
    si = t.scene.ray_intersect(
        path.ray, ray_flags=mi.RayFlags.All, coherent=path.depth == 0, active=path.active
    )
    bsdf = si.bsdf()
    flags = bsdf.flags()
    see_through = t.surfaces.see_through
    T = bsdf.eval_null_transmission(si, path.active) if see_through else None
    hidden = mi.Bool(False)
    if t.hide_emitters:
        hidden = path.active & (path.depth == 0) & (si.shape.emitter() != None)  # noqa: E711
    add_emission(t, si, T, path)

    meets = path.active & si.is_valid() & ~hidden
    goes_on = meets & (path.depth + 1 < t.max_depth)
    goes_on &= ~t.surfaces.unlit(si.shape, path.delta)
    scatters = mi.Bool(goes_on)  # a copy
    if see_through:  # so may the end of the longest path be
        scatters |= meets & mi.has_flag(flags, mi.BSDFFlags.Null)
    d2 = dr.squared_norm(si.p - path.vertex.p)
    m = misweights.arrived(path.m, d2, dr.abs(dr.dot(si.n, path.ray.d)))
    g = dr.select(path.depth == 0, 1, t.κ)

    # ---------------- a point of a lamp, a light vertex, and a new direction ----------------

    lit = goes_on & mi.has_flag(flags, mi.BSDFFlags.Smooth)
    sampled = lit & (path.depth + 2 >= t.min_depth)
    ds, Le = t.scene.sample_emitter_direction(si, sampler.next_2d(), not see_through, sampled)
    sampled &= ds.pdf != 0
    if t.surfaces.spheres:
        sampled &= ~t.surfaces.light_themselves(si, ds)
    slot, count, joined = cache.pick(group, sampler.next_1d(), lit)
    y = cache.vertices.read(slot, t.κ, path.ray.wavelengths, joined)
    to_y = y.si.p - si.p
    distance2 = dr.squared_norm(to_y)
    to_y *= dr.rsqrt(distance2)
    joined &= distance2 > 0
    edges = path.depth + 2 + y.edges
    joined &= (edges <= t.max_depth) & (edges >= t.min_depth)
    (lamp, x), drawn = scatter(
        t.radiance,
        si,
        [si.to_local(ds.d), si.to_local(to_y)],
        sampler.next_1d(),
        sampler.next_2d(),
        scatters,
    )
    add_direct(t, si, ds, Le, lamp, m, g, sampled, path)

    joined &= dr.any(x.f != 0)
    at_y = towards(t.importance, y.si, y.si.to_local(-to_y), joined)
    cos_x, cos_y = (dr.abs(dr.dot(n, to_y)) for n in (si.n, y.si.n))
    w = misweights.of_connection(
        t.κ,
        x.pdf * cos_y / distance2,
        misweights.other_ways(y.subpath, y.g, at_y.pdf_back),
        at_y.pdf * cos_x / distance2,
        misweights.other_ways(m, g, x.pdf_back),
    )
    w = t.alone(w, s=y.edges + 1, t=path.depth + 2)
    value = x.f * at_y.f * without_shading_normal(y.si, to_y) * y.throughput
    value *= w * count / distance2
    if t.surfaces.disperse:
        value *= dr.select(y.dispersed & ~path.dispersed, mi.Float(len(mi.Spectrum())), 1)
    joined &= dr.any(value != 0) & dr.all(dr.isfinite(value))
    value *= unoccluded(t, si, y.si.p, joined)
    path.L[joined] = dr.fma(path.β, value, path.L)

    if grid is not None:
        path.L = dr.fma(path.β, merged(t, grid, si, m, path, group, lit & unconnected(m)), path.L)

    # ---------------------------- next ray and weight ----------------------------

    ray = si.spawn_ray(si.to_world(drawn.wo))
    weight = drawn.weight
    if t.surfaces.disperse:
        parts = ~path.dispersed & ((drawn.sampled_type & HERO_WAVELENGTH) != 0)
        weight *= dr.select(parts, mi.Float(len(mi.Spectrum())), 1)
        path.dispersed |= parts & scatters
    passes = known = mi.Bool(False)
    if see_through:
        passes = scatters & mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Null)
        known = passes & dr.any(T != 0)
    if t.hide_emitters:
        ray = dr.select(hidden, si.spawn_ray(path.ray.d), ray)
        weight = dr.select(hidden, 1, weight)
        passes, known = passes | hidden, known | hidden
    delta = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
    cos = dr.abs(dr.dot(si.n, ray.d))
    ν = None if t.ν is None else dr.select(unconnected(m), t.ν, 0)
    after = misweights.scattered(m, g, drawn.pdf, drawn.pdf_back, cos, delta, ν)

    path.ray = ray
    path.seen |= path.active & si.is_valid() & ~passes
    path.depth[si.is_valid() & ~passes] += 1
    # Other ways see through surfaces, too: the vertex stays where light last scattered.
    path.vertex = dr.select(known, path.vertex, mi.Interaction3f(si))
    path.m = dr.select(known, path.m, after)
    path.delta = dr.select(known, path.delta, delta)
    path.β *= weight
    eta = dr.select(passes, 1, drawn.eta)
    path.η *= eta
    path.usual = usual_throughput(path.usual, path.β, path.η, path.depth, ~passes, path.delta)
    kept = dr.max(weight) * dr.square(eta)
    decides = (path.depth >= t.rr_depth) & ~passes
    path.β, survives = russian_roulette(
        path.β, path.η, path.usual, kept, path.depth, decides, sampler.next_1d()
    )
    path.active = (goes_on | passes) & survives


def add_emission(t: Transport, si: mi.SurfaceInteraction3f, T: Any, path: EyePath) -> None:
    """Add the light of the emitter that a ray has met."""
    ds = mi.DirectionSample3f(t.scene, si, path.vertex)
    behind = path.active & (path.depth > 0)
    pdf = t.scene.pdf_emitter_direction(path.vertex, ds, behind)
    E = t.emission.emitted(ds, pdf, behind)
    w = dr.select(path.depth == 0, 1, misweights.of_hit(path.m, pdf, E))
    w = t.alone(w, s=mi.UInt32(0), t=path.depth + 2)
    shown = mi.Bool(path.active)
    if t.min_depth > 1:
        shown &= path.depth + 1 >= t.min_depth
    if t.hide_emitters:
        shown &= path.depth > 0
    Le = ds.emitter.eval(si, shown) * w
    if t.surfaces.masked_lamps:
        Le *= t.surfaces.shining(si.shape, T)
    path.L = dr.fma(path.β, Le, path.L)


def add_direct(
    t: Transport,
    si: mi.SurfaceInteraction3f,
    ds: mi.DirectionSample3f,
    Le: mi.Spectrum,
    lamp: Towards,
    m: Subpath,
    g: mi.Float,
    lit: mi.Bool,
    path: EyePath,
) -> None:
    """Add the light of a sampled point of an emitter."""
    R = t.emission.ratio(ds, ds.pdf, lit) * dr.abs(dr.dot(si.n, ds.d))
    pdf_ratio = dr.select(ds.delta, 0, lamp.pdf / ds.pdf)
    w = misweights.of_emitter_sample(pdf_ratio, R, misweights.other_ways(m, g, lamp.pdf_back))
    w = t.alone(w, s=mi.UInt32(1), t=path.depth + 2)
    direct = lamp.f * Le * w
    if t.surfaces.see_through:
        lit &= dr.any(direct != 0)
        direct *= t.surfaces.transmittance(t.scene, si, ds, lit)
    path.L[lit] = dr.fma(path.β, direct, path.L)
