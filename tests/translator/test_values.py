"""The text of one keyword's values: counts, columns, limits and remarks."""

import pytest

from relume.translator import values
from relume.translator.outcome_rows import Note
from relume.translator.values import MAX_GUESSES, FileContext, ValueProblem, ValueReader


def reader(text, **place):
    """A reader of the values of `WORD`, at line 7 from column 5 on unless told otherwise."""
    context = FileContext({"a": 3.0}, {"N": "2*2", "TEXT": "x"})
    return ValueReader(context, "WORD", text, **{"line": 7, "offset": 5, **place})


def problem(call, *args):
    """Line, column, message and kind of the error that a call raises."""
    with pytest.raises(ValueProblem) as caught:
        call(*args)
    found = caught.value.problem
    return found.line, found.column, found.message, found.kind


def test_numbers_and_their_columns():
    """Expressions with the names of `VAR`; columns are those of the line."""
    text = reader("1 a*2")
    assert text.numbers(1, 2) == (1, 6)
    assert text.columns == [6, 8]


@pytest.mark.parametrize(
    ("text", "counts", "column", "wanted"),
    [("1", (2,), 7, "expects 2 values, found 1 in '1'"), ("1 2 3", (1, 2), 10, "1 or 2 values"),
     ("", (1,), 6, "expects 1 value, found 0")],
)
def test_counts(text, counts, column, wanted):
    """At the first value too many, or at the end where one is missing."""
    line, found, message, kind = problem(reader(text).numbers, *counts)
    assert (line, found, kind) == (7, column, "syntax")
    assert wanted in message


def test_limits_of_numbers():
    """Beyond single precision."""
    assert problem(reader("1 2e30").numbers, 2)[1:] == (
        8, "WORD expects numbers up to 1e+30, found 2e+30", "range")


def test_an_environment_variable_has_no_place():
    """Line 0 and column 0, whatever the offset in its text."""
    assert problem(reader("1 )", line=0).expressions)[:2] == (0, 0)


def test_numbers_of_the_environment():
    """0 where the variable is not set, an error where it is no number; each with a remark."""
    text = reader("%N% rest")
    assert text.environment_number() == 4
    assert text.notes == [Note("value-from-variable", "from environment variable N")]
    text = reader("%M%")
    assert text.environment_number() == 0
    assert text.notes == [Note("variable-not-set", "environment variable M is not set: 0")]
    assert problem(reader("%TEXT%").environment_number)[3] == "value"
    assert problem(reader("%N").environment_number)[3] == "syntax"


def test_long_messages_are_cut(monkeypatch):
    """They may quote the file."""
    monkeypatch.setattr(values, "MAX_MESSAGE", 10)
    assert len(reader("").error("x" * 11).problem.message) == 10


def test_guesses_of_misspelt_words_are_counted():
    """A file of nothing but unknown words does not take minutes; case alone is always seen."""
    context = FileContext({}, {})
    assert context.nearest("colour", ["color"]) == "color"
    for _ in range(MAX_GUESSES):
        context.nearest("unlike", ["color"])
    assert context.nearest("colour", ["color"]) is None
    assert context.nearest("COLOR", ["color"]) == "color"
