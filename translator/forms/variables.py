"""Variables that a scene file defines (spec section 2)."""

from __future__ import annotations

from typing import Any

from relume.translator.cursor import Cursor
from relume.translator.expressions import clip
from relume.translator.forms.base import Form
from relume.translator.forms.numbers import number_text
from relume.translator.keywords import Keyword


class Variables(Form):
    """A name beside the keyword and an expression below it; the first definition counts."""

    def read(self, row: Keyword, cursor: Cursor, word: str, target: Any) -> None:
        reports = [cursor.report(word)]
        beside = cursor.beside()
        name = beside.text.strip()
        if not (name.isascii() and name.isalnum() and name[0].isalpha()):
            message = f"{word} expects a name of letters and digits, found '{clip(beside.text)}'"
            cursor.error(beside.offset + 1, message)
            name = ""
        values = cursor.below(word, "an expression")
        reports.append(cursor.report(word))
        if values.text.startswith("%"):
            value = values.environment_number()
        else:
            (value,) = values.numbers(1)
        if not name:
            return
        for note in values.notes:
            reports[1].add(note)
        variables = getattr(target, row.field)
        if name in variables:
            for report in reports:
                report.becomes("variable-defined-already", name=name)
        else:
            variables[name] = value

    def lines(self, row: Keyword, value: dict[str, float]) -> list[str]:
        return [
            line for name, x in value.items() for line in (f"{row.name} {name}", number_text(x))
        ]

    def description(self, row: Keyword) -> str:
        return "name beside, expression below"


VARIABLES = Variables()
