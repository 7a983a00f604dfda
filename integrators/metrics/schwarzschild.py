"""A black hole without spin (Schwarzschild), in Cartesian coordinates without poles."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.integrators.metrics.metric import SAGITTA, Geodesic, Metric
from relume.parameters import POSITIVE, choice, number, vector

OBSERVERS = ("coordinate", "static")
"""Who may send rays from a sensor."""

HORIZON = 2.0
"""Radius [M]."""

PHOTON_SPHERE = 3.0
"""Radius [M] inside which no light that is on its way in turns back."""

LEAVING = 4.0
"""Distance [M] beyond which light that goes out may be taken for its asymptote."""


class Schwarzschild(Metric):
    r"""Light around a mass M, all lengths in units of M.

    With the radius r of the scene for the areal radius, the unit of energy that of the light at
    infinity, and the angular momentum :math:`L = |x \times x'|`,

    .. math:: x'' = -3 L^2 x / r^5.

    Args:
        props: `mi.Properties` with ``center``, ``mass`` and ``observer``.

    Raises:
        ValueError: the mass is not above 0, or the observer unknown.
    """

    def __init__(self, props: mi.Properties) -> None:
        self.center, self.mass = center_and_mass(props)
        self.observer = choice(props, "observer", OBSERVERS)

    def parameters(self) -> dict[str, object]:
        return {"center": self.center, "mass": self.mass, "observer": self.observer}

    def begin(self, p: mi.Point3f, d: mi.Vector3f, side: mi.UInt32, camera: bool) -> Geodesic:
        x = mi.Vector3f((p - self.center) / self.mass)
        r = dr.norm(x)
        n = x / r
        f = 1 - HORIZON / r
        if camera and self.observer == "static":
            d = dr.normalize(dr.fma((dr.safe_sqrt(f) - 1) * dr.dot(d, n), n, d))
        cos2 = dr.square(dr.dot(d, n))
        v = d * dr.rsqrt(dr.maximum(dr.fma(f, 1 - cos2, cos2), 1e-12))
        k = 3 * dr.squared_norm(dr.cross(x, v))
        return Geodesic([*x, *v], [k], 0.1 * r)

    def derivative(self, y: list[mi.Float], k: list[mi.Float]) -> list[mi.Float]:
        x = mi.Vector3f(*y[:3])
        i = dr.rsqrt(dr.squared_norm(x))
        return [*y[3:], *(x * (-k[0] * i * dr.square(dr.square(i))))]

    def scales(self, y: list[mi.Float]) -> list[mi.Float]:
        r = dr.norm(mi.Vector3f(*y[:3]))
        return [r, r, r, mi.Float(1), mi.Float(1), mi.Float(1)]

    def longest_step(self, g: Geodesic, chords: bool) -> mi.Float:
        r = dr.norm(mi.Vector3f(*g.y[:3]))
        h = 0.5 * r
        if chords:  # h² |x''| / 8 is the sagitta
            bend = dr.maximum(g.k[0], 1e-12)
            h = dr.minimum(h, dr.square(r) * dr.sqrt(8 * SAGITTA * r / bend))
        return h

    def point(self, g: Geodesic, side: mi.UInt32) -> mi.Point3f:
        return dr.fma(self.mass, mi.Point3f(*g.y[:3]), self.center)

    def direction(self, g: Geodesic) -> mi.Vector3f:
        return dr.normalize(mi.Vector3f(*g.y[3:]))

    def asymptote(self, g: Geodesic) -> tuple[mi.Vector3f, mi.Float]:
        x, v = mi.Vector3f(*g.y[:3]), self.direction(g)
        r = dr.norm(x)
        along = dr.dot(x, v)
        u = along / r
        sin2 = g.k[0] / (3 * dr.square(r) * dr.squared_norm(mi.Vector3f(*g.y[3:])))
        bend = bend_left(r, u, sin2)
        leaves = (u > 0) & (r > LEAVING)
        rest = dr.select(leaves, bend * r * dr.safe_sqrt(sin2), dr.inf)
        return dr.normalize(v - bend * (x - along * v)), rest

    def captured(self, g: Geodesic) -> mi.Bool:
        return dr.squared_norm(mi.Vector3f(*g.y[:3])) < HORIZON**2

    def dark(self, p: mi.Point3f) -> mi.Bool:
        return dr.norm(p - self.center) < HORIZON * self.mass

    def bound(self, g: Geodesic) -> mi.Bool:
        return dr.squared_norm(mi.Vector3f(*g.y[:3])) < PHOTON_SPHERE**2


def bend_left(r: mi.Float, u: mi.Float, sin2: mi.Float) -> mi.Float:
    """Deflection that is left to light that leaves, over its impact parameter [rad/M].

    To first order in 1/r: the integral of 3 b³ / (b² + s²)^(5/2) over what is left of the way.

    Args:
        r: distance from the hole [M].
        u: cosine of the angle between the direction from the hole and that of the light, above 0.
        sin2: square of its sine.
    """
    return sin2 * (2 + u) / dr.square((1 + u) * r)


def center_and_mass(props: mi.Properties) -> tuple[mi.Point3f, mi.Float]:
    """Read the parameters ``center`` and ``mass`` of a black hole.

    Raises:
        ValueError: the mass is not above 0.
    """
    center = vector(props, "center", (0, 0, 0))
    values = mi.Point3f(*center.tolist()), mi.Float(number(props, "mass", 1.0, POSITIVE))
    dr.make_opaque(*values)
    return values
