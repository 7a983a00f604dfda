"""Document to text: a scene file that reads back as an equal document.

Everything but a few special forms follows from the tables of keywords and of shapes.
"""

import functools
import math
from dataclasses import astuple

from relume.translator.document import Document
from relume.translator.keywords import ENVIRONMENT, NEXT_LINE, TEXTS, rows
from relume.translator.objects import DISPERSION, REFLECTIONS, Reflection, SceneObject
from relume.translator.shapes import SHAPES

IMPLIED_ROUGHNESS = {"diffuse": 1.0, "specular": 0.0}
"""What a `reflection` line sets `roughness` to (spec section 8.1)."""


def print_document(document):
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
    blocks = [_keyword_lines(document, Document())]
    blocks += [_object(block) for block in document.objects]
    blocks += [_gravity(block) for block in document.gravity]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines) + "\n"


def _keyword_lines(target, silent):
    """Lines of all fields of `target` that differ from `silent`, a target of defaults."""
    lines = []
    for row in rows(type(target)):
        value = getattr(target, row.field)
        if row.form == ENVIRONMENT or value is None or value == getattr(silent, row.field):
            continue
        lines += SPECIAL.get(row.kind, _plain)(row, value)
    return lines


def _plain(row, value):
    """A keyword with its values beside it or below it."""
    below = row.form == NEXT_LINE
    values = _name(value, below) if row.kind in TEXTS else _numbers(value)
    if not below:
        return [f"{row.name} {values}"]
    return [row.name, *["0"] * row.dummies, values]


def _beside(row, value):
    """A keyword of a form that may stand beside its values, whatever its usual form."""
    return [f"{row.name} {_numbers(value)}"]


def _variables(row, value):
    return [line for name, x in value.items() for line in (f"{row.name} {name}", _numbers(x))]


def _matrix(row, value):
    return [row.name, *_transforms(value), ""]


def _transforms(value):
    return [f"{t.kind} {_numbers(t.values)}" for t in value]


def _reflection(row, value):
    lines = []
    surface = Reflection(value.kind, False, value.dispersion, value.coefficients)
    if surface != Reflection():
        lines.append(f"{row.name} {_model(value)}")
        lines += [_numbers(value.coefficients)] if value.coefficients else []
    return lines + ([f"{row.name} Subsurface_Scattering"] if value.subsurface else [])


def _model(value):
    coefficients = 6 if value.dispersion in ("cauchy6", "sellmeier3") else 0
    for model, (kind, _) in REFLECTIONS.items():
        same = kind == value.kind and DISPERSION.get(model) == value.dispersion
        if same and len(value.coefficients) == coefficients:
            return model
    raise ValueError(f"no reflection of the language is {value}")


SPECIAL = {
    "phase": _beside,
    "ambient": _beside,
    "variable": _variables,
    "transforms": _matrix,
    "reflection": _reflection,
}
"""How the kinds of row are printed that are neither numbers nor names."""


def _object(block):
    lines = ["OBJECT", *_shape(block.shape)]
    implied = IMPLIED_ROUGHNESS.get(block.reflection.kind)
    lines += _keyword_lines(block, SceneObject(roughness=implied))
    return lines + _transforms(block.transforms)


@functools.cache
def _shape_rows():
    """The rows of the table of shapes by the class that each builds."""
    found = {}
    for row in SHAPES.values():
        numbers = (1.0, 1.0, 1.0, 1.0, 1.0)[: row.arity] if row.arity else "name"
        found[type(row.build(numbers, *[(1.0, 1.0, 1.0)] * len(row.vectors)))] = row
    return found


def _shape(shape):
    """The shape line and those below it; a shape's fields hold its numbers in the file's order."""
    row = _shape_rows().get(type(shape))
    if row is None:
        raise ValueError(f"no shape of the language is {shape!r}")
    if row.arity == 0:
        return [f"{row.name} {_name(shape.file)}"]
    numbers = [
        x for value in astuple(shape) for x in (value if isinstance(value, tuple) else [value])
    ]
    lines = [f"{row.name} {_numbers(numbers[: row.arity])}"]
    for k, vector in enumerate(row.vectors):
        at = row.arity + 3 * k
        lines.append(f"{vector} {_numbers(numbers[at : at + 3])}")
    return lines


def _gravity(block):
    word = type(block).__name__.upper()
    opening = word if block.position is None else f"{word} {_numbers(block.position)}"
    return [opening, *_keyword_lines(block, type(block)())]


def _numbers(values):
    """One number or several as they stand in a file: the shortest text of the very same value."""
    if isinstance(values, tuple | list):
        return " ".join(_numbers(value) for value in values)
    if not math.isfinite(values):
        raise ValueError(f"a scene file cannot hold the number {values}")
    return (
        repr(int(values))
        if isinstance(values, bool | int)
        else repr(float(values)).removesuffix(".0")
    )


def _name(text, below=False):
    """A name that takes the rest of a line; a `#` in the first column would make it a comment."""
    if not text or text != text.strip(" \t") or any(c in text for c in "\r\n\0"):
        raise ValueError(f"a scene file cannot hold the name {text!r}")
    return f" {text}" if below and text.startswith("#") else text
