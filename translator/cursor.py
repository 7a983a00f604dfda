"""The place in a scene file where the parser stands, and what it has said so far."""

import re
from difflib import get_close_matches

from relume.translator.diagnostics import LineReport
from relume.translator.expressions import clip
from relume.translator.values import ValueReader

_WORD = re.compile(r"[ \t]*([^ \t]*)[ \t]*")


MAX_GUESSES = 1000
"""How many unknown words of a file are compared with all keywords; it takes 0.2 ms each."""


class Cursor:
    """The lines of a file, the current one, and the reports and problems collected.

    Args:
        lines: lines without line ends.
        variables: names defined by `VAR`, filled while the file is read.
        reports: list that the line reports are added to.
        environ: environment variables that `%NAME%` may ask for.
    """

    def __init__(self, lines, variables, reports, environ):
        self.lines = lines
        self.at = 0
        self.values = ValueReader(variables, environ)
        self.reports = reports
        self.guesses = 0

    @property
    def line(self):
        """Text of the current line."""
        return self.lines[self.at]

    @property
    def number(self):
        """Number of the current line, from 1."""
        return self.at + 1

    def keyword_text(self):
        """Word of the current line, the text behind it, and the column of that text, from 0."""
        match = _WORD.match(self.line)
        return match[1], self.line[match.end() :], match.end()

    def block_lines(self):
        """Step through the lines of a block, up to an empty line; comments are passed over.

        A line that holds blanks alone does not end a block (spec section 1.3).
        """
        while self.at + 1 < len(self.lines) and self.lines[self.at + 1] != "":
            self.at += 1
            if self.line.strip() and not self.line.startswith("#"):
                yield self.line

    def value_line(self, word, what):
        """Step to the line with the values of the word in the current line; comments are skipped.

        Returns:
            The line, or None after noting a problem where there is none; the cursor then stays.
        """
        at = self.at + 1
        while at < len(self.lines) and self.lines[at].startswith("#"):
            at += 1
        if at >= len(self.lines) or not self.lines[at].strip(" \t"):
            found = "an empty line" if at < len(self.lines) else "the end of the file"
            self.error(len(word) + 1, f"{word} expects {what} on the next line, found {found}")
            return None
        self.at = at
        return self.line

    def described(self, word, code=None, /, **values):
        """A report of the current line, with the note of an outcome or as translated.

        Blanks at the end of a translated line, which stopped the program, are noted.
        """
        report = LineReport(self.number, word)
        if code is not None:
            report.becomes(code, **values)
        elif self.line.endswith((" ", "\t")):
            report.remark("trailing-blank")
        return report

    def report(self, word, code=None, /, **values):
        """Add a report of the current line and return it."""
        self.reports.append(self.described(word, code, **values))
        return self.reports[-1]

    def error(self, column, message, kind="syntax"):
        """Note a problem in the current line at a column, from 1."""
        self.values.error(self.number, column, message, kind)

    def nearest(self, word, words):
        """The known word that `word` is a misspelling of, or None."""
        folded = {known.casefold(): known for known in sorted(words)}
        if word.casefold() in folded:
            return folded[word.casefold()]
        self.guesses += 1
        if self.guesses > MAX_GUESSES or len(word) > 64:
            return None
        close = get_close_matches(word, sorted(words), n=1, cutoff=0.8)
        return close[0] if close else None

    def unknown(self, word, words, what):
        """A word that is none of `words`: an error if it is a misspelling of one, else skipped."""
        if close := self.nearest(word, words):
            self.error(1, f"'{clip(word)}' is no {what}; did you mean '{close}'?", "keyword")
        else:
            self.report(clip(word), "unknown-word", what=what)
