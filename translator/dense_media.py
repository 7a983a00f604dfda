"""Media too dense to be simulated, with a note of where the limit lies.

Two things fail. A ray starts off its surface by `precision.ray_offset`, so a walk into a medium
begins at that depth: with an albedo of 0.9, 3, 10 and 29 % of the light are lost where it is 0.06,
0.18 and 0.6 mean free paths. And roulette ends a twentieth of the paths at each scattering beyond
DEPTH: what longer walks carry is in too few samples to be seen. In a furnace of albedo 1 of 60 mean
free paths to its end, 84 % of the light are lost with DEPTH 200; of 100 and DEPTH 1000, 5 %.
"""

from __future__ import annotations

import numpy as np

from relume.translator import precision
from relume.translator.diagnostics import LineReports
from relume.translator.media import HomogeneousMedium
from relume.translator.objects import SceneObject

DEPTH = 0.02
"""Mean free paths below the surface from which on a note tells where walks begin: a loss of 1 %."""

SURVIVED = 100
"""Scatterings beyond DEPTH that a path in 170 survives."""


def report_deep_starts(block: SceneObject, medium: HomogeneousMedium, corners: np.ndarray) -> None:
    """Report that walks begin too deep in an object, if they do.

    Args:
        block: the object.
        medium: the medium inside.
        corners: points of the object, or corners of its box, (N, 3), in world space.
    """
    # Where nothing is absorbed it does not matter where a walk begins.
    reduced = np.where(np.array(medium.sigma_a) > 0, medium.reduced, 0).max()
    depth = precision.ray_offset(corners) * reduced
    if depth > DEPTH:
        block.lines.becomes("", "walks-begin-deep", depth=depth)


def least_half(points: np.ndarray) -> float:
    """Half the shortest side of the box of points (N, 3)."""
    return float(np.ptp(points, axis=0).min()) / 2


def report_long_walks(
    lines: LineReports, field: str, medium: HomogeneousMedium, radius: float, depth: float
) -> None:
    """Report that most of the light is scattered too often to be followed, if it is.

    Args:
        lines: those of the document or object that has the medium.
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
