"""What the translator tells the reader of a scene file: errors with a place, and line outcomes."""

from dataclasses import dataclass, field

OUTCOMES = ("translated", "approximated", "ignored", "unsupported")
"""What can become of a line, from best to worst."""

ERROR_KINDS = {
    "syntax": "The line does not have the form that its keyword asks for.",
    "keyword": "A misspelt, indented or misplaced keyword.",
    "value": "The text is well formed but has no usable value.",
    "range": "A value outside the range of its keyword.",
    "asset": "A file that the scene names is missing or cannot be used.",
    "file": "The scene file itself cannot be read.",
    "scene": "The lines are fine one by one but make no scene together.",
}
"""Kinds of errors with the sentence that documents each."""


@dataclass(frozen=True, order=True)
class Problem:
    """One error in a scene file.

    Attributes:
        line: line number, from 1; 0 where the error belongs to no line (an environment variable).
        column: column, from 1; 0 where the whole line is meant, or no line.
        message: the offending text and what was expected.
        kind: one of `ERROR_KINDS`.
    """

    line: int
    column: int
    message: str
    kind: str


class SceneError(Exception):
    """Every error found in one scene file, in the order of its lines.

    Attributes:
        file: name of the scene file as given.
        problems: the errors, at least one.
    """

    def __init__(self, file, problems):
        self.file = str(file)
        self.problems = sorted(problems)
        super().__init__("\n".join(self.described()))

    def described(self):
        """The errors as `file:line:column: message` lines, without a line or column of 0."""
        places = [[str(n) for n in (p.line, p.column) if n] for p in self.problems]
        return [
            f"{':'.join([self.file, *place])}: {p.message}"
            for place, p in zip(places, self.problems, strict=True)
        ]


@dataclass
class LineReport:
    """What became of one line of a scene file.

    Attributes:
        line: line number, from 1.
        keyword: the keyword the line belongs to (for a value line, the keyword above it).
        outcome: one of `OUTCOMES`.
        note: the reason, or what the reader should know; may be empty.
    """

    line: int
    keyword: str
    outcome: str = "translated"
    note: str = ""

    def becomes(self, outcome, note):
        """Lower the outcome to `outcome` (never raise it) and add `note`."""
        if OUTCOMES.index(outcome) > OUTCOMES.index(self.outcome):
            self.outcome = outcome
        self.remark(note)

    def remark(self, note):
        """Add `note` without changing the outcome."""
        if note and note not in self.note:
            self.note = f"{self.note}; {note}" if self.note else note


@dataclass
class LineReports:
    """Where the fields of a document, an object or a block were set.

    Attributes:
        reports: for each field name the reports of the lines that set it last (keyword line and
            value lines); for `""` those that open the block.
        all: reports of all lines of the block, in file order.
    """

    reports: dict = field(default_factory=dict)
    all: list = field(default_factory=list)

    def becomes(self, name, outcome, note):
        """Set the outcome of the lines that gave the field `name`; nothing if the file has none."""
        for report in self.reports.get(name, ()):
            report.becomes(outcome, note)

    def remark(self, name, note):
        """Add a note to the lines that gave the field `name`."""
        for report in self.reports.get(name, ())[:1]:
            report.remark(note)

    def whole(self, outcome, note):
        """Set the outcome of every line of the block."""
        for report in self.all:
            report.becomes(outcome, note)

    def line(self, name=""):
        """Number of the line that set the field `name`; of the block's first line if none did."""
        for reports in (self.reports.get(name), self.reports.get(""), self.all):
            if reports:
                return reports[0].line
        return 1
