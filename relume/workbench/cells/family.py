"""What a cell is: a scene of known mean radiance, for one method, at one value of what varies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from relume.options import RenderOptions
from relume.translator import Document


@dataclass(frozen=True)
class Case:
    """A scene with a known mean radiance.

    Attributes:
        scene: text in the scene language, a document, or a dictionary for `mi.load_dict` with a
            sensor and, if the method is an integrator, an `integrator` whose type it replaces.
        expected: mean radiance of the picture, one number or one for each channel.
        scale: radiance in units of which errors are given; by default that expected. It must be
            given where that is 0.
        files: what the scene names, by file name: linear pictures, (height, width, 3), and texts.
        spp: samples of a pixel in one run.
        variant: Mitsuba variant of a dictionary.
        options: how a text or a document is translated.
        forbidden: where the scene language forbids the input, what its refusal says; it is to be
            refused for that, and rendered by no means.
    """

    scene: str | Document | dict[str, Any]
    expected: float | Sequence[float]
    scale: float | None = None
    files: Mapping[str, np.ndarray | str] = field(default_factory=dict)
    spp: int = 64
    variant: str = "llvm_ad_rgb"
    options: RenderOptions = field(default_factory=RenderOptions)
    forbidden: str = ""


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
        why: derivation of why cells are not exact, where some are not.
    """

    name: str
    quantity: str
    answer: str
    make: Callable[[Any], Case]
    values: tuple[float | str, ...]
    methods: tuple[str, ...]
    why: str = ""


@dataclass(frozen=True)
class Cell:
    """One family at one value for one method."""

    family: Family
    value: float | str
    method: str

    @property
    def at(self) -> str:
        """The value as text."""
        return self.value if isinstance(self.value, str) else f"{self.value:g}"

    @property
    def name(self) -> str:
        """Unique name, such as `path/grey ball/0.001`."""
        return f"{self.method}/{self.family.name}/{self.at}"


def family(
    quantity: str, values: Sequence[float | str], *methods: str, why: str = ""
) -> Callable[[Callable[[Any], Case]], Family]:
    """Decorator that makes a `Family` of a function from a value to a `Case`.

    Its name and docstring are the family's name and the derivation of the answer; `why` is that of
    the family.
    """

    def made(make: Callable[[Any], Case]) -> Family:
        answer = " ".join((make.__doc__ or "").split())
        name = make.__name__.replace("_", " ")
        return Family(name, quantity, answer, make, tuple(values), methods, why)

    return made
