"""The reference page of the scene language, made from the tables that the parser reads.

::

    python -m relume.translator.reference > docs/keywords.md
"""

from relume.translator.blocks import TRANSFORMS, BlackHole, WormHole
from relume.translator.diagnostics import ERROR_KINDS
from relume.translator.dialects import DIFFERENCES
from relume.translator.document import Document
from relume.translator.environment_variables import ALIASES
from relume.translator.expressions import CONSTANTS, FUNCTIONS, FUNCTIONS2
from relume.translator.keywords import BLOCK, ENVIRONMENT, NEXT_LINE, TEXTS, rows
from relume.translator.materials_table import MATERIALS
from relume.translator.object_parser import REAL_BUT_IGNORED
from relume.translator.objects import REFLECTIONS, SceneObject
from relume.translator.outcomes import OUTCOMES
from relume.translator.shapes import SHAPES

FORMS = {
    NEXT_LINE: "below",
    "same line": "beside",
    BLOCK: "block",
    ENVIRONMENT: "none",
}
"""The forms of a keyword as the page calls them."""

VALUES = {
    "text": "name",
    "symbol": "name of a material",
    "phase": "1 number below or 3 beside",
    "ambient": "3 numbers, below or beside",
    "ward": "4 numbers",
    "reflection": "a word, see Reflections",
    "variable": "name beside, expression below",
    "transforms": "lines of a matrix",
}
"""The kinds of values that are no plain numbers."""

INTRODUCTION = f"""\
# The scene language

Made from the parser's tables by `python -m relume.translator.reference > docs/keywords.md`.

A keyword starts in the first column and is case sensitive. Its values stand **below** it, on the
next line, or **beside** it, behind a blank; a **block** takes all lines up to the next empty one.
A line that starts with `#` is a comment. Text is UTF-8 or cp932. A keyword that is given again
replaces the values given before, except `VAR`, where the first definition counts.

Numbers are expressions: `+ - * / % ^` with `-2^2` = 4, brackets, the constants
{", ".join(f"`{name}`" for name in CONSTANTS)}, names defined by `VAR`, and the functions
{", ".join(f"`{name}`" for name in (*FUNCTIONS, *FUNCTIONS2))}.
The trigonometric ones take radians, those with a `d` at either end degrees. A blank ends an
expression. `%NAME%` alone on the line below a keyword of one number stands for the environment
variable NAME, 0 if it is not set.

Environment variables replace what the file says, which replaces the default; their values are
expressions, too. {", ".join(f"`{a}` is another name of `{b}`" for a, b in ALIASES.items())}.
"""

HEADER = ("Keyword", "Values", "Range", "Default", "Environment", "Meaning")


def page():
    """The text of docs/keywords.md."""
    sections = [
        INTRODUCTION,
        "## Keywords of the scene\n",
        keyword_table(Document),
        "## Objects\n\n`OBJECT` opens a block: a shape first, then attributes in any order.\n",
        "### Shapes\n",
        shape_table(),
        "### Attributes\n",
        keyword_table(SceneObject),
        "### Reflections\n",
        word_table("Line", {f"reflection {word}": doc for word, (_, doc) in REFLECTIONS.items()}),
        "### Transforms\n\nApplied in the order of the lines, about the origin of the world; each "
        "takes three numbers.\nIn a `CAMERA_MATRIX`, rotations turn the viewing direction, `scale` "
        "has no effect.\n",
        word_table("Line", {f"{word} x y z": doc for word, doc in TRANSFORMS.items()}),
        "### Materials\n\nNames for `MATERIAL_SYMBOL`: "
        + ", ".join(f"`{name}`" for name in MATERIALS) + ".\n",
        "## Gravity\n\nOutside the manual: read and reported as unsupported. "
        "`BLACKHOLE` and `WORMHOLE` may be followed by a position.\n",
        "### `BLACKHOLE`\n",
        keyword_table(BlackHole, ""),
        "### `WORMHOLE`\n",
        keyword_table(WormHole, ""),
        "## Words that look like keywords\n",
        "Seen in real files, and ignored.\n",
        word_table("Word", {word: OUTCOMES[c].note for word, c in REAL_BUT_IGNORED.items()}),
        "## Manual and program\n\nWhere the manual and the original program differ. "
        "`--dialect prender` follows the program\nin the rows of kind *switch* alone; a defect of "
        "kind *never* is copied by neither dialect, and\n*same* is how both dialects read what the "
        "manual leaves open.\n",
        difference_table(),
        "## Kinds of errors\n",
        word_table("Kind", ERROR_KINDS),
    ]
    return "\n".join(sections)


def keyword_table(cls, outside=" Not in the manual."):
    """The rows of a dataclass; `outside` is added to the meaning of those the manual lacks."""
    return table(HEADER, [keyword_cells(row, outside) for row in rows(cls)])


def keyword_cells(row, outside):
    """The cells of one keyword."""
    names = f"`{row.name}`" if row.form != ENVIRONMENT else "(environment only)"
    if row.aliases:
        names += ", also " + ", ".join(f"`{alias}`" for alias in row.aliases)
    meaning = row.doc if row.in_manual else row.doc + outside
    if row.dummies:
        meaning += " A mean stands on the line between, which is read and not used."
    environment = ", ".join(f"`{name}`" for name in row.environment)
    return names, values(row), limits(row), default(row), environment, meaning


def values(row):
    """What a keyword takes and where."""
    if row.kind in VALUES:
        own_place = row.kind not in TEXTS and row.kind != "ward"
        return VALUES[row.kind] if own_place or row.form == ENVIRONMENT else (
            f"{VALUES[row.kind]} {FORMS[row.form]}")
    kind = {"number": "number", "integer": "whole number", "flag": "0 or 1"}[row.kind]
    count = kind if row.kind == "flag" else f"{row.arity} {kind}{'s' if row.arity > 1 else ''}"
    return f"{count} {FORMS[row.form]}"


def limits(row):
    """Range and unit."""
    unit = f"[{row.unit}]" if row.unit else ""
    return " ".join(part for part in (row.range_text(), unit) if part)


def default(row):
    """The default value as a file would say it."""
    value = row.default
    if row.kind in ("reflection", "transforms", "variable") or value is None or value == "":
        return ""
    if isinstance(value, tuple):
        return " ".join(f"{x:g}" for x in value)
    return f"`{value}`" if isinstance(value, str) else f"{value:g}"


def shape_table():
    """The shapes with the lines below them."""
    cells = []
    for row in SHAPES.values():
        below = ", ".join(f"`{name} x y z`" for name in row.vectors)
        cells.append((f"`{row.name}`", row.units, below, row.doc))
    return table(("Shape", "Values beside it", "Lines below it", "Meaning"), cells)


def difference_table():
    """The table of dialects."""
    cells = [(f"`{row.id}`", row.manual, row.program, row.kind) for row in DIFFERENCES.values()]
    return table(("Id", "Manual", "Program", "Kind"), cells)


def word_table(header, words):
    """Words with a sentence each."""
    return table((header, "Meaning"), [(f"`{word}`", text) for word, text in words.items()])


def table(header, cells):
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *cells]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    print(page(), end="")
