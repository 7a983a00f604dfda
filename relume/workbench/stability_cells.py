"""Cells of `relume stability`: scenes with a known answer, at the inputs where methods may fail.

A cell is one row of a family at one value of what it varies, measured for one method. A family is a
function in a file of `relume/workbench/cells`, one file for each theme. To add cells write

    @family("radius [scene unit]", (1e-3, 1, 1e3), "path", "volpath")
    def grey_ball(radius):
        \"""A ball of albedo 1/2 under a sky of radiance 1 has radiance 1/2 everywhere: no ray that
        leaves a convex body meets it again.\"""
        scene = text(ball("0 0 0", radius, "color 0.5 0.5 0.5"), camera=(0, 0, 3 * radius), ...)
        return Case(scene, 0.5)

in one of them (a new file is named in `cells/__init__.py`). The docstring is the derivation of the
answer and stands in the report. The function is called when a cell is measured, so it may take
its time, such as for a quadrature. Scenes are written in the scene language where it has the means,
so that the translation is measured, too (`cells/scenes.py` helps), else they are dictionaries for
`mi.load_dict`. The methods are plugin ids: an integrator replaces that of the scene (and takes its
depths), any other is what the scene is about and is rendered as planned.
"""

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Case:
    """A scene with a known mean radiance.

    Attributes:
        scene: text in the scene language, or a dictionary for `mi.load_dict` with a sensor and, if
            the method is an integrator, an `integrator` whose type it replaces.
        expected: mean radiance of the picture, one number or one for each channel.
        scale: radiance in units of which errors are told; by default that expected. It must be
            given where that is 0.
        files: pictures that the scene names, by file name: linear, (height, width, 3).
        spp: samples of a pixel in one run.
        variant: Mitsuba variant of a dictionary.
    """

    scene: str | dict
    expected: float | tuple
    scale: float | None = None
    files: dict = field(default_factory=dict)
    spp: int = 64
    variant: str = "llvm_ad_rgb"


@dataclass(frozen=True)
class Family:
    """Cells that differ in one value.

    Attributes:
        name: what is shown, in words.
        quantity: what the values are, with the unit.
        answer: derivation of the known answer.
        make: function from a value to a `Case`.
        values: numbers or strings, in the order of the report.
        methods: plugin ids that the cells are measured for.
    """

    name: str
    quantity: str
    answer: str
    make: Callable
    values: tuple
    methods: tuple


@dataclass(frozen=True)
class Cell:
    """One family at one value for one method."""

    family: Family
    value: object
    method: str

    @property
    def at(self):
        """The value as text."""
        return self.value if isinstance(self.value, str) else f"{self.value:g}"

    @property
    def name(self):
        """Unique name, such as `path/grey ball/0.001`."""
        return f"{self.method}/{self.family.name}/{self.at}"


FAMILIES = []
"""All families, in the order of the report."""


def family(quantity, values, *methods):
    """Decorator that makes a function from a value to a `Case` a family; see above."""

    def register(make):
        answer = " ".join(make.__doc__.split())
        name = make.__name__.replace("_", " ")
        FAMILIES.append(Family(name, quantity, answer, make, tuple(values), methods))
        return make

    return register


def all_cells():
    """Every `Cell`, by method in the order in which families name them."""
    from relume.workbench import cells  # noqa: F401  registers the families

    methods = dict.fromkeys(method for row in FAMILIES for method in row.methods)
    return [
        Cell(row, value, method)
        for method in methods
        for row in FAMILIES
        if method in row.methods
        for value in row.values
    ]
