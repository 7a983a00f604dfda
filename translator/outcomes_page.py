"""The page of outcome codes, made from the table that reports are made from.

::

    python -m relume.translator.outcomes_page > docs/outcomes.md
"""

from __future__ import annotations

from collections.abc import Iterable

from relume.translator import (
    outcomes_of_gravity,
    outcomes_of_meshes,
    outcomes_of_objects,
    outcomes_of_reading,
    outcomes_of_scenes,
)
from relume.translator.dialects import DIFFERENCES
from relume.translator.outcomes import explanation

INTRODUCTION = """\
# Outcome codes

Made from the translator's tables by `python -m relume.translator.outcomes_page > docs/outcomes.md`.

`relume check` reports what became of every line of a scene file: it is translated, approximated,
ignored or unsupported. A note says why, and has one of the codes below; braces stand for values of
the scene. `relume check --explain CODE` prints the same text, and `relume check --json` lists the
codes of each line.
"""

CHAPTERS: dict[str, Iterable[str]] = {
    "Lines as they are read": outcomes_of_reading.OUTCOMES,
    "Camera, rendering and surroundings": outcomes_of_scenes.OUTCOMES,
    "Objects": outcomes_of_objects.OUTCOMES,
    "Relativity": outcomes_of_gravity.OUTCOMES,
    "Meshes": outcomes_of_meshes.OUTCOMES,
    "Manual and program": DIFFERENCES,
}
"""The chapters of the page, with the codes of each."""


def page() -> str:
    """The text of docs/outcomes.md."""
    parts = [INTRODUCTION]
    for title, codes in CHAPTERS.items():
        parts.append(f"## {title}\n")
        parts += [f"### `{code}`\n\n{explanation(code)}\n" for code in codes]
    return "\n".join(parts)


if __name__ == "__main__":
    print(page(), end="")
