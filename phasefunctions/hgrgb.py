r"""Henyey-Greenstein phase function with a mean cosine for each channel (``hgrgb``)
================================================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``g``
     - vector
     - Mean cosines of red, green and blue, each in [-1, 1]. Default: 0, 0, 0. Exposed.

For each channel, with :math:`\vartheta` the angle between the directions of travel before and
after,

.. math::
    p(\vartheta) = \frac{1 - g^2}{4 \pi (1 + g^2 - 2 g \cos\vartheta)^{3/2}}

Directions are drawn from one of the channels, chosen evenly; the density is the mean of all
channels, so that no weight exceeds the number of channels. For g = 1 and -1 the phase function is
a Dirac delta: light goes straight on, or back. Such a channel is met by sampling alone, and
``eval_pdf`` is 0 there, as for mirrors. In spectral variants g is that of red from 611 nm up, of
green at 549 nm, of blue from 464 nm down (the dominant wavelengths of the primaries of sRGB),
linear between. The stock ``hg`` has one g and takes neither 1 nor -1.

**Source.** L. G. Henyey and J. L. Greenstein, "Diffuse Radiation in the Galaxy", Astrophysical
Journal 93, 1941, eq. 2; legacy manual, `PAHASE`. Its inverse, by which directions are drawn, is in
`relume.phasefunctions.henyeygreenstein`.

**Variants.** All; light is depolarized.

**Usage.**

.. code-block:: python

    {'type': 'homogeneous', 'phase': {'type': 'hgrgb', 'g': [0.9, 0.8, 0.7]}}
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.parameters import Range, check, expose, vector
from relume.phasefunctions.henyeygreenstein import henyey_greenstein, sample_henyey_greenstein

RUNS_UNDER = ("scalar", "polarized")

MEAN_COSINE = Range(-1.0, 1.0)
BLUE, GREEN, RED = 464.0, 549.0, 611.0
"""Dominant wavelengths of the primaries of sRGB [nm]."""

DELTA_DENSITY = 1e9
"""Density reported for a direction of the Dirac lobe: far above that of any emitter sample, so that
its weight in multiple importance sampling is 1, and with a square that single precision holds."""


def at_wavelengths(g: Sequence[mi.Float], wavelengths: Any) -> list[mi.Float]:
    """g of each channel of the variant in use.

    Args:
        g: of red, green and blue.
        wavelengths: of a path [nm]; used in spectral variants alone.
    """
    if mi.is_rgb:
        return list(g)
    if mi.is_monochromatic:
        return [(g[0] + g[1] + g[2]) / 3]
    to_green = dr.clip((wavelengths - BLUE) / (GREEN - BLUE), 0, 1)
    to_red = dr.clip((wavelengths - GREEN) / (RED - GREEN), 0, 1)
    return list(dr.lerp(dr.lerp(g[2], g[1], to_green), g[0], to_red))


def toward(wi: mi.Vector3f, g: mi.Float) -> mi.Vector3f:
    """Return the direction that g favours: straight on, for g >= 0, or back to `wi`."""
    return dr.select(g >= 0, -wi, wi)


def define() -> type[mi.PhaseFunction]:
    """Return the plugin's class for the variant in use."""

    class HenyeyGreensteinRGB(mi.PhaseFunction):
        def __init__(self, props):
            mi.PhaseFunction.__init__(self, props)
            self.g = mi.Color3f(*vector(props, "g", (0, 0, 0), MEAN_COSINE).tolist())
            self.m_flags = +mi.PhaseFunctionFlags.Anisotropic
            self.parameters_changed([])

        def traverse(self, cb):
            expose(self, cb, ("g",))

        def parameters_changed(self, keys):
            check(self, {"g": MEAN_COSINE})
            dr.make_opaque(self.g)

        def channels(self, wavelengths):
            """Return g of each channel, as a list of floats."""
            return at_wavelengths(self.g, wavelengths)

        def lobe(self, g, wi, wo):
            """Return p for one channel, 0 for a Dirac lobe."""
            # 1 - |cos|, free of cancellation.
            x = 0.5 * dr.squared_norm(wo - toward(wi, g))
            return henyey_greenstein(g, x)

        def values(self, gs, wi, wo):
            """Return p of every channel and their mean, the density of sampling."""
            p = [self.lobe(g, wi, wo) for g in gs]
            return p, sum(p) / len(p)

        def eval_pdf(self, ctx, mei, wo, active=True):
            p, pdf = self.values(self.channels(mei.wavelengths), mei.wi, wo)
            return self.spectrum(p) & active, dr.select(active, pdf, 0)

        def sample(self, ctx, mei, sample1, sample2, active=True):
            gs = self.channels(mei.wavelengths)
            n = len(gs)
            chosen = mi.UInt32(dr.minimum(sample1 * n, n - 1))
            g = gs[0]
            for k in range(1, n):
                g = dr.select(chosen == k, gs[k], g)
            x = sample_henyey_greenstein(g, sample2.x)
            sin_phi, cos_phi = dr.sincos(dr.two_pi * sample2.y)
            sin = dr.safe_sqrt(x * (2 - x))
            wo = mi.Frame3f(toward(mei.wi, g)).to_world(
                mi.Vector3f(sin * cos_phi, sin * sin_phi, 1 - x)
            )
            p, pdf = self.values(gs, mei.wi, wo)
            # All channels with the same Dirac lobe share its samples.
            delta = dr.abs(g) == 1
            same = [dr.select(other == g, mi.Float(1), 0) for other in gs]
            share = sum(same) / n
            pdf = dr.select(pdf > 0, pdf, 1)
            weight = [dr.select(delta, s / share, q / pdf) for s, q in zip(same, p, strict=True)]
            pdf = dr.select(delta, DELTA_DENSITY, pdf)
            return wo, self.spectrum(weight) & active, dr.select(active, pdf, 0)

        def spectrum(self, values):
            """Return the values of the channels as what integrators multiply by."""
            return mi.depolarizer(mi.UnpolarizedSpectrum(values))

        def to_string(self):
            return f"HenyeyGreensteinRGB[g={self.g}]"

    return HenyeyGreensteinRGB
