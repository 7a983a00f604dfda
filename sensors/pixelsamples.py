"""Samples of pixels: what an integrator makes of rays of a sensor."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.sensors.colors import linear_rgb

FILTERS = ("BoxFilter", "TentFilter", "GaussianFilter")
"""Reconstruction filters that samples can follow: those without negative weights."""

TENT_OF_A_PIXEL = 0.501
"""Half-width of a tent that stands for 0.5, of which Mitsuba's films make a box."""

CELLS = 512
"""Of a table of a filter."""


def position_in_pixel(sensor: mi.Sensor, sample: mi.Point2f) -> mi.Point2f:
    """Return where a sample of a pixel lies, distributed as the film's reconstruction filter.

    Args:
        sensor: whose film has one of `FILTERS`, or else is taken to have a box filter.
        sample: uniform variates.

    Returns:
        The position from the corner of the pixel; [0, 1] is inside.
    """
    rfilter = sensor.film().rfilter()
    kind, radius = rfilter.class_name(), rfilter.radius()
    if kind == "TentFilter":
        radius = 0.5 if abs(radius - TENT_OF_A_PIXEL) < 1e-6 else radius
        return 0.5 + radius * mi.warp.square_to_tent(sample)
    if kind == "GaussianFilter":
        # Mitsuba cuts it off at four standard deviations.
        return 0.5 + radius / 4 * mi.warp.square_to_std_normal(sample)
    if kind == "BoxFilter" and radius != 0.5:
        return 0.5 + radius * (2 * sample - 1)
    return sample


def within_tent(sample: mi.Point2f) -> mi.Point2f:
    """Return a position in a pixel, distributed as a tent of half-width 1/2."""
    return 0.5 + 0.5 * mi.warp.square_to_tent(sample)


class PixelFilter:
    """A film's reconstruction filter, from which positions about pixels are drawn.

    All filters of Mitsuba are products of one function f of x and y. It is drawn in proportion to
    |f|, tabulated, and samples get the weight of its sign. Unless the film has a border, pixels see
    nothing beyond it, and f is normalized within.

    Args:
        film: ``mi.Film``.
    """

    def __init__(self, film: mi.Film) -> None:
        rfilter = film.rfilter()
        kind, self.radius = rfilter.class_name(), float(rfilter.radius())
        self.tent = kind == "TentFilter" and self.radius < TENT_OF_A_PIXEL + 1e-6
        self.tabulated = not self.tent and kind != "BoxFilter"
        self.border = film.sample_border()
        if not self.tabulated:
            return
        x = ((np.arange(CELLS) + 0.5) / CELLS * 2 - 1) * self.radius
        f = np.array([float(np.array(rfilter.eval(mi.Float(t))).item()) for t in x])
        sums = [np.concatenate([[0.0], np.cumsum(g)]) for g in (np.abs(f), f)]
        self.mass = float(sums[0][-1]) * 2 * self.radius / CELLS
        self.total, self.signed = (mi.Float((s / sums[0][-1]).astype(np.float32)) for s in sums)

    def place(
        self, corner: mi.Point2f, sample: mi.Point2f, size: mi.Vector2f
    ) -> tuple[mi.Point2f, mi.Float]:
        """Draw a position for a sample of a pixel.

        Args:
            corner: column and row of the pixel.
            sample: uniform variates.
            size: columns and rows of the film.

        Returns:
            Position from the corner [pixel], and weight.
        """
        if self.tent:
            return within_tent(sample), mi.Float(1)
        if not self.tabulated:
            return sample, mi.Float(1)
        (x, u), (y, v) = (self._draw(*one) for one in zip(corner, sample, size, strict=True))
        return mi.Point2f(x, y), u * v

    def _draw(self, corner, sample, size):
        """Draw along one axis."""
        low, high = mi.Float(0), mi.Float(CELLS)
        if not self.border:
            to_cells = CELLS / (2 * self.radius)
            low = dr.maximum((self.radius - (corner + 0.5)) * to_cells, 0)
            high = dr.minimum((self.radius + size - (corner + 0.5)) * to_cells, CELLS)
        first, last = self._interpolated(self.total, low), self._interpolated(self.total, high)
        u = dr.fma(last - first, sample, first)
        cell = dr.binary_search(0, CELLS, lambda i: dr.gather(mi.Float, self.total, i + 1) < u)
        cell = dr.minimum(cell, CELLS - 1)
        start, end = (dr.gather(mi.Float, self.total, cell + i) for i in (0, 1))
        within = dr.clip((u - start) / dr.maximum(end - start, 1e-12), 0, 1)
        t = dr.clip(mi.Float(cell) + within, low, high)
        f = [self._interpolated(self.signed, mi.Float(cell) + i) for i in (0, 1)]
        whole = self._interpolated(self.signed, high) - self._interpolated(self.signed, low)
        return t * (2 * self.radius / CELLS) - self.radius + 0.5, (
            dr.sign(f[1] - f[0]) * (last - first) / whole
        )

    def integral(self, corner: mi.Float, size: mi.Float) -> mi.Float:
        """The integral of f along one axis over what a pixel sees; arguments as `place`."""
        low, high = mi.Float(0), mi.Float(CELLS)
        if not self.border:
            to_cells = CELLS / (2 * self.radius)
            low = dr.maximum((self.radius - (corner + 0.5)) * to_cells, 0)
            high = dr.minimum((self.radius + size - (corner + 0.5)) * to_cells, CELLS)
        start, end = (self._interpolated(self.signed, x) for x in (low, high))
        return self.mass * (end - start)

    @staticmethod
    def _interpolated(table, cell):
        """The value of a table of `CELLS` + 1 numbers between two of them."""
        i = dr.minimum(mi.UInt32(cell), CELLS - 1)
        a, b = (dr.gather(mi.Float, table, i + k) for k in (0, 1))
        return dr.fma(b - a, cell - mi.Float(i), a)


