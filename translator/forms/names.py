"""Names: of files, and of measured materials."""

from __future__ import annotations

from typing import Any

from relume.translator.cursor import Cursor
from relume.translator.expressions import clip
from relume.translator.forms.base import LineForm
from relume.translator.keywords import Keyword
from relume.translator.materials_table import MATERIALS
from relume.translator.values import ValueReader


class Name(LineForm):
    """A name, which takes the rest of its line and may hold blanks."""

    def value(self, row: Keyword, values: ValueReader) -> str:
        return values.name_text()

    def text(self, value: str) -> str:
        return name_text(value)

    def noun(self, row: Keyword) -> str:
        return "name"

    def default_text(self, row: Keyword) -> str:
        return f"`{row.default}`" if row.default else ""

    def from_environment(self, row: Keyword, values: ValueReader, before: Any, index: int) -> str:
        return values.text


class Names(Name):
    """Names, one on each line that has the keyword: a list, in the order of the file."""

    def read(self, row: Keyword, cursor: Cursor, word: str, target: Any) -> None:
        name = self.value(row, cursor.beside())
        report = cursor.report(word)
        getattr(target, row.field).append(name)
        target.lines.reports.setdefault(row.field, []).append(report)

    def lines(self, row: Keyword, value: Any) -> list[str]:
        return [f"{row.name} {self.text(name)}" for name in value]

    def noun(self, row: Keyword) -> str:
        return "name, on each of several lines"

    def default_text(self, row: Keyword) -> str:
        return ""


class MaterialName(Name):
    """The name of a measured material."""

    def value(self, row: Keyword, values: ValueReader) -> str:
        name = super().value(row, values)
        if name not in MATERIALS:
            close = values.context.nearest(name, MATERIALS)
            known = f"it is none of {', '.join(MATERIALS)}"
            hint = f"did you mean '{close}'?" if close else known
            raise values.error(f"unknown material '{clip(name)}'; {hint}")
        return name

    def noun(self, row: Keyword) -> str:
        return "name of a material"


def name_text(name: str) -> str:
    """A name as it stands in a file.

    Raises:
        ValueError: a name that no scene file can hold: empty, with line ends, or with blanks at its
            ends.
    """
    if not name or name != name.strip(" \t") or any(c in name for c in "\r\n\0"):
        raise ValueError(f"a scene file cannot hold the name {name!r}")
    return name


NAME = Name()
NAMES = Names()
MATERIAL_NAME = MaterialName()
