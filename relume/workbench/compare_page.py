"""The page of `relume compare`: one HTML file that opens from disk and needs nothing else.

Linear pictures and maps are embedded as compressed half floats in base64; the script draws them on
a canvas, so exposure is changed without loss. Without script the two pictures are shown as JPEG. A
content security policy keeps the page from the network. The template is `templates/compare.html`;
pages that stand together may share the styles and scripts, `ASSETS`.
"""

from __future__ import annotations

import base64
import io
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image

from relume.output import encode_display
from relume.workbench import estimates, measures, pages
from relume.workbench.compare_table import explanations, tables
from relume.workbench.comparison import Comparison

ASSETS = ("viewer.css", "compare.css", "viewer.js", "compare.js")
HALF_MAX = 65504.0


def page(comparison: Comparison, linked: bool = False) -> str:
    """The page of a comparison, as text.

    Args:
        comparison: what to show.
        linked: whether style and script are the files `ASSETS` beside the page, which
            `write_assets` writes, rather than in it.
    """
    report = comparison.report()
    names = [side.name for side in comparison.sides]
    views = [
        ("split", "pictures"),
        ("first", names[0]),
        ("second", names[1]),
        ("difference", "difference"),
        ("z", "z of pixels"),
        ("blocks", "z of blocks"),
        *([("flip", "FLIP")] if comparison.flip else []),
    ]
    # In JSON `<` stands in strings alone; escaped, nothing in it ends the script element.
    data = json.dumps(view_data(comparison, report)).replace("<", "\\u003c")
    return pages.filled(
        "compare.html",
        title=f"{report['scene']}: {names[0]} against {names[1]}",
        report=report,
        views=views,
        images=[(side.name, _jpeg(side.estimate.pixels.mean)) for side in comparison.sides],
        tables=tables(report),
        explanations=explanations(report),
        data=Markup(data),
        linked=linked,
        style=pages.asset("viewer.css") + pages.asset("compare.css"),
        script=pages.asset("viewer.js") + pages.asset("compare.js"),
    )


def write_assets(folder: str | Path) -> None:
    """Write the style and the script that linked pages in a folder share."""
    for name in ASSETS:
        Path(folder, name).write_text(pages.asset(name), encoding="utf-8")


def view_data(comparison: Comparison, report: dict[str, Any]) -> dict[str, Any]:
    """What the script draws: numbers, and arrays as `packed`, rows from the top.

    Pictures are divided by `scale`; `difference` is the mean over the channels of what relMSE
    squares, with its sign; `z` and `blocks` are those of the channel with the largest |z|.
    """
    a, b = (side.estimate.pixels.mean for side in comparison.sides)
    scale = abs(float(b.mean())) or 1.0
    root = np.sqrt(measures.weight(b))
    pixels, blocks = comparison.scores["pixels"], comparison.scores["blocks"]
    height, width = a.shape[:2]
    arrays = {
        "first": a / scale,
        "second": b / scale,
        "difference": ((a - b) * root).mean(axis=2),
        "z": _largest(pixels.z),
        "blocks": _largest(blocks.z),
    }
    if comparison.flip:
        arrays["flip"] = comparison.flip[0]
    return {
        "width": width,
        "height": height,
        "side": estimates.block_side(height, width),
        "scale": scale,
        "names": [side.name for side in comparison.sides],
        "thresholds": {"z": pixels.threshold, "blocks": blocks.threshold},
        "most": None if comparison.agree else report["most"],
        "arrays": {name: packed(values) for name, values in arrays.items()},
    }


def _largest(z: np.ndarray) -> np.ndarray:
    """The score of largest magnitude among the channels."""
    channel = np.abs(z).argmax(axis=2)[..., None]
    return np.take_along_axis(z, channel, axis=2)[..., 0]


def packed(values: np.ndarray) -> str:
    """Half floats, all high bytes before all low ones, by zlib, in base64."""
    clipped = np.clip(values, -HALF_MAX, HALF_MAX).astype("<f2")
    low, high = clipped.reshape(-1, 1).view(np.uint8).T
    return base64.b64encode(zlib.compress(high.tobytes() + low.tobytes(), 9)).decode()


def _jpeg(picture: np.ndarray) -> str:
    buffer = io.BytesIO()
    Image.fromarray(encode_display(picture)).save(buffer, format="JPEG", quality=85)
    return base64.b64encode(buffer.getvalue()).decode()
