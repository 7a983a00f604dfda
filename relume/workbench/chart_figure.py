"""Charts as figures: error over wall and processor time, log-log, with bands and Pareto front."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.ft2font import FT2Font
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from relume.output import replacing
from relume.workbench import curves
from relume.workbench.chart_table import TARGETS
from relume.workbench.methods import METHODS

if TYPE_CHECKING:
    from relume.workbench.charting import Chart

Style = dict[str, Any]

COLORS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999",
    "#0000ff", "#00d200", "#ff00e1", "#4b0f87", "#ff005a", "#5a5a00", "#780f1e", "#a5c32d",
    "#2d78ff", "#ffa587", "#d20087", "#e187ff", "#4b2d5a", "#008700", "#963cf0", "#005a5a",
)  # fmt: skip
"""Those of Okabe and Ito, distinct for colour-blind readers, too; then each as far from all before
it as CIELAB has room between paper and ink."""

MARKERS = (*"osD^vPX*<>ph8dH+x1234|_", ".")
CLOCKS = {"wall": "wall time of a render [s]", "cpu": "processor time, all threads [s]"}
FLOOR_COLOR = "0.55"


def chart_figure(chart: Chart) -> Figure:
    """The figure of a chart: a panel for each clock."""
    figure = Figure(figsize=(11.2, 4.2), layout="constrained")
    panels = figure.subplots(1, len(CLOCKS), sharey=True)
    styles = style_of([curve.name for curve in chart.curves])
    for axes, clock in zip(panels, CLOCKS, strict=True):
        draw(axes, chart, clock, styles)
        axes.set_xlabel(CLOCKS[clock])
    panels[0].set_ylabel("relMSE, the reference's noise subtracted")
    noise_scale(panels[-1])
    legend = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        list(legend.values()), list(legend), loc="outside right upper", fontsize=8, frameon=False
    )
    width, height = chart.settings["size"]
    figure.suptitle(f"{printable(chart.name)}, {width}x{height}", fontsize=11)
    return figure


def overview_figure(charts: Sequence[Chart]) -> Figure:
    """The figure of several charts: a panel for each, over wall time."""
    columns = min(4, len(charts))
    rows = -(-len(charts) // columns)
    figure = Figure(figsize=(3 * columns, 2.7 * rows + 0.5), layout="constrained")
    names = dict.fromkeys(curve.name for chart in charts for curve in chart.curves)
    styles = style_of(names)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    shown: dict[Any, Any] = {}
    for axes, chart in zip(panels, charts, strict=False):
        draw(axes, chart, "wall", styles)
        axes.set_title(printable(chart.name), fontsize=9)
        handles, labels = axes.get_legend_handles_labels()
        shown |= dict(zip(labels, handles, strict=True))
    for axes in panels[len(charts) :]:
        axes.set_axis_off()
    figure.supxlabel(CLOCKS["wall"], fontsize=9)
    figure.supylabel("relMSE", fontsize=9)
    handles, labels = list(shown.values()), list(shown)
    figure.legend(handles, labels, loc="outside upper center", ncols=6, fontsize=8)
    return figure


def style_of(names: Iterable[str]) -> dict[str, Style]:
    """Colour and marker of each method, no two of them alike.

    Those of the table have the same in all figures; others get what is left.

    Raises:
        ValueError: there are more methods than colours.
    """
    names = list(dict.fromkeys(names))
    known = {row.name: index for index, row in enumerate(METHODS)}
    taken = {known[name] for name in names if name in known}
    free = iter(i for i in range(len(COLORS)) if i not in taken)
    places = {name: known[name] if name in known else next(free, len(COLORS)) for name in names}
    if max(places.values(), default=0) >= len(COLORS):
        raise ValueError(f"a figure has colours for {len(COLORS)} methods, not {len(names)}")
    return {name: {"color": COLORS[i], "marker": MARKERS[i]} for name, i in places.items()}


def draw(axes: Axes, chart: Chart, clock: str, styles: dict[str, Style]) -> None:
    """Draw the curves of a chart over one clock."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for curve in chart.curves:
        draw_curve(axes, curve, clock, styles[curve.name])
    front = curves.front(chart.curves, clock)
    axes.plot(*front, color="0.5", linewidth=6, alpha=0.3, zorder=0, label="Pareto front")
    low, high = axes.get_ylim()
    if chart.reference.noise > low / 30:
        axes.axhline(
            chart.reference.noise,
            color=FLOOR_COLOR,
            linestyle=":",
            label="noise of the reference",
        )
    for target in TARGETS:
        if low < target**2 < high:
            axes.axhline(target**2, color="0.85", linewidth=0.8, zorder=-1)
    axes.grid(True, which="major", color="0.92", zorder=-2)
    plain_ticks(axes.xaxis)
    axes.tick_params(labelsize=8)


def plain_ticks(axis: Axis) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5, with plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def draw_curve(axes: Axes, curve: curves.Curve, clock: str, style: Style) -> None:
    """Draw error with its band, and bias² where it is more than chance."""
    times = curve.time(clock)
    e, half = curve.error()
    seen = e > 0
    if not seen.any():
        return
    factor = np.exp(half[seen] / e[seen])  # a band of the logarithm: never below 0
    color = style["color"]
    band = (e[seen] / factor, e[seen] * factor)
    axes.fill_between(times[seen], *band, color=color, alpha=0.2, linewidth=0)
    axes.plot(times[seen], e[seen], markersize=4, linewidth=1.3, label=curve.name, **style)
    if curve.biased():
        b, b_half = curve.bias2()
        known = b > b_half
        dashed: Style = {"color": color, "linestyle": "--", "linewidth": 1}
        axes.plot(times[known], b[known], label=f"bias² of {curve.name}", **dashed)


def noise_scale(axes: Axes) -> None:
    """A second scale of relative noise, the root of relMSE [%]."""
    right = axes.secondary_yaxis(
        "right",
        functions=(lambda e: 100 * np.sqrt(np.maximum(e, 0)), lambda p: (np.asarray(p) / 100) ** 2),
    )
    right.set_ylabel("relative noise [%]")
    plain_ticks(right.yaxis)
    right.tick_params(labelsize=8)


def printable(text: str) -> str:
    """Text with the characters that the font of the figures has; □ for the others."""
    font = FT2Font(findfont(FontProperties(family="DejaVu Sans")))
    return "".join(c if font.get_char_index(ord(c)) else "□" for c in text)


def save(figure: Figure, path: str | Path, description: str) -> None:
    """Write a figure as SVG or PNG by the extension, the same bytes for the same figure.

    Args:
        figure: what to write.
        path: the file.
        description: kept in it, such as the command that makes it.

    Raises:
        OutputError: it cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lstrip(".")
    settings: Any = {"svg.fonttype": "none", "svg.hashsalt": "relume"}
    metadata: dict[str, str | None] = {"Description": description}
    metadata |= {"Date": None, "Creator": None} if kind == "svg" else {"Software": None}
    with matplotlib.rc_context(settings), replacing(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=96, metadata=metadata)
