"""The families of cells of `relume stability`, one file for each theme."""

from relume.workbench.cells import (
    beams,
    chains,
    domes,
    glass,
    glossy,
    lamps,
    sizes,
    surroundings,
    translucency,
    volumes,
    walks,
)

__all__ = [
    "beams",
    "chains",
    "domes",
    "glass",
    "glossy",
    "lamps",
    "sizes",
    "surroundings",
    "translucency",
    "volumes",
    "walks",
]
