"""Scattering and absorption coefficients of a medium (spec sections 10.1 and 10.2)."""

from __future__ import annotations

from relume.translator.cursor import Cursor
from relume.translator.diagnostics import LineReport
from relume.translator.forms.numbers import Number, Triple
from relume.translator.keywords import Keyword

UNUSED_MEAN = "A mean stands on the line between, which is read and not used."
"""Sentence for the table of keywords."""


class Coefficients(Number):
    """A mean on a line of its own, which is not used, and below it a number for each channel."""

    def lines_between(self, cursor: Cursor, word: str) -> list[LineReport]:
        cursor.value_line(word, "a mean and below it three values")
        return [cursor.described(word, "unused-mean")]

    def lines(self, row: Keyword, value: Triple) -> list[str]:
        return [row.name, "0", self.text(value)]


COEFFICIENTS = Coefficients()
