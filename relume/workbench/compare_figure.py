"""A comparison as a figure: both pictures and where they differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from relume.output import encode_display
from relume.workbench import estimates
from relume.workbench.chart_figure import printable

if TYPE_CHECKING:
    from relume.workbench.comparison import Comparison

WIDTH, DPI = 9.6, 75
"""Of the figure [inch], and dots per inch."""


def compare_figure(comparison: Comparison) -> Figure:
    """Both pictures, and the score of each block in units of the threshold, largest channel."""
    blocks = comparison.scores["blocks"]
    pictures = [side.estimate.pixels.mean for side in comparison.sides]
    shape = pictures[0].shape[:2]
    height = WIDTH / 3 * shape[0] / shape[1] + 0.9
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, picture, side in zip(panels, pictures, comparison.sides, strict=False):
        axes.imshow(encode_display(picture))
        axes.set_title(printable(side.name), fontsize=9)
    place = np.abs(blocks.z).argmax(axis=2)[..., None]
    z = np.take_along_axis(blocks.z, place, axis=2)[..., 0] / blocks.threshold
    scores = estimates.from_blocks(np.clip(z, -2, 2), shape)
    drawn = panels[2].imshow(scores, cmap="coolwarm", vmin=-2, vmax=2)
    panels[2].set_title("difference of blocks over the threshold", fontsize=9)
    figure.colorbar(drawn, ax=panels[2], shrink=0.8)
    for axes in panels:
        axes.set_xticks([])
        axes.set_yticks([])
    figure.suptitle(printable(comparison.verdict()), fontsize=10)
    return figure
