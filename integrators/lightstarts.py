"""The first vertices of light subpaths: `emission` in a kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.emission import AREA, FAR, NONE, PICTURE, POINT, row_of
from relume.integrators.seethrough import Surfaces


@dataclass
class LightStart:
    """A ray that leaves a lamp.

    Attributes:
        ray: ``mi.Ray3f``.
        emitter: ``mi.EmitterPtr``.
        n: ``mi.Normal3f`` of the lamp.
        E: density of the emission, over the cosine at the lamp; 1 where that is a delta.
        power: ``mi.Spectrum``, radiance over E; 1 where it depends on where the ray arrives.
        dVC: sum of the subpath.
        no_delta: whether its light may not go on by way of mirrors and glass.
        active: lanes.
    """

    ray: mi.Ray3f
    emitter: mi.EmitterPtr
    n: mi.Normal3f
    E: mi.Float
    power: mi.Spectrum
    dVC: mi.Float
    no_delta: mi.Bool
    active: mi.Bool


def offset(p: mi.Point3f, d: mi.Vector3f) -> mi.Point3f:
    """A point a little further along d, as far as rays leave a surface."""
    return dr.fma(mi.math.RayEpsilon * (1 + dr.max(dr.abs(p))), d, p)


class Emission:
    """The emitters of a scene, as `emission` tells them.

    Args:
        scene: `mi.Scene`.

    Attributes:
        kinds: which kinds of emission there are.
        emits: whether any emitter does.
        beams: whether some light that is ``FAR`` has one direction.
        has_points: whether some lamp has no size.
    """

    def __init__(self, scene: mi.Scene) -> None:
        emitters = scene.emitters()
        rows = [row_of(emitter, scene) for emitter in emitters]
        emitting = [i for i, row in enumerate(rows) if row.kind != NONE]
        self.kinds = {row.kind for row in rows}
        self.emits = bool(emitting)
        self.emitters = scene.emitters_dr()
        far = [e for e, row in zip(emitters, rows, strict=True) if row.kind == FAR]
        self.beams = any(not emitter.is_environment() for emitter in far)
        self.has_points = self.beams or POINT in self.kinds
        skies = [emitter for emitter in far if emitter.is_environment()]
        self.environment = mi.EmitterPtr(skies[0]) if skies else None
        P = 1 / max(1, len(emitting))
        q = [float(scene.pdf_emitter(mi.UInt32(i))[0]) for i in range(len(rows))]
        ids = [int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(e))[0]) for e in emitters]
        size = max(ids, default=0) + 1
        table: list[list[float]] = [[0.0] * size for _ in range(3)]
        for row, own, pick in zip(rows, ids, q, strict=True):
            R = row.R * P / (1 if row.kind == AREA else max(pick, 1e-30))
            E = row.E if row.kind != POINT else 0.0
            for column, value in zip(table, (row.kind, R, E), strict=True):
                column[own] = value
        self.kind, self.R, self.E = (mi.Float(column) for column in table)

        chosen = [rows[i] for i in emitting]
        self.which = mi.UInt32(emitting or [0])
        self.count = dr.opaque(mi.UInt32, max(1, len(emitting)))
        self.P = dr.opaque(mi.Float, P)
        self.solid_angle = mi.Float([row.solid_angle for row in chosen] or [1.0])
        self.section = mi.Float([1 / row.R if row.kind == FAR else 1.0 for row in chosen] or [1.0])
        self.is_disk = mi.Bool([row.disk for row in chosen] or [False])
        vectors = [x for row in chosen for v in (row.position, row.axis, row.u, row.v) for x in v]
        self.vectors = mi.Float(vectors or [0.0] * 12)
        dr.eval(self.kind, self.R, self.E, self.which, self.vectors)

    def _row(self, emitter: Any, active: Any) -> tuple[Any, Any]:
        own = dr.reinterpret_array(mi.UInt32, emitter)
        kind = dr.gather(mi.Float, self.kind, own, active)
        return kind, dr.gather(mi.Float, self.R, own, active)

    def kind_of(self, emitter: mi.EmitterPtr, active: mi.Bool) -> mi.Float:
        """The kind of an emitter."""
        return self._row(emitter, active)[0]

    def ratio(self, ds: mi.DirectionSample3f, pdf: mi.Float, active: mi.Bool) -> mi.Float:
        """R of a point of a lamp as a surface sees it.

        Args:
            ds: ``mi.DirectionSample3f`` from the surface.
            pdf: density of emitter sampling [1/sr].
            active: lanes.
        """
        kind, R = self._row(ds.emitter, active)
        d2 = dr.square(ds.dist)
        if AREA in self.kinds:
            R *= dr.select((kind == AREA) & (pdf > 0), dr.rcp(pdf), 1)
        if PICTURE in self.kinds:
            R *= dr.select(kind == PICTURE, dr.abs(dr.dot(ds.n, ds.d)) / d2, 1)
        if POINT in self.kinds:
            R *= dr.select(kind == POINT, dr.rcp(d2), 1)
        return R

    def emitted(self, ds: mi.DirectionSample3f, pdf: mi.Float, active: mi.Bool) -> mi.Float:
        """E of a lamp that a ray has hit; arguments as `ratio`."""
        own = dr.reinterpret_array(mi.UInt32, ds.emitter)
        can_be_hit = dr.gather(mi.Float, self.E, own, active)
        E = self.ratio(ds, pdf, active) * pdf
        if AREA in self.kinds:
            kind, R = self._row(ds.emitter, active)
            E = dr.select(kind == AREA, R, E)
        return E * can_be_hit

    def start(
        self,
        surfaces: Surfaces,
        scene: mi.Scene,
        sampler: mi.Sampler,
        wavelengths: mi.Spectrum,
        active: mi.Bool,
    ) -> LightStart:
        """Draw a ray that leaves a lamp.

        Args:
            surfaces: those that light crosses straight on.
            scene: ``mi.Scene``.
            sampler: of three pairs of numbers.
            wavelengths: of the light.
            active: lanes.
        """
        picked, at, towards = sampler.next_1d(), sampler.next_2d(), sampler.next_2d()
        row = dr.minimum(mi.UInt32(picked * mi.Float(self.count)), self.count - 1)
        index = dr.gather(mi.UInt32, self.which, row, active)
        emitter = dr.gather(mi.EmitterPtr, self.emitters, index, active)
        own = dr.reinterpret_array(mi.UInt32, emitter)
        kind = dr.gather(mi.Float, self.kind, own, active)
        hittable = dr.gather(mi.Float, self.E, own, active) != 0
        position, axis, u, v = (
            dr.gather(mi.Vector3f, self.vectors, row * 4 + i, active) for i in range(4)
        )
        ray = dr.zeros(mi.Ray3f)
        ray.wavelengths, ray.maxt = wavelengths, dr.largest(mi.Float)
        n, E, power = mi.Normal3f(axis), mi.Float(1), mi.Spectrum(1)

        if AREA in self.kinds or PICTURE in self.kinds:
            on = active & ((kind == AREA) | (kind == PICTURE))
            ps, _ = emitter.sample_position(0.0, at, on)
            si = mi.SurfaceInteraction3f(ps, wavelengths)
            si.sh_frame, si.n = mi.Frame3f(ps.n), ps.n
            si.wi = mi.warp.square_to_cosine_hemisphere(towards)
            si.shape = emitter.get_shape()
            Le = emitter.eval(si, on)
            if surfaces.masked_lamps:
                T = si.shape.bsdf().eval_null_transmission(si, on)
                Le *= surfaces.shining(si.shape, T)
            d = si.to_world(si.wi)
            start = si.spawn_ray(d)
            ray.o, ray.d = dr.select(on, start.o, ray.o), dr.select(on, d, ray.d)
            n = dr.select(on, ps.n, n)
            E = dr.select(on, self.P * ps.pdf * dr.inv_pi, E)
            power = dr.select(on, dr.select(E > 0, Le / E, 0), power)

        if POINT in self.kinds:
            on = active & (kind == POINT)
            Ω = dr.gather(mi.Float, self.solid_angle, row, on)
            versine = towards.x * Ω * dr.inv_two_pi
            sine, (s, c) = dr.safe_sqrt(versine * (2 - versine)), dr.sincos(dr.two_pi * towards.y)
            local = mi.Vector3f(sine * c, sine * s, 1 - versine)
            ray.o = dr.select(on, mi.Point3f(position), ray.o)
            ray.d = dr.select(on, mi.Frame3f(axis).to_world(local), ray.d)
            power = dr.select(on, mi.Spectrum(Ω / self.P), power)

        delta = (kind == POINT) | ~hittable
        if FAR in self.kinds:
            on = active & (kind == FAR)
            area = dr.gather(mi.Float, self.section, row, on)
            power = dr.select(on, mi.Spectrum(area / self.P), power)
            far, disk = mi.Ray3f(ray), mi.warp.square_to_uniform_disk_concentric(at)
            if self.environment is not None:
                sky = on & (emitter == self.environment)
                it = dr.zeros(mi.Interaction3f)
                it.p, it.wavelengths = mi.Point3f(position), wavelengths
                ds, weight = self.environment.sample_direction(it, towards, sky)
                across = mi.Frame3f(ds.d).to_world(mi.Vector3f(disk.x, disk.y, 1)) * u.x
                far.o, far.d = mi.Point3f(position + across), -ds.d
                sky &= ds.pdf > 0
                E = dr.select(sky, self.P * ds.pdf / area, E)
                power = dr.select(sky, power * weight, dr.select(on & ~sky, 0, power))
            if self.beams:
                beam = on
                if self.environment is not None:
                    beam = on & (emitter != self.environment)
                delta |= beam
                round_ = dr.gather(mi.Bool, self.is_disk, row, beam)
                a, b = (dr.select(round_, x, y) for x, y in zip(disk, at, strict=True))
                it = dr.zeros(mi.Interaction3f)
                it.p, it.wavelengths = mi.Point3f(position + u * a + v * b), wavelengths
                ds, _ = emitter.sample_direction(it, mi.Point2f(0.5), beam)
                far.o = dr.select(beam, offset(ds.p, axis), far.o)
                far.d = dr.select(beam, axis, far.d)
                power = dr.select(beam, mi.Spectrum(area / self.P), power)
            ray.o, ray.d = dr.select(on, far.o, ray.o), dr.select(on, far.d, ray.d)
            n = dr.select(on, mi.Normal3f(ray.d), n)
        return LightStart(
            ray=ray,
            emitter=emitter,
            n=n,
            E=E,
            power=power,
            dVC=dr.select(delta | (E <= 0), 0, dr.rcp(E)),
            no_delta=~hittable & (kind == PICTURE),
            active=active & (kind != NONE),
        )
