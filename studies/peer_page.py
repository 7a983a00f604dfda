"""The page docs/peer.md from the figures of peer.py."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from studies.peer_defects import DEFECTS, ELSEWHERE, defect_of
from studies.peer_pictures import AT_EDGES, BLOCK, IN_BLOCK, MATCH, MEAN, SHIFTS

Figures = Mapping[str, Any]


def verdict(figures: Figures) -> str:
    """`agree`, the row of a known defect, or `DISAGREE` with what does not pass."""
    if not figures["faults"]:
        return "agree"
    defect = defect_of(figures["name"])
    return f"defect `{defect.row}`" if defect else "**DISAGREE**: " + ", ".join(figures["faults"])


def page(pictures: list[Figures]) -> str:
    """The page.

    Args:
        pictures: figures of each picture, in the order of the table.
    """
    verdicts = [verdict(figures) for figures in pictures]
    agree = sum(text == "agree" for text in verdicts)
    known = sum(text.startswith("defect") for text in verdicts)
    counts = f"{agree} of {len(pictures)} agree, {known} show a known defect of the program, and "
    counts += f"{len(pictures) - agree - known} disagree.\n"
    found = {figures["name"]: figures for figures in pictures}
    rows = [row(figures, text) for figures, text in zip(pictures, verdicts, strict=True)]
    defects = [defect_row(defect, found) for defect in DEFECTS]
    defects += [f"| `{row}` | {words} | {size} |" for row, words, size in ELSEWHERE]
    return HEAD + counts + MIDDLE + "\n".join(defects) + "\n" + TABLE + "\n".join(rows) + "\n"


def ratio(figures: Figures) -> str:
    """Ratios of the means, in words."""
    return " / ".join(f"{value:.3f}" for value in figures["ratio"])


def row(figures: Figures, text: str) -> str:
    """A row of the table of pictures."""
    if "ratio" not in figures:
        return f"| {figures['name']} | | | | {text} |"
    place = "" if figures["place"] is None else f"{figures['place']:.2f}"
    return (
        f"| {figures['name']} | {ratio(figures)} | {figures['block']:+.3f} | {place} | {text} |"
    )


def defect_row(defect: Any, found: Mapping[str, Figures]) -> str:
    """A row of the table of defects: the scene that it distorts most shows its size."""
    shown = [found[name] for name in defect.scenes if "ratio" in found.get(name, {})]
    if not shown:
        return f"| `{defect.row}` | {defect.words} | not rendered |"
    most = max(shown, key=lambda figures: abs(figures["block"]))
    size = f"{most['name']}: {ratio(most)}, in a block {most['block']:+.2f}"
    if len(shown) > 1:
        size += f" (also {', '.join(f['name'] for f in shown if f is not most)})"
    return f"| `{defect.row}` | {defect.words} | {size} |"


HEAD = f"""\
# One feature each

Small scenes, each made to show one feature of the language, as the original program rendered them
with `LUMINANCE_CUTOFF` 0, against ours in dialect `prender`. Ours are rendered on the very points
where the program takes its sub-pixels, so that edges alias alike.

    make study-peer REFERENCES=folder

A picture agrees if

- the mean of each channel does, to {MEAN:.0%} and five standard errors;
- the mean of each block of {BLOCK} x {BLOCK} pixels does, to {IN_BLOCK:.0%}, five standard errors,
  and {AT_EDGES:.0%} of the difference to neighbours, for where there are edges a sub-pixel may fall
  on either side;
- its edges and features are in their places: the correlation of the gradients is {MATCH:.0%} of
  what noise leaves of it, and nowhere better with the picture shifted by up to {SHIFTS} pixels,
  mirrored, turned or transposed.

"""

MIDDLE = """
## Defects of the program

No dialect copies these. The size is the ratio of ours to the program's, in red, green and blue,
and the largest relative difference of a block. The rows are those of the
[table of dialects](keywords.md).

| row | what the program does | size |
|---|---|---|
"""

TABLE = """
## The pictures

The ratio of the means of ours and the program's, the largest difference of a block's mean beyond
what passes (0 where all pass), and the correlation of the gradients.

| scene | ours / theirs | block | place | verdict |
|---|---|---|---|---|
"""
