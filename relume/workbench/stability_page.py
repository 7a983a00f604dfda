"""The figures of a stability report: a heat map for each method, and tables in Markdown."""

import io
import math

from PIL import Image

from relume.workbench.stability_verdict import FALSE_ALARMS, LIMIT, NEGLIGIBLE, POWER, WANTED

ROW, LABEL, SQUARE = 0.22, 4.1, 0.55
"""Height of a row, width of its label and of a square [inch]."""

COLUMNS = 2
"""Columns of heat maps."""


def color(cell):
    """Colour of a cell: green, yellow to orange by the size of the error, red, or grey if said."""
    if cell["verdict"] == "exact":
        return (0.62, 0.82, 0.62)
    if cell["verdict"] == "fails":
        return (0.72, 0.10, 0.10) if cell["silent"] else (0.70, 0.70, 0.74)
    if abs(cell["error"]) <= max(cell["half_width"], NEGLIGIBLE):
        return (0.65, 0.78, 0.93)
    depth = math.log(max(abs(cell["error"]), NEGLIGIBLE) / NEGLIGIBLE) / math.log(
        LIMIT / NEGLIGIBLE
    )
    return (1.0, 0.95 - 0.45 * depth, 0.55 - 0.45 * depth)


LEGEND = (
    ("exact", {"verdict": "exact"}),
    ("off by 0.2 %", {"verdict": "degrades", "error": 0.002, "half_width": 0}),
    ("off by 4 %", {"verdict": "degrades", "error": 0.04, "half_width": 0}),
    ("noisy", {"verdict": "degrades", "error": 0, "half_width": 0}),
    ("fails, says so", {"verdict": "fails", "silent": False}),
    ("fails silently", {"verdict": "fails", "silent": True}),
)


def grouped(cells):
    """Cells by method and family: {method: {family: [cell, ...]}}, in their order."""
    result = {}
    for cell in cells:
        result.setdefault(cell["method"], {}).setdefault(cell["family"], []).append(cell)
    return result


def heat_map(cells, path):
    """Draw the heat maps of all methods into one PNG.

    Args:
        cells: the `cells` of a report.
        path: file to write.

    Raises:
        ModuleNotFoundError: matplotlib is not installed.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = _columns(grouped(cells))
    widest = [
        max(len(row) for _, families in blocks for row in families.values()) for blocks in columns
    ]
    heights = [sum(len(families) + 2 for _, families in blocks) for blocks in columns]
    width = sum(LABEL + SQUARE * n + 0.3 for n in widest)
    height = ROW * (max(heights) + 2)
    figure = Figure(figsize=(width, height), dpi=80)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(height, 0))
    axes.axis("off")
    x = 0.1
    for k, (name, look) in enumerate(LEGEND):
        _square(axes, x + 1.5 * k, ROW / 4, 1.45, name, color(look))
    for blocks, squares in zip(columns, widest, strict=True):
        _blocks(axes, blocks, x)
        x += LABEL + SQUARE * squares + 0.3
    drawn = io.BytesIO()
    figure.savefig(drawn)
    Image.open(drawn).convert("RGB").quantize(64).save(path, format="PNG", optimize=True)


def _columns(methods):
    """Methods in columns of about equal height, in their order: lists of (method, families)."""
    rows = sum(len(families) + 2 for families in methods.values())
    columns, filled = [[]], 0
    for method, families in methods.items():
        if len(columns) < COLUMNS and filled >= rows / COLUMNS:
            columns.append([])
            filled = 0
        columns[-1].append((method, families))
        filled += len(families) + 2
    return columns


def _blocks(axes, blocks, x):
    y = 1.5 * ROW
    for method, families in blocks:
        y += 1.2 * ROW
        axes.text(x, y, method, fontsize=10, fontweight="bold", va="bottom")
        for family, row in families.items():
            axes.text(x, y + 0.7 * ROW, f"{family}: {row[0]['quantity']}", fontsize=7)
            for k, cell in enumerate(row):
                _square(axes, x + LABEL + k * SQUARE, y, SQUARE, cell["at"], color(cell))
            y += ROW
        y += 0.8 * ROW


def _square(axes, x, y, width, text, face):
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((x, y), width, ROW, facecolor=face, edgecolor="white", linewidth=1))
    ink = "white" if sum(face) < 1.2 else "black"
    axes.text(x + width / 2, y + 0.68 * ROW, text, fontsize=7, ha="center", color=ink)


def markdown(report, picture):
    """The report as a page.

    Args:
        report: what `stability.run` returned.
        picture: file name of the heat map.
    """
    cells = report["cells"]
    lines = [
        "# Stability",
        "",
        f"Made by `{report['command']}` with Mitsuba {report['versions']['mitsuba']} and Dr.Jit"
        f" {report['versions']['drjit']}; `make study-stability` makes this page of all cells.",
        "",
        "Every method is rendered at the inputs where it may fail, in scenes whose mean radiance is"
        " known. A cell is *exact* where the error lies within its noise"
        f" ({100 * (1 - FALSE_ALARMS):g} % interval) or below {100 * NEGLIGIBLE:g} %, and an error"
        f" of {100 * WANTED:g} % would be seen with {100 * POWER:g} % probability. It *fails* where"
        f" the error is above {100 * LIMIT:g} %, a value is not finite or negative, or the scene is"
        " refused; a failure is *silent* if no note of the translation, warning or refusal says so."
        " Between the two it *degrades*, by an error or by noise that hides one of"
        f" {100 * WANTED:g} %.",
        "",
        f"![A square for each cell]({picture})",
        "",
        *_summary(cells),
        "",
        "## What is not exact",
        "",
        *_departures(cells),
        "",
        "## The scenes and their answers",
        "",
        *_answers(cells),
    ]
    return "\n".join(lines) + "\n"


VERDICTS = ("exact", "degrades", "fails, says so", "fails silently")


def counted(cells):
    """How many cells have each of `VERDICTS`."""
    counts = dict.fromkeys(VERDICTS, 0)
    for cell in cells:
        name = cell["verdict"]
        if name == "fails":
            name = "fails silently" if cell["silent"] else "fails, says so"
        counts[name] += 1
    return counts


def summary(cells):
    """Rows of text for each method: its name, the counts, the smallest visible error at worst."""
    rows = []
    for method, families in grouped(cells).items():
        own = [cell for row in families.values() for cell in row]
        shown = [cell["sees"] for cell in own if cell["verdict"] == "exact"]
        sees = f"{100 * max(shown):.2g} %" if shown else "-"
        rows.append([method, str(len(own)), *map(str, counted(own).values()), sees])
    return rows


SUMMARY_HEAD = ["method", "cells", *VERDICTS, "exact cells see at least"]


def _summary(cells):
    return [_row(SUMMARY_HEAD), _row(["---"] * len(SUMMARY_HEAD)), *map(_row, summary(cells))]


def _departures(cells):
    yield _row(["method", "scene", "at", "verdict", "largest pixel", "what says so"])
    yield _row(["---"] * 6)
    for cell in cells:
        if cell["verdict"] != "exact":
            firefly = f"{cell['firefly']:.3g}"
            said = "" if cell["verdict"] == "degrades" and not cell["said"] else cell["said"]
            yield _row(
                [cell["method"], cell["family"], cell["at"], cell["text"], firefly, said or "-"]
            )


def _answers(cells):
    for family, cell in {cell["family"]: cell for cell in cells}.items():
        yield f"- **{family}** ({cell['quantity']}). {cell['answer']}"


def _row(values):
    return "| " + " | ".join(str(value).replace("|", "\\|") for value in values) + " |"
