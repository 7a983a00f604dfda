"""The maps of `relume.dome_maps` in Dr.Jit, with their inverses and densities."""

from __future__ import annotations

from abc import ABC, abstractmethod

import drjit as dr
import mitsuba as mi
import numpy as np

from relume import dome_maps

SINE_FLOOR = 1e-5  # keeps densities finite at the poles of a map


def _latlong_density(sine: mi.Float) -> mi.Float:
    """d(u, v)/dω of a map that is linear in both angles: 1 / (2π² sin θ)."""
    return dr.rcp(2.0 * dr.square(dr.pi) * dr.maximum(sine, SINE_FLOOR))


class DomeMap(ABC):
    """A map of `dome_maps.FORMULAS`; each map has its own class below.

    Args:
        name: which.
    """

    def __init__(self, name: str) -> None:
        self.formula = dome_maps.FORMULAS[name]

    def to_uv(self, n: mi.Vector3f) -> mi.Point2f:
        """Image coordinates of unit vectors."""
        return mi.Point2f(*self.formula(dr, n.x, n.y, n.z))

    @abstractmethod
    def to_direction(self, uv: mi.Point2f) -> mi.Vector3f:
        """The inverse of `to_uv`: unit vectors, NaN where the image shows no direction."""

    @abstractmethod
    def density(self, n: mi.Vector3f) -> mi.Float:
        """Area in (u, v) per solid angle at unit vectors."""


class Transposed(DomeMap):
    def to_direction(self, uv: mi.Point2f) -> mi.Vector3f:
        sine, cosine = dr.sincos(dr.pi * uv.x)
        s, c = dr.sincos(dr.two_pi * uv.y)
        return mi.Vector3f(sine * c, sine * s, cosine)

    def density(self, n: mi.Vector3f) -> mi.Float:
        return _latlong_density(dr.hypot(n.x, n.y))


class Panoramic(DomeMap):
    def to_direction(self, uv: mi.Point2f) -> mi.Vector3f:
        sine, cosine = dr.sincos(dr.pi * (1.0 - uv.y))
        s, c = dr.sincos(dr.pi * dr.fma(2.0, uv.x, -1.0))
        return mi.Vector3f(sine * s, cosine, -sine * c)

    def density(self, n: mi.Vector3f) -> mi.Float:
        return _latlong_density(dr.hypot(n.x, n.z))


class Equirectangular(DomeMap):
    def to_direction(self, uv: mi.Point2f) -> mi.Vector3f:
        sine, cosine = dr.sincos(dr.pi * (0.5 - uv.y))
        s, c = dr.sincos(dr.pi * dr.fma(2.0, uv.x, -1.0))
        return mi.Vector3f(cosine * c, sine, cosine * s)

    def density(self, n: mi.Vector3f) -> mi.Float:
        return _latlong_density(dr.hypot(n.x, n.z))


class LightProbe(DomeMap):
    """Light probe with the direction `front` * Z at the centre; the rim is the opposite one."""

    def __init__(self, name: str, front: float) -> None:
        super().__init__(name)
        self.front = front

    def to_direction(self, uv: mi.Point2f) -> mi.Vector3f:
        x, y = dr.fma(2.0, uv.x, -1.0), dr.fma(2.0, uv.y, -1.0)
        r = dr.hypot(x, y)
        sine, cosine = dr.sincos(dr.pi * r)
        scale = dr.select(r < 1.0, sine / dr.maximum(r, 1e-20), dr.nan)  # no direction beyond
        return mi.Vector3f(scale * x, scale * y, self.front * cosine)

    def density(self, n: mi.Vector3f) -> mi.Float:
        sine = dr.hypot(n.x, n.y)
        r = dr.maximum(dr.atan2(sine, self.front * n.z) * dr.inv_pi, SINE_FLOOR)
        return r / (4.0 * dr.pi * dr.maximum(sine, SINE_FLOOR))


class Hemisphere(DomeMap):
    """The dome seen from above, orthographically; below y = 0 it is mirrored."""

    def to_direction(self, uv: mi.Point2f) -> mi.Vector3f:
        z, x = dr.fma(2.0, uv.x, -1.0), dr.fma(2.0, uv.y, -1.0)
        return mi.Vector3f(x, dr.sqrt(1.0 - dr.square(x) - dr.square(z)), z)  # NaN off the dome

    def density(self, n: mi.Vector3f) -> mi.Float:
        return 0.25 * dr.abs(n.y)


MAPS: dict[str, DomeMap] = {
    "transposed": Transposed("transposed"),
    "panoramic": Panoramic("panoramic"),
    "angular": LightProbe("angular", -1.0),
    "angular_mirrored": LightProbe("angular_mirrored", 1.0),
    "equirectangular": Equirectangular("equirectangular"),
    "hemisphere": Hemisphere("hemisphere"),
}


def find_map(name: str) -> DomeMap:
    """Return the map called `name`.

    Raises:
        ValueError: there is none.
    """
    if name not in MAPS:
        raise ValueError(f"map must be one of {', '.join(MAPS)}, got {name!r}")
    return MAPS[name]


def texel(uv: mi.Point2f, width: int, height: int) -> tuple[mi.UInt32, mi.UInt32]:
    """Column and row from the top (`mi.UInt32`) of the texel at `uv` in a width x height image."""

    def index(x: mi.Float, size: int) -> mi.UInt32:
        return mi.UInt32(dr.clip(dr.floor(x * (size - 1)), 0.0, size - 1))

    return index(uv.x, width), height - 1 - index(uv.y, height)


def cell_solid_angles(
    dome_map: DomeMap, width: int, height: int, upper_only: bool, samples: int = 8
) -> np.ndarray:
    """Solid angle of the directions that look up each texel.

    Args:
        dome_map: one of `MAPS`.
        width: columns of the image.
        height: rows of the image.
        upper_only: count directions with y >= 0 only.
        samples: the midpoint rule takes samples x samples points a texel.

    Returns:
        float64 array of shape (max(height - 1, 1), max(width - 1, 1)) in sr, rows from the bottom.
    """
    columns, rows = max(width - 1, 1), max(height - 1, 1)
    total = np.zeros((rows, columns))
    j, i = dr.meshgrid(dr.arange(mi.Float, columns), dr.arange(mi.Float, rows))
    for a in range(samples):
        for b in range(samples):
            uv = mi.Point2f((j + (a + 0.5) / samples) / columns, (i + (b + 0.5) / samples) / rows)
            n = dome_map.to_direction(uv)
            shown = dr.isfinite(n.x) & dr.isfinite(n.y)
            if upper_only:
                shown &= n.y >= 0.0
            # the orthographic map has 1/|y| at its rim; the floor is below what a texel resolves
            per_uv = dr.rcp(dr.maximum(dome_map.density(n), SINE_FLOOR))
            total += np.array(dr.select(shown, per_uv, 0.0)).reshape(rows, columns)
    return total / (samples**2 * rows * columns)
