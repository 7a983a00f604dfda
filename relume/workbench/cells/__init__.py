"""Cells of `relume stability`: scenes with a known answer, at the inputs where methods may fail.

A cell is one row of a family at one value of what it varies, measured for one method. A family is a
function in a module of this package, one for each theme. To add cells write

    @family("radius [scene unit]", (1e-3, 1, 1e3), "path", "volpath")
    def grey_ball(radius: float) -> Case:
        \"""A ball of albedo 1/2 under a sky of radiance 1 has radiance 1/2 everywhere: no ray that
        leaves a convex body meets it again.\"""
        scene = text(ball("0 0 0", radius, "color 0.5 0.5 0.5"), camera=(0, 0, 3 * radius), ...)
        return Case(scene, 0.5)

in one of them (a new module is added to `THEMES`). The docstring is the derivation of the answer
and stands in the report. The function is called when a cell is measured, so it may take its time,
such as for a quadrature. Scenes are written in the scene language where it has the means, so that
the translation is measured, too (`scenes.py` helps), else they are dictionaries for `mi.load_dict`.
The methods are plugin ids: an integrator replaces that of the scene (and takes its depths), any
other is what the scene is about and is rendered as planned.
"""

from __future__ import annotations

from relume.workbench.cells import (
    beams,
    chains,
    converted,
    domes,
    glass,
    glossy,
    lamps,
    objects,
    refracted,
    seethrough,
    sizes,
    surroundings,
    translucency,
    volumes,
    walks,
)
from relume.workbench.cells.family import Case, Cell, Family

THEMES = (
    sizes,
    beams,
    chains,
    lamps,
    domes,
    glass,
    glossy,
    surroundings,
    translucency,
    objects,
    refracted,
    volumes,
    walks,
    seethrough,
    converted,
)
"""Modules of families, in the order of the report."""

FAMILIES = tuple(
    value for theme in THEMES for value in vars(theme).values() if isinstance(value, Family)
)

__all__ = ["FAMILIES", "THEMES", "Case", "Cell", "Family", "all_cells"]


def all_cells() -> list[Cell]:
    """Every `Cell`, by method in the order in which families name them."""
    methods = dict.fromkeys(method for family in FAMILIES for method in family.methods)
    return [
        Cell(family, value, method)
        for method in methods
        for family in FAMILIES
        if method in family.methods
        for value in family.values
    ]
