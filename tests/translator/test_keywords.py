"""Rows of keywords: ranges, spellings, and the fields that they declare."""

from dataclasses import dataclass

import pytest

from relume.translator.forms.numbers import NUMBER
from relume.translator.keywords import NEXT_LINE, Keyword, below, beside, by_word, rows


@pytest.mark.parametrize(
    ("limits", "text", "inside", "outside"),
    [
        ({}, "", (-1e30, 1e30), ()),
        ({"low": 1}, "at least 1", (1, 2), (0.999,)),
        ({"high": 1}, "at most 1", (-5, 1), (1.001,)),
        ({"low": 0, "high": 180}, "0 to 180", (0, 180), (-1, 181)),
        ({"above": 0}, "above 0", (1e-9,), (0, -1)),
        ({"above": -1, "under": 1}, "above -1, below 1", (-0.999, 0.999), (-1, 1)),
        ({"above": 0, "high": 179.9}, "above 0, at most 179.9", (179.9,), (0, 180)),
    ],
)
def test_ranges(limits, text, inside, outside):
    """In words, and of values: both ends belong to the range, except that of `above`."""
    row = Keyword("x", NEXT_LINE, NUMBER, 1, 0.0, "", **limits)
    assert row.range_text() == text
    assert [row.contains(x) for x in (*inside, *outside)] == [True] * len(inside) + [
        False] * len(outside)


@dataclass
class Table:
    """Two keywords and a plain field."""

    first: float = below("FIRST", NUMBER, 1, 1.0, "One.", aliases=("ONE",))
    plain: int = 0
    second: float = beside("second", NUMBER, 1, 2.0, "Two.")


def test_the_fields_of_a_dataclass_are_its_table():
    """In their order, with their defaults and under each spelling."""
    assert [(row.name, row.place, row.field) for row in rows(Table)] == [
        ("FIRST", "below", "first"), ("second", "beside", "second")]
    assert {word: row.field for word, row in by_word(Table).items()} == {
        "FIRST": "first", "ONE": "first", "second": "second"}
    assert (Table().first, Table().second) == (1.0, 2.0)
