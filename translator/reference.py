"""The reference page of the scene language, made from the tables that the parser reads.

::

    python -m relume.translator.reference > docs/keywords.md
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from relume.translator.diagnostics import ERROR_KINDS
from relume.translator.dialects import DIFFERENCES
from relume.translator.document import Document
from relume.translator.environment_variables import ALIASES
from relume.translator.expressions import BINARY_FUNCTIONS, CONSTANTS, FUNCTIONS
from relume.translator.forms.reflections import REFLECTIONS
from relume.translator.forms.transforms import TRANSFORMS
from relume.translator.gravity import OF_THE_SCENE, BlackHole, WormHole
from relume.translator.keywords import ENVIRONMENT, Keyword, rows
from relume.translator.materials_table import MATERIALS
from relume.translator.object_parser import LOOKALIKES
from relume.translator.objects import SceneObject
from relume.translator.outcomes import OUTCOMES
from relume.translator.shapes import SHAPES

INTRODUCTION = f"""\
# The scene language

Made from the parser's tables by `python -m relume.translator.reference > docs/keywords.md`.

A keyword starts in the first column and is case sensitive. Its values stand **below** it, on the
next line, or **beside** it, behind a blank; a **block** takes all lines up to the next empty one.
A line that starts with `#` is a comment. Text is UTF-8 or cp932. A keyword that is given again
replaces the values given before, except `VAR`, where the first definition counts.

Numbers are expressions: `+ - * / % ^` with `-2^2` = 4, brackets, the constants
{", ".join(f"`{name}`" for name in CONSTANTS)}, names defined by `VAR`, and the functions
{", ".join(f"`{name}`" for name in (*FUNCTIONS, *BINARY_FUNCTIONS))}.
The trigonometric ones take radians, those with a `d` at either end degrees. A blank ends an
expression. `%NAME%` alone on the line below a keyword of one number stands for the environment
variable NAME, 0 if it is not set.

Environment variables replace what the file says, which replaces the default; their values are
expressions, too. {", ".join(f"`{a}` is another name of `{b}`" for a, b in ALIASES.items())}.
"""

HEADER = ("Keyword", "Values", "Range", "Default", "Environment", "Meaning")


def page() -> str:
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
        "## Gravity\n\nOutside the manual: blocks that bend space. A scene has one hole, the last "
        "`WORMHOLE`, else the last\n`BLACKHOLE`, whose mass is 1 scene unit: its horizon has the "
        "radius 2 where it does not spin.\n",
        "### `BLACKHOLE`\n\nMay be followed by the position of its centre. "
        + ", ".join(f"`{word}`" for word in OF_THE_SCENE)
        + " may stand in the block,\ntoo; they are the keywords of the scene.\n",
        keyword_table(BlackHole, ""),
        "### `WORMHOLE`\n",
        keyword_table(WormHole, ""),
        "## Words that look like keywords\n",
        "Seen in real files, and ignored.\n",
        word_table("Word", {word: OUTCOMES[code].note for word, code in LOOKALIKES.items()}),
        "## Manual and program\n\nWhere the manual and the original program differ. "
        "`--dialect prender` follows the program\nin the rows of kind *switch* alone; a defect of "
        "kind *never* is copied by neither dialect, and\n*same* is how both dialects read what the "
        "manual leaves open.\n",
        difference_table(),
        "## Kinds of errors\n",
        word_table("Kind", ERROR_KINDS),
    ]
    return "\n".join(sections)


def keyword_table(cls: type, outside: str = " Not in the manual.") -> str:
    """The rows of a dataclass; `outside` is added to the meaning of those the manual lacks."""
    return table(HEADER, [keyword_cells(row, outside) for row in rows(cls)])


def keyword_cells(row: Keyword, outside: str) -> tuple[str, ...]:
    """The cells of one keyword."""
    names = f"`{row.name}`" if row.place != ENVIRONMENT else "(environment only)"
    if row.aliases:
        names += ", also " + ", ".join(f"`{alias}`" for alias in row.aliases)
    meaning = row.doc if row.in_manual else row.doc + outside
    environment = ", ".join(f"`{name}`" for name in row.environment)
    values, default = row.form.description(row), row.form.default_text(row)
    return names, values, limits(row), default, environment, meaning


def limits(row: Keyword) -> str:
    """Range and unit."""
    unit = f"[{row.unit}]" if row.unit else ""
    return " ".join(part for part in (row.range_text(), unit) if part)


def shape_table() -> str:
    """The shapes with the lines below them."""
    cells = []
    for row in SHAPES.values():
        below = ", ".join(f"`{name} x y z`" for name in row.vectors)
        cells.append((f"`{row.name}`", row.numbers, below, row.doc))
    return table(("Shape", "Values beside it", "Lines below it", "Meaning"), cells)


def difference_table() -> str:
    """The table of dialects."""
    cells = [(f"`{row.id}`", row.manual, row.program, row.kind) for row in DIFFERENCES.values()]
    return table(("Id", "Manual", "Program", "Kind"), cells)


def word_table(header: str, words: dict[str, str]) -> str:
    """Words with a sentence each."""
    return table((header, "Meaning"), [(f"`{word}`", text) for word, text in words.items()])


def table(header: Sequence[str], cells: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *cells]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    print(page(), end="")
