"""The figures of a stability report: a heat map for each method, and tables in Markdown."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

from PIL import Image

from relume.workbench import pages
from relume.workbench.stability_verdict import FALSE_ALARMS, LIMIT, NEGLIGIBLE, POWER, WANTED

CellReport: TypeAlias = dict[str, Any]
"""A cell and its measurement, as `stability.report` gives it."""

Families: TypeAlias = dict[str, list[CellReport]]

ROW, LABEL, SQUARE = 0.22, 4.1, 0.55
"""Height of a row, width of its label and of a square [inch]."""

LEGEND_WIDTH = 1.5
"""Of an entry of the legend [inch]."""

COLUMNS = 2
"""Columns of heat maps."""


def color(cell: CellReport) -> tuple[float, float, float]:
    """Colour of a cell: green, yellow to orange by the size of the error, red, or grey if said."""
    if cell["verdict"] == "exact":
        return (0.62, 0.82, 0.62)
    if cell["verdict"] == "refused":
        return (0.85, 0.92, 0.85)
    if cell["verdict"] == "fails":
        return (0.72, 0.10, 0.10) if cell["silent"] else (0.70, 0.70, 0.74)
    if abs(cell["error"]) <= max(cell["half_width"], NEGLIGIBLE):
        return (0.65, 0.78, 0.93)
    depth = math.log(max(abs(cell["error"]), NEGLIGIBLE) / NEGLIGIBLE) / math.log(
        LIMIT / NEGLIGIBLE
    )
    return (1.0, 0.95 - 0.45 * depth, 0.55 - 0.45 * depth)


LEGEND: tuple[tuple[str, CellReport], ...] = (
    ("exact", {"verdict": "exact"}),
    ("rightly refused", {"verdict": "refused"}),
    ("off by 0.2 %", {"verdict": "degrades", "error": 0.002, "half_width": 0}),
    ("off by 4 %", {"verdict": "degrades", "error": 0.04, "half_width": 0}),
    ("noisy", {"verdict": "degrades", "error": 0, "half_width": 0}),
    ("fails, says so", {"verdict": "fails", "silent": False}),
    ("fails silently", {"verdict": "fails", "silent": True}),
)


def grouped(cells: Iterable[CellReport]) -> dict[str, Families]:
    """Cells by method and family: {method: {family: [cell, ...]}}, in their order."""
    result: dict[str, Families] = {}
    for cell in cells:
        result.setdefault(cell["method"], {}).setdefault(cell["family"], []).append(cell)
    return result


def heat_map(cells: Sequence[CellReport]) -> bytes:
    """Draw the heat maps of all methods into one PNG.

    Args:
        cells: the `cells` of a report.

    Returns:
        The contents of the file.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = _columns(grouped(cells))
    widest = [
        max(len(row) for _, families in blocks for row in families.values()) for blocks in columns
    ]
    heights = [sum(len(families) + 2 for _, families in blocks) for blocks in columns]
    width = max(sum(LABEL + SQUARE * n + 0.3 for n in widest), LEGEND_WIDTH * len(LEGEND) + 0.2)
    height = ROW * (max(heights) + 2)
    figure = Figure(figsize=(width, height), dpi=80)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(height, 0))
    axes.axis("off")
    x = 0.1
    for k, (name, look) in enumerate(LEGEND):
        _square(axes, x + LEGEND_WIDTH * k, ROW / 4, LEGEND_WIDTH - 0.05, name, color(look))
    for blocks, squares in zip(columns, widest, strict=True):
        _blocks(axes, blocks, x)
        x += LABEL + SQUARE * squares + 0.3
    drawn = io.BytesIO()
    figure.savefig(drawn)
    encoded = io.BytesIO()
    Image.open(drawn).convert("RGB").quantize(64).save(encoded, format="PNG", optimize=True)
    return encoded.getvalue()


def _columns(methods: dict[str, Families]) -> list[list[tuple[str, Families]]]:
    """Methods in columns of about equal height, in their order: lists of (method, families)."""
    rows = sum(len(families) + 2 for families in methods.values())
    columns: list[list[tuple[str, Families]]] = [[]]
    filled = 0.0
    for method, families in methods.items():
        if len(columns) < COLUMNS and filled >= rows / COLUMNS:
            columns.append([])
            filled = 0
        columns[-1].append((method, families))
        filled += len(families) + 2
    return columns


