r"""Where along a flight through a medium the light of lamps is looked for.

Light that is scattered once between a point o and the surface that its ray meets at the distance T
is an integral over the distance t. Of a lamp near the ray it has a peak of the width of its
distance D, which flights of a mean free path hardly ever hit. So t is drawn from a mixture

    p(t) = (1 - alpha) sigma e^(-sigma t) / (1 - e^(-sigma T))
         + alpha D / ((theta_b - theta_a) (D^2 + (t - delta)^2)),

the exponential law within [0, T], and the equiangular one: delta is where the ray is nearest to the
lamp, and theta the angles under which o and the end of the ray are seen from there. Lamps of the
radius r count as no nearer than r. alpha grows from 0 where the lamp is far from what of the ray is
seen to `MOST_EQUIANGULAR` where it is near, and is 0 for light from infinity. Of parallel beams the
part of the ray inside the beam takes the place of [0, T].

Source: C. Kulla and M. Fajardo, "Importance Sampling Techniques for Path Tracing in Participating
Media", Computer Graphics Forum 31(4), 2012, sections 4 and 5."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.walkmedia import chosen

MOST_EQUIANGULAR = 0.75
"""Largest share of the equiangular law."""

DARK = 16.0
"""Mean free paths of the channel that is seen farthest after which no light is looked for."""

THIN = 1e-3
"""Mean free paths on the way up to which the exponential law is taken for an even one."""


@dataclass
class Flight:
    """A flight on which lamps were looked for, that has ended by scattering.

    Attributes:
        o: ``mi.Vector3f``, where it began.
        d: ``mi.Vector3f``, its direction.
        s: ``mi.Float``, its length [scene unit].
        T: ``mi.Float``, within which lamps were looked for; 0 for no flight.
        sigma: ``mi.Float``, extinction that was expected [1/scene unit].
        drawn: ``mi.Float``, density of the law that s was drawn by, at s [1/scene unit].
        exponential: ``mi.Float``, the same of the exponential law within T.
    """

    o: mi.Vector3f
    d: mi.Vector3f
    s: mi.Float
    T: mi.Float
    sigma: mi.Float
    drawn: mi.Float
    exponential: mi.Float

    @classmethod
    def none(cls) -> Flight:
        """That of what no flight has led to."""
        s, T, sigma, drawn, exponential = (mi.Float(0) for _ in range(5))
        return cls(mi.Vector3f(0), mi.Vector3f(0, 0, 1), s, T, sigma, drawn, exponential)

    @classmethod
    def of(
        cls,
        o: mi.Vector3f,
        d: mi.Vector3f,
        s: mi.Float,
        T: mi.Float,
        q: mi.Spectrum,
        sigma_t: mi.Spectrum,
    ) -> Flight:
        """One for whose channels the extinctions `sigma_t` were drawn with the probabilities q."""
        drawn = dr.sum(q * sigma_t * dr.exp(-sigma_t * s))
        exponential = truncated(q, sigma_t, s, T)
        return cls(o, d, s, T, dr.sum(q * sigma_t), drawn, exponential)


@dataclass
class Stretch:
    """The part of a ray on which a lamp is looked for, and how.

    Attributes:
        t0, t1: ``mi.Float``, where it begins and ends [scene unit].
        α: ``mi.Float``, share of the equiangular law.
        δ: ``mi.Float``, where the ray is nearest to the lamp.
        D: ``mi.Float``, how near.
    """

    t0: mi.Float
    t1: mi.Float
    α: mi.Float
    δ: mi.Float
    D: mi.Float

    @property
    def worth(self) -> mi.Float:
        """What the lamp is worth to be looked for in any case, from 0 to 1."""
        return self.α / MOST_EQUIANGULAR

    def angles(self) -> tuple[mi.Float, mi.Float]:
        """The angles at which the ends of the ray are seen from the lamp's foot on it."""
        return dr.atan(-self.δ / self.D), dr.atan((self.t1 - self.δ) / self.D)

    def equiangular(self, t: mi.Float) -> mi.Float:
        """Density of the equiangular law [1/scene unit]."""
        a, b = self.angles()
        density = self.D / ((b - a) * dr.fma(self.D, self.D, dr.square(t - self.δ)))
        return dr.select((self.α > 0) & (b > a), density, 0)

    def density(self, t: mi.Float, exponential: mi.Float) -> mi.Float:
        """Density of the mixture, from that of the exponential law."""
        return dr.lerp(exponential, self.equiangular(t), self.α)

    def sample(
        self, q: mi.Spectrum, sigma_t: mi.Spectrum, sample1: Any, sample2: Any
    ) -> tuple[mi.Float, mi.Float]:
        """Draw a distance.

        Args:
            q: probability of each channel.
            sigma_t: extinction [1/scene unit].
            sample1: uniform variate for the law and the channel.
            sample2: uniform variate for the distance.

        Returns:
            (distance, density [1/scene unit]).
        """
        angular = sample1 < self.α
        reused = (sample1 - self.α) / (1 - self.α)
        sigma = chosen(q, sigma_t, reused)
        way = self.t1 - self.t0
        drop = -dr.log(1 - sample2 * (1 - dr.exp(-sigma * way)))
        t = self.t0 + dr.select(is_even(sigma, way), sample2 * way, drop / sigma)
        a, b = self.angles()
        turned = dr.fma(self.D, dr.tan(dr.fma(sample2, b - a, a)), self.δ)
        t = dr.clip(dr.select(angular, turned, t), self.t0, self.t1)
        return t, self.density(t, truncated(q, sigma_t, t - self.t0, way))


