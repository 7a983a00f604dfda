"""The place in a scene file where the parser stands, and what it has said so far."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager

from relume.translator.diagnostics import LineReport, Problem
from relume.translator.expressions import clip
from relume.translator.values import FileContext, ValueProblem, ValueReader

_WORD = re.compile(r"[ \t]*([^ \t]*)[ \t]*")


class Cursor:
    """The lines of a file, the current one, and the reports and problems collected.

    Args:
        lines: lines without line ends.
        variables: names defined by `VAR`, filled while the file is read.
        reports: list that the line reports are added to.
        environ: environment variables that `%NAME%` may ask for.

    Attributes:
        index: index of the current line, from 0.
        context: what all lines share, with the problems found so far.
    """

    def __init__(
        self,
        lines: list[str],
        variables: dict[str, float],
        reports: list[LineReport],
        environ: Mapping[str, str],
    ) -> None:
        self.lines = lines
        self.index = 0
        self.context = FileContext(variables, environ)
        self.reports = reports

    @property
    def line(self) -> str:
        """Text of the current line."""
        return self.lines[self.index]

    @property
    def number(self) -> int:
        """Number of the current line, from 1."""
        return self.index + 1

    @property
    def word(self) -> str:
        """First word of the current line."""
        return self.beside().name

    def beside(self) -> ValueReader:
        """The text behind the first word of the current line."""
        match = _WORD.match(self.line)
        assert match is not None  # the pattern matches the empty text
        offset = match.end()
        return ValueReader(self.context, match[1], self.line[offset:], self.number, offset)

    def below(self, word: str, what: str) -> ValueReader:
        """Step to the next line as `value_line`; its text, without blanks before it."""
        line = self.value_line(word, what)
        offset = len(line) - len(line.lstrip(" \t"))
        return ValueReader(self.context, word, line[offset:], self.number, offset, below=True)

    def block_lines(self) -> Iterator[str]:
        """Step through the lines of a block, up to an empty line; comments are passed over.

        A line that holds blanks alone does not end a block (spec section 1.3).
        """
        while self.index + 1 < len(self.lines) and self.lines[self.index + 1] != "":
            self.index += 1
            if self.line.strip() and not self.line.startswith("#"):
                yield self.line

    def value_line(self, word: str, what: str) -> str:
        """Step to the line with the values of the word in the current line; comments are skipped.

        Args:
            word: the word.
            what: what is expected there, for the message.

        Raises:
            ValueProblem: there is no such line; the cursor stays.
        """
        index = self.index + 1
        while index < len(self.lines) and self.lines[index].startswith("#"):
            index += 1
        if index >= len(self.lines) or not self.lines[index].strip(" \t"):
            found = "an empty line" if index < len(self.lines) else "the end of the file"
            message = f"{word} expects {what} on the next line, found {found}"
            raise self.beside().error(message, "syntax", len(word) + 1)
        self.index = index
        return self.line

    def described(self, word: str, code: str | None = None, /, **values: object) -> LineReport:
        """A report of the current line, with the note of an outcome or as translated.

        Blanks at the end of a translated line, which stopped the program, are noted.
        """
        report = LineReport(self.number, word)
        if code is not None:
            report.becomes(code, **values)
        elif self.line.endswith((" ", "\t")):
            report.remark("trailing-blank")
        return report

    def report(self, word: str, code: str | None = None, /, **values: object) -> LineReport:
        """Add a report of the current line and return it."""
        self.reports.append(self.described(word, code, **values))
        return self.reports[-1]

    def error(self, column: int, message: str, kind: str = "syntax") -> None:
        """Note a problem in the current line at a column, from 1."""
        self.context.problems.append(self.beside().error(message, kind, column).problem)

    @contextmanager
    def noting_problems(self) -> Iterator[None]:
        """Note the `ValueProblem` that ends the block early, if one does."""
        try:
            yield
        except ValueProblem as error:
            self.context.problems.append(error.problem)

    @property
    def problems(self) -> list[Problem]:
        """The errors found so far."""
        return self.context.problems

    def nearest(self, word: str, words: Iterable[str]) -> str | None:
        """The known word that `word` is a misspelling of, or None."""
        return self.context.nearest(word, words)

    def unknown(self, word: str, words: Iterable[str], what: str) -> None:
        """A word that is none of `words`: an error if it is a misspelling of one, else skipped."""
        if close := self.nearest(word, words):
            self.error(1, f"'{clip(word)}' is no {what}; did you mean '{close}'?", "keyword")
        else:
            self.report(clip(word), "unknown-word", what=what)
