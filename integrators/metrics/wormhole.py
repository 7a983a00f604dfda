"""A wormhole of three parameters, each geodesic in the plane in which it lies."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.integrators.metrics.metric import SAGITTA, Geodesic, Metric
from relume.parameters import NOT_NEGATIVE, POSITIVE, number, vector

LENSING_WIDTH = 1.42953
"""W over the scale of length M of the shape (James et al. 2015)."""

BEYOND = 1e-4
"""How far a step out of the throat goes beyond it, in its radii."""

NEWTON_STEPS = 6
"""Steps for l of a radius; from above they converge one-sidedly."""


class Wormhole(Metric):
    r"""Two flat spaces that are joined by a throat.

    With l the proper distance from its middle, :math:`|l| < a` in the throat, and

    .. math::
        r(l) = \rho + M (x \arctan x - \tfrac12 \log(1 + x^2)),
        \quad x = 2 (|l| - a) / (\pi M),

    the radius r, light moves in the plane of its start and direction by

    .. math:: l'' = \beta^2 r'(l) / r^3, \qquad \psi' = \beta / r^2,

    :math:`\beta` its conserved impact parameter. Directions from the mouth are the same on both
    sides. Observers are at rest; surfaces are, too.

    Args:
        props: `mi.Properties` with ``mouth_in``, ``mouth_out``, ``rho``, ``a`` and ``W``.

    Raises:
        ValueError: the throat has no radius, or no lensing width, or a negative length.
    """

    sides = 2

    def __init__(self, props: mi.Properties) -> None:
        self.rho = mi.Float(number(props, "rho", 1.3, POSITIVE))
        self.a = mi.Float(number(props, "a", 0.5, NOT_NEGATIVE))
        self.M = mi.Float(number(props, "W", 0.05, POSITIVE) / LENSING_WIDTH)
        origin = (0, 0, 0)
        mouths = [vector(props, "mouth_in", origin), vector(props, "mouth_out", origin)]
        self.mouths = [mi.Point3f(*mouth.tolist()) for mouth in mouths]
        dr.make_opaque(self.rho, self.a, self.M, self.mouths)

    def parameters(self) -> dict[str, object]:
        mouths = {"mouth_in": self.mouths[0], "mouth_out": self.mouths[1]}
        return mouths | {"rho": self.rho, "a": self.a, "W": self.M * LENSING_WIDTH}

    def shape(self, l: mi.Float) -> tuple[mi.Float, mi.Float]:
        """The radius at l, and its slope along \\|l|."""
        x = dr.maximum(dr.abs(l) - self.a, 0) * 2 / (dr.pi * self.M)
        angle = dr.atan(x)
        r = dr.fma(self.M, x * angle - 0.5 * dr.log(dr.fma(x, x, 1)), self.rho)
        return r, 2 / dr.pi * angle

    def distance(self, r: mi.Float) -> mi.Float:
        """The l >= a of a radius; a where it is below that of the throat."""
        y = dr.maximum(r - self.rho, 0) / self.M
        x = dr.fma(2 / dr.pi, y, dr.sqrt(2 * y))
        for _ in range(NEWTON_STEPS):
            angle = dr.atan(x)
            excess = x * angle - 0.5 * dr.log(dr.fma(x, x, 1)) - y
            x = dr.select(angle > 0, dr.maximum(x - excess / angle, 0), 0)
        return dr.fma(0.5 * dr.pi * self.M, x, self.a)

    def mouth(self, side: mi.UInt32) -> mi.Point3f:
        return dr.select(side == 1, self.mouths[0], self.mouths[1])

    def begin(self, p: mi.Point3f, d: mi.Vector3f, side: mi.UInt32, camera: bool) -> Geodesic:
        x = mi.Vector3f(p - self.mouth(side))
        r = dr.norm(x)
        n = x / r
        along = dr.dot(d, n)
        across = d - along * n
        sine = dr.norm(across)
        t = dr.select(sine > 1e-7, across / sine, mi.Frame3f(n).s)
        sign = dr.select(side == 1, mi.Float(1), -1)
        beta = dr.maximum(r, self.rho) * sine
        return Geodesic(
            [sign * self.distance(r), mi.Float(0), sign * along], [beta, *n, *t], 0.1 * r
        )

    def derivative(self, y: list[mi.Float], k: list[mi.Float]) -> list[mi.Float]:
        l, _, p = y
        r, slope = self.shape(l)
        turn = k[0] / dr.square(r)
        return [p, turn, dr.mulsign(k[0] * turn * slope / r, l)]

    def scales(self, y: list[mi.Float]) -> list[mi.Float]:
        return [self.shape(y[0])[0], mi.Float(1), mi.Float(1)]

    def longest_step(self, g: Geodesic, chords: bool) -> mi.Float:
        l, _, p = g.y
        r, slope = self.shape(l)
        outside = dr.abs(l) - self.a
        h = dr.maximum(0.5 * outside, 0.2 * self.M)
        if chords:
            bend = (1 - slope) * dr.minimum(g.k[0] / r, 1)
            h = dr.minimum(h, r * dr.sqrt(8 * SAGITTA / dr.maximum(bend, 1e-9)))
        # The throat is a cylinder: the equations are exact on any length of it.
        rest = (self.a - dr.mulsign(l, p)) / dr.maximum(dr.abs(p), 1e-6)
        return dr.select(outside > 0, h, rest + BEYOND * self.rho)

    def axes(self, g: Geodesic) -> tuple[mi.Vector3f, mi.Vector3f]:
        """Directions from the mouth to the ray, and across in its plane."""
        s, c = dr.sincos(g.y[1])
        n, t = mi.Vector3f(*g.k[1:4]), mi.Vector3f(*g.k[4:7])
        return c * n + s * t, c * t - s * n

    def point(self, g: Geodesic, side: mi.UInt32) -> mi.Point3f:
        n, _ = self.axes(g)
        return dr.fma(self.shape(g.y[0])[0], n, self.mouth(side))

    def direction(self, g: Geodesic) -> mi.Vector3f:
        n, t = self.axes(g)
        out = dr.mulsign(g.y[2], g.y[0])
        return dr.normalize(out * n + g.k[0] / self.shape(g.y[0])[0] * t)

    def asymptote(self, g: Geodesic) -> tuple[mi.Vector3f, mi.Float]:
        # 1/r' - 1 is about M/l; half of it, times the sine, is what ψ turns more than where r' = 1.
        n, t = self.axes(g)
        r, _ = self.shape(g.y[0])
        cosine, sine = dr.mulsign(g.y[2], g.y[0]), g.k[0] / r
        outside = dr.abs(g.y[0]) - self.a
        rest = dr.select((cosine > 0) & (outside > self.M), sine * self.M / outside, dr.inf)
        d = dr.fma(cosine, n, sine * t)
        more = dr.select(dr.isfinite(rest), 0.5 * rest, 0)
        return dr.normalize(d + more * (cosine * t - sine * n)), rest

    def side(self, g: Geodesic) -> mi.UInt32:
        return dr.select(g.y[0] >= 0, mi.UInt32(1), 2)

    def in_scene(self, g: Geodesic) -> mi.Bool:
        return dr.abs(g.y[0]) > self.a
