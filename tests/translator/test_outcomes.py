"""The table of outcomes: the code of the translator uses its rows, and all of them."""

import ast
import re
import string
from pathlib import Path

import pytest

from relume.translator import outcomes_page
from relume.translator.dialects import DIFFERENCES
from relume.translator.line_outcomes import DOCUMENT_ROWS, OBJECT_ROWS
from relume.translator.outcome_rows import KINDS
from relume.translator.outcomes import OUTCOMES, explanation, find_outcome, make_note

ROOT = Path(__file__).parents[2]
FILES = [
    file
    for file in sorted((ROOT / "translator").rglob("*.py"))
    if not file.name.startswith("outcomes")
]
REPORTING = {
    "becomes",
    "remark",
    "whole_becomes",
    "report",
    "described",
    "make_note",
    "note",
    "note_faces",
}
"""Methods and functions that take a code."""

TABLES = (*DOCUMENT_ROWS, *OBJECT_ROWS)
"""Rows of fields, conditions and codes."""

NEVER_NOTED = {
    "alpha", "emission-units-glossy", "glass-colour", "polygon-corners", "screen", "sss-base",
    "sss-energy",
}  # fmt: skip
"""Rows of the dialects that no line's note names, or another code's."""


def calls():
    """Calls that report an outcome: place, method, code (an expression) and names of the values."""
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            called = node.func
            name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
            if name not in REPORTING:
                continue
            codes = [arg for arg in node.args if not is_place(arg, node, name)]
            values = {keyword.arg for keyword in node.keywords}
            values |= {"count"} if name == "note_faces" else set()  # which counts them itself
            yield f"{file.name}:{node.lineno}", name, codes, values


def is_place(arg, node, name):
    """Whether an argument says where a code is reported: a field, a line's word."""
    first = arg is node.args[0]
    if name in ("report", "described", "note_faces"):
        return first
    on_line = len(node.args) == 1
    return first and name in ("becomes", "remark") and not on_line


LITERAL = [
    (place, name, code.value, values)
    for place, name, codes, values in calls()
    for code in codes
    if isinstance(code, ast.Constant)
]


def test_calls_are_found():
    """The walk above sees the calls that the tests below judge."""
    assert len(LITERAL) > 100
    assert {name for _, name, _, _ in LITERAL} >= {"becomes", "remark", "make_note", "note"}


def placeholders(row):
    """Names of the values that a note needs."""
    found = string.Formatter().parse(row.note + row.prender_note)
    return {name for _, name, _, _ in found if name}


@pytest.mark.parametrize(("place", "name", "code", "values"), LITERAL)
def test_every_call_names_a_row_and_gives_its_values(place, name, code, values):
    """The code is known, its kind fits the verb, and its placeholders are just what is given."""
    row = find_outcome(code)
    if name != "make_note":
        assert name != "remark" or row.kind == "translated"
        assert name not in ("becomes", "whole_becomes") or row.kind != "translated"
    assert values - {"dialect"} == placeholders(row), place
    assert ("dialect" in values) or not row.prender_note, f"{place}: the dialects have two notes"


def test_other_codes_are_literals_close_by():
    """A code that is computed is one of the literals of its file, so that a search finds it."""
    computed = {
        ast.unparse(code)
        for _, _, codes, _ in calls()
        for code in codes
        if not isinstance(code, ast.Constant)
    }
    choices = r"'[a-z-]+' if .* else '[a-z-]+'|LOOKALIKES\[word\]|_REPAIRS\[kind\]"
    allowed = re.compile(rf"{choices}|code|scene\.\w+")
    assert {text for text in computed if not allowed.fullmatch(text)} == set()


def test_every_row_is_used():
    """A row that no code names is dead; those of the dialects may stand in the table alone."""
    files = [ast.parse(f.read_text(encoding="utf-8")) for f in FILES if f.name != "dialects.py"]
    words = {node.value for file in files for node in ast.walk(file) if is_code(node)}
    used = {code for _, _, code, _ in LITERAL} | {code for *_, code in TABLES}
    # What is computed is a literal elsewhere; only there a code may be taken for another word.
    assert set(OUTCOMES) - used - {word for word in words if "-" in word} == NEVER_NOTED


def is_code(node):
    """Whether a node may be a code that stands outside a call."""
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def test_the_tables_of_keywords_name_rows():
    """A misspelt code in a table would be found only by the scene that meets its condition."""
    assert {code for *_, code in TABLES} <= set(OUTCOMES)


@pytest.mark.parametrize("code", OUTCOMES)
def test_rows_are_whole(code):
    """Stable codes are lower case words; every row has a kind, a section, and says what to do."""
    row = OUTCOMES[code]
    assert re.fullmatch(r"[a-z]+(-[a-z0-9]+)*", code) and row.code == code
    assert row.kind in KINDS
    assert re.fullmatch(r"\d+(\.\d+)?", row.section)
    assert row.note and row.picture.endswith(".") and row.advice.endswith(".")


def test_rows_of_the_dialects_are_outcomes():
    """Their codes are their ids, and no other row has one of them."""
    assert set(DIFFERENCES) <= set(OUTCOMES)
    tables = [set(codes) for codes in outcomes_page.CHAPTERS.values()]
    assert sum(map(len, tables)) == len(OUTCOMES) == len(set.union(*tables))


def test_notes_need_their_values():
    """A value that is missing is an error, not a note with braces."""
    assert make_note("medium-ball", radius=2.0).text == "fills a ball of radius 2 around the scene"
    with pytest.raises(KeyError, match="radius"):
        make_note("medium-ball")


def test_unknown_codes_suggest_others():
    with pytest.raises(KeyError, match="did you mean 'lamp-not-shown'"):
        find_outcome("lamp-not-show")


def test_explanations_hold_the_note_and_what_to_do():
    """Values stand as bare names in braces, whatever their format."""
    text = explanation("medium-ball")
    assert "> fills a ball of radius {radius} around the scene\n" in text
    assert OUTCOMES["medium-ball"].picture in text and "section 10.1" in text
    assert "--dialect prender" in explanation("infinity-length")


def test_the_page_is_up_to_date():
    """docs/outcomes.md is what `python -m relume.translator.outcomes_page` prints."""
    page = (ROOT / "docs" / "outcomes.md").read_text(encoding="utf-8")
    assert page == outcomes_page.page()
    assert all(f"### `{code}`\n\n{explanation(code)}\n" in page for code in OUTCOMES)
