"""Films that light subpaths fill: sums of 64-bit integers, whatever the order of additions."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.sensors.colors import absolute_luminance, linear_rgb
from relume.sensors.pixelsamples import PixelFilter

PRECISION = 2.0**30
"""Units of a film in the scale of its values."""

MOST = 2.0**58
"""Largest value of one splat, in units."""


class FilmPixels:
    """The pixels of a film that see what arrives at a position on it.

    Args:
        film: ``mi.Film``, whose size and filter count.
    """

    def __init__(self, film: mi.Film) -> None:
        self.width, self.height = (int(x) for x in film.crop_size())
        self.filter, self.rfilter = PixelFilter(film), film.rfilter()
        if self.filter.tent:
            self.radius = 0.5
        else:
            self.radius = self.filter.radius if self.filter.tabulated else 0.5
        self.size = mi.Vector2f(*(dr.opaque(mi.Float, float(x)) for x in (self.width, self.height)))

    def covers(self, position: mi.Point2f) -> mi.Bool:
        """Whether a position, [0, 1] inside, is seen by a pixel of the film."""
        margin = max(0.0, self.radius - 0.5) if self.filter.border else 0.0
        x = position * self.size
        return dr.all((x >= -margin) & (x < self.size + margin))

    def _share(self, x: mi.Float, pixel: mi.Float, size: mi.Float) -> mi.Float:
        """What a pixel has of a coordinate along one axis, of integral 1 over what it sees."""
        t = x - (pixel + 0.5)
        if self.filter.tent:
            return 2 * dr.maximum(1 - 2 * dr.abs(t), 0)
        return dr.select(
            dr.abs(t) < self.radius, self.rfilter.eval(t) / self.filter.integral(pixel, size), 0
        )

    def _pixel(self, x: mi.Float, sample: mi.Float, size: mi.Float) -> tuple[mi.Float, mi.Float]:
        """A pixel near a coordinate, drawn by its share, and the weight for that."""
        if not self.filter.tent and not self.filter.tabulated:
            return dr.floor(x), mi.Float(1)
        first = dr.floor(x - self.radius - 0.5)
        pixels = [first + i for i in range(math.ceil(2 * self.radius) + 2)]
        shares = [self._share(x, pixel, size) for pixel in pixels]
        total = sum(dr.abs(share) for share in shares)
        rest, pixel, sign = sample * total, mi.Float(first), mi.Float(1)
        left = mi.Bool(True)  # whether the pixel is still to come
        for candidate, share in zip(pixels, shares, strict=True):
            here = left & (rest < dr.abs(share))
            pixel, sign = dr.select(here, candidate, pixel), dr.select(here, dr.sign(share), sign)
            rest -= dr.abs(share)
            left &= ~here
        return pixel, dr.select(left, 0, sign * total)

    def pixel(
        self, position: mi.Point2f, sample: mi.Point2f
    ) -> tuple[mi.UInt32, mi.Float, mi.Bool]:
        """Draw a pixel that sees a position.

        Args:
            position: ``mi.Point2f``, on the film, [0, 1] inside.
            sample: ``mi.Point2f``, uniform variates.

        Returns:
            (its index, the weight for drawing it, whether it is one of the film).
        """
        x = position * self.size
        (column, a), (row, b) = (
            self._pixel(*one) for one in zip(x, sample, self.size, strict=True)
        )
        inside = (column >= 0) & (row >= 0) & (column < self.size.x) & (row < self.size.y)
        place = mi.UInt32(dr.select(inside, dr.fma(row, self.size.x, column), 0))
        return place, a * b, inside


class SplatFilm(FilmPixels):
    """A film of sums.

    Args:
        film: ``mi.Film``, whose size and filter it has.
        scale: of what a splat brings.
    """

    def __init__(self, film: mi.Film, scale: float) -> None:
        super().__init__(film)
        self.unit = 2.0 ** math.floor(math.log2(PRECISION / scale)) if scale > 0 else 1.0
        self.units = dr.opaque(mi.Float, self.unit)
        self.sums = dr.zeros(mi.Int64, self.width * self.height * 3)

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
        place, weight, inside = self.pixel(position, sample)
        active &= inside
        color = linear_rgb(dr.select(active, value * weight, 0), wavelengths)
        active &= dr.all(dr.isfinite(color))
        color = dr.select(active, color, 0)
        for i in range(3):
            units = mi.Int64(dr.round(dr.clip(color[i] * self.units, -MOST, MOST)))
            # Direct: other modes keep a film for each thread.
            dr.scatter_add(self.sums, units, place * 3 + i, active, mode=dr.ReduceMode.Direct)
        return absolute_luminance(color)

    def picture(self) -> np.ndarray:
        """The sums: (pixels, 3) float64."""
        sums: np.ndarray = self.sums.numpy().astype(float).reshape(-1, 3) / self.unit
        return sums
