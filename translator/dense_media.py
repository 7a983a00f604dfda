"""Media that stock integrators do not follow, with notes of what they cost and where limits lie.

`randomwalk` follows walks inside objects in coordinates of their own, but where other faces are it
knows as single precision does: with an albedo of 0.9 a sphere that is not alone is 2 % too bright
where coordinates are rounded to 0.06 mean free paths, and exact at 0.006.

In a medium around all objects the roulette of `volpath` ends a twentieth of the paths at each
scattering beyond DEPTH: what longer walks carry is in too few samples to be seen. In a furnace of
albedo 1 of 60 mean free paths to its end, 84 % of the light are lost with DEPTH 200; of 100 and
DEPTH 1000, 5 %. `randomwalk` takes these, and media with small lamps.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from relume.translator.diagnostics import LineReports
from relume.translator.media import HomogeneousMedium
from relume.translator.objects import SceneObject
from relume.translator.scene_values import Entry

ROUNDING = 2.0**-24
"""Largest error of a coordinate in single precision, in units of it."""

UNSURE = 0.02
"""Mean free paths from which on a note tells that coordinates are rounded to them."""

SURVIVED = 20
"""Scatterings beyond DEPTH that a third of the paths survive: at twice as many `volpath` is already
the worse of the two."""

SMALL = 0.01
"""Radius of a lamp, in units of that of the medium, up to which light near it is hard to find."""

SEEN = 0.1
"""Optical depth of scattering from which on it is to be seen."""

HAZY = 1.0
"""The same, reduced by g, from which on a spot is better found along flights: of what is thinner
only its cone is lit, and that is quickly found by `volpath`."""

STEPS = 2000.0
"""About the most steps of a walk that crosses in one what nothing is in."""


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
    """Report it, with what it costs, if most of the light is scattered more often than DEPTH.

    Args:
        lines: those of the document.
        field: field whose lines tell.
        medium: the medium.
        radius: about how far it is to its end [scene unit].
        depth: the scene's DEPTH.
    """
    count = scatterings(medium, radius)
    if count > depth + SURVIVED:
        steps = min(count, STEPS) if similar(medium) else count
        lines.becomes(field, "long-walks", count=count, steps=steps)


def scatterings(medium: HomogeneousMedium, radius: float) -> float:
    """About how often light is scattered before it is absorbed, or has left a medium.

    Args:
        medium: the medium.
        radius: about how far it is to its end [scene unit].
    """
    thick = radius * np.array(medium.sigma_s)
    across = thick * (1 + radius * medium.reduced)
    absorbed = np.divide(medium.sigma_a, medium.sigma_t, out=np.ones(3), where=medium.sigma_t > 0)
    return float(np.minimum(across, 1 / np.maximum(absorbed, 1e-12)).max())


def similar(medium: HomogeneousMedium) -> bool:
    """Whether `randomwalk` crosses in one step what nothing is in."""
    return not any(medium.g) or (not medium.chromatic and len(set(medium.g)) == 1)


def why_followed(
    medium: HomogeneousMedium | None, radius: float, depth: float, entries: Collection[Entry]
) -> str:
    """Why `randomwalk` is to render the medium around all objects; empty if it need not.

    Args:
        medium: that medium.
        radius: about how far it is to its end [scene unit].
        depth: the scene's DEPTH.
        entries: dictionaries of shapes and lamps.
    """
    if medium is None:
        return ""
    if scatterings(medium, radius) > depth + SURVIVED:
        return "walks longer than DEPTH"
    seen = radius * max(medium.sigma_s) > SEEN
    hazy = radius * np.multiply(medium.sigma_s, np.subtract(1, medium.g)).max() > HAZY
    balls = seen and any(is_small(e, radius) for e in entries)
    found = balls or (hazy and any(e["type"] == "falloffspot" for e in entries))
    return "small lamps in a medium" if found else ""


def is_small(entry: Entry, radius: float) -> bool:
    """Whether a dictionary is that of a ball of light which is small in a medium of some radius."""
    shines = entry["type"] == "sphere" and "emitter" in entry
    return bool(shines and entry["radius"] < SMALL * radius)
