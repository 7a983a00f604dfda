"""How a keyword of the scene language is declared: once, as a field of the document.

A field of the dataclasses in `document`, `objects` and `gravity` is made by `beside(...)`,
`below(...)` or `keyword(...)`. That row is all there is to a keyword: its form (see `forms`) reads,
prints and describes its values, and takes them from environment variables.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from relume.translator.cursor import Cursor
    from relume.translator.forms.base import Form

T = TypeVar("T")

NEXT_LINE = "below"
SAME_LINE = "beside"
BLOCK = "block"
ENVIRONMENT = "environment only"


@dataclass(frozen=True)
class Keyword:
    """One row of the table of keywords.

    Attributes:
        name: the word, case sensitive, in the first column of its line.
        place: `NEXT_LINE` (word alone, values below it), `SAME_LINE` (word, blank, values),
            `BLOCK` (word opens a block up to the next empty line) or `ENVIRONMENT` (no keyword).
        form: how the values are written and what they are in the document.
        arity: how many values.
        default: value where the file is silent.
        doc: the sentence that documents the keyword.
        low, high: range of every value, both ends included.
        above: if given, every value must exceed it.
        under: if given, every value must stay below it.
        unit: unit of the values.
        aliases: other spellings that are accepted with a note.
        environment: variables that override the value; where there are several, one for each value.
        section: section of the specification.
        in_manual: whether the manual knows the keyword.
        field: name of the field that holds the value; set by the dataclass.
    """

    name: str
    place: str
    form: Form
    arity: int
    default: Any
    doc: str
    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf
    under: float = math.inf
    unit: str = ""
    aliases: tuple[str, ...] = ()
    environment: tuple[str, ...] = ()
    section: str = ""
    in_manual: bool = True
    field: str = ""

    def read(self, cursor: Cursor, word: str, target: Any) -> None:
        """Read the keyword in the current line into its field; what is wrong with it is noted.

        Args:
            cursor: stands in the line of the keyword; left in the last line that belongs to it.
            word: the keyword as it is spelt in the file.
            target: document, object or block whose field is set.
        """
        with cursor.noting_problems():
            self.form.read(self, cursor, word, target)

    def range_text(self) -> str:
        """The range in words, empty where every finite number will do."""
        if self.above > -math.inf and self.under < math.inf:
            return f"above {self.above:g}, below {self.under:g}"
        if self.above > -math.inf:
            return f"above {self.above:g}" + (
                f", at most {self.high:g}" if self.high < math.inf else ""
            )
        if self.low > -math.inf and self.high < math.inf:
            return f"{self.low:g} to {self.high:g}"
        if self.low > -math.inf:
            return f"at least {self.low:g}"
        return f"at most {self.high:g}" if self.high < math.inf else ""

    def contains(self, value: float) -> bool:
        """Whether one value lies in the range."""
        return self.low <= value <= self.high and self.above < value < self.under


def keyword(
    name: str, place: str, form: Form, arity: int, default: Any, doc: str, **rest: Any
) -> Any:
    """A dataclass field declared by a row of the table of keywords; arguments as `Keyword`."""
    row = Keyword(name, place, form, arity, default, doc, **rest)
    if isinstance(default, (list, dict)):
        return dataclasses.field(default_factory=type(default), metadata={"keyword": row})
    return dataclasses.field(default=default, metadata={"keyword": row})


def below(name: str, form: Form, arity: int, default: Any, doc: str, **rest: Any) -> Any:
    """A dataclass field whose keyword has its values on the next line; arguments as `Keyword`."""
    return keyword(name, NEXT_LINE, form, arity, default, doc, **rest)


def beside(name: str, form: Form, arity: int, default: Any, doc: str, **rest: Any) -> Any:
    """A dataclass field whose keyword has its values on the same line; arguments as `Keyword`."""
    return keyword(name, SAME_LINE, form, arity, default, doc, **rest)


def rows(cls: type) -> tuple[Keyword, ...]:
    """The rows declared by the fields of a dataclass, in order, each knowing its field's name."""
    if cls not in _ROWS:
        _ROWS[cls] = tuple(
            dataclasses.replace(f.metadata["keyword"], field=f.name)
            for f in dataclasses.fields(cls)
            if "keyword" in f.metadata
        )
    return _ROWS[cls]


_ROWS: dict[type, tuple[Keyword, ...]] = {}


def by_word(cls: type) -> Mapping[str, Keyword]:
    """The rows of a dataclass by keyword and alias."""
    return {word: row for row in rows(cls) for word in (row.name, *row.aliases)}


def document_fields(cls: type[T]) -> type[T]:
    """Class decorator: append to the docstring a line for each keyword field."""
    lines = [(cls.__doc__ or "").rstrip(), "", "    Attributes:"]
    for row in rows(cls):
        details = [f"`{row.name}`", f"default {row.default}"]
        details += [f"[{row.unit}]"] if row.unit else []
        details += [row.range_text()] if row.range_text() else []
        details += [f"section {row.section}"] if row.section else []
        lines.append(f"        {row.field}: {row.doc} ({', '.join(details)})")
    cls.__doc__ = "\n".join(lines)
    return cls
