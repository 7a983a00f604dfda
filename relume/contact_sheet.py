"""Contact sheets of a folder of renders: `index.html`, and the same as one picture."""

from __future__ import annotations

import functools
import math
import textwrap
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from relume import noise, output
from relume.workbench import pages

if TYPE_CHECKING:
    from PIL import Image
    from rich.console import Console

    from relume.folders import Row

THUMBNAIL = (240, 180)
COLUMNS = 6
CAPTION = 34
GAP = 8
PAPER, INK, FAINT, FAULT = "#16181c", "#e8e8e8", "#9aa0a8", "#ff8f70"


def write_sheet(rows: Sequence[Row], folder: str | Path) -> None:
    """Write `index.html` and `index.png` into the folder of the pictures.

    Args:
        rows: what became of each scene.
        folder: that holds their PNGs.

    Raises:
        OutputError: a file cannot be written.
    """
    folder = Path(folder)
    page = pages.filled(
        "contact_sheet.html",
        cards=[card(row) for row in rows],
        summary=summary(rows),
    )
    with output.replacing(folder / "index.html") as temporary:
        temporary.write_text(page, encoding="utf-8")
    if rows:
        with output.replacing(folder / "index.png") as temporary:
            sheet(rows, folder).save(temporary, format="PNG")


def card(row: Row) -> dict[str, Any]:
    """What the page shows of a scene."""
    return {
        "name": row.name,
        "scene": str(row.scene),
        "href": quote(row.picture),
        "linear": quote(row.linear),
        "width": row.size[0],
        "height": row.size[1],
        "error": row.error,
        "facts": facts(row),
        "losses": row.losses,
        "kind": kind(row),
    }


def kind(row: Row) -> str:
    """`error`, `approximated` where it is not as written, `early`, or `done`."""
    if row.error:
        return "error"
    return "early" if row.why else "approximated" if row.losses else "done"


def facts(row: Row) -> str:
    """Size, samples, noise and time of a picture in a line."""
    if row.error:
        return ""
    found = [f"{row.size[0]}x{row.size[1]}", f"{row.spp} spp"]
    if math.isfinite(row.noise):
        found.append(f"noise {noise.significant(100 * row.noise)} %")
    found.append(noise.duration(row.seconds))
    marks = ["denoised"] if row.denoised else []
    return " · ".join(found + marks + ([row.why] if row.why else []))


def summary(rows: Sequence[Row]) -> str:
    """How many scenes there are of each kind, and their time."""
    counts = {name: sum(kind(row) == name for row in rows) for name in LABELS}
    said = [f"{count} {LABELS[name]}" for name, count in counts.items() if count]
    kept = sum(row.kept for row in rows)
    time = noise.duration(sum(row.seconds for row in rows))
    return f"{len(rows)} scenes: {', '.join(said)}; {time} of rendering" + (
        f"; {kept} were there already" if kept else ""
    )


LABELS = {
    "done": "as written",
    "approximated": "not quite as written",
    "early": "ended early",
    "error": "without a picture",
}
"""Kinds of rows in words."""


# ---- the picture


def sheet(rows: Sequence[Row], folder: Path) -> Image.Image:
    """All thumbnails with captions, from left to right and top to bottom."""
    from PIL import Image, ImageDraw, ImageOps

    columns = min(COLUMNS, len(rows))
    width, height = THUMBNAIL[0] + GAP, THUMBNAIL[1] + CAPTION + GAP
    size = columns * width + GAP, -(-len(rows) // columns) * height + GAP
    paper = Image.new("RGB", size, PAPER)
    draw = ImageDraw.Draw(paper)
    for index, row in enumerate(rows):
        x, y = index % columns * width + GAP, index // columns * height + GAP
        if row.error:
            lines = textwrap.wrap(row.error.replace("\n", " "), 38)[:9]
            draw.multiline_text((x, y), "\n".join(lines), FAULT, font(11, row.error))
        else:
            with Image.open(folder / row.picture) as picture:
                fitted = ImageOps.contain(picture.convert("RGB"), THUMBNAIL)
                paper.paste(fitted, (x, y + THUMBNAIL[1] - fitted.height))
        name = _fitting(row.name, 34)
        draw.text((x, y + THUMBNAIL[1] + 2), name, INK, font(12, name))
        below = " · ".join(facts(row).split(" · ")[1:]) or "no picture"
        draw.text((x, y + THUMBNAIL[1] + 18), below, FAINT, font(10))
    return paper


def font(size: int, text: str = "") -> Any:
    """A font at a size in pixels: that of the charts, or one that has the characters of `text`."""
    from PIL import ImageFont

    return ImageFont.truetype(font_file(frozenset(map(ord, text))), size)


@functools.cache
def font_file(characters: Collection[int]) -> str:
    """File of the charts' font, or where that lacks characters, of an installed one with most."""
    from matplotlib import font_manager

    charts = str(font_manager.findfont(font_manager.FontProperties(family="DejaVu Sans")))
    if not (best := _lacking(charts, characters)):
        return charts
    found = charts
    for path in sorted(font_manager.findSystemFonts()):
        if "lastresort" in path.casefold():  # it has a box for every character
            continue
        if (lacking := _lacking(path, characters)) < best:
            found, best = path, lacking
    return found


def _lacking(path: str, characters: Collection[int]) -> int:
    """How many of the characters a font lacks; one that cannot be read lacks all."""
    from matplotlib.ft2font import FT2Font

    try:
        has = FT2Font(path).get_charmap()
    except (RuntimeError, OSError):
        return len(characters)
    return sum(code not in has for code in characters)


def _fitting(text: str, length: int) -> str:
    return text if len(text) <= length else "…" + text[1 - length :]


# ---- the table


def print_table(rows: Sequence[Row], console: Console) -> None:
    """Print a line for each scene, and how many are of each kind."""
    from rich.markup import escape
    from rich.table import Table

    styles = {"error": "red", "early": "yellow", "approximated": "yellow", "done": ""}
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("scene", "picture", "notes"):
        table.add_column(heading, overflow="fold")
    for row in rows:
        notes = row.error.split("\n")[0] or f"{len(row.losses)} lines not as written"
        style = styles[kind(row)]
        shown = escape(notes) if row.error or row.losses else ""
        table.add_row(escape(row.name), facts(row), shown, style=style)
    console.print(table)
    console.print(escape(summary(rows)), highlight=False)
