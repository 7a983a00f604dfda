r"""The phase function of Henyey and Greenstein, for one mean cosine g or one for each channel.

With :math:`\vartheta` the angle between the directions of travel before and after,

.. math:: p(\vartheta) = \frac{1 - g^2}{4 \pi (1 + g^2 - 2 g \cos\vartheta)^{3/2}}

All is computed from :math:`x = 1 - |\cos|` of the angle to the direction that g favours, straight
on or back, which keeps its digits where p is steep: with a = \|g\|,
:math:`1 + g^2 - 2 g \cos\vartheta = (1 - a)^2 + 2 a x`.

Source: L. G. Henyey and J. L. Greenstein, "Diffuse Radiation in the Galaxy", Astrophysical Journal
93, 1941, eq. 2; the inverse is that of the legacy manual, `PAHASE`, rearranged for x.
"""

from __future__ import annotations

from typing import Any

import drjit as dr

Values = Any
"""``mi.Float``, or ``mi.Spectrum`` with one value for each channel."""


def henyey_greenstein(g: Values, x: Values) -> Values:
    """Return the phase function [1/sr], 0 for the Dirac lobes of g = 1 and -1.

    Args:
        g: mean cosine, in [-1, 1].
        x: 1 - cosine of the angle to the direction that g favours, in [0, 2].
    """
    a = dr.abs(g)
    d2 = dr.fma(2 * a, x, dr.square(1 - a))
    smooth = a < 1
    d2 = dr.select(smooth, d2, 1)
    return dr.select(smooth, (1 - a) * (1 + a) * dr.inv_four_pi / (d2 * dr.sqrt(d2)), 0)


def sample_henyey_greenstein(g: Values, sample: Values) -> Values:
    r"""Draw x = 1 - cosine of the angle to the direction that g favours.

    With a = \|g\|, x = 2 xi (1 - a)^2 (1 + a - a xi) / (1 + a - 2 a xi)^2, exact where x is near 0.

    Args:
        g: mean cosine, in [-1, 1].
        sample: xi, a uniform variate.
    """
    a, xi = dr.abs(g), sample
    x = 2 * xi * dr.square(1 - a) * dr.fma(-a, xi, 1 + a)
    return x / dr.square(dr.maximum(dr.fma(-2 * a, xi, 1 + a), 1e-20))
