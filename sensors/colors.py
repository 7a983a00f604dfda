"""Colours of radiances, as Mitsuba's films have them."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

LUMINANCE = (0.212671, 0.715160, 0.072169)
"""Luminance of the primaries of linear sRGB, as in ``mi.luminance``."""


def linear_rgb(L: mi.Spectrum, wavelengths: mi.Spectrum) -> mi.Color3f:
    """Return the linear RGB of a radiance.

    Args:
        L: ``mi.Spectrum``; in spectral variants an estimate of the radiance at `wavelengths` over
            their density.
        wavelengths: of the ray [nm]; no matter in other variants.
    """
    L = mi.unpolarized_spectrum(L)
    if mi.is_spectral:
        return mi.spectrum_to_srgb(L, wavelengths)
    return mi.Color3f(L[0]) if mi.is_monochromatic else mi.Color3f(L)


def absolute_luminance(color: mi.Color3f) -> mi.Float:
    """Return the luminance of the absolute values of a colour.

    Spectra may give colours that RGB cannot hold. No channel is larger than this over the least of
    `LUMINANCE`.
    """
    return mi.luminance(dr.abs(color))
