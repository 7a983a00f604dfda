"""What a line of a scene file can become: the form of a row in the table of outcomes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

KINDS = ("translated", "approximated", "ignored", "unsupported")
"""The kinds of outcomes, from best to worst."""


_FORMAT = re.compile(r"\{(\w+):[^}]*\}")


@dataclass(frozen=True)
class Outcome:
    """One row of the table of outcomes.

    Attributes:
        code: stable name, of small letters, digits and hyphens; `relume check --explain` takes it.
        kind: one of `KINDS`; a `translated` row is a remark that leaves its line translated.
        section: section of the scene language.
        note: what a report says in one line, with `{placeholders}` for the values of the scene.
        picture: what it means for the picture.
        advice: what the reader of the scene file can do.
        prender_note: the note in the dialect `prender`; empty where it is the same.
    """

    code: str
    kind: str
    section: str
    note: str
    picture: str
    advice: str
    prender_note: str = ""

    @property
    def pattern(self) -> str:
        """The note with the bare names of its values in braces, for readers."""
        return _FORMAT.sub("{\\1}", self.note)

    def text(self, values: Mapping[str, object]) -> str:
        """The note with its values; the value `dialect` chooses between two notes.

        Raises:
            KeyError: a value is missing.
        """
        chosen = self.prender_note if values.get("dialect") == "prender" else ""
        return (chosen or self.note).format(**values)


@dataclass(frozen=True)
class Note:
    """A note on a line: the code of its outcome, and the text with the values of the scene."""

    code: str
    text: str

    def at(self, place: str) -> Note:
        """The note with the place in another file that it is about."""
        return Note(self.code, f"{place}: {self.text}")

    def __str__(self) -> str:
        return self.text


def table(rows: Iterable[tuple[str, ...]]) -> dict[str, Outcome]:
    """Outcomes by code, from rows of code, kind, section, note, picture and advice."""
    return {row[0]: Outcome(*row) for row in rows}
