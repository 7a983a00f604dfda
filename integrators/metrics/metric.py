"""What every metric tells of its geodesics, and the integration that they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

TOLERANCE = 2e-7
"""Error of a step relative to `Metric.scales`; single precision resolves 6e-8."""

SAGITTA = 3e-4
"""Largest distance between a geodesic and its chord, in distances from the curved region."""

REST = 2e-4
"""Deflection [rad] that may be left where a geodesic is taken for its asymptote."""

_A = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (3 / 10, -9 / 10, 6 / 5),
    (-11 / 54, 5 / 2, -70 / 27, 35 / 27),
    (1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096),
)
_FIFTH = (37 / 378, 0.0, 250 / 621, 125 / 594, 0.0, 512 / 1771)
_FOURTH = (2825 / 27648, 0.0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4)


@dataclass
class Geodesic:
    """A ray of light on its way, each number an array over rays.

    Attributes:
        y: list of ``mi.Float`` that change along the ray.
        k: list of ``mi.Float`` that do not.
        h: ``mi.Float``, next step of the parameter.
    """

    y: list[mi.Float]
    k: list[mi.Float]
    h: mi.Float


class Metric(ABC):
    """Where light goes in a space that is flat far from some centre.

    Scene points are ``mi.Point3f`` and directions unit ``mi.Vector3f`` of the coordinates that the
    scene's objects are written in. The side, ``mi.UInt32``, is 1, or 2 for what is beyond a
    wormhole. Positions in `Geodesic.y` are relative to the centre, where single precision is best.
    """

    sides: int = 1
    """How many skies there are."""

    @abstractmethod
    def parameters(self) -> dict[str, object]:
        """Its parameters by name, as a scene gives them."""

    @abstractmethod
    def begin(self, p: mi.Point3f, d: mi.Vector3f, side: mi.UInt32, camera: bool) -> Geodesic:
        """The geodesic from a scene point in a direction.

        Args:
            p: the point.
            d: the direction of the traced ray, against that of the light.
            side: of the point.
            camera: whether an observer sends it; surfaces are at rest in the scene.
        """

    @abstractmethod
    def derivative(self, y: list[mi.Float], k: list[mi.Float]) -> list[mi.Float]:
        """The equations of motion, dy over the parameter."""

    @abstractmethod
    def scales(self, y: list[mi.Float]) -> list[mi.Float]:
        """What the errors of `y` are compared with."""

    @abstractmethod
    def longest_step(self, g: Geodesic, chords: bool) -> mi.Float:
        """Limit of the next step by the distance from the centre.

        Args:
            g: the geodesic.
            chords: whether the chord of the step is to be within `SAGITTA`, too.
        """

    @abstractmethod
    def point(self, g: Geodesic, side: mi.UInt32) -> mi.Point3f:
        """Where the geodesic is, as seen from a side."""

    @abstractmethod
    def direction(self, g: Geodesic) -> mi.Vector3f:
        """Where it goes to."""

    @abstractmethod
    def asymptote(self, g: Geodesic) -> tuple[mi.Vector3f, mi.Float]:
        """Direction in which it leaves, and the angle [rad] from `direction` to it.

        The angle is infinite where the geodesic does not leave yet.
        """

    def side(self, g: Geodesic) -> mi.UInt32:
        """Side on which it is."""
        return mi.UInt32(1)

    def in_scene(self, g: Geodesic) -> mi.Bool:
        """Whether it is where objects can be: what begins elsewhere meets none."""
        return mi.Bool(True)

    def captured(self, g: Geodesic) -> mi.Bool:
        """Whether it has ended on a horizon."""
        return mi.Bool(False)

    def dark(self, p: mi.Point3f) -> mi.Bool:
        """Whether a scene point is inside a horizon."""
        return mi.Bool(False)

    def bound(self, g: Geodesic) -> mi.Bool:
        """Whether a geodesic that has run out of steps is taken for captured."""
        return mi.Bool(False)

    def step(self, g: Geodesic, chords: bool) -> tuple[Geodesic, mi.Bool]:
        """Move on by one step of the method of Cash and Karp, orders 5 and 4.

        Args:
            g: the geodesic.
            chords: as in `longest_step`.

        Returns:
            The geodesic after the step, or where it was with a shorter next step; and whether the
            step was taken.
        """
        h = dr.minimum(g.h, self.longest_step(g, chords))
        slopes = [self.derivative(g.y, g.k)]
        for row in _A:
            slopes.append(self.derivative(combined(g.y, h, row, slopes), g.k))
        y = combined(g.y, h, _FIFTH, slopes)
        lower = combined(g.y, h, _FOURTH, slopes)
        error = mi.Float(0)
        for a, b, scale in zip(y, lower, self.scales(g.y), strict=True):
            error = dr.maximum(error, dr.abs(a - b) / scale)
        error /= TOLERANCE
        taken = error <= 1  # false for NaN
        growth = 0.9 * dr.power(dr.maximum(error, 1e-4), -0.2)
        h *= dr.select(taken, growth, dr.select(error < 1e4, dr.maximum(growth, 0.1), 0.1))
        y = [dr.select(taken, new, old) for new, old in zip(y, g.y, strict=True)]
        return Geodesic(y, g.k, h), taken


def combined(
    y: list[mi.Float], h: mi.Float, weights: tuple[float, ...], slopes: list[list[mi.Float]]
) -> list[mi.Float]:
    """y + h times the weighted sum of slopes."""
    result = []
    for i, start in enumerate(y):
        total = mi.Float(0)
        for weight, slope in zip(weights, slopes, strict=True):
            if weight:
                total = dr.fma(weight, slope[i], total)
        result.append(dr.fma(h, total, start))
    return result
