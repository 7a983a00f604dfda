"""Films that light subpaths fill: sums of 64-bit integers, whatever the order of additions."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.sensors.colors import absolute_luminance, linear_rgb
from relume.sensors.pixelsamples import FILTERS, TENT_OF_A_PIXEL

PRECISION = 2.0**30
"""Units of a film in the scale of its values."""

MOST = 2.0**58
"""Largest value of one splat, in units."""


class SplatFilm:
    """A film of sums.

    Args:
        film: ``mi.Film``, whose size and filter it has.
        scale: of what a splat brings.

    Raises:
        ValueError: the filter has negative weights.
    """

    def __init__(self, film: mi.Film, scale: float) -> None:
        self.width, self.height = (int(x) for x in film.crop_size())
        rfilter = film.rfilter()
        self.filter, self.radius = rfilter.class_name(), float(rfilter.radius())
        if self.filter not in FILTERS:
            raise ValueError(
                f"samples cannot follow the film's {self.filter}, negative in places; expected a "
                "box, tent or gaussian filter"
            )
        if self.filter == "TentFilter" and abs(self.radius - TENT_OF_A_PIXEL) < 1e-6:
            self.radius = 0.5
        self.unit = 2.0 ** math.floor(math.log2(PRECISION / scale)) if scale > 0 else 1.0
        self.size = mi.Vector2f(*(dr.opaque(mi.Float, float(x)) for x in (self.width, self.height)))
        self.units = dr.opaque(mi.Float, self.unit)
        self.sums = dr.zeros(mi.Int64, self.width * self.height * 3)

    @property
    def margin(self) -> float:
        """How far beyond the film a splat may lie [pixel]."""
        # A Gaussian ends at four standard deviations in Mitsuba; samples do not know that.
        reach = self.radius * (1.25 if self.filter == "GaussianFilter" else 1)
        return max(0.0, reach - 0.5)

    def covers(self, position: mi.Point2f) -> mi.Bool:
        """Whether a position, [0, 1] inside, reaches a pixel of the film."""
        x, m = position * self.size, self.margin
        return (x.x >= -m) & (x.y >= -m) & (x.x < self.size.x + m) & (x.y < self.size.y + m)

    def _density(self, x: mi.Float) -> mi.Float:
        """The filter, of integral 1, at a distance from the middle of a pixel."""
        if self.filter == "BoxFilter":
            return dr.select(dr.abs(x) <= self.radius, mi.Float(0.5 / self.radius), 0)
        if self.filter == "TentFilter":
            return dr.maximum(1 - dr.abs(x) / self.radius, 0) / self.radius
        σ = self.radius / 4
        return dr.exp(-0.5 * dr.square(x / σ)) / (σ * math.sqrt(2 * math.pi))

    def _pixel(self, x: mi.Float, sample: mi.Float) -> tuple[mi.Float, mi.Float]:
        """A pixel near a coordinate, by its share of the filter, and the sum of all shares."""
        if self.filter == "BoxFilter" and self.radius == 0.5:
            return dr.floor(x), mi.Float(1)
        reach = self.margin + 0.5
        first = dr.floor(x - reach)
        shares = [self._density(x - (first + i + 0.5)) for i in range(math.ceil(2 * reach) + 1)]
        total, rest, pixel = sum(shares), mi.Float(sample), mi.Float(first)
        rest *= total
        for share in shares[:-1]:
            pixel = dr.select(rest >= share, pixel + 1, pixel)
            rest = dr.select(rest >= share, rest - share, -1)
        return pixel, total

    def splat(
        self,
        value: mi.Spectrum,
        wavelengths: mi.Spectrum,
        position: mi.Point2f,
        sample: mi.Point2f,
        active: mi.Bool,
    ) -> mi.Float:
        """Add a value.

        Args:
            value: ``mi.Spectrum``.
            wavelengths: of it.
            position: ``mi.Point2f``, on the film, [0, 1] inside.
            sample: ``mi.Point2f``, uniform variates for the pixel.
            active: lanes.

        Returns:
            Its luminance.
        """
        x = position * self.size
        (column, a), (row, b) = self._pixel(x.x, sample.x), self._pixel(x.y, sample.y)
        active &= (column >= 0) & (row >= 0) & (column < self.size.x) & (row < self.size.y)
        color = linear_rgb(dr.select(active, value * (a * b), 0), wavelengths)
        active &= dr.all(dr.isfinite(color))
        color = dr.select(active, color, 0)
        place = mi.UInt32(dr.select(active, dr.fma(row, self.size.x, column), 0))
        for i in range(3):
            units = mi.Int64(dr.round(dr.clip(color[i] * self.units, -MOST, MOST)))
            # Direct: other modes keep a film for each thread.
            dr.scatter_add(self.sums, units, place * 3 + i, active, mode=dr.ReduceMode.Direct)
        return absolute_luminance(color)

    def picture(self) -> np.ndarray:
        """The sums: (pixels, 3) float64."""
        sums: np.ndarray = self.sums.numpy().astype(float).reshape(-1, 3) / self.unit
        return sums
