"""Reading of `OBJECT` blocks: the shape line, its extra lines and the attributes."""

import dataclasses

from relume.translator.blocks import TRANSFORMS, Transform
from relume.translator.expressions import clip
from relume.translator.keyword_lines import assign, read_keyword
from relume.translator.keywords import by_word
from relume.translator.materials_table import MATERIALS
from relume.translator.objects import DISPERSION, REFLECTIONS, Reflection, SceneObject
from relume.translator.shapes import SHAPES

ATTRIBUTES = by_word(SceneObject)

REAL_BUT_IGNORED = {
    "direct_normal": "no-keyword",
    "texture_coef": "no-keyword",
    "coef": "no-attribute",
    "nromal": "misspelt-normal",
    "diskX": "undefined-shape",
}
"""Words of real files that look like keywords and are none (spec section 1.5), with the outcome."""

OLD_WARD = {2: (1.0, 1.0), 3: (1.0,)}
"""What the forms of older manuals leave out: rho_d and rho_s, or rho_d alone (section 8.5)."""


def read_object(cursor):
    """Read the block that the current line opens.

    Returns:
        A list with the `SceneObject`, or an empty one where the block holds no usable shape.
    """
    return _ObjectReader(cursor).read()


class _ObjectReader:
    def __init__(self, cursor):
        self.cursor = cursor
        self.object = SceneObject()
        self.lines = self.object.lines

    def read(self):
        cursor = self.cursor
        problems, first = len(cursor.values.problems), len(cursor.reports)
        self.lines.reports[""] = [cursor.report("OBJECT")]
        self.object.shape = self.shape()
        for _ in cursor.block_lines():
            self.attribute()
        self.lines.all = cursor.reports[first:]
        if self.object.shape is None:
            if len(cursor.values.problems) == problems:
                self.lines.whole_becomes("object-without-shape")
            return []
        return [self.object]

    # -- shape ---------------------------------------------------------------------------------

    def shape(self):
        cursor = self.cursor
        line = cursor.value_line("OBJECT", "a shape")
        if line is None:
            return None
        word, rest, offset = cursor.keyword_text()
        row = SHAPES.get(word)
        if row is None:
            return self.unknown_shape(word)
        report = cursor.report(word)
        if row.arity == 0:
            read = cursor.values.text(word, rest, cursor.number, offset)
            return read and row.build(read[0])
        read = cursor.values.numbers(word, rest, cursor.number, offset, (row.arity,))
        numbers = read and self.radii(row, read[0], report)
        vectors = self.edges() if row.vectors == ("U", "V") else self.normals(row)
        if not numbers or vectors is None:
            return None
        return row.build(tuple(numbers), *vectors)

    def unknown_shape(self, word):
        if word in REAL_BUT_IGNORED:
            self.cursor.report(word, REAL_BUT_IGNORED[word])
            return None
        close = self.cursor.nearest(word, SHAPES)
        hint = f"; did you mean '{close}'?" if close else f"; shapes are {', '.join(SHAPES)}"
        message = f"OBJECT expects a shape on its first line, found '{clip(word)}'{hint}"
        self.cursor.error(1, message, "keyword")
        return None

    def radii(self, row, values, report):
        """The numbers of a shape line; only the size of a radius counts, and it must not be 0."""
        numbers = [value for value, _ in values]
        for k in row.positive:
            if numbers[k] == 0:
                self.cursor.error(values[k][1], f"{row.name} expects a radius above 0", "range")
                return None
            if numbers[k] < 0:
                report.remark("negative-radius", given=numbers[k], read=-numbers[k])
                numbers[k] = -numbers[k]
        if row.name == "disk2" and not 0 <= numbers[4] < numbers[3]:
            wanted = f"disk2 expects an inner radius of 0 to below {numbers[3]:g}"
            self.cursor.error(values[4][1], f"{wanted}, found {numbers[4]:g}", "range")
            return None
        return numbers

    def vector(self, word):
        """Three numbers behind the word of the current line, or None after noting a problem."""
        _, rest, offset = self.cursor.keyword_text()
        report = self.cursor.report(clip(word))
        read = self.cursor.values.numbers(word, rest, self.cursor.number, offset, (3,))
        for note in read[1] if read else ():
            report.add(note)
        return read and tuple(value for value, _ in read[0])

    def edges(self):
        """The lines U and V, in either order; None where a line is neither.

        Those lines are left for the attributes: the object has no shape, as in the program.
        """
        edges = {}
        while len(edges) < 2:
            at, line = self.cursor.at, self.cursor.value_line("uvplane", "a line 'U x y z'")
            letter = line[0] if line else ""
            if line is None or letter not in ("U", "V") or letter in edges:
                self.cursor.at = at
                return None
            edges[letter] = self.vector(letter)
        return None if None in edges.values() else (edges["U"], edges["V"])

    def normals(self, row):
        """The line below a plane or disk: any word and a normal, as the program reads it."""
        vectors = []
        for name in row.vectors:
            line = self.cursor.value_line(row.name, f"a line '{name} x y z'")
            if line is None:
                return None
            word = self.cursor.keyword_text()[0]
            if word in ATTRIBUTES and word != name:
                message = f"{row.name} expects a line '{name} x y z' below it, found '{word}'"
                self.cursor.error(1, message)
                return None
            vectors.append(self.vector(word))
        return None if None in vectors else vectors

    # -- attributes ----------------------------------------------------------------------------

    def attribute(self):
        cursor = self.cursor
        word = cursor.keyword_text()[0]
        if cursor.line[0] in " \t":
            message = f"'{clip(cursor.line.strip())}': a keyword must start in the first column"
            cursor.error(1, message, "keyword")
        elif word == "reflection":
            self.reflection()
        elif word in TRANSFORMS:
            self.transform(word)
        elif word == "ward_brdf":
            self.ward(word)
        elif word.startswith("specul"):
            read_keyword(cursor, ATTRIBUTES["specular"], word, self.object, self.lines)
        elif word == "MATERIAL_SYMBOL":
            self.material_symbol(word)
        elif word in ATTRIBUTES:
            read_keyword(cursor, ATTRIBUTES[word], word, self.object, self.lines)
        elif word in REAL_BUT_IGNORED:
            cursor.report(word, REAL_BUT_IGNORED[word])
        else:
            cursor.unknown(word, {*ATTRIBUTES, *TRANSFORMS}, "attribute")

    def transform(self, word):
        value = self.vector(word)
        if value is not None:
            self.object.transforms.append(Transform(word, value))

    def ward(self, word):
        cursor, row = self.cursor, ATTRIBUTES[word]
        _, rest, offset = cursor.keyword_text()
        read = cursor.values.numbers(word, rest, cursor.number, offset, (4, 3, 2))
        if read is None or not cursor.values.in_range(row, read[0], cursor.number):
            return
        values = tuple(value for value, _ in read[0])
        for value, column in read[0][-2:]:
            if value == 0:
                cursor.error(column, "ward_brdf expects alpha_x and alpha_y above 0", "range")
                return
        report = cursor.report(word)
        if len(values) < 4:
            assumed = "rho_d 1, rho_s 1" if len(values) == 2 else "rho_d 1"
            report.remark("old-ward-form", count=len(values), assumed=assumed)
        values = (*OLD_WARD.get(len(values), ()), *values)
        assign(self.object, self.lines, row.field, values, [report])

    def material_symbol(self, word):
        before = self.object.material_symbol
        read_keyword(self.cursor, ATTRIBUTES[word], word, self.object, self.lines)
        name = self.object.material_symbol
        if name == before or name in MATERIALS:
            return
        close = self.cursor.nearest(name, MATERIALS)
        hint = f"; did you mean '{close}'?" if close else f"; it is none of {', '.join(MATERIALS)}"
        self.cursor.error(1, f"unknown material '{clip(name)}'{hint}", "value")
        self.object.material_symbol = before

    # -- reflection ----------------------------------------------------------------------------

    def reflection(self):
        cursor = self.cursor
        _, rest, offset = cursor.keyword_text()
        model = rest.strip()
        if model not in REFLECTIONS:
            close = cursor.nearest(model, REFLECTIONS)
            hint = (
                f"; did you mean '{close}'?" if close else f"; models are {', '.join(REFLECTIONS)}"
            )
            cursor.error(offset + 1, f"unknown reflection '{clip(model)}'{hint}", "keyword")
            return
        reports = [cursor.report("reflection")]
        coefficients = self.coefficients(model, reports)
        if coefficients is None:
            return
        before = self.object.reflection
        if model == "Subsurface_Scattering":
            self.object.reflection = dataclasses.replace(before, subsurface=True)
            self.lines.reports["subsurface"] = reports
            return
        kind = REFLECTIONS[model][0]
        # `reflection reflection` after a dispersive line or before it keeps the dispersion (8.7).
        value = Reflection(kind, False, DISPERSION.get(model), coefficients)
        assign(self.object, self.lines, "reflection", value, reports)
        self.lines.reports.pop("subsurface", None)
        if kind in ("diffuse", "specular"):
            self.object.roughness = 1.0 if kind == "diffuse" else 0.0
            for old in self.lines.reports.pop("roughness", ()):
                old.becomes("roughness-set-by-reflection", kind=kind, line=cursor.number)

    def coefficients(self, model, reports):
        """The six coefficients below `reflection1` and `reflection2`; missing ones are 0."""
        if DISPERSION.get(model) not in ("cauchy6", "sellmeier3"):
            return ()
        cursor = self.cursor
        line = cursor.value_line("reflection", "six coefficients")
        if line is None:
            return None
        offset = len(line) - len(line.lstrip(" \t"))
        counts = tuple(range(1, 7))
        read = cursor.values.numbers("reflection", line[offset:], cursor.number, offset, counts)
        if read is None:
            return None
        reports.append(cursor.report("reflection"))
        values = [value for value, _ in read[0]]
        if len(values) < 6:
            reports[-1].remark("missing-coefficients")
        return tuple(values + [0.0] * (6 - len(values)))