def _blocks(axes: Any, blocks: list[tuple[str, Families]], x: float) -> None:
    y = 1.5 * ROW
    for method, families in blocks:
        y += 1.2 * ROW
        axes.text(x, y, method, fontsize=10, fontweight="bold", va="bottom")
        for family, row in families.items():
            axes.text(x, y + 0.7 * ROW, f"{family}: {row[0]['quantity']}", fontsize=7)
            for k, cell in enumerate(row):
                style = "italic" if cell["earlier"] else "normal"
                _square(axes, x + LABEL + k * SQUARE, y, SQUARE, cell["at"], color(cell), style)
            y += ROW
        y += 0.8 * ROW


def _square(
    axes: Any, x: float, y: float, width: float, text: str, face: Any, style: str = "normal"
) -> None:
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((x, y), width, ROW, facecolor=face, edgecolor="white", linewidth=1))
    ink = "white" if sum(face) < 1.2 else "black"
    middle = (x + width / 2, y + 0.68 * ROW)
    axes.text(*middle, text, fontsize=7, fontstyle=style, ha="center", color=ink)


def markdown(report: dict[str, Any], picture: str) -> str:
    """The report as a page.

    Args:
        report: what `Stability.report` returned; a cell may have `date` and `version`, of when it
            was measured. `missing` are names of cells that have not been measured.
        picture: file name of the heat map.
    """
    cells = report["cells"]
    departures = [cell for cell in cells if cell["verdict"] not in RIGHT]
    own = [cell for cell in departures if not cell["reference"]]
    return pages.filled(
        "stability.md",
        report=report,
        dated=dated(cells),
        missing=gathered(report.get("missing", ())),
        picture=picture,
        head=SUMMARY_HEAD,
        rows=summary(cells),
        departures=own,
        references=[cell for cell in departures if cell["reference"]],
        refusals=[cell for cell in cells if cell["verdict"] == "refused"],
        reasons={cell["family"]: cell["why"] for cell in own if cell["why"]},
        families={cell["family"]: cell for cell in cells}.values(),
        percent={
            "confidence": f"{100 * (1 - FALSE_ALARMS):g}",
            "negligible": f"{100 * NEGLIGIBLE:g}",
            "wanted": f"{100 * WANTED:g}",
            "power": f"{100 * POWER:g}",
            "limit": f"{100 * LIMIT:g}",
        },
    )


def dated(cells: Iterable[CellReport]) -> list[tuple[str, int, str]]:
    """Of which versions cells are, how many and when they were measured; the newest date first.

    Returns:
        (version, or empty if it is not known; cells; first to last date, or empty) of each.
    """
    days: dict[str, list[str]] = {}
    for cell in cells:
        days.setdefault(cell["version"], []).append(cell["date"])
    found = sorted(days.items(), key=lambda item: max(item[1]), reverse=True)
    return [
        (version, len(dates), " to ".join(dict.fromkeys((min(dates), max(dates)))))
        for version, dates in found
    ]


def gathered(names: Iterable[str]) -> list[str]:
    """Names of cells as words: `surfacepath, white room: 0.999, 0.9999`."""
    rows: dict[str, list[str]] = {}
    for name in names:
        row, _, at = name.rpartition("/")
        rows.setdefault(row.replace("/", ", "), []).append(at)
    return [f"{row}: {', '.join(values)}" for row, values in rows.items()]


RIGHT = ("exact", "refused")
"""Verdicts of cells in which nothing is to be mended."""

VERDICTS = (*RIGHT, "degrades", "fails, says so", "fails silently")


def counted(cells: Iterable[CellReport]) -> dict[str, int]:
    """How many cells have each of `VERDICTS`."""
    counts = dict.fromkeys(VERDICTS, 0)
    for cell in cells:
        name = cell["verdict"]
        if name == "fails":
            name = "fails silently" if cell["silent"] else "fails, says so"
        counts[name] += 1
    return counts


def summary(cells: Iterable[CellReport]) -> list[list[str]]:
    """Rows of text for each method: its name, the counts, the smallest visible error at worst."""
    rows = []
    for method, families in grouped(cells).items():
        own = [cell for row in families.values() for cell in row]
        shown = [cell["sees"] for cell in own if cell["verdict"] == "exact"]
        sees = f"{100 * max(shown):.2g} %" if shown else "-"
        rows.append([method, str(len(own)), *map(str, counted(own).values()), sees])
    return rows


SUMMARY_HEAD = ["method", "cells", *VERDICTS, "exact cells see at least"]
