"""Reading the values of one keyword line: counting, typing and range checks."""

import re

from relume.translator.diagnostics import Problem
from relume.translator.expressions import ExpressionError, clip, evaluate
from relume.translator.keywords import TEXTS
from relume.translator.outcomes import make_note

MAX_NUMBER = 1e30
"""Largest absolute value of a number: beyond it single precision fails."""

LONGEST_MESSAGE = 900
"""Longest text of a problem, which may quote the file."""

_LEADING_NUMBERS = re.compile(r"\s*([+-]?[0-9]{1,300}(?:\.[0-9]*)?)")


class ValueReader:
    """Turns text into typed values and collects what is wrong with it.

    Args:
        variables: names defined by `VAR`, filled while the file is read.
        environ: the environment variables that `%NAME%` may ask for.
    """

    def __init__(self, variables, environ):
        self.variables = variables
        self.environ = environ
        self.problems = []

    def error(self, line, column, message, kind):
        """Note a problem at a line and a column, both counted from 1."""
        self.problems.append(Problem(line, column, clip(message, LONGEST_MESSAGE), kind))

    def numbers(self, name, text, line, offset, counts):
        """Read expressions from `text`, which starts at column `offset` (from 0) of its line.

        Returns:
            (values with their columns from 1, notes), or None after noting a problem: a malformed
            expression, or a count that is not among `counts`.
        """
        try:
            found, notes = evaluate(text, self.variables)
        except ExpressionError as error:
            self.error(line, offset + error.column + 1, f"{name}: {error}", error.kind)
            return None
        if len(found) not in counts:
            wanted = " or ".join(str(count) for count in counts)
            at = found[max(counts)][1] if len(found) > max(counts) else len(text.rstrip())
            self.error(
                line,
                offset + at + 1,
                f"{name} expects {wanted} value{'s' if counts != (1,) else ''}, found {len(found)}"
                + (f" in '{clip(text.strip())}'" if text.strip() else ""),
                "syntax",
            )
            return None
        for value, column in found:
            if abs(value) > MAX_NUMBER:
                message = f"{name} expects numbers up to {MAX_NUMBER:g}, found {value:g}"
                self.error(line, offset + column + 1, message, "range")
                return None
        return [(value, offset + column + 1) for value, column in found], notes

    def integers(self, name, text, line, offset, count):
        """As `numbers`, for words that the program scans as plain integers.

        Text after the last integer is dropped with a note, as the program does.
        """
        leading = []
        at = 0
        while len(leading) < count and (match := _LEADING_NUMBERS.match(text, at)):
            leading.append((float(match.group(1)), offset + match.start(1) + 1))
            at = match.end()
        try:
            found, notes = evaluate(text, self.variables)
        except ExpressionError:
            found, notes = [], []
        if len(found) == count:
            result = [(value, offset + column + 1) for value, column in found]
        elif len(leading) == count and (at == len(text) or text[at] in " \t"):
            result, notes = leading, [make_note("text-after-value", text=clip(text[at:].strip()))]
        else:
            return self.numbers(name, text, line, offset, (count,))
        for value, column in result:
            if value != int(value):
                self.error(line, column, f"{name} expects a whole number, found {value:g}", "value")
                return None
        return result, notes

    def in_range(self, row, values, line):
        """Whether all values lie in the row's range; a problem for the first that does not."""
        for value, column in values:
            if not row.contains(value):
                wanted = row.range_text() + (f" [{row.unit}]" if row.unit else "")
                self.error(line, column, f"{row.name} must be {wanted}, found {value:g}", "range")
                return False
        return True

    def typed(self, row, text, line, offset, name=None):
        """The value of a row from the text of its line.

        Returns:
            (value, notes), or None after noting a problem.
        """
        name = name or row.name
        if row.kind in TEXTS:
            return self.text(name, text, line, offset)
        if row.kind in ("integer", "flag"):
            read = self.integers(name, text, line, offset, row.arity)
        else:
            read = self.numbers(name, text, line, offset, (row.arity,))
        if read is None or not self.in_range(row, read[0], line):
            return None
        values = [value for value, _ in read[0]]
        if row.kind == "flag":
            values = [value != 0 for value in values]
        elif row.kind == "integer":
            values = [int(value) for value in values]
        return (values[0] if row.arity == 1 else tuple(values)), read[1]

    def text(self, name, text, line, offset):
        """A name that takes the rest of its line; trailing blanks are dropped."""
        value = text.strip(" \t")
        if not value:
            self.error(line, offset + 1, f"{name} expects a name, found nothing", "syntax")
            return None
        return value, []

    def environment_value(self, text, line, offset):
        """The value of `%NAME%`: a plain number from the environment, 0 if it is not set.

        Returns:
            (value, notes), or None after noting a problem.
        """
        name, closed, _ = text.strip()[1:].partition("%")
        if not closed or not name:
            self.error(line, offset + 1, f"expected '%NAME%', found '{clip(text)}'", "syntax")
            return None
        given = self.environ.get(name)
        if given is None:
            return 0.0, [make_note("variable-not-set", name=clip(name))]
        try:
            (value, _), *rest = evaluate(given)[0]
        except (ExpressionError, ValueError):
            rest = [None]
        if rest:
            message = f"environment variable {clip(name)} expects one number, found '{clip(given)}'"
            self.error(line, offset + 1, message, "value")
            return None
        return value, [make_note("value-from-variable", name=clip(name))]