@dataclass
class PixelSample:
    """What a ray through a pixel finds.

    Attributes:
        color: ``mi.Color3f``, linear RGB.
        valid: ``mi.Bool``, whether it finds a surface, or what else the integrator counts as such.
    """

    color: mi.Color3f
    valid: mi.Bool


def trace_pixels(
    scene: mi.Scene,
    sensor: mi.Sensor,
    integrator: mi.SamplingIntegrator,
    sampler: mi.Sampler,
    on_film: mi.Point2f,
) -> PixelSample:
    """Trace a ray through each of the positions on the film.

    Args:
        scene: what is seen.
        sensor: its medium, if it has one, is where the rays begin.
        integrator: what finds the radiance along them.
        sampler: of the lens, the wavelength and the paths.
        on_film: from 0 to 1 over the crop window.
    """
    lens = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Point2f(0.5)
    wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0)
    ray, weight = sensor.sample_ray_differential(0.0, wavelength, on_film, lens)
    L, valid, *_ = integrator.sample(scene, sampler, ray, sensor.get_medium())
    return PixelSample(linear_rgb(L * weight, ray.wavelengths), valid)


def sample_pixels(
    scene: mi.Scene,
    sensor: mi.Sensor,
    integrator: mi.SamplingIntegrator,
    sampler: mi.Sampler,
    corner: mi.Point2f,
    sample: mi.Point2f,
    size: mi.Vector2f,
) -> mi.Color3f:
    """Return the linear RGB of one sample of each of the pixels.

    Args:
        scene: what is seen.
        sensor: as `position_in_pixel` and `trace_pixels` have it.
        integrator: what finds the radiance.
        sampler: of the lens, the wavelength and the paths.
        corner: column and row of the pixel.
        sample: uniform variates for the position in the pixel.
        size: columns and rows of the film.
    """
    position = (corner + position_in_pixel(sensor, sample)) / size
    return trace_pixels(scene, sensor, integrator, sampler, position).color
