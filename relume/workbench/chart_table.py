"""The figures of charts: CSV of all points, and a table of methods for files and terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from relume.workbench.charting import Chart

TARGETS = (0.05, 0.01)
"""Relative noise to which times are given: the root of relMSE."""

POINTS = (
    "scene", "method", "spp", "runs", "wall_s", "cpu_s", "error", "error_plus_minus", "bias2",
    "bias2_plus_minus", "reference_noise", "on_front",
)  # fmt: skip


def points(chart: Chart) -> list[tuple[Any, ...]]:
    """Every point of a chart: a list of rows as `POINTS` names them."""
    rows = []
    for curve in chart.curves:
        measured = (curve.time("wall"), curve.time("cpu"), *curve.error(), *curve.bias2())
        columns = zip(curve.spp, chart.on_front(curve), *measured, strict=True)
        for spp, on_front, *values in columns:
            named = (chart.name, curve.name, int(spp), curve.runs)
            rows.append((*named, *map(float, values), chart.reference.noise, int(on_front)))
    return rows


def summary(chart: Chart) -> list[dict[str, Any]]:
    """What the points say of each method: a list of dictionaries of JSON values.

    `slope` is that of the error over samples, `slope_of_time` over wall time; `bias` the root of
    bias², relative, or the most that it can be where `biased` is False. Times are in seconds; None
    stands for never, and for slopes that are unknown.
    """
    rows = []
    for curve in chart.curves:
        slope, of_time = curve.slope(), curve.slope(curve.time())
        bias2, bias2_half = (float(x[-1]) for x in curve.bias2())
        biased = curve.biased()
        row = {
            "scene": chart.name,
            "method": curve.name,
            "first_s": curve.first,
            "most_spp": int(curve.spp[-1]),
            "slope": slope and slope[0],
            "slope_plus_minus": slope and slope[1],
            "slope_of_time": of_time and of_time[0],
            "biased": biased,
            "bias": math.sqrt(max(bias2 if biased else bias2 + bias2_half, 0)),
        }
        for clock in ("wall", "cpu"):
            for target in TARGETS:
                time, half = curve.time_to(target**2, clock)
                name = f"{clock}_s_to_{100 * target:g}_percent"
                row[name] = time if math.isfinite(time) else None
                row[f"{name}_factor"] = math.exp(half) if math.isfinite(half) else None
        row["points"] = len(curve.spp)
        row["points_on_front"] = int(chart.on_front(curve).sum())
        row["not_finite"] = curve.not_finite
        rows.append(row)
    return rows


def as_csv(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Rows as the text of a CSV file; numbers with six digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        writer.writerow(f"{x:.6g}" if isinstance(x, float) else x for x in row)
    return text.getvalue()


def cells(row: dict[str, Any]) -> list[tuple[str, str]]:
    """A row of `summary` in words: pairs of heading and text."""

    def time(clock: str, target: float) -> str:
        seconds = row[f"{clock}_s_to_{100 * target:g}_percent"]
        return "never" if seconds is None else f"{short(seconds, 3)} s"

    slope = "-"
    if row["slope"] is not None:
        slope = f"{row['slope']:.2f} ± {row['slope_plus_minus']:.2f}"
    return [
        ("method", row["method"]),
        ("slope", slope),
        ("bias", f"{'' if row['biased'] else '< '}{short(100 * row['bias'], 2)} %"),
        *((f"{100 * target:g} % in", time("wall", target)) for target in TARGETS),
        (f"CPU, {100 * TARGETS[0]:g} %", time("cpu", TARGETS[0])),
        ("front", f"{row['points_on_front']} of {row['points']}"),
        ("first run", f"+{row['first_s']:.2f} s"),
    ]


def short(x: float, digits: int) -> str:
    """A number in so many significant digits, without an exponent below a million."""
    return f"{x:.{digits}g}" if x < 10**digits or x >= 1e6 else f"{x:.0f}"


def lines(chart: Chart) -> list[str]:
    """The table of a chart as lines of text."""
    rows = [cells(row) for row in summary(chart)]
    table = [[head for head, _ in rows[0]], *([text for _, text in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    aligned = [[row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])] for row in table]
    return [chart.name, *("  ".join(row) for row in aligned), *left_out(chart)]


def left_out(chart: Chart) -> list[str]:
    """Why methods that were asked for have no curve: a list of sentences."""
    return [f"{name} is left out: {why}" for name, why in chart.skipped.items()]


def explanations(chart: Chart) -> list[str]:
    """What the figures of a chart mean: a list of sentences."""
    about = chart.reference.about
    return [
        "Error is relMSE, the reference's own noise subtracted; ± is the 95 % interval over"
        f" {chart.settings['runs']} independent renders at each number of samples.",
        "Slope is that of log error over log samples: -1 without bias. Bias is the root of bias² at"
        " the most samples, relative; after < the most that it can be.",
        "Times are those to 5 % and 1 % relative noise, the root of relMSE; beyond the measured"
        " points the variance falls with the samples and the bias stays.",
        "Front: points that no other method is below. First run: what it takes beyond the next one,"
        " to compile; it is in no curve.",
        f"Reference: {about['method']}, {about['runs']} x {about['spp']} samples of a pixel,"
        f" relMSE {chart.reference.noise:.2g}, {about['key']}.exr in the cache.",
    ]
