"""How a keyword of the scene language is declared: once, as a field of the document.

A field of the dataclasses in `document`, `objects` and `blocks` is made by `keyword(...)`. That row
is all there is to a keyword: the parser, the checks, the printer and the reference page read it.
"""

import dataclasses
import functools
import math
from dataclasses import dataclass

NEXT_LINE = "next line"
SAME_LINE = "same line"
BLOCK = "block"
ENVIRONMENT = "environment only"

TEXTS = ("text", "symbol")
"""Kinds of row whose value is a name: the rest of the line."""


@dataclass(frozen=True)
class Keyword:
    """One row of the table of keywords.

    Attributes:
        name: the word, case sensitive, in the first column of its line.
        form: `NEXT_LINE` (word alone, values below it), `SAME_LINE` (word, blank, values),
            `BLOCK` (word opens a block up to the next empty line) or `ENVIRONMENT` (no keyword).
        kind: `number` (an expression), `integer`, `flag` (0 is off, anything else on) or `text`;
            or the name of a form that the parser knows (`phase`, `ambient`, `ward`, `reflection`,
            `symbol`, `variable`, `transforms`).
        arity: how many values.
        default: value where the file is silent.
        low, high: range of every value, both ends included.
        above: if given, every value must exceed it.
        unit: unit of the values.
        doc: the sentence that documents the keyword.
        aliases: other spellings that are accepted with a note.
        environment: variables that override the value, one for each value.
        dummies: value lines that come before the values and are read but not used.
        section: section of the specification.
        in_manual: whether the manual knows the keyword.
        field: name of the field that holds the value; set by the dataclass.
    """

    name: str
    form: str
    kind: str
    arity: int
    default: object
    doc: str
    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf
    unit: str = ""
    aliases: tuple = ()
    environment: tuple = ()
    dummies: int = 0
    section: str = ""
    in_manual: bool = True
    field: str = ""

    def range_text(self):
        """The range in words, empty where every finite number will do."""
        if self.above > -math.inf:
            return f"above {self.above:g}" + (
                f", at most {self.high:g}" if self.high < math.inf else ""
            )
        if self.low > -math.inf and self.high < math.inf:
            return f"{self.low:g} to {self.high:g}"
        if self.low > -math.inf:
            return f"at least {self.low:g}"
        return f"at most {self.high:g}" if self.high < math.inf else ""

    def contains(self, value):
        """Whether one value lies in the range."""
        return self.low <= value <= self.high and value > self.above


def keyword(name, form, kind, arity, default, doc, **rest):
    """A dataclass field declared by a row of the table of keywords; arguments as `Keyword`."""
    row = Keyword(name, form, kind, arity, default, doc, **rest)
    if isinstance(default, (list, dict)):
        return dataclasses.field(default_factory=type(default), metadata={"keyword": row})
    return dataclasses.field(default=default, metadata={"keyword": row})


@functools.cache
def rows(cls):
    """The rows declared by the fields of a dataclass, in order, each knowing its field's name."""
    return tuple(
        dataclasses.replace(f.metadata["keyword"], field=f.name)
        for f in dataclasses.fields(cls)
        if "keyword" in f.metadata
    )


def by_word(cls):
    """The rows of a dataclass by keyword and alias."""
    return {word: row for row in rows(cls) for word in (row.name, *row.aliases)}


def document_fields(cls):
    """Class decorator: append to the docstring a line for each keyword field."""
    lines = [cls.__doc__.rstrip(), "", "    Attributes:"]
    for row in rows(cls):
        details = [f"`{row.name}`", f"default {row.default}"]
        details += [f"[{row.unit}]"] if row.unit else []
        details += [row.range_text()] if row.range_text() else []
        lines.append(f"        {row.field}: {row.doc} ({', '.join(details)})")
    cls.__doc__ = "\n".join(lines)
    return cls
