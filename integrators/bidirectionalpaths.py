"""Paths of `bdpt` as functions of a row of numbers, each found in one way that is drawn.

The third number chooses the number of edges and the way (s, t), s vertices from the lamp and t from
the camera (Hachisuka, Kaplanyan and Dachsbacher, "Multiplexed Metropolis Light Transport", ACM
Transactions on Graphics 2014); two more do among very long paths. The others are those of both
subpaths and of the connection of their ends. What is found is weighed by the balance heuristic
with one sample of each way, r = κ = 1 in `bdpt`, and by one over the probability of the way.

The number of the way is no part of small steps: the others mean something else in each of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.integrators import misweights
from relume.integrators.eyesubpaths import started as eye_started
from relume.integrators.misweights import Subpath
from relume.integrators.pathways import Ways
from relume.integrators.primarysamples import Numbers, PathSampler, sampler_class
from relume.integrators.scattering import towards, without_shading_normal
from relume.integrators.sensorconnections import Pinhole, SensorConnection
from relume.integrators.splats import FilmPixels
from relume.integrators.subpaths import Transport, unoccluded
from relume.integrators.subpathwalks import Walk, arrived, started, walk
from relume.sensors.colors import absolute_luminance, linear_rgb
from relume.sensors.pixelsamples import trace_pixels


@dataclass
class End:
    """The last vertex of a subpath.

    Attributes:
        si: ``mi.SurfaceInteraction3f``.
        m: `Subpath` where it has arrived.
        β: ``mi.Spectrum``, what arrives; from a lamp without shading normals.
        active: whether it can be connected.
    """

    si: mi.SurfaceInteraction3f
    m: Subpath
    β: mi.Spectrum
    active: mi.Bool


class BidirectionalSampler(PathSampler):
    """Traces the paths that `bdpt` finds through a sensor.

    Args:
        scene: `mi.Scene`.
        sensor: `mi.Sensor`.
        integrator: `bdpt`.
    """

    spread = False
    held = range(2, 5)

    def __init__(self, scene: mi.Scene, sensor: mi.Sensor, integrator: mi.Integrator) -> None:
        super().__init__(scene, sensor, integrator)
        pinhole = Pinhole.of(sensor, (self.width, self.height))
        self.transport = Transport(scene, pinhole.prepared() if pinhole else None, integrator)
        self.film_pixels = FilmPixels(sensor.film())
        t = self.transport
        self.ways = Ways(t.min_depth, t.max_depth, t.emission.emits, pinhole is not None)

    def trace(self, number: Numbers) -> tuple[mi.Color3f, mi.UInt32, mi.UInt32]:
        """See `PathSampler.trace`; the pixel is that which sees the path."""
        corner, position, sign = self.place(number)
        s, edges_t, rarity = self.ways.pick(*(number(mi.UInt32(d)) for d in self.held))
        sampler = sampler_class(mi.variant())(number, self.held.stop)
        lens = sampler.next_2d() if self.sensor.needs_aperture_sample() else mi.Point2f(0.5)
        u = sampler.next_1d() if mi.is_spectral else mi.Float(0)
        ray, weight = self.sensor.sample_ray_differential(0.0, u, position, lens)
        L, seen = self.contribution(sampler, ray, s, edges_t, lens)
        pixel = corner.y * self.columns + corner.x
        weight = weight * sign
        if seen is not None:
            shown = edges_t == 1
            nowhere = dr.zeros(mi.SurfaceInteraction3f)
            _, colour_weight = self.sensor.sample_wavelengths(nowhere, u)
            sample = mi.Point2f(number(mi.UInt32(0)), number(mi.UInt32(1)))
            seen_by, sees, inside = self.film_pixels.pixel(seen.position, sample)
            inside &= self.film_pixels.covers(seen.position)
            weight = dr.select(shown, colour_weight * dr.select(inside, sees, 0), weight)
            pixel = dr.select(shown & inside, seen_by, pixel)
        f = linear_rgb(L * weight, ray.wavelengths) * rarity
        f = dr.select(dr.isfinite(absolute_luminance(f)), f, 0)
        return f, pixel, mi.UInt32(sampler.dimension)

    def cover(self, number: Numbers) -> mi.Float:
        """See `PathSampler.cover`."""
        _, position, sign = self.place(number)
        sampler = sampler_class(mi.variant())(number, self.held.stop)
        hides = self.transport.hide_emitters
        seen = mi.load_dict({"type": "surfacepath", "max_depth": 2, "hide_emitters": hides})
        found = trace_pixels(self.scene, self.sensor, seen, sampler, position)
        return dr.select(found.valid, sign, 0)

    def contribution(
        self, sampler: mi.Sampler, ray: mi.Ray3f, s: mi.UInt32, t: mi.UInt32, lens: mi.Point2f
    ) -> tuple[mi.Spectrum, SensorConnection | None]:
        """What a way finds of light, weighed, and where a light subpath's end is seen.

        Args:
            sampler: of all numbers.
            ray: of the camera.
            s: vertices from the lamp.
            t: vertices from the camera.
            lens: variates of the point of the lens.
        """
        tr = self.transport
        emits = tr.emission.emits
        if emits:
            light, y = self.light_end(sampler, ray.wavelengths, s)
        hits = s == 0
        eye, x = self.eye_end(sampler, ray, t, hits)
        L = self.hit(eye, x, hits & (t > 1))

        # ------------- from the camera: a sampled point of a lamp, or the other end -------------

        lit = x.active & ~hits
        direct = lit & (s == 1)
        ds, Le = tr.scene.sample_emitter_direction(x.si, sampler.next_2d(), False, direct)
        direct &= ds.pdf != 0
        if tr.surfaces.spheres:
            direct &= ~tr.surfaces.light_themselves(x.si, ds)
        lit &= direct | (s > 1)
        d, p, distance2 = ds.d, ds.p, mi.Float(1)
        seen = None
        if emits:
            joined = lit & (s > 1) & y.active
            lit &= direct | joined
            to_y = y.si.p - x.si.p
            distance2 = dr.squared_norm(to_y)
            joined &= distance2 > 0
            to_y *= dr.rsqrt(distance2)
            d, p = dr.select(joined, to_y, d), dr.select(joined, y.si.p, p)
        at_x = towards(tr.radiance, x.si, x.si.to_local(d), lit)
        others_x = misweights.other_ways(x.m, mi.Float(1), at_x.pdf_back)
        cos_x = dr.abs(dr.dot(x.si.n, d))
        R = tr.emission.ratio(ds, ds.pdf, direct) * cos_x
        pdf_ratio = dr.select(ds.delta, 0, at_x.pdf / ds.pdf)
        w = tr.alone(misweights.of_emitter_sample(pdf_ratio, R, others_x), s=s, t=t)
        value = dr.select(direct, x.β * at_x.f * Le * w, 0)
        if not emits:
            return L + value * self.arrives(x.si, p, ds, direct, direct & dr.any(value != 0)), None

        # ------------- from the lamp: the other end, or the camera -------------

        shown = mi.Bool(False)
        back = -to_y
        if tr.pinhole:
            seen = tr.pinhole.connect(y.si.p, lens)
            shown = y.active & (t == 1) & seen.active & (seen.squared_distance > 0)
            shown &= ~tr.surfaces.unlit(y.si.shape, mi.Bool(True))
            if tr.hide_emitters:
                shown &= y.si.shape.emitter() == None  # noqa: E711
            back = dr.select(shown, seen.d, back)
        at_y = towards(tr.importance, y.si, y.si.to_local(back), joined | shown)
        others_y = misweights.other_ways(y.m, mi.Float(1), at_y.pdf_back)
        cos_y = dr.abs(dr.dot(y.si.n, back))
        sent = y.β * at_y.f * without_shading_normal(y.si, back)
        w = misweights.of_connection(
            mi.Float(1), at_x.pdf * cos_y / distance2, others_y,
            at_y.pdf * cos_x / distance2, others_x,
        )  # fmt: skip
        both = x.β * at_x.f * sent * tr.alone(w, s=s, t=t) / distance2
        if tr.surfaces.disperse:
            both *= dr.select(light.dispersed & ~eye.dispersed, mi.Float(len(mi.Spectrum())), 1)
        value = dr.select(joined, both, value)
        if seen is not None:
            w = misweights.of_sensor_connection(
                seen.pdf * cos_y / seen.squared_distance, mi.Float(1), others_y
            )
            to_camera = sent * tr.alone(w, s=s, t=t) * seen.pdf / seen.squared_distance
            if tr.surfaces.disperse:
                to_camera *= dr.select(light.dispersed, mi.Float(len(mi.Spectrum())), 1)
            value = dr.select(shown, to_camera, value)
            p = dr.select(shown, seen.end, p)
        wanted = (direct | joined | shown) & dr.any(value != 0) & dr.all(dr.isfinite(value))
        value = dr.select(wanted, value, 0)
        one = dr.zeros(mi.SurfaceInteraction3f)
        one.p = dr.select(shown, y.si.p, x.si.p)
        one.n = dr.select(shown, y.si.n, x.si.n)
        one.wavelengths = ray.wavelengths
        if tr.hide_emitters:
            value *= dr.select(shown, unoccluded(tr, one, p, wanted & shown, True), 1)
            wanted &= ~shown
        return L + value * self.arrives(one, p, ds, direct, wanted), seen

    def arrives(
        self,
        si: mi.SurfaceInteraction3f,
        p: mi.Point3f,
        ds: mi.DirectionSample3f,
        direct: mi.Bool,
        active: mi.Bool,
    ) -> mi.Spectrum:
        """What of the light between two points arrives; 1 for those that are not active."""
        tr = self.transport
        if tr.surfaces.see_through:
            to = dr.select(direct, ds, dr.zeros(mi.DirectionSample3f))
            to.p = p
            T = tr.surfaces.transmittance(tr.scene, si, to, active)
        else:
            T = unoccluded(tr, si, p, active)
        return dr.select(active, T, 1)

    def light_end(
        self, sampler: mi.Sampler, wavelengths: mi.Spectrum, s: mi.UInt32
    ) -> tuple[Walk, End]:
        """Trace a light subpath of s vertices, if these are two or more."""
        t = self.transport
        start = t.emission.start(t.surfaces, t.scene, sampler, wavelengths, s > 1)
        origin = dr.zeros(mi.Interaction3f)
        origin.p = mi.Point3f(start.ray.o)
        bright = start.active & (s > 1) & dr.any(start.power != 0)
        m = Subpath(mi.Float(0), mi.Float(start.dVC))
        path = started(t, start.ray, start.power, m, origin, bright)
        path.delta = mi.Bool(start.no_delta)
        walk(t, sampler, path, s - 1, mi.Bool(False), start)
        si, m, β = arrived(t, path, start, path.active)
        shading = without_shading_normal(si, path.ray.d)
        β = dr.select(shading > 0, β / shading, 0)
        active = path.active & si.is_valid() & dr.any(β != 0)
        active &= mi.has_flag(si.bsdf().flags(), mi.BSDFFlags.Smooth)
        return path, End(si, m, β, active)

    def eye_end(
        self, sampler: mi.Sampler, ray: mi.Ray3f, t: mi.UInt32, hits: mi.Bool
    ) -> tuple[Walk, End]:
        """Trace a subpath of the camera of t vertices, if these are two or more."""
        tr = self.transport
        first = eye_started(tr, ray)
        path = started(tr, ray, 1, first.m, first.vertex, t > 1)
        walk(tr, sampler, path, t - 1, hits, None)
        si, m, β = arrived(tr, path, None, path.active)
        active = path.active & si.is_valid() & ~tr.surfaces.unlit(si.shape, path.delta)
        active &= mi.has_flag(si.bsdf().flags(), mi.BSDFFlags.Smooth)
        return path, End(si, m, β, active)

    def hit(self, path: Walk, x: End, active: mi.Bool) -> mi.Spectrum:
        """The light of the lamp on which a subpath of the camera ends, weighed."""
        t = self.transport
        active = active & path.active
        if t.hide_emitters:
            active &= path.edges > 0
        ds = mi.DirectionSample3f(t.scene, x.si, path.vertex)
        behind = active & (path.edges > 0)
        pdf = t.scene.pdf_emitter_direction(path.vertex, ds, behind)
        E = t.emission.emitted(ds, pdf, behind)
        w = dr.select(path.edges == 0, 1, misweights.of_hit(path.m, pdf, E))
        w = t.alone(w, s=mi.UInt32(0), t=path.edges + 2)
        Le = ds.emitter.eval(x.si, active) * w
        if t.surfaces.masked_lamps:
            T = x.si.bsdf().eval_null_transmission(x.si, active)
            Le *= t.surfaces.shining(x.si.shape, T)
        return dr.select(active, path.β * Le, 0)
