"""Reading the values of one keyword: counting, typing and range checks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING

from relume.translator.diagnostics import Problem
from relume.translator.expressions import ExpressionError, clip, evaluate
from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note

if TYPE_CHECKING:
    from relume.translator.keywords import Keyword

MAX_NUMBER = 1e30
"""Largest absolute value of a number: beyond it single precision fails."""

MAX_MESSAGE = 900
"""Longest message of a problem [characters]; it may quote the file."""

MAX_GUESSES = 1000
"""How many unknown words of a file are compared with all keywords; it takes 0.2 ms each."""

_LEADING_NUMBERS = re.compile(r"\s*([+-]?[0-9]{1,300}(?:\.[0-9]*)?)")


class ValueProblem(Exception):
    """Values that cannot be read: what is wrong, and where.

    Attributes:
        problem: the entry for the list of errors of the file.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.message)
        self.problem = problem


class FileContext:
    """What all lines of one scene file share while they are read.

    Args:
        variables: names defined by `VAR`, filled while the file is read.
        environ: the environment variables that `%NAME%` may ask for.

    Attributes:
        problems: the errors found so far.
        taken: the variables that `%NAME%` asked for, and whether they are set.
    """

    def __init__(self, variables: dict[str, float], environ: Mapping[str, str]) -> None:
        self.variables = variables
        self.environ = environ
        self.problems: list[Problem] = []
        self.taken: dict[str, bool] = {}
        self._guesses = 0

    def nearest(self, word: str, words: Iterable[str]) -> str | None:
        """The known word that `word` is a misspelling of, or None."""
        known = sorted(words)
        folded = {each.casefold(): each for each in known}
        if word.casefold() in folded:
            return folded[word.casefold()]
        self._guesses += 1
        if self._guesses > MAX_GUESSES or len(word) > 64:
            return None
        close = get_close_matches(word, known, n=1, cutoff=0.8)
        return close[0] if close else None


