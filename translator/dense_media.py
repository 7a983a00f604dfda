"""Media too dense to be simulated, with a note of where the limit lies.

Two things fail. A ray starts off its surface by `precision.offset`, so a walk into a medium begins
at that depth: with an albedo of 0.9, 3, 10 and 29 % of the light are lost where it is 0.06, 0.18
and 0.6 mean free paths. And roulette ends a twentieth of the paths at each scattering beyond DEPTH:
what longer walks carry is in too few samples to be seen. In a furnace of albedo 1 of 60 mean free
paths to its end, 84 % of the light are lost with DEPTH 200; of 100 and DEPTH 1000, 5 %.
"""

import numpy as np

from relume.translator import precision

DEPTH = 0.02
"""Mean free paths below the surface from which on a note tells where walks begin: a loss of 1 %."""

SURVIVED = 100
"""Scatterings beyond DEPTH that a path in 170 survives."""


def entered(block, medium, corners):
    """Note that walks begin too deep in an object, if they do.

    Args:
        block: `SceneObject`.
        medium: the `HomogeneousMedium` inside.
        corners: points of the object, or corners of its box, (N, 3), in world space.
    """
    # Where nothing is absorbed it does not matter where a walk begins.
    reduced = np.where(np.array(medium.sigma_a) > 0, medium.reduced, 0).max()
    depth = precision.offset(corners) * reduced
    if depth > DEPTH:
        text = f"single precision: rays start {depth:.2g} mean free paths below the surface"
        block.lines.becomes("", "approximated", f"{text}: too dark")


def least_half(points):
    """Half the shortest side of the box of points (N, 3)."""
    return float(np.ptp(points, axis=0).min()) / 2


def walks(document, source, field, medium, radius):
    """Note that most of the light is scattered too often to be followed, if it is.

    Args:
        document: the document, for its DEPTH.
        source: lines of the medium.
        field: field that the note goes to.
        medium: the `HomogeneousMedium`.
        radius: about how far it is to its end [scene unit].
    """
    thick = radius * np.array(medium.sigma_s)
    across = thick * (1 + radius * medium.reduced)
    absorbed = np.divide(medium.sigma_a, medium.sigma_t, out=np.ones(3), where=medium.sigma_t > 0)
    # A walk ends where it leaves or is absorbed, whichever comes first.
    count = np.minimum(across, 1 / np.maximum(absorbed, 1e-12)).max()
    if count > document.depth + SURVIVED:
        text = f"walks of about {count:.2g} scatterings, roulette ends those well beyond DEPTH"
        source.becomes(field, "approximated", f"{text}: too dark, or noisy")
