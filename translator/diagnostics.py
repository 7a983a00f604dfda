"""What the translator tells the reader of a scene file: errors with a place, and line outcomes."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable
from dataclasses import dataclass, field

from relume.translator.outcome_rows import KINDS, Note
from relume.translator.outcomes import OUTCOMES, make_note

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

    def __init__(self, file: object, problems: Iterable[Problem]) -> None:
        self.file = str(file)
        self.problems = sorted(problems)
        super().__init__("\n".join(self.described()))

    def described(self) -> list[str]:
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
        outcome: one of `outcome_rows.KINDS`.
        notes: the reasons, or what the reader should know, in the order of the translation.
    """

    line: int
    keyword: str
    outcome: str = KINDS[0]
    notes: list[Note] = field(default_factory=list)

    @property
    def note(self) -> str:
        """All notes in one line of text."""
        return "; ".join(note.text for note in self.notes)

    @property
    def codes(self) -> tuple[str, ...]:
        """Codes of the notes, each once; `outcomes.OUTCOMES` explains them."""
        return tuple(dict.fromkeys(note.code for note in self.notes))

    def as_dict(self) -> dict[str, object]:
        """The report as JSON values."""
        place = {"line": self.line, "keyword": self.keyword, "outcome": self.outcome}
        return place | {"note": self.note, "codes": list(self.codes)}

    def becomes(self, code: str, /, **values: object) -> None:
        """Add the note of an outcome, and lower the line to its kind; it is never raised.

        Args:
            code: key of `outcomes.OUTCOMES`, of another kind than `translated`.
            values: for the placeholders of its note.

        Raises:
            KeyError: unknown code, or a value is missing.
            ValueError: the outcome is a remark.
        """
        self.add(make_note(code, remark=False, **values))

    def remark(self, code: str, /, **values: object) -> None:
        """As `becomes`, with an outcome of the kind `translated`, which lowers no line."""
        self.add(make_note(code, remark=True, **values))

    def add(self, note: Note) -> None:
        """Add a note that is made already; a second time it adds nothing."""
        self.outcome = max(self.outcome, OUTCOMES[note.code].kind, key=KINDS.index)
        if note not in self.notes:
            self.notes.append(note)


@functools.cache
def _field_names(owner: type) -> frozenset[str]:
    return frozenset(row.name for row in dataclasses.fields(owner))


@dataclass
class LineReports:
    """Where the fields of a document, an object or a block were set.

    Attributes:
        owner: the dataclass whose fields these are.
        also: names besides its fields that lines set.
        reports: for each field name the reports of the lines that set it last (keyword line and
            value lines), empty for an environment variable; for `""` those that open the block.
        all: reports of all lines of the block, in file order.
    """

    owner: type
    also: tuple[str, ...] = ()
    reports: dict[str, list[LineReport]] = field(default_factory=dict)
    all: list[LineReport] = field(default_factory=list)

    def becomes(self, name: str, code: str, /, **values: object) -> None:
        """Lower the lines that gave a field to an outcome; nothing if the file has none.

        Args:
            name: the field, or `""` for the lines that open the block.
            code: key of `outcomes.OUTCOMES`, of another kind than `translated`.
            values: for the placeholders of its note.

        Raises:
            KeyError: unknown field or code, or a value is missing.
            ValueError: the outcome is a remark.
        """
        self.add(name, make_note(code, remark=False, **values))

    def remark(self, name: str, code: str, /, **values: object) -> None:
        """Remark on the first line that gave a field; otherwise as `becomes`."""
        self.add(name, make_note(code, remark=True, **values))

    def add(self, name: str, note: Note) -> None:
        """Add a note that is made already: a remark to the first line, others to all lines."""
        remark = OUTCOMES[note.code].kind == KINDS[0]
        for report in self.of(name)[: 1 if remark else None]:
            report.add(note)

    def whole_becomes(self, code: str, /, **values: object) -> None:
        """Report an outcome at every line of the block."""
        for report in self.all:
            report.becomes(code, **values)

    def of(self, name: str) -> list[LineReport]:
        """Reports of the lines that gave the field `name`, empty where none did.

        Raises:
            KeyError: there is no such field.
        """
        self.check(name)
        return self.reports.get(name, [])

    def check(self, name: str) -> None:
        """Refuse what is no field of the owner."""
        if name and name not in self.also and name not in _field_names(self.owner):
            raise KeyError(f"{self.owner.__name__} has no field '{name}'")

    def is_set(self, name: str) -> bool:
        """Whether a line or an environment variable gives the field `name`."""
        self.check(name)
        return name in self.reports

    def line(self, name: str = "") -> int:
        """Number of the line that set the field `name`; of the block's first line if none did."""
        for reports in (self.of(name), self.of(""), self.all):
            if reports:
                return reports[0].line
        return 1
