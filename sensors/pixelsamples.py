"""Samples of pixels: what an integrator makes of rays of a sensor."""

from __future__ import annotations

import mitsuba as mi

from relume.sensors.colors import linear_rgb

FILTERS = ("BoxFilter", "TentFilter", "GaussianFilter")
"""Reconstruction filters that samples can follow: those without negative weights."""


TENT_OF_A_PIXEL = 0.501
"""Half-width of a tent that stands for 0.5, of which Mitsuba's films make a box."""


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
        sensor: its medium, if it has one, is where the rays begin.
        integrator: what finds the radiance along them.
        sampler: of the lens, the wavelength and the paths.
        corner: column and row of the pixel.
        sample: uniform variates for the position in the pixel.
        size: columns and rows of the film.
    """
    position = (corner + position_in_pixel(sensor, sample)) / size
    lens = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Point2f(0.5)
    wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0)
    ray, weight = sensor.sample_ray_differential(0.0, wavelength, position, lens)
    L, *_ = integrator.sample(scene, sampler, ray, sensor.get_medium())
    return linear_rgb(L * weight, ray.wavelengths)
