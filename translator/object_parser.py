"""Reading of `OBJECT` blocks: the shape line, its extra lines and the attributes."""

from __future__ import annotations

from relume.translator.cursor import Cursor
from relume.translator.diagnostics import LineReport
from relume.translator.expressions import clip
from relume.translator.forms.numbers import Triple
from relume.translator.forms.transforms import TRANSFORMS, Transform
from relume.translator.keywords import by_word
from relume.translator.objects import SceneObject, Shape
from relume.translator.shapes import SHAPES, ShapeKeyword
from relume.translator.values import ValueReader

ATTRIBUTES = by_word(SceneObject)

LOOKALIKES = {
    "direct_normal": "no-keyword",
    "texture_coef": "no-keyword",
    "coef": "no-attribute",
    "nromal": "misspelt-normal",
    "diskX": "undefined-shape",
}
"""Words of real files that look like keywords and are none (spec section 1.5), with the outcome."""


def read_object(cursor: Cursor) -> list[SceneObject]:
    """Read the block that the current line opens.

    Returns:
        A list with the `SceneObject`, or an empty one where the block holds no usable shape.
    """
    return _ObjectReader(cursor).read()


class _ObjectReader:
    def __init__(self, cursor: Cursor) -> None:
        self.cursor = cursor
        self.object = SceneObject()
        self.lines = self.object.lines

    def read(self) -> list[SceneObject]:
        cursor = self.cursor
        problems, first = len(cursor.problems), len(cursor.reports)
        self.lines.reports[""] = [cursor.report("OBJECT")]
        with cursor.noting_problems():
            self.object.shape = self.shape()
        for _ in cursor.block_lines():
            self.attribute()
        self.lines.all = cursor.reports[first:]
        if self.object.shape is None:
            if len(cursor.problems) == problems:
                self.lines.whole_becomes("object-without-shape")
            return []
        return [self.object]

    # -- shape ---------------------------------------------------------------------------------

    def shape(self) -> Shape | None:
        cursor = self.cursor
        cursor.value_line("OBJECT", "a shape")
        word, values = cursor.word, cursor.beside()
        row = SHAPES.get(word)
        if row is None:
            self.unknown_shape(word)
            return None
        report = cursor.report(word)
        if row.arity == 0:
            return row.build(values.name_text())
        numbers = vectors = None
        with cursor.noting_problems():
            numbers = self.numbers(row, values, report)
        with cursor.noting_problems():
            vectors = self.edges() if row.vectors == ("U", "V") else self.normals(row)
        if numbers is None or vectors is None:
            return None
        return row.build(numbers, *vectors)

    def unknown_shape(self, word: str) -> None:
        if word in LOOKALIKES:
            self.cursor.report(word, LOOKALIKES[word])
            return
        close = self.cursor.nearest(word, SHAPES)
        hint = f"; did you mean '{close}'?" if close else f"; shapes are {', '.join(SHAPES)}"
        message = f"OBJECT expects a shape on its first line, found '{clip(word)}'{hint}"
        self.cursor.error(1, message, "keyword")

    def numbers(
        self, row: ShapeKeyword, values: ValueReader, report: LineReport
    ) -> tuple[float, ...]:
        """The numbers of a shape line; only the size of a radius counts, and it must not be 0."""
        numbers = list(values.numbers(row.arity))
        for k in row.radii:
            if numbers[k] == 0:
                message = f"{row.name} expects a radius above 0"
                raise values.error(message, "range", values.columns[k])
            if numbers[k] < 0:
                report.remark("negative-radius", given=numbers[k], read=-numbers[k])
                numbers[k] = -numbers[k]
        if row.name == "disk2" and not 0 <= numbers[4] < numbers[3]:
            wanted = f"disk2 expects an inner radius of 0 to below {numbers[3]:g}"
            raise values.error(f"{wanted}, found {numbers[4]:g}", "range", values.columns[4])
        return tuple(numbers)

    def vector(self, word: str) -> Triple | None:
        """Three numbers behind the word of the current line, or None after noting a problem."""
        report = self.cursor.report(clip(word))
        values = self.cursor.beside()
        with self.cursor.noting_problems():
            x, y, z = values.numbers(3)
            for note in values.notes:
                report.add(note)
            return x, y, z
        return None

    def edges(self) -> list[Triple] | None:
        """The lines U and V, in either order; None where a line is neither.

        Those lines are left for the attributes: the object has no shape, as in the program.
        """
        cursor = self.cursor
        edges: dict[str, Triple | None] = {}
        while len(edges) < 2:
            index, line = cursor.index, cursor.value_line("uvplane", "a line 'U x y z'")
            letter = line[0]
            if letter not in ("U", "V") or letter in edges:
                cursor.index = index
                return None
            edges[letter] = self.vector(letter)
        u, v = edges["U"], edges["V"]
        return None if u is None or v is None else [u, v]

    def normals(self, row: ShapeKeyword) -> list[Triple] | None:
        """The line below a plane or disk: any word and a normal, as the program reads it."""
        vectors = []
        for name in row.vectors:
            self.cursor.value_line(row.name, f"a line '{name} x y z'")
            word = self.cursor.word
            if word in ATTRIBUTES and word != name:
                message = f"{row.name} expects a line '{name} x y z' below it, found '{word}'"
                self.cursor.error(1, message)
                return None
            vectors.append(self.vector(word))
        found = [vector for vector in vectors if vector is not None]
        return found if len(found) == len(vectors) else None

    # -- attributes ----------------------------------------------------------------------------

    def attribute(self) -> None:
        cursor = self.cursor
        word = cursor.word
        if cursor.line[0] in " \t":
            message = f"'{clip(cursor.line.strip())}': a keyword must start in the first column"
            cursor.error(1, message, "keyword")
        elif word in TRANSFORMS:
            self.transform(word)
        elif word.startswith("specul"):
            ATTRIBUTES["specular"].read(cursor, word, self.object)
        elif word in ATTRIBUTES:
            ATTRIBUTES[word].read(cursor, word, self.object)
        elif word in LOOKALIKES:
            cursor.report(word, LOOKALIKES[word])
        else:
            cursor.unknown(word, {*ATTRIBUTES, *TRANSFORMS}, "attribute")

    def transform(self, word: str) -> None:
        value = self.vector(word)
        if value is not None:
            self.object.transforms.append(Transform(word, value))
