"""The table of outcomes: why a line of a scene file is approximated, ignored or remarked on.

Every note of a report comes from a row here, whose code stays the same from version to version.
The rows of `dialects` are outcomes, too.
"""

from __future__ import annotations

import difflib

from relume.translator import (
    dialects,
    outcomes_of_gravity,
    outcomes_of_meshes,
    outcomes_of_objects,
    outcomes_of_reading,
    outcomes_of_scenes,
)
from relume.translator.outcome_rows import KINDS, Note, Outcome

OUTCOMES: dict[str, Outcome] = {
    **outcomes_of_reading.OUTCOMES,
    **outcomes_of_scenes.OUTCOMES,
    **outcomes_of_objects.OUTCOMES,
    **outcomes_of_gravity.OUTCOMES,
    **outcomes_of_meshes.OUTCOMES,
    **{row.id: dialects.outcome(row) for row in dialects.DIFFERENCES.values()},
}
"""All outcomes by code."""


class UnknownCode(KeyError):
    """There is no outcome of a code; the text suggests others."""

    def __str__(self) -> str:
        return str(self.args[0])


def make_note(code: str, /, *, remark: bool | None = None, **values: object) -> Note:
    """The note of an outcome with the values of a scene.

    Args:
        code: key of `OUTCOMES`.
        remark: if given, whether the outcome must be a remark, of the kind `translated`.
        values: for its placeholders; `dialect` chooses between two notes where there are two.

    Raises:
        KeyError: unknown code, or a value is missing.
        ValueError: the outcome is a remark and must not be, or the other way round.
    """
    row = find_outcome(code)
    if remark is not None and remark != (row.kind == KINDS[0]):
        raise ValueError(f"outcome '{code}' is of kind '{row.kind}'")
    return Note(code, row.text(values))


def find_outcome(code: str) -> Outcome:
    """The outcome of a code.

    Raises:
        UnknownCode: there is none; the message suggests those spelt alike.
    """
    if code not in OUTCOMES:
        close = difflib.get_close_matches(code, OUTCOMES, n=3, cutoff=0.5)
        hint = f"; did you mean {' or '.join(repr(name) for name in close)}?" if close else ""
        raise UnknownCode(f"unknown outcome '{code}'{hint}")
    return OUTCOMES[code]


def explanation(code: str) -> str:
    """The outcome of a code explained in Markdown, for the command line and the documentation.

    Raises:
        UnknownCode: there is none.
    """
    row = find_outcome(code)
    kind = "translated, with a remark" if row.kind == KINDS[0] else row.kind
    prender = [f"> {row.prender_note} (`--dialect prender`)"] if row.prender_note else []
    paragraphs = [
        f"{kind.capitalize()}; section {row.section} of the scene language.",
        f"> {row.pattern}",
        *prender,
        row.picture,
        row.advice,
    ]
    return "\n\n".join(paragraphs)
