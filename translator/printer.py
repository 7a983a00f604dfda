"""Document to text: a scene file that reads back as an equal document.

Everything follows from the tables of keywords, each with its form, and of shapes.
"""

from __future__ import annotations

import functools
from dataclasses import astuple
from typing import Any

from relume.translator.document import Document
from relume.translator.forms.names import name_text
from relume.translator.forms.numbers import number_text
from relume.translator.forms.reflections import IMPLIED_ROUGHNESS
from relume.translator.forms.transforms import transform_lines
from relume.translator.gravity import BlackHole, WormHole
from relume.translator.keywords import ENVIRONMENT, rows
from relume.translator.objects import SceneObject, Shape
from relume.translator.shapes import SHAPES, MeshFile, ShapeKeyword


def print_document(document: Document) -> str:
    """The text of a scene file that says what a document says.

    Values that are the default are left out. `read_text` of the result gives an equal document,
    with two exceptions that the language leaves no words for: `suffix`, which comes from the
    environment alone, is not written, and a `roughness` of None in an object whose reflection is
    `diffuse` or `specular` reads back as the 1 or 0 that this line sets.

    Args:
        document: the `Document`; its values are those that a scene file may hold.

    Returns:
        The text, with LF line ends.

    Raises:
        ValueError: a value that no scene file can hold: a number that is not finite, a name that is
            empty, has line ends or blanks at its ends, a shape or reflection of no known kind.
    """
    blocks = [_keyword_lines(document, type(document)())]
    blocks += [_object(block) for block in document.objects]
    blocks += [_gravity(block) for block in document.gravity]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines) + "\n"


def _keyword_lines(target: Any, silent: Any) -> list[str]:
    """Lines of all fields of `target` that differ from `silent`, a target of defaults."""
    lines = []
    for row in rows(type(target)):
        value = getattr(target, row.field)
        if row.place == ENVIRONMENT or value is None or value == getattr(silent, row.field):
            continue
        lines += row.form.lines(row, value)
    return lines


def _object(block: SceneObject) -> list[str]:
    lines = ["OBJECT", *_shape(block.shape)]
    implied = IMPLIED_ROUGHNESS.get(block.reflection.kind or "")
    lines += _keyword_lines(block, SceneObject(roughness=implied))
    return lines + transform_lines(block.transforms)


@functools.cache
def _shape_rows() -> dict[type, ShapeKeyword]:
    """The rows of the table of shapes by the class that each builds."""
    found = {}
    for row in SHAPES.values():
        numbers: Any = (1.0,) * row.arity if row.arity else "name"
        found[type(row.build(numbers, *[(1.0, 1.0, 1.0)] * len(row.vectors)))] = row
    return found


def _shape(shape: Shape | None) -> list[str]:
    """The shape line and those below it; a shape's fields hold its numbers in the file's order."""
    row = _shape_rows().get(type(shape))
    if shape is None or row is None:
        raise ValueError(f"no shape of the language is {shape!r}")
    if isinstance(shape, MeshFile):
        return [f"{row.name} {name_text(shape.file)}"]
    numbers = [
        x for value in astuple(shape) for x in (value if isinstance(value, tuple) else [value])
    ]
    lines = [f"{row.name} {number_text(numbers[: row.arity])}"]
    for k, vector in enumerate(row.vectors):
        first = row.arity + 3 * k
        lines.append(f"{vector} {number_text(numbers[first : first + 3])}")
    return lines


def _gravity(block: BlackHole | WormHole) -> list[str]:
    word = type(block).__name__.upper()
    position = block.position if isinstance(block, BlackHole) else None
    opening = word if position is None else f"{word} {number_text(position)}"
    return [opening, *_keyword_lines(block, type(block)())]
