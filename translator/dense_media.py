"""Media too dense to be simulated, with a note of where the limit lies.

Two things fail. `randomwalk` follows walks inside objects in coordinates of their own, but where
other faces are it knows as single precision does: with an albedo of 0.9 a sphere that is not alone
is 2 % too bright where coordinates are rounded to 0.06 mean free paths, and exact at 0.006. And in
a medium around all objects the roulette of `volpath` ends a twentieth of the paths at each
scattering beyond DEPTH: what longer walks carry is in too few samples to be seen. In a furnace of
albedo 1 of 60 mean free paths to its end, 84 % of the light are lost with DEPTH 200; of 100 and
DEPTH 1000, 5 %.
"""

from __future__ import annotations

import numpy as np

from relume.translator.diagnostics import LineReports
from relume.translator.media import HomogeneousMedium
from relume.translator.objects import SceneObject

ROUNDING = 2.0**-24
"""Largest error of a coordinate in single precision, in units of it."""

UNSURE = 0.02
"""Mean free paths from which on a note tells that coordinates are rounded to them."""

SURVIVED = 100
"""Scatterings beyond DEPTH that a path in 170 survives."""


def report_rounding(block: SceneObject, medium: HomogeneousMedium, corners: np.ndarray) -> None:
    """Report that single precision does not tell where an object's surface is, if it does not.

    Args:
        block: the object.
        medium: the medium inside.
        corners: points of the object, or corners of its box, (N, 3), in world space.
    """
    # Where nothing is absorbed it does not matter where a walk ends.
    reduced = np.where(np.array(medium.sigma_a) > 0, medium.reduced, 0).max()
    error = ROUNDING * float(np.abs(corners).max()) * reduced
    if error > UNSURE:
        block.lines.becomes("", "surface-unsure", error=error)


def report_long_walks(
    lines: LineReports, field: str, medium: HomogeneousMedium, radius: float, depth: float
) -> None:
    """Report that most of the light is scattered too often to be followed, if it is.

    Args:
        lines: those of the document.
        field: field whose lines tell.
        medium: the medium.
        radius: about how far it is to its end [scene unit].
        depth: the scene's DEPTH.
    """
    thick = radius * np.array(medium.sigma_s)
    across = thick * (1 + radius * medium.reduced)
    absorbed = np.divide(medium.sigma_a, medium.sigma_t, out=np.ones(3), where=medium.sigma_t > 0)
    # A walk ends where it leaves or is absorbed, whichever comes first.
    count = np.minimum(across, 1 / np.maximum(absorbed, 1e-12)).max()
    if count > depth + SURVIVED:
        lines.becomes(field, "long-walks", count=count)
