"""Parameters of plugins: read from a scene, and checked again whenever they change."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

Properties = Any
"""`mi.Properties`."""


@dataclass(frozen=True)
class Range:
    """Numbers from `least` to `most`, finite ones; `least` itself is not among them if `above`."""

    least: float = -math.inf
    most: float = math.inf
    above: bool = False

    def __contains__(self, value: float) -> bool:
        if not math.isfinite(value) or value > self.most:
            return False
        return value > self.least if self.above else value >= self.least

    def __str__(self) -> str:
        if self.most < math.inf:
            return f"{'above' if self.above else 'from'} {self.least:g} to {self.most:g}"
        if self.least > -math.inf:
            return f"above {self.least:g}" if self.above else f"{self.least:g} or more"
        return "finite"

    def check(self, name: str, *values: float) -> None:
        """Check numbers.

        Raises:
            ValueError: one is outside; `name` is that of the parameter.
        """
        for value in values:
            if value not in self:
                raise ValueError(f"{name} is {value}, but must be {self}")


ANY = Range()
NOT_NEGATIVE = Range(0.0)
POSITIVE = Range(0.0, above=True)


# ------------------------------ reading ------------------------------


def wrong_type(name: str, expected: str, value: object) -> ValueError:
    """The error of a parameter that is no number, or the like."""
    found = repr(value) if isinstance(value, str) else type(value).__name__
    return ValueError(f"{name} must be {expected}, not {found}")


def number(props: Properties, name: str, default: float | None, allowed: Range = ANY) -> float:
    """Read a number.

    Args:
        props: ``mi.Properties``.
        name: of the parameter.
        default: None if it is required.
        allowed: its range.

    Raises:
        ValueError: it is missing, no number, or outside its range.
    """
    if default is None and name not in props:
        raise ValueError(f"{name} is missing")
    value = props.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise wrong_type(name, "a number", value)
    allowed.check(name, value)
    return float(value)


def whole(props: Properties, name: str, default: int, allowed: Range) -> int:
    """Read a whole number; arguments and errors as `number`."""
    value = props.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise wrong_type(name, "a whole number", value)
    allowed.check(name, value)
    return value


def flag(props: Properties, name: str, default: bool) -> bool:
    """Read a boolean.

    Raises:
        ValueError: it is something else.
    """
    value = props.get(name, default)
    if not isinstance(value, bool):
        raise wrong_type(name, "true or false", value)
    return value


def text(props: Properties, name: str, default: str = "") -> str:
    """Read a string.

    Raises:
        ValueError: it is something else.
    """
    value = props.get(name, default)
    if not isinstance(value, str):
        raise wrong_type(name, "a string", value)
    return value


def choice(props: Properties, name: str, allowed: tuple[str, ...]) -> str:
    """Read a word, by default the first of `allowed`.

    Raises:
        ValueError: it is another word.
    """
    value = props.get(name, allowed[0])
    if value not in allowed:
        raise ValueError(f"{name} is {value!r}, but must be one of {', '.join(allowed)}")
    return value


def refractive_index(props: Properties, name: str, default: float) -> float:
    """Read a refractive index above 0, or the name of a material, as stock ``dielectric`` does.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(props.get(name, default), str):
        try:
            return mi.lookup_ior(props, name, default)
        except RuntimeError as error:
            raise ValueError(f"{name}: {str(error).rpartition('] ')[2]}") from None
    return number(props, name, default, POSITIVE)


def vector(
    props: Properties, name: str, default: Iterable[float], allowed: Range = ANY
) -> np.ndarray:
    """Read a point or vector: float64, shape (3,).

    Raises:
        ValueError: it is something else, or outside the range of its components.
    """
    value = props.get(name, mi.ScalarVector3d(*default))
    try:
        found = np.array(value, dtype=np.float64).reshape(3)
    except (TypeError, ValueError):
        raise wrong_type(name, "three numbers", value) from None
    allowed.check(name, *found)
    return found


# ------------------------------ checking ------------------------------


def plain(value: Any) -> float:
    """The number in a ``mi.Float`` of one lane."""
    return float(np.array(value).ravel()[0])


NUMBERS = ("value", "data")
"""Parameters of textures that hold what the texture gives."""

FEW = 64
"""Numbers that are sooner copied than reduced in a kernel."""


def numbers_of(value: Any) -> np.ndarray:
    """The smallest and the largest number in a Dr.Jit array, or in a texture as far as it tells.

    Textures in 8 bit hold numbers from 0 to 1, those for wavelengths no colours.
    """
    if isinstance(value, mi.Texture):
        found = [np.empty(0)]
        for name, (part, _) in children(value).items():
            if isinstance(part, mi.Texture) or (name in NUMBERS and not coefficients(value, part)):
                found.append(numbers_of(part))
        return np.concatenate(found)
    flat = value.array if dr.is_tensor_v(value) else dr.ravel(value) if dr.is_array_v(value) else 0
    if isinstance(flat, int):
        return np.array([value], float)
    if not dr.is_float_v(flat):
        return np.empty(0)
    flat = dr.detach(flat)
    if not dr.is_jit_v(flat) or dr.width(flat) <= FEW:
        return np.array(flat, float).ravel()
    least, most, finite = dr.min(flat), dr.max(flat), dr.all(dr.isfinite(flat))
    return np.array([least[0], most[0]] if finite[0] else [math.nan], float)


def coefficients(texture: Any, part: Any) -> bool:
    """Whether a texture holds coefficients of spectra: three or four numbers for a colour."""
    if not mi.is_spectral or texture.class_name() == "UniformSpectrum":
        return False
    return not dr.is_tensor_v(part) or part.shape[-1] > 1


def children(thing: Any) -> dict[str, tuple[Any, int]]:
    """What ``traverse`` shows of an object itself: values and ``mi.ParamFlags`` by name."""

    class Callback(mi.TraversalCallback):  # type: ignore[misc]
        def __init__(self) -> None:
            mi.TraversalCallback.__init__(self)
            self.found: dict[str, tuple[Any, int]] = {}

        def put(self, name: str, value: Any, flags: Any, cpptype: Any = None) -> None:
            if cpptype is not None:  # a value in C++
                value = mi.get_property(value, cpptype, thing)
            self.found[name] = value, int(flags)

    callback = Callback()
    thing.traverse(callback)
    return callback.found


def check(plugin: object, ranges: Mapping[str, Range], keys: Iterable[str] = ()) -> None:
    """Check the parameters of a plugin.

    Args:
        plugin: has an attribute for each parameter: a texture, a Dr.Jit array or a number.
        ranges: by name of the parameter.
        keys: names of those that have changed; none stands for all.

    Raises:
        ValueError: a number, or one of a texture, is outside its range.
    """
    changed = set(keys) or set(ranges)
    for name, allowed in ranges.items():
        if name in changed:
            allowed.check(name, *numbers_of(getattr(plugin, name)))


def expose(plugin: object, callback: Any, names: tuple[str, ...]) -> None:
    """Show attributes of a plugin to ``mi.traverse``, without gradients.

    Not in scalar variants, where they are plain numbers of Python, which nobody else can set.
    """
    if dr.is_jit_v(mi.Float):
        for name in names:
            callback.put(name, getattr(plugin, name), mi.ParamFlags.NonDifferentiable)
