"""Refractive indices that depend on the wavelength, and the hero wavelength's protocol.

**Hero wavelength.** A dispersive refraction sends each of the wavelengths of a path in a direction
of its own. Only one of them, the hero, can follow the sampled direction; by the sampling of the
wavelengths each of the k of a path (``mi.Spectrum``) is as good as the others, so the hero's share
times k is an unbiased estimate of the sum (Wilkie et al., "Hero Wavelength Spectral Sampling",
2014, without the combination of techniques). The factor k is due once per path, which
a BSDF, knowing no path, cannot arrange. Therefore:

- A BSDF that disperses has `HERO_WAVELENGTH` among its flags, and so has any around it.
- An integrator that keeps track of it sets `HERO_WAVELENGTH` in ``BSDFContext.type_mask``. The
  BSDF then follows wavelength 0, returns 0 for the others, *without* the factor, and sets the same
  bit in ``BSDFSample3f.sampled_type``. The integrator multiplies by k at the first such event.
- For any other integrator the BSDF draws one of the k wavelengths at random at every dispersive
  refraction and returns k times its share: unbiased as well, yet a path of m refractions survives
  with probability k^(1-m) only, and the noise grows with m.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

HERO_WAVELENGTH = 1 << 24
"""Bit outside ``mi.BSDFFlags``: see the protocol above."""

SODIUM_D = 589.3
"""Wavelength [nm] whose index stands for all where colours are not wavelengths."""

VISIBLE = (360.0, 830.0)
"""Range [nm] in which an index has to be defined: what Mitsuba's spectral variants sample."""

DEFAULTS = {
    "cauchy6": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "sellmeier3": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "formula99": (1.4, 50.0, 230.0),
}
"""Number and default values of the coefficients of each formula."""


def index_squared(formula: str, coefficients: Sequence[Any], wavelength: Any) -> Any:
    """Return n^2 at `wavelength`; scalars, NumPy and Dr.Jit arrays alike.

    Args:
        formula: one of (manual, "Refractive index definition")
            ``cauchy6``: n^2 = a + b w^2 + c w^-2 + d w^-4 + e w^-6 + f w^-8,
            ``sellmeier3``: n^2 = 1 + a w^2/(w^2-b) + c w^2/(w^2-d) + e w^2/(w^2-f),
            ``formula99``: n = a + b/(wavelength - c).
        coefficients: a, b, ... as many as `DEFAULTS` has for the formula; w in micrometres,
            wavelength in nanometres.
        wavelength: nanometres.
    """
    if formula == "formula99":
        a, b, c = coefficients
        n = a + b / (wavelength - c)
        return n * n
    a, b, c, d, e, f = coefficients
    w2 = wavelength * wavelength * 1e-6
    if formula == "cauchy6":
        v2 = 1 / w2
        return a + b * w2 + v2 * (c + v2 * (d + v2 * (e + v2 * f)))
    return 1 + w2 * (a / (w2 - b) + c / (w2 - d) + e / (w2 - f))


def parse_coefficients(formula: str, text: str) -> tuple[float, ...]:
    """Return the coefficients of `formula` as a tuple of floats.

    Args:
        formula: a key of `DEFAULTS`.
        text: numbers separated by blanks or commas; those missing at the end keep their defaults.

    Raises:
        ValueError: unknown formula, too many or unreadable numbers, or an index that is not
            finite and positive everywhere in `VISIBLE`.
    """
    if formula not in DEFAULTS:
        raise ValueError(f"dispersion is {formula!r}, but must be one of {', '.join(DEFAULTS)}")
    given = tuple(float(word) for word in text.replace(",", " ").split())
    default = DEFAULTS[formula]
    if len(given) > len(default):
        raise ValueError(f"{formula} takes {len(default)} coefficients, not {len(given)}")
    coefficients = given + default[len(given) :]
    with np.errstate(divide="ignore", invalid="ignore"):
        n2 = index_squared(formula, coefficients, np.arange(VISIBLE[0], VISIBLE[1] + 1))
    if not np.all(np.isfinite(n2) & (n2 > 0)):
        raise ValueError(
            f"{formula} with coefficients {coefficients} gives no real index somewhere in "
            f"{VISIBLE[0]:.0f} to {VISIBLE[1]:.0f} nm (the coefficients are in micrometres, "
            "those of formula99 in nanometres)"
        )
    return coefficients
