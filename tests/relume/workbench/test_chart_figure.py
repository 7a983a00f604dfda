"""Figures of charts: methods are told apart, and nothing covers their curves."""

import itertools
import types

import numpy as np
import pytest

from relume.workbench import chart_figure, curves
from relume.workbench.methods import METHODS

OTHERS = ("bdpt", "randomwalk", "ptracer", "prb")


def lab(color):
    """CIELAB of a colour of sRGB."""
    c = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    c = np.where(c > 0.04045, ((c + 0.055) / 1.055) ** 2.4, c / 12.92)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    x = to_xyz @ c / [0.9505, 1, 1.089]
    f = np.where(x > 0.008856, np.cbrt(x), 7.787 * x + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_no_two_methods_look_alike():
    """All methods of the table and some integrators more, in one figure."""
    names = [row.name for row in METHODS] + [*OTHERS]
    styles = chart_figure.style_of(dict.fromkeys(names))
    assert len({style["marker"] for style in styles.values()}) == len(styles)
    for (a, one), (b, other) in itertools.combinations(styles.items(), 2):
        assert np.linalg.norm(lab(one["color"]) - lab(other["color"])) > 25, (a, b)


def test_a_method_looks_the_same_in_every_figure():
    alone = chart_figure.style_of(["erpt", "mine"])
    among = chart_figure.style_of(["mine", "path", "volpath", "erpt"])
    assert alone["erpt"] == among["erpt"]
    assert among["mine"] not in (among["path"], among["volpath"], among["erpt"])


def test_more_methods_than_colours_are_refused():
    with pytest.raises(ValueError, match="colours for"):
        chart_figure.style_of(f"method{i}" for i in range(99))


def chart(count):
    """A chart of that many methods whose errors are 1 / samples, up to a factor."""
    made = []
    for index, row in enumerate(METHODS[:count]):
        steps = np.array([1, 4, 16, 64])
        error = (1 + index / 3) / steps
        made.append(
            types.SimpleNamespace(
                name=row.name,
                time=lambda clock, s=steps: s / 10,
                error=lambda e=error: (e, e / 10),
                biased=lambda: False,
            )
        )
    return types.SimpleNamespace(
        name="scene",
        curves=made,
        settings={"size": (96, 72)},
        reference=types.SimpleNamespace(noise=0.0),
    )


def test_the_legend_covers_no_curve(monkeypatch):
    monkeypatch.setattr(curves, "front", lambda *_: ([0.1, 6.4], [1.0, 1 / 64]))
    figure = chart_figure.chart_figure(chart(9))
    figure.draw_without_rendering()
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert names == [row.name for row in METHODS[:9]] + ["Pareto front"]
    box = legend.get_window_extent()
    for axes in figure.axes:
        assert not box.overlaps(axes.get_window_extent())
        assert axes.get_legend() is None
        assert axes.get_window_extent().width > 0.25 * figure.bbox.width
