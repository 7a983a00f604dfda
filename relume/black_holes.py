"""What plugins and the translator know of black holes: formulas alone, without Mitsuba."""

from __future__ import annotations

import math

MOST_SPIN = 0.999999
"""Largest spin [M], of either sign: beyond, single precision knows no horizon."""


def innermost_orbit(spin: float) -> float:
    """Radius [M] of the innermost stable orbit that turns with the hole.

    Source: Bardeen, Press and Teukolsky 1972, equation 2.21.

    Args:
        spin: a of the hole [M], within -1 and 1.
    """
    a = abs(spin)
    z1 = 1 + (1 - a * a) ** (1 / 3) * ((1 + a) ** (1 / 3) + (1 - a) ** (1 / 3))
    z2 = math.sqrt(3 * a * a + z1 * z1)
    return 3 + z2 - math.sqrt((3 - z1) * (3 + z1 + 2 * z2))
