"""Numbers: expressions, whole numbers, and switches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from relume.translator.expressions import clip
from relume.translator.forms.base import LineForm
from relume.translator.keywords import Keyword
from relume.translator.values import ValueReader

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]


class Number(LineForm):
    """As many expressions as the row says; a float, or a tuple of them.

    One number on a line of its own may be `%NAME%`, the value of an environment variable. Several
    numbers are overridden by environment variables one by one.
    """

    noun_of_one = "number"
    whole = False

    def value(self, row: Keyword, values: ValueReader) -> Any:
        if row.arity == 1 and values.below and values.text.startswith("%"):
            numbers: tuple[float, ...] = (values.environment_number(),)
            values.check_range(row, numbers)
            return self.converted(numbers[0], values)
        numbers = self.numbers(row, values)
        values.check_range(row, numbers)
        converted = tuple(self.converted(number, values) for number in numbers)
        return converted[0] if row.arity == 1 else converted

    def numbers(self, row: Keyword, values: ValueReader) -> tuple[float, ...]:
        """The numbers in the text, before their range is checked."""
        return values.numbers(row.arity)

    def converted(self, number: float, values: ValueReader) -> float:
        """A number in the field's type."""
        return number

    def text(self, value: Any) -> str:
        return number_text(value)

    def noun(self, row: Keyword) -> str:
        return f"{row.arity} {self.noun_of_one}{'s' if row.arity > 1 else ''}"

    def from_environment(self, row: Keyword, values: ValueReader, before: Any, index: int) -> Any:
        found = values.expressions()
        if len(found) != 1 or (self.whole and found[0] != int(found[0])):
            wanted = f"{values.name} expects one {'whole number' if self.whole else 'number'}"
            raise values.error(f"{wanted}, found '{clip(values.text)}'")
        values.check_range(row, found)
        number = self.converted(found[0], values)
        return number if row.arity == 1 else (*before[:index], number, *before[index + 1 :])


class NumberOnEitherLine(Number):
    """Numbers that stand beside the keyword or below it: manual and program differ."""

    either_line = True


class Integer(Number):
    """Whole numbers; text behind them is dropped with a note, as in the original program."""

    noun_of_one = "whole number"
    whole = True

    def numbers(self, row: Keyword, values: ValueReader) -> tuple[float, ...]:
        return values.integers(row.arity)

    def converted(self, number: float, values: ValueReader) -> float:
        if number != int(number):
            message = f"{values.name} expects a whole number, found {number:g}"
            raise values.error(message)
        return int(number)


class Flag(Integer):
    """A switch: 0 is off, any other whole number on."""

    def converted(self, number: float, values: ValueReader) -> float:
        return number != 0

    def noun(self, row: Keyword) -> str:
        return "0 or 1"


def number_text(values: float | Sequence[float]) -> str:
    """One number or several as they stand in a file: the shortest text of the very same value.

    Raises:
        ValueError: a number that is not finite, which no scene file can hold.
    """
    if isinstance(values, tuple | list):
        return " ".join(number_text(value) for value in values)
    assert isinstance(values, bool | int | float)
    if not math.isfinite(values):
        raise ValueError(f"a scene file cannot hold the number {values}")
    return (
        repr(int(values))
        if isinstance(values, bool | int)
        else repr(float(values)).removesuffix(".0")
    )


NUMBER = Number()
NUMBER_ON_EITHER_LINE = NumberOnEitherLine()
INTEGER = Integer()
FLAG = Flag()
