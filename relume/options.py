"""How a scene is rendered where that is not as the scene says: one record for all entry points."""

from __future__ import annotations

import dataclasses
import difflib
import operator
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from relume.translator.dialects import DIALECTS
from relume.translator.document import MAX_PIXELS, MAX_SAMPLES, MAX_SIDE

Folder = str | os.PathLike[str]

SAMPLERS = ("owen", "independent")
"""Where the random numbers of samples come from, the default first."""


@dataclass(frozen=True)
class RenderOptions:
    """What to change of a scene's own settings.

    Attributes:
        size: (width, height) in pixels instead of the scene's: sides of 1 to `MAX_SIDE`, at most
            `MAX_PIXELS` pixels.
        spp: samples of a pixel instead of the scene's, 1 to `MAX_SAMPLES`.
        seed: non-negative integer; the same seed gives the same picture, bit for bit.
        integrator: plugin id of an integrator instead of the planned one, or `bdpt-merging`.
        variant: Mitsuba variant instead of the planned one.
        sampler: `owen` for numbers that are spread evenly in each pixel, `independent` for others.
            Metropolis renders and integrators that render by Mitsuba's own means have their own.
        dialect: `manual`, or `prender` to match an old picture.
        asset_path: folders in which files that the scene names are looked for, too; a single one
            becomes a tuple.
        stand_ins: whether something is shown in the place of missing pictures.

    Raises:
        ValueError: a value out of range.
        TypeError: a value of another type.
    """

    size: tuple[int, int] | None = None
    spp: int | None = None
    seed: int = 0
    integrator: str | None = None
    variant: str | None = None
    sampler: str = SAMPLERS[0]
    dialect: str = "manual"
    asset_path: Sequence[Folder] = ()
    stand_ins: bool = False

    def __post_init__(self) -> None:
        values = {
            "size": None if self.size is None else _size(self.size),
            "spp": None if self.spp is None else _whole("spp", self.spp, 1, MAX_SAMPLES),
            "seed": _whole("seed", self.seed, 0),
            "integrator": _name("integrator", self.integrator, "plugin id, such as 'volpath'"),
            "variant": _name("variant", self.variant, "Mitsuba variant, such as 'llvm_ad_rgb'"),
            "sampler": _one_of("sampler", self.sampler, SAMPLERS),
            "dialect": _one_of("dialect", self.dialect, DIALECTS),
            "asset_path": _folders(self.asset_path),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, options: RenderOptions | None = None, **changes: Any) -> RenderOptions:
        """`options`, or the defaults, with some fields changed.

        Args:
            options: the options to begin with; None for the defaults.
            changes: new values by field.

        Raises:
            TypeError: a change that is no field, or `options` are none.
            ValueError: a value out of range.
        """
        if not isinstance(options, cls | None):
            raise TypeError(
                f"options: expected RenderOptions, such as RenderOptions(spp=64), found {options!r}"
            )
        names = [field.name for field in dataclasses.fields(cls)]
        for name in changes.keys() - names:
            close = difflib.get_close_matches(name, names, n=1)
            hint = f"did you mean '{close[0]}'?" if close else f"options are {', '.join(names)}"
            raise TypeError(f"unknown option '{name}'; {hint}")
        return dataclasses.replace(options or cls(), **changes)


def _index(name: str, value: Any) -> int:
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name} {value!r}: expected a whole number") from None


def _whole(name: str, value: Any, low: int, high: int | None = None) -> int:
    """A whole number in a range, both ends included."""
    number = _index(name, value)
    if number < low or (high is not None and number > high):
        limits = f"{low} or more" if high is None else f"{low} to {high}"
        raise ValueError(f"{name} {number}: expected {limits}")
    return number


def _size(value: Any) -> tuple[int, int]:
    try:
        width, height = value
    except (TypeError, ValueError):
        raise TypeError(f"size {value!r}: expected (width, height), such as (640, 480)") from None
    width, height = _index("size", width), _index("size", height)
    sides = min(width, height) >= 1 and max(width, height) <= MAX_SIDE
    if not sides or width * height > MAX_PIXELS:
        limit = f"expected sides of 1 to {MAX_SIDE} and at most {MAX_PIXELS} pixels"
        raise ValueError(f"size {width}x{height}: {limit}")
    return width, height


def _name(name: str, value: Any, expected: str) -> str | None:
    if value is not None and not isinstance(value, str):
        raise TypeError(f"{name}: expected a {expected}, found {kind_of(value)}")
    return value


def _one_of(name: str, value: Any, known: Sequence[str]) -> str:
    if value not in known:
        raise ValueError(f"unknown {name} {value!r}, expected one of {', '.join(known)}")
    return value


def _folders(value: Any) -> tuple[Folder, ...]:
    if isinstance(value, str | os.PathLike):
        return (value,)
    try:
        folders = tuple(value)
    except TypeError:
        folders = (value,)
    for folder in folders:
        if not isinstance(folder, str | os.PathLike):
            raise TypeError(f"asset_path: expected folders, found {kind_of(folder)}")
    return folders


def kind_of(value: object) -> str:
    """The type of a value in words, for errors: `dict`, `mitsuba.Scene`."""
    return f"{type(value).__module__}.{type(value).__name__}".removeprefix("builtins.")
