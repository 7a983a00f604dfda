"""What a form of values does: the classes that all forms derive from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from relume.translator.cursor import Cursor
from relume.translator.diagnostics import LineReport
from relume.translator.expressions import clip
from relume.translator.keywords import ENVIRONMENT, NEXT_LINE, Keyword
from relume.translator.values import ValueReader


class Form(ABC):
    """A form that reads and prints lines of its own; most forms are a `LineForm`."""

    @abstractmethod
    def read(self, row: Keyword, cursor: Cursor, word: str, target: Any) -> None:
        """Read the keyword in the current line, set its field and report its lines.

        Args:
            row: the keyword's row.
            cursor: stands in the line of the keyword; left in the last line that belongs to it.
            word: the keyword as it is spelt in the file.
            target: document, object or block whose field is set.

        Raises:
            ValueProblem: what is wrong with the values.
        """

    @abstractmethod
    def lines(self, row: Keyword, value: Any) -> list[str]:
        """The lines of a scene file that read back as `value`.

        Raises:
            ValueError: no scene file can hold the value.
        """

    @abstractmethod
    def description(self, row: Keyword) -> str:
        """What stands where, for the table of keywords."""

    def default_text(self, row: Keyword) -> str:
        """The default as the table of keywords shows it; empty where there is none to show."""
        return ""

    def from_environment(self, row: Keyword, values: ValueReader, before: Any, index: int) -> Any:
        """The value of the field when an environment variable of the row is set.

        Args:
            row: the keyword's row.
            values: the text of the variable.
            before: the value of the field so far.
            index: which of the variables in `row.environment` it is.

        Raises:
            ValueProblem: what is wrong with the text.
        """
        raise TypeError(f"{type(self).__name__} takes no environment variables: {row.name}")


class LineForm(Form):
    """A form whose values stand on one line, beside the keyword or below it.

    Attributes:
        either_line: whether the values may stand beside and below, whatever the row says.
    """

    either_line = False

    @abstractmethod
    def value(self, row: Keyword, values: ValueReader) -> Any:
        """The value of the field from the text of its line, or of an environment variable.

        Raises:
            ValueProblem: what is wrong with the text.
        """

    @abstractmethod
    def text(self, value: Any) -> str:
        """The text of the line that reads back as `value`.

        Raises:
            ValueError: no scene file can hold the value.
        """

    @abstractmethod
    def noun(self, row: Keyword) -> str:
        """What the values are, such as `2 numbers`, for the table of keywords."""

    def lines_between(self, cursor: Cursor, word: str) -> list[LineReport]:
        """Step over lines between the keyword and its values; their reports."""
        return []

    def read(self, row: Keyword, cursor: Cursor, word: str, target: Any) -> None:
        values = cursor.beside()
        if row.place == NEXT_LINE and values.text and not self.either_line:
            found = f"found '{clip(values.text.rstrip())}' behind it"
            cursor.error(len(word) + 2, f"{word} takes its values on the next line, {found}")
            return
        reports = [cursor.described(word)]
        if word != row.name:
            reports[0].remark("other-spelling", name=row.name)
        reports += self.lines_between(cursor, word)
        if not values.text and (row.place == NEXT_LINE or self.either_line):
            values = cursor.below(word, "its value")
            reports.append(cursor.described(word))
        value = self.value(row, values)
        for note in values.notes:
            reports[0].add(note)
        cursor.reports += reports
        assign(target, row.field, value, reports)

    def lines(self, row: Keyword, value: Any) -> list[str]:
        text = self.text(value)
        if row.place != NEXT_LINE or self.either_line:
            return [f"{row.name} {text}"]
        # In the first column, `#` would make the line a comment.
        return [row.name, f" {text}" if text.startswith("#") else text]

    def description(self, row: Keyword) -> str:
        if self.either_line:
            return f"{self.noun(row)}, below or beside"
        noun = self.noun(row)
        return noun if row.place == ENVIRONMENT else f"{noun} {row.place}"

    def default_text(self, row: Keyword) -> str:
        return "" if row.default is None else self.text(row.default)

    def from_environment(self, row: Keyword, values: ValueReader, before: Any, index: int) -> Any:
        return self.value(row, values)


def assign(target: Any, field: str, value: Any, reports: list[LineReport]) -> None:
    """Set a field; the lines that set it before are reported as overridden."""
    setattr(target, field, value)
    for old in target.lines.reports.get(field, ()):
        old.becomes("set-again", line=reports[0].line)
    target.lines.reports[field] = reports