def truncated(q: mi.Spectrum, sigma_t: mi.Spectrum, t: mi.Float, T: mi.Float) -> mi.Float:
    """Density of the mixture of the channels' exponential laws within [0, T] [1/scene unit]."""
    law = sigma_t * dr.exp(-sigma_t * t) / (1 - dr.exp(-sigma_t * T))
    return dr.sum(q * dr.select(is_even(sigma_t, T), dr.rcp(T), law))


def is_even(sigma_t: Any, T: mi.Float) -> Any:
    """Whether so little is met on the way that the law is taken for an even one, free of 0/0."""
    return sigma_t * T <= THIN


class Lamps:
    """Where the lamps of a scene are, as known before it is rendered.

    Args:
        scene: `mi.Scene`.

    Attributes:
        near: whether some lamp is at a finite place.
        beams: whether some is a parallel beam.
    """

    def __init__(self, scene: mi.Scene) -> None:
        emitters = list(scene.emitters())
        numbers = [int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(e))[0]) for e in emitters]
        size = max(numbers, default=0) + 1
        ball, beam = np.zeros((size, 4), np.float32), np.zeros((size, 12), np.float32)
        ball[:, 3] = -1
        for number, emitter in zip(numbers, emitters, strict=True):
            if hasattr(emitter, "to_beam"):
                beam[number, :9] = np.array(emitter.to_beam, float).reshape(3, 3).ravel()
                beam[number, 9:] = np.array(emitter.origin, float).ravel()
            elif emitter.bbox().valid() and not emitter.is_environment():
                ball[number] = ball_of(emitter.bbox())
        self.near, self.beams = bool((ball[:, 3] >= 0).any()), bool(beam.any())
        self._emitters = scene.emitters_dr()
        self._ball = [mi.Float(column) for column in ball.T]
        self._beam = [mi.Float(column) for column in beam.T] if self.beams else []

    def chosen(self, scene: mi.Scene, sample: mi.Float, active: mi.Bool) -> mi.EmitterPtr:
        """The lamp that emitter sampling takes by the first of its variates."""
        index, _, _ = scene.sample_emitter(sample, active)
        return dr.gather(mi.EmitterPtr, self._emitters, index, active)

    def stretch(
        self,
        lamp: mi.EmitterPtr,
        o: mi.Point3f,
        d: mi.Vector3f,
        T: mi.Float,
        sigma: mi.Float,
        active: mi.Bool,
    ) -> Stretch:
        """On which part of rays lamps are looked for.

        Args:
            lamp: one for each ray.
            o: where they start.
            d: their directions.
            T: their lengths [scene unit].
            sigma: extinction on the way [1/scene unit].
            active: lanes.
        """
        number = dr.reinterpret_array(mi.UInt32, lamp)
        found = Stretch(mi.Float(0), mi.Float(T), mi.Float(0), mi.Float(0), mi.Float(1))
        if self.near:
            x, y, z, r2 = (dr.gather(mi.Float, column, number, active) for column in self._ball)
            c = mi.Point3f(x, y, z) - o
            found.δ = dr.dot(c, d)
            # |c|^2 - delta^2 without cancellation.
            found.D = dr.sqrt(dr.maximum(dr.squared_norm(c - found.δ * d) + r2, 1e-20))
            seen = dr.minimum(T, dr.rcp(sigma))
            away = dr.squared_norm(c - dr.clip(found.δ, 0, seen) * d)
            near = dr.square(seen) / (dr.square(seen) + away)
            found.α = dr.select(r2 >= 0, MOST_EQUIANGULAR * near, 0)
        if self.beams:
            t0, t1 = self.crossed(number, o, d, active)
            found.t0 = dr.clip(t0, 0, T)
            found.t1 = dr.clip(t1, 0, T)
        return found

    def density(self, lamp: mi.EmitterPtr, flight: Flight, active: mi.Bool) -> mi.Float:
        """How much more densely looking for lamps finds the ends of flights than flights do.

        Args:
            lamp: one for each flight.
            flight: in the world.
            active: lanes.
        """
        stretch = self.stretch(lamp, flight.o, flight.d, flight.T, flight.sigma, active)
        ratio = stretch.density(flight.s, flight.exponential) / flight.drawn
        within = dr.select(flight.s < flight.T, ratio, 0)
        return dr.select(flight.T > 0, within, 1)

    def crossed(
        self, number: mi.UInt32, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.Float, mi.Float]:
        """Where rays enter and leave parallel beams; all of them lies in other lamps' light."""
        m = [dr.gather(mi.Float, column, number, active) for column in self._beam]
        offset = mi.Vector3f(o) - mi.Vector3f(m[9], m[10], m[11])
        t0, t1 = mi.Float(0), mi.Float(dr.inf)
        is_beam = mi.Bool(False)
        for row in range(3):
            across = mi.Vector3f(*m[3 * row : 3 * row + 3])
            is_beam |= dr.any(across != 0)
            at, speed = dr.dot(across, offset), dr.dot(across, d)
            zero, one = -at / speed, (1 - at) / speed
            if row == 2:  # there is no end to a beam
                one = dr.mulsign(mi.Float(dr.inf), speed)
            outside = (at < 0) | ((at > 1) if row < 2 else False)
            still = speed == 0
            t0 = dr.select(
                still, dr.select(outside, dr.inf, t0), dr.maximum(t0, dr.minimum(zero, one))
            )
            t1 = dr.select(still, t1, dr.minimum(t1, dr.maximum(zero, one)))
        return dr.select(is_beam, t0, 0), dr.select(is_beam, t1, dr.inf)


def ball_of(box: mi.ScalarBoundingBox3f) -> list[float]:
    """Centre, and squared radius, of a lamp of about the size of a box, (4,)."""
    low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
    return [*(0.5 * (low + high)), float(np.square(0.25 * (high - low)).sum())]