class ValueReader:
    """The text that holds the values of one keyword, and its place in the file.

    Args:
        context: what the lines of the file share.
        name: the keyword as it is spelt; messages open with it.
        text: the values.
        line: number of their line, from 1; 0 for the value of an environment variable.
        offset: column where `text` starts in its line, from 0.
        below: whether the values stand on the line below the keyword.

    Attributes:
        notes: remarks for the reader of the file, added while values are read.
        columns: where each of the values read last starts in its line, from 1.
    """

    def __init__(
        self,
        context: FileContext,
        name: str,
        text: str,
        line: int = 0,
        offset: int = 0,
        below: bool = False,
    ) -> None:
        self.context = context
        self.name = name
        self.text = text
        self.line = line
        self.offset = offset
        self.below = below
        self.notes: list[Note] = []
        self.columns: list[int] = []

    def error(self, message: str, kind: str = "value", column: int | None = None) -> ValueProblem:
        """An error to raise.

        Args:
            message: what was found and what was expected.
            kind: one of `ERROR_KINDS`.
            column: where, from 1; by default where the text starts.
        """
        place = (self.offset + 1 if column is None else column) if self.line else 0
        return ValueProblem(Problem(self.line, place, clip(message, MAX_MESSAGE), kind))

    def expressions(self) -> list[float]:
        """The values of all expressions in the text.

        Raises:
            ValueProblem: a malformed expression, or one without a finite value.
        """
        try:
            found, notes = evaluate(self.text, self.context.variables)
        except ExpressionError as error:
            column = self.offset + error.column + 1
            raise self.error(f"{self.name}: {error}", error.kind, column) from None
        self.notes += notes
        self.columns = [self.offset + column + 1 for _, column in found]
        return [value for value, _ in found]

    def numbers(self, *counts: int) -> tuple[float, ...]:
        """As many expressions as one of `counts` says.

        Raises:
            ValueProblem: a malformed expression, another count, or an absurdly large number.
        """
        values = self.expressions()
        if len(values) not in counts:
            wanted = " or ".join(str(count) for count in counts)
            end = self.offset + len(self.text.rstrip()) + 1
            raise self.error(
                f"{self.name} expects {wanted} value{'s' if counts != (1,) else ''}, "
                f"found {len(values)}"
                + (f" in '{clip(self.text.strip())}'" if self.text.strip() else ""),
                "syntax",
                self.columns[max(counts)] if len(values) > max(counts) else end,
            )
        for value, column in zip(values, self.columns, strict=True):
            if abs(value) > MAX_NUMBER:
                message = f"{self.name} expects numbers up to {MAX_NUMBER:g}, found {value:g}"
                raise self.error(message, "range", column)
        return tuple(values)

    def integers(self, count: int) -> tuple[float, ...]:
        """Whole numbers, for words that the original program scans as plain integers.

        Text after the last integer is dropped with a note, as the program does.

        Raises:
            ValueProblem: as `numbers`, or a number that is not whole.
        """
        values, columns, end = self._leading_numbers(count)
        try:
            found, notes = evaluate(self.text, self.context.variables)
        except ExpressionError:
            found, notes = [], []
        if len(found) == count:
            values = [value for value, _ in found]
            columns = [self.offset + column + 1 for _, column in found]
        elif len(values) == count and (end == len(self.text) or self.text[end] in " \t"):
            rest = clip(self.text[end:].strip())
            notes = [make_note("text-after-value", text=rest)] if rest else []
        else:
            return self.numbers(count)
        self.notes += notes
        self.columns = columns
        for value, column in zip(values, columns, strict=True):
            if value != int(value):
                message = f"{self.name} expects a whole number, found {value:g}"
                raise self.error(message, "value", column)
        return tuple(values)

    def _leading_numbers(self, count: int) -> tuple[list[float], list[int], int]:
        """At most `count` plain numbers at the start, their columns, and where they end."""
        values: list[float] = []
        columns: list[int] = []
        end = 0
        while len(values) < count and (match := _LEADING_NUMBERS.match(self.text, end)):
            values.append(float(match[1]))
            columns.append(self.offset + match.start(1) + 1)
            end = match.end()
        return values, columns, end

    def name_text(self) -> str:
        """A name, which takes the rest of the line; blanks behind it are dropped.

        Raises:
            ValueProblem: there is no name.
        """
        value = self.text.rstrip(" \t")
        if not value:
            raise self.error(f"{self.name} expects a name, found nothing", "syntax")
        return value

    def environment_number(self) -> float:
        """The value of `%NAME%`: a plain number from the environment, 0 if it is not set.

        Raises:
            ValueProblem: there is no name between signs of percent, or the variable is no number.
        """
        name, closed, _ = self.text.strip()[1:].partition("%")
        if not closed or not name:
            raise self.error(f"expected '%NAME%', found '{clip(self.text)}'", "syntax")
        given = self.context.environ.get(name)
        self.context.taken[clip(name)] = given is not None
        if given is None:
            self.notes.append(make_note("variable-not-set", name=clip(name)))
            return 0.0
        try:
            ((value, _),) = evaluate(given)[0]
        except ValueError:  # no expression, or not exactly one
            wanted = f"environment variable {clip(name)} expects one number"
            raise self.error(f"{wanted}, found '{clip(given)}'") from None
        self.notes.append(make_note("value-from-variable", name=clip(name)))
        return value

    def check_range(self, row: Keyword, numbers: Iterable[float]) -> None:
        """Check numbers made of the text.

        Raises:
            ValueProblem: for the first number that is out of the row's range, at its column if it
                is one of those read last.
        """
        for k, number in enumerate(numbers):
            if not row.contains(number):
                column = self.columns[k] if k < len(self.columns) else None
                wanted = row.range_text() + (f" [{row.unit}]" if row.unit else "")
                message = f"{self.name} must be {wanted}, found {number:g}"
                raise self.error(message, "range", column)
