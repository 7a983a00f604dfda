"""Subpaths from the lamps: each vertex is shown to the camera, and kept for connections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators import misweights
from relume.integrators.common import russian_roulette
from relume.integrators.emission import AREA, FAR, POINT
from relume.integrators.lightstarts import LightStart
from relume.integrators.lightvertices import SLOTS, LightVertex, LightVertices
from relume.integrators.merging import unconnected_light
from relume.integrators.misweights import Subpath
from relume.integrators.scattering import scatter, without_shading_normal
from relume.integrators.splats import SplatFilm
from relume.integrators.subpaths import Transport, unoccluded


@dataclass
class LightPath:
    """State of a light subpath: its next ray, what it carries, and where it was last.

    Attributes:
        kept: smooth vertices so far.
        bright: largest channel of what it carried at its first vertex.
        shown: luminance of what it has shown to the camera.
    """

    ray: mi.Ray3f
    β: mi.Spectrum
    m: Subpath
    origin: mi.Point3f
    edges: mi.UInt32
    kept: mi.UInt32
    bright: mi.Float
    no_delta: mi.Bool
    dispersed: mi.Bool
    active: mi.Bool
    shown: mi.Float


@dr.syntax
def trace_light(
    transport: Transport,
    sampler: mi.Sampler,
    wavelengths: Any,
    colour_weight: Any,
    vertices: LightVertices,
    film: SplatFilm,
    count: int,
) -> tuple[Any, Any, Any]:
    """Trace light subpaths.

    Args:
        transport: `Transport`.
        sampler: seeded for as many lanes.
        wavelengths: of each subpath.
        colour_weight: ``mi.Spectrum``, of these wavelengths.
        vertices: where vertices are kept.
        film: `SplatFilm`, where those that the camera sees are shown.
        count: how many subpaths.

    Returns:
        (vertices that each subpath has kept, luminance that each has shown, largest channel of what
        each has brought to its first vertex).
    """
    t = transport
    start = t.emission.start(t.surfaces, t.scene, sampler, wavelengths, mi.Bool(True))
    lane = dr.arange(mi.UInt32, count)
    path = LightPath(
        ray=mi.Ray3f(start.ray),
        β=mi.Spectrum(start.power),
        m=Subpath(mi.Float(0), mi.Float(start.dVC), t.no_merges()),
        origin=mi.Point3f(start.ray.o),
        edges=mi.UInt32(0),
        kept=mi.UInt32(0),
        bright=mi.Float(1),
        no_delta=mi.Bool(start.no_delta),
        dispersed=mi.Bool(False),
        active=mi.Bool(start.active) & dr.any(start.power != 0) & (t.max_depth > 1),
        shown=mi.Float(0),
    )
    while dr.hint(path.active, label="Light subpaths"):
        step(t, sampler, start, lane, vertices, film, colour_weight, path)
    return path.kept, path.shown, path.bright


def step(
    t: Transport,
    sampler: mi.Sampler,
    start: LightStart,
    lane: mi.UInt32,
    vertices: LightVertices,
    film: SplatFilm,
    colour_weight: mi.Spectrum,
    path: LightPath,
) -> None:
    """Trace one ray, show and keep the vertex where it ends, and scatter there."""
    si = t.scene.ray_intersect(
        path.ray, ray_flags=mi.RayFlags.All, coherent=False, active=path.active
    )
    met = path.active & si.is_valid()
    bsdf = si.bsdf()
    flags = bsdf.flags()

    # ---------------- the vertex that a null surface is not ----------------

    d2 = dr.squared_norm(si.p - path.origin)
    cos = dr.abs(dr.dot(si.n, path.ray.d))
    m = misweights.arrived(path.m, d2, cos)
    β = path.β
    first = met & (path.edges == 0)
    m, β = first_vertex(t, start, si, cos, m, β, first)
    shading = without_shading_normal(si, path.ray.d)
    incoming = dr.select(shading > 0, dr.rcp(shading), 0)
    g = dr.select(path.edges == 0, 1, t.κ)
    edges = path.edges + 1

    # ---------------- the camera and a new direction ----------------

    goes_on = met & (edges + 1 < t.max_depth)
    smooth = met & mi.has_flag(flags, mi.BSDFFlags.Smooth)
    seen = None
    if t.pinhole:
        seen = t.pinhole.connect(si.p, sampler.next_2d() if t.pinhole.lens else None)
    u1, u2, u3, u4 = sampler.next_1d(), sampler.next_2d(), sampler.next_2d(), sampler.next_1d()
    towards = si.to_local(seen.d) if seen else mi.Vector3f(0, 0, 1)
    found, drawn = scatter(t.importance, si, [towards], u1, u2, met)

    if seen:
        eye = found[0]
        pdf_sensor = seen.pdf * dr.abs(dr.dot(si.n, seen.d)) / seen.squared_distance
        w = misweights.of_sensor_connection(
            pdf_sensor, t.r, misweights.other_ways(m, g, eye.pdf_back)
        )
        w = t.alone(w, s=edges + 1, t=mi.UInt32(1))
        value = β * incoming * eye.f * without_shading_normal(si, seen.d)
        hero = dr.select(path.dispersed, mi.Float(len(mi.Spectrum())), 1)
        value *= hero * w * seen.pdf / seen.squared_distance
        shown = smooth & seen.active & dr.any(value != 0) & (edges + 1 >= t.min_depth)
        shown &= (seen.squared_distance > 0) & film.covers(seen.position)
        if t.hide_emitters:
            shown &= si.shape.emitter() == None  # noqa: E711
        shown &= ~t.surfaces.unlit(si.shape, mi.Bool(True))
        value *= unoccluded(t, si, seen.end, shown, passes_lamps=t.hide_emitters)
        # Positions on the film take two numbers, also where no filter spreads them.
        path.shown += film.splat(value * colour_weight, si.wavelengths, seen.position, u3, shown)

    # ---------------- the cache ----------------

    to_camera = 2 if t.pinhole or t.ν is None else 1  # edges at least
    keeps = smooth & (edges + to_camera <= t.max_depth) & dr.any(β != 0)
    nth = mi.Float(path.kept) - (SLOTS - 2)  # vertex of those that share the last place
    slot = lane * SLOTS + dr.minimum(path.kept, SLOTS - 1)
    vertex = LightVertex(si, β * incoming, m, g, edges, path.dispersed)
    vertices.store(slot, vertex, keeps & ((nth <= 1) | (u4 * nth < 1)))
    path.kept[keeps] += 1

    # ---------------- next ray ----------------

    d = si.to_world(drawn.wo)
    passes = mi.Bool(False)
    if t.surfaces.see_through:
        T = bsdf.eval_null_transmission(si, met)
        passes = met & mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Null) & dr.any(T != 0)
    delta = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
    weight = drawn.weight * dr.select(passes, 1, incoming * without_shading_normal(si, d))
    if t.surfaces.disperse:
        parts = ~path.dispersed & ((drawn.sampled_type & HERO_WAVELENGTH) != 0)
        path.dispersed |= parts & met
    ν = None if t.ν is None else dr.select(unconnected_light(m, edges), t.ν, 0)
    cos = dr.abs(dr.dot(si.n, d))
    after = misweights.scattered(m, g, drawn.pdf, drawn.pdf_back, cos, delta, ν)

    path.bright = dr.select(first & ~passes, dr.max(β), path.bright)
    path.β = dr.select(passes, path.β, β) * weight
    path.m = dr.select(passes, path.m, after)
    path.origin = dr.select(passes, path.origin, si.p)
    stops = delta & path.no_delta & ~passes
    path.no_delta = dr.select(passes, path.no_delta, t.surfaces.unlit(si.shape, mi.Bool(True)))
    path.edges = dr.select(passes, path.edges, edges)
    path.ray = si.spawn_ray(d)
    decides = met & ~passes & (path.edges >= t.rr_depth)
    left, one, kept = path.β / path.bright, mi.Float(1), dr.max(weight)
    left, survives = russian_roulette(left, one, one, kept, path.edges, decides, sampler.next_1d())
    path.β = left * path.bright
    path.active = (goes_on | passes) & ~stops & survives


def first_vertex(
    t: Transport,
    start: LightStart,
    si: mi.SurfaceInteraction3f,
    cos: mi.Float,
    m: Subpath,
    β: mi.Spectrum,
    first: mi.Bool,
) -> tuple[Subpath, mi.Spectrum]:
    """What the first vertex adds: how emitter sampling would have found the lamp from there.

    For delta lamps also the power, which may depend on the distance.
    """
    ds = dr.zeros(mi.DirectionSample3f)
    ds.p, ds.n, ds.emitter = start.ray.o, start.n, start.emitter
    ds.d = -start.ray.d
    ds.dist = dr.norm(si.p - start.ray.o)
    kind = t.emission.kind_of(start.emitter, first)
    pdf = mi.Float(1)
    if AREA in t.emission.kinds:
        pdf = t.scene.pdf_emitter_direction(si, ds, first & (kind == AREA))
    R = t.emission.ratio(ds, pdf, first)
    dVCM = dr.select(first, dr.select(R * cos > 0, dr.rcp(R * cos), 0), m.dVCM)
    if POINT in t.emission.kinds or t.emission.beams:
        beam = first & ((kind == POINT) | (kind == FAR))
        if t.emission.environment is not None:
            beam &= start.emitter != t.emission.environment
        _, E = start.emitter.sample_direction(si, mi.Point2f(0.5), beam)
        E *= dr.select(kind == POINT, dr.square(ds.dist), 1)
        β = dr.select(beam, β * E, β)
    return Subpath(dVCM, m.dVC, m.dVM), β
