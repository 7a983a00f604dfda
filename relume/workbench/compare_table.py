"""The figures of a comparison as tables, for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from relume.workbench.comparison import decimals

Report = dict[str, Any]


def tables(report: Report) -> list[tuple[list[str], list[list[str]]]]:
    """The tables of a report.

    Args:
        report: what `Comparison.report` returned.

    Returns:
        List of (heading row, other rows), all of them strings.
    """
    return [
        (["", *(side["name"] for side in report["sides"])], _sides(report["sides"])),
        (["energy", "ratio", "bias", "z"], [_channel(channel) for channel in report["energy"]]),
        (["error", ""], _errors(report)),
        (
            ["test", "of", "largest |z|", "threshold", "above it"],
            [
                [
                    test["level"] + ("" if test["counts"] else " (does not count)"),
                    str(test["tests"]),
                    f"{test['largest']:.2f}",
                    f"{test['threshold']:.2f}",
                    str(test["rejected"]),
                ]
                for test in report["tests"]
            ],
        ),
    ]


def explanations(report: Report) -> list[str]:
    """What the figures mean: a list of sentences."""
    confidence = round(100 * report["confidence"])
    alarms = round(100 * report["false_alarms"])
    return [
        f"± is the {confidence} % interval. The ratio is the mean of the first over that of the"
        " second, the bias their difference.",
        f"Two methods of the same expectation are found to differ in {alarms} % of comparisons:"
        " all tests together, by Šidák's correction. z is positive where the first is brighter.",
        "relMSE is mean((I - R)² / (R² + 0.01 m²)), R the second picture and m its mean; debiased,"
        " the variance of R is subtracted.",
        "Efficiency is 1 / (relMSE of the noise · time), the same for any number of samples; the"
        " noise of both is weighed by the mean of both pictures."
        " Time is the median of the runs times their number.",
        *(
            ["A picture holds no variance: its noise is that part of the difference which varies"
             " from pixel to pixel more than the renders explain. Tests of its single pixels do not"
             " count."]
            if any(side["variance"] == "estimated" for side in report["sides"])
            else []
        ),
    ]  # fmt: skip


def print_report(report: Report, console: Console) -> None:
    """Print the verdict and the tables."""
    style = "green" if report["verdict"] == "agree" else "yellow"
    console.print(Text(report["text"], style=f"bold {style}"), soft_wrap=True)
    for head, rows in tables(report):
        table = Table(box=None, padding=(0, 2), header_style="bold")
        for column, name in enumerate(head):
            table.add_column(Text(name), justify="right" if column else "left")
        for row in rows:
            table.add_row(*map(Text, row))
        console.print()
        console.print(table)


def _mean(channel: int, side: dict[str, Any]) -> str:
    return _with_error(side["mean"][channel], side["mean_plus_minus"][channel])


def _sides(sides: list[dict[str, Any]]) -> list[list[str]]:
    def row(name: str, text: Callable[[dict[str, Any]], str]) -> list[str]:
        return [name, *(text(side) for side in sides)]

    channels = [
        row(
            f"mean of {name}",
            partial(_mean, c),
        )
        for c, name in enumerate(("red", "green", "blue"))
    ]
    return [
        row("runs x samples", lambda s: f"{s['runs']} x {s['spp']}" if s["runs"] else "a picture"),
        *channels,
        row("relMSE of the noise", lambda side: f"{side['rel_mse_of_noise']:.3g}"),
        row("time", lambda side: _or_dash(side["seconds"], "{:.3g} s")),
        row("efficiency", lambda side: _or_dash(side["efficiency"], "{:.3g} / s")),
        row("NaN, infinite", lambda side: str(side["not_finite"])),
        row("negative", lambda side: str(side["negative"])),
    ]


def _channel(channel: dict[str, Any]) -> list[str]:
    def interval(name: str) -> str:
        if channel[name] is None:
            return "-"
        return _with_error(channel[name], channel[f"{name}_plus_minus"])

    return [channel["channel"], interval("ratio"), interval("bias"), f"{channel['z']:+.2f}"]


def _with_error(value: float, half_width: float) -> str:
    digits = decimals(half_width)
    return f"{value:.{digits}f} ± {half_width:.{digits}f}"


def _errors(report: Report) -> list[list[str]]:
    return [
        ["relMSE", f"{report['rel_mse']:.4g}"],
        ["relMSE, debiased", f"{report['rel_mse_debiased']:.4g}"],
        ["HDR-FLIP, mean", _or_dash(report["flip"], "{:.4f}")],
    ]


def _or_dash(value: float | None, form: str) -> str:
    return "-" if value is None else form.format(value)
