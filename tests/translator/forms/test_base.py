"""A keyword with a new form of values is one class and one row: no other module knows a form."""

import ast
import importlib
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import relume.translator
from relume.translator.diagnostics import LineReports
from relume.translator.document import Document
from relume.translator.forms.base import Form, LineForm, assign
from relume.translator.keywords import BLOCK, below, beside, keyword
from relume.translator.parser import fill
from relume.translator.printer import print_document
from relume.translator.reference import keyword_table


class TimeOfDay(LineForm):
    """Hours and minutes, such as 6:30; in the document, minutes since midnight."""

    def value(self, row, values):
        hours, colon, minutes = values.text.strip().partition(":")
        if not (colon and hours.isdecimal() and minutes.isdecimal()):
            raise values.error(f"{values.name} expects a time such as 6:30, found '{values.text}'")
        total = 60 * int(hours) + int(minutes)
        values.check_range(row, [total])
        return total

    def text(self, value):
        return f"{value // 60}:{value % 60:02}"

    def noun(self, row):
        return "time"


class Legend(Form):
    """A block with a word and its meaning on each line."""

    def read(self, row, cursor, word, target):
        reports = [cursor.report(word)]
        legend = {}
        for _ in cursor.block_lines():
            entry = cursor.beside()
            legend[entry.name] = entry.name_text()
            reports.append(cursor.report(word))
        assign(target, row.field, legend, reports)

    def lines(self, row, value):
        return [row.name, *(f"{word} {meaning}" for word, meaning in value.items()), ""]

    def description(self, row):
        return "words with meanings"


@dataclass
class Almanac(Document):
    """A document with keywords of these forms."""

    sunrise: int = below(
        "SUNRISE", TimeOfDay(), 1, 360, "When the sun rises.",
        high=1439, aliases=("DAWN",), environment=("SUNRISE",),
    )
    sunset: int = beside("sunset", TimeOfDay(), 1, 1080, "When the sun sets.", in_manual=False)
    legend: dict[str, str] = keyword("LEGEND", BLOCK, Legend(), 0, {}, "What the words mean.")
    note: str = field(default="", compare=False)
    lines: LineReports = field(
        default_factory=lambda: LineReports(Almanac), compare=False, repr=False
    )


def read(text, environ=None):
    """The document and the problems of scene text."""
    document = Almanac()
    problems = fill(document, text.split("\n"), environ or {})
    return document, problems


TEXT = "SUNRISE\n6:30\nsunset 19:05\nLEGEND\nx first axis\ny second axis\n\nDEPTH\n3\n"


def test_it_is_parsed():
    """Below its keyword, beside it, and in a block; every line is reported at its field."""
    document, problems = read(TEXT)
    assert problems == []
    assert (document.sunrise, document.sunset, document.depth) == (390, 1145, 3)
    assert document.legend == {"x": "first axis", "y": "second axis"}
    lines = {name: [r.line for r in reports] for name, reports in document.lines.reports.items()}
    assert lines == {"sunrise": [1, 2], "sunset": [3], "legend": [4, 5, 6], "depth": [8, 9]}


def test_its_errors_have_a_place():
    """Those that the form raises, and those of its place and range; the other lines are read."""
    text = "SUNRISE\n half past\nsunset 1\nDAWN\n24:00\nSUNRISE 6:30\nSUNRSE\nDEPTH\n3\n"
    document, problems = read(text)
    found = [(p.line, p.column, p.kind) for p in problems]
    assert found == [
        (2, 2, "value"), (3, 8, "value"), (5, 1, "range"), (6, 9, "syntax"), (7, 1, "keyword")
    ]
    assert problems[2].message == "DAWN must be at most 1439, found 1440"
    assert document.depth == 3


def test_a_comment_disables_its_block():
    """As it does `CAMERA_MATRIX`: the row alone says that the keyword opens a block."""
    document, problems = read("#LEGEND\nx first axis\n\nDEPTH\n3\n")
    assert (problems, document.legend, document.depth) == ([], {}, 3)
    assert document.lines.all[0].note == "part of the LEGEND block disabled in line 1"


def test_it_is_printed():
    """The text reads back as an equal document; defaults are left out."""
    document, _ = read(TEXT)
    text = print_document(document)
    assert {"6:30", "sunset 19:05", "x first axis"} < set(text.split("\n"))
    assert read(text)[0] == document
    assert "SUNRISE" not in print_document(Almanac())


def test_it_is_documented():
    """In the table of keywords, with what stands where, range, default and variable."""
    table = keyword_table(Almanac).split("\n")
    assert [row for row in table if "SUN" in row.upper() or "LEGEND" in row] == [
        "| `SUNRISE`, also `DAWN` | time below | at most 1439 | 6:00 | `SUNRISE` | "
        "When the sun rises. |",
        "| `sunset` | time beside |  | 18:00 |  | When the sun sets. Not in the manual. |",
        "| `LEGEND` | words with meanings |  |  |  | What the words mean. |",
    ]


def test_it_is_taken_from_the_environment():
    """Over the value of the file, by the same rules."""
    document, problems = read(TEXT, {"SUNRISE": "7:15"})
    assert (document.sunrise, problems) == (435, [])
    assert document.lines.all[0].note == "overridden by the environment variable SUNRISE"
    document, (problem,) = read(TEXT, {"SUNRISE": "24:00"})
    assert document.sunrise == 390
    assert (problem.line, problem.column, problem.kind) == (0, 0, "range")
    assert problem.message == "environment variable SUNRISE must be at most 1439, found 1440"


def test_a_form_of_own_lines_takes_no_variable_unless_it_says_how():
    """A row that promises a variable for such a form is a mistake of the row."""

    @dataclass
    class Mistaken(Document):
        legend: dict[str, str] = keyword(
            "LEGEND", BLOCK, Legend(), 0, {}, "Words.", environment=("LEGEND",)
        )

    with pytest.raises(TypeError, match="Legend takes no environment variables: LEGEND"):
        fill(Mistaken(), [], {"LEGEND": "x"})


FOLDER = Path(relume.translator.__file__).parent


def forms_named_in(file):
    """The classes and instances of forms that a module imports, the base classes aside."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(
            "relume.translator.forms"
        ):
            module = importlib.import_module(node.module)
            for name in (alias.name for alias in node.names):
                value = getattr(module, name)
                own = isinstance(value, type) and issubclass(value, Form)
                if isinstance(value, Form) or (own and value not in (Form, LineForm)):
                    yield name


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.py")), ids=lambda file: file.name)
def test_only_rows_name_forms(file):
    """What a form does is asked of the row; its name stands in the tables of keywords alone."""
    found = set(forms_named_in(file))
    if file.stem in ("document", "objects", "gravity"):
        assert found
    else:
        assert found == set()
