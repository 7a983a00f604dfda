"""A spinning black hole (Kerr), in Cartesian Kerr-Schild coordinates without poles."""

from __future__ import annotations

import math
from typing import NamedTuple

import drjit as dr
import mitsuba as mi

from relume.black_holes import MOST_SPIN
from relume.integrators.metrics.metric import SAGITTA, Geodesic, Metric
from relume.integrators.metrics.schwarzschild import (
    LEAVING,
    OBSERVERS,
    PHOTON_SPHERE,
    bend_left,
    center_and_mass,
)
from relume.parameters import Range, choice, number

SPIN = Range(-MOST_SPIN, MOST_SPIN)

GAP = 1e-3
"""How close to the horizon, in its radii, light is captured: the scene's azimuth diverges there."""

WINDING = 0.1
"""Largest turn [rad] of the scene's coordinates against those of Kerr and Schild in a chord."""


class Place(NamedTuple):
    """What depends on the position alone: r, r² + a², Σ, the gradient of r."""

    r: mi.Float
    q: mi.Float
    sigma: mi.Float
    dr: mi.Vector3f


class Kerr(Metric):
    r"""Light around a mass M that spins about +Z, all lengths in units of M.

    The scene shows Boyer and Lindquist's :math:`(r, \theta, \varphi)` at

    .. math::
        x + i y = \sqrt{r^2 + a^2} \sin\theta\, e^{i \varphi}, \qquad z = r \cos\theta.

    A ray is traced against its light: forward in time in the metric of the opposite spin, in
    ingoing coordinates, in which it crosses the horizon smoothly, by the Hamiltonian

    .. math::
        H = \tfrac12 (p^2 - 1 - f (1 + l \cdot p)^2), \qquad f = 2 r^3 / (r^4 + a^2 z^2),

    with l as in Kerr and Schild, and the azimuth ahead of the scene's by
    :math:`\arctan(a/r) + a \int dr/\Delta`.

    Args:
        props: `mi.Properties` with ``center``, ``mass``, ``spin`` and ``observer``.

    Raises:
        ValueError: the mass is not above 0, the spin outside `SPIN`, or the observer unknown.
    """

    def __init__(self, props: mi.Properties) -> None:
        self.center, self.mass = center_and_mass(props)
        self.observer = choice(props, "observer", OBSERVERS)
        spin = number(props, "spin", 0.0, SPIN)
        root = math.sqrt(1 - spin * spin)
        self.a = mi.Float(-spin)
        self.outer, self.inner = mi.Float(1 + root), mi.Float(1 - root)
        dr.make_opaque(self.a, self.outer, self.inner)

    def parameters(self) -> dict[str, object]:
        of_mass = {"center": self.center, "mass": self.mass}
        return of_mass | {"spin": -self.a, "observer": self.observer}

    # ------------------------------ coordinates ------------------------------

    def place(self, x: mi.Vector3f) -> Place:
        a2, z2 = dr.square(self.a), dr.square(x.z)
        u = dr.squared_norm(x) - a2
        root = dr.sqrt(dr.fma(u, u, 4 * a2 * z2))
        # The smaller of the two roots loses its digits.
        r2 = dr.select(u > 0, 0.5 * (u + root), 2 * a2 * z2 / dr.maximum(root - u, 1e-20))
        r2 = dr.maximum(r2, 1e-6)
        r = dr.sqrt(r2)
        q, sigma = r2 + a2, r2 + a2 * z2 / r2
        gradient = mi.Vector3f(x.x * r, x.y * r, x.z * q / r) / sigma
        return Place(r, q, sigma, gradient)

    def delta(self, r: mi.Float) -> mi.Float:
        """Δ = r² - 2 r + a², without cancellation at the horizon."""
        return dr.maximum((r - self.outer) * (r - self.inner), 1e-12)

    def turn(self, r: mi.Float) -> tuple[mi.Float, mi.Float]:
        """Azimuth in the scene less that of Kerr and Schild, and its slope."""
        outer = dr.maximum(r - self.outer, 1e-9)
        log = dr.log(outer / (r - self.inner)) / (self.outer - self.inner)
        slope = self.a * (dr.rcp(dr.square(r) + dr.square(self.a)) - dr.rcp(self.delta(r)))
        return -dr.atan2(self.a, r) - self.a * log, slope

    # ------------------------------ rays ------------------------------

    def begin(self, p: mi.Point3f, d: mi.Vector3f, side: mi.UInt32, camera: bool) -> Geodesic:
        x = mi.Vector3f((p - self.center) / self.mass)
        at = self.place(x)
        if camera and self.observer == "static":
            d = self.seen_at_rest(x, d, at)
        angle, slope = self.turn(at.r)
        v = d - slope * dr.dot(at.dr, d) * mi.Vector3f(-x.y, x.x, 0)
        x, v = turned(x, -angle), turned(v, -angle)
        l, f = self.congruence(x, at)
        lv = dr.dot(l, v)
        # The null vector with that velocity, in units of its energy.
        E2 = f * dr.square(lv) + (1 - f) * dr.squared_norm(v)
        E = dr.sqrt(dr.maximum(E2, 1e-12))
        future = (E + f * lv) / dr.select(dr.abs(1 - f) < 1e-6, 1e-6, 1 - f)
        momentum = (v + f * (future + lv) * l) / E
        impossible = E2 <= 0  # no light goes there inside the ergosphere
        return Geodesic([*dr.select(impossible, 0, x), *momentum], [], 0.1 * at.r)

    def seen_at_rest(self, x: mi.Vector3f, d: mi.Vector3f, at: Place) -> mi.Vector3f:
        """Direction in the scene of what an observer at rest sees in a direction."""
        radial = dr.normalize(at.dr)
        around = dr.normalize(mi.Vector3f(-x.y, x.x, 0) + mi.Vector3f(0, 1e-12, 0))
        static = dr.maximum(at.sigma - 2 * at.r, 0)
        delta = self.delta(at.r)
        d += (dr.sqrt(delta / at.q) - 1) * dr.dot(d, radial) * radial
        d += (dr.sqrt(at.q * static / (delta * at.sigma)) - 1) * dr.dot(d, around) * around
        return dr.normalize(d)

    def congruence(self, x: mi.Vector3f, at: Place) -> tuple[mi.Vector3f, mi.Float]:
        """The vector l and the factor f of the metric."""
        l = mi.Vector3f(
            dr.fma(at.r, x.x, self.a * x.y) / at.q,
            dr.fma(at.r, x.y, -self.a * x.x) / at.q,
            x.z / at.r,
        )
        return l, 2 * at.r / at.sigma

    def derivative(self, y: list[mi.Float], k: list[mi.Float]) -> list[mi.Float]:
        x, p = mi.Vector3f(*y[:3]), mi.Vector3f(*y[3:])
        at = self.place(x)
        r, q, a = at.r, at.q, self.a
        l, f = self.congruence(x, at)
        s = 1 + dr.dot(l, p)
        v = p - f * s * l
        # df and d(l · p), by r and by x where r stays.
        az = dr.square(a * x.z / r)
        f_r = f * (3 * az - dr.square(r)) / (r * at.sigma)
        f_z = -2 * f * dr.square(a / r) * x.z / at.sigma
        n = p.x * dr.fma(r, x.x, a * x.y) + p.y * dr.fma(r, x.y, -a * x.x)
        lp_r = (p.x * x.x + p.y * x.y) / q - 2 * r * n / dr.square(q) - p.z * x.z / dr.square(r)
        lp = mi.Vector3f((p.x * r - p.y * a) / q, (p.x * a + p.y * r) / q, p.z / r)
        df = f_r * at.dr + mi.Vector3f(0, 0, f_z)
        return [*v, *(0.5 * dr.square(s) * df + f * s * (lp_r * at.dr + lp))]

    def scales(self, y: list[mi.Float]) -> list[mi.Float]:
        x, p = mi.Vector3f(*y[:3]), mi.Vector3f(*y[3:])
        r, size = dr.norm(x), dr.norm(p)
        return [r, r, r, size, size, size]

    def longest_step(self, g: Geodesic, chords: bool) -> mi.Float:
        x = mi.Vector3f(*g.y[:3])
        r = dr.norm(x)
        h = 0.5 * r
        if chords:
            across = dr.squared_norm(dr.cross(x, mi.Vector3f(*g.y[3:])))
            bend = 3 * dr.maximum(across, dr.abs(self.a)) + 1e-9
            h = dr.minimum(h, dr.square(r) * dr.sqrt(8 * SAGITTA * r / bend))
            at = self.place(x)
            _, slope = self.turn(at.r)
            h = dr.minimum(h, WINDING / dr.maximum(dr.abs(slope), 1e-9))
        return h

    def point(self, g: Geodesic, side: mi.UInt32) -> mi.Point3f:
        x = mi.Vector3f(*g.y[:3])
        angle, _ = self.turn(self.place(x).r)
        return dr.fma(self.mass, mi.Point3f(turned(x, angle)), self.center)

    def direction(self, g: Geodesic) -> mi.Vector3f:
        x, p = mi.Vector3f(*g.y[:3]), mi.Vector3f(*g.y[3:])
        at = self.place(x)
        l, f = self.congruence(x, at)
        v = p - f * (1 + dr.dot(l, p)) * l
        angle, slope = self.turn(at.r)
        v += slope * dr.dot(at.dr, v) * mi.Vector3f(-x.y, x.x, 0)
        return dr.normalize(turned(v, angle))

    def asymptote(self, g: Geodesic) -> tuple[mi.Vector3f, mi.Float]:
        x, d = self.point(g, mi.UInt32(1)) - self.center, self.direction(g)
        x /= self.mass
        r = dr.norm(x)
        along = dr.dot(x, d)
        u = along / r
        sin2 = dr.maximum(1 - dr.square(u), 0)
        # As without spin, and the frame's dragging of what goes straight out.
        bend = bend_left(r, u, sin2)
        rest = bend * r * dr.sqrt(sin2) + dr.abs(self.a) / dr.square(r)
        leaves = (u > 0) & (r > LEAVING)
        d = turned(d - bend * (x - along * d), -self.a / dr.square(r))
        return dr.normalize(d), dr.select(leaves, rest, dr.inf)

    def captured(self, g: Geodesic) -> mi.Bool:
        return self.place(mi.Vector3f(*g.y[:3])).r < (1 + GAP) * self.outer

    def dark(self, p: mi.Point3f) -> mi.Bool:
        x = mi.Vector3f((p - self.center) / self.mass)
        return self.place(x).r < (1 + GAP) * self.outer

    def bound(self, g: Geodesic) -> mi.Bool:
        return self.place(mi.Vector3f(*g.y[:3])).r < PHOTON_SPHERE


def turned(v: mi.Vector3f, angle: mi.Float) -> mi.Vector3f:
    """A vector turned about +Z."""
    s, c = dr.sincos(angle)
    return mi.Vector3f(c * v.x - s * v.y, s * v.x + c * v.y, v.z)
