"""Colours of black bodies, of luminance 1."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.sensors.colors import LUMINANCE

SECOND_CONSTANT = 1.438777e7
"""h c / k [nm K]."""

COLDEST, HOTTEST, COUNT = 500.0, 1e5, 512
"""Range [K] and number of tabulated temperatures, whose logarithms are evenly spaced."""

SRGB = np.array(
    [
        [3.240479, -1.537150, -0.498535],
        [-0.969256, 1.875991, 0.041556],
        [0.055648, -0.204043, 1.057311],
    ]
)
"""Linear sRGB of XYZ."""


def planck(wavelength: np.ndarray, temperature: np.ndarray) -> np.ndarray:
    """Planck's law for wavelengths [nm] and temperatures [K], in units of its own."""
    x = SECOND_CONSTANT / (wavelength * temperature)
    return (560 / wavelength) ** 5 / np.expm1(np.minimum(x, 80))


class BlackBodies:
    """Black bodies by temperature, under the variant in use; those out of range as the last ones.

    No dataclass, whose fields Dr.Jit would take for state of the loops that use it.
    """

    def __init__(self) -> None:
        wavelengths = np.arange(360.5, 830)
        temperatures = np.geomspace(COLDEST, HOTTEST, COUNT)
        matching = np.array(mi.cie1931_xyz(mi.Float(wavelengths)))
        light = planck(wavelengths[:, None], temperatures)
        xyz = matching @ light
        colors = np.maximum(SRGB @ xyz, 0)
        colors /= np.array(LUMINANCE) @ colors
        self.colors = [mi.Float(channel) for channel in colors]
        self.log_luminance = mi.Float(np.log(xyz[1]))
        dr.make_opaque(self.colors, self.log_luminance)

    def eval(self, temperature: mi.Float, wavelengths: mi.Spectrum) -> mi.Spectrum:
        """Spectrum or colour of luminance 1.

        Args:
            temperature: of the body [K].
            wavelengths: of the ray [nm]; no matter in variants without wavelengths.
        """
        T = dr.clip(temperature, COLDEST, HOTTEST)
        x = dr.log(T / COLDEST) * ((COUNT - 1) / np.log(HOTTEST / COLDEST))
        i = dr.minimum(mi.UInt32(x), COUNT - 2)
        t = x - i

        def between(table: mi.Float) -> mi.Float:
            low, high = dr.gather(mi.Float, table, i), dr.gather(mi.Float, table, i + 1)
            return dr.lerp(low, high, t)

        if mi.is_spectral:
            decay = dr.minimum(SECOND_CONSTANT / (wavelengths * T), 80)
            shape = dr.power(560 / wavelengths, 5) / (dr.exp(decay) - 1)
            return shape * dr.exp(-between(self.log_luminance))
        if mi.is_monochromatic:
            return mi.Spectrum(1)
        return mi.Spectrum(*(between(channel) for channel in self.colors))
