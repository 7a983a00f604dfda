"""What `compare`, `chart` and `stability` have in common: scenes taken, options written down."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias

from relume.options import SAMPLERS, RenderOptions
from relume.translator import Document

Progress: TypeAlias = Callable[[int, int], Any]
"""Called with what is done and with all there is to do; True stops the measurement."""


SIDE = 160
"""Longest side of the picture, unless a size is given [pixel]: errors need no large pictures."""


def name_of(document: Document) -> str:
    """The name of a scene in reports: the path of its file."""
    return document.path or "document"


def notes(document: Document) -> list[str]:
    """What of a translated scene is not rendered as written: a list of sentences."""
    shown = ("unsupported", "approximated")
    lines = (line for line in document.lines.all if line.outcome in shown and line.note)
    return [f"line {x.line}, {x.keyword}: {x.outcome}: {x.note}" for x in lines]


def option_words(options: RenderOptions, *names: str) -> list[str]:
    """Words of a command line for some fields of options, unless they are None or usual."""
    words = []
    for name in names:
        value = getattr(options, name)
        if name == "size" and value is not None:
            value = "{}x{}".format(*value)
        if value is not None and (name, value) != ("sampler", SAMPLERS[0]):
            words += [f"--{name}", str(value)]
    for folder in options.asset_path:
        words += ["--asset-path", str(folder)]
    return words + (["--stand-ins"] if options.stand_ins else [])


def repeated(option: str, values: Iterable[str]) -> list[str]:
    """Words of a command line for an option that may be repeated."""
    return [word for value in values for word in (option, value)]


def reduced(image: Sequence[int]) -> tuple[int, int]:
    """A size with the shape of `image` and a longer side of at most `SIDE`."""
    scale = min(1.0, SIDE / max(image))
    width, height = (max(1, round(scale * side)) for side in image)
    return width, height


def refuse(options: RenderOptions, reasons: dict[str, str]) -> None:
    """Refuse options that a measurement does not take.

    Args:
        options: as they were given.
        reasons: by name of the field.

    Raises:
        ValueError: one of them is set.
    """
    for name, reason in reasons.items():
        if getattr(options, name) != getattr(RenderOptions(), name):
            raise ValueError(f"{name}: {reason}")
