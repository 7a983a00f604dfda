"""Parts of Mitsuba dictionaries, for cells that the scene language cannot say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mitsuba as mi

from relume.workbench.cells.scenes import SIDE


def camera(position: Sequence[float], target: Sequence[float], angle: float) -> dict[str, Any]:
    """A sensor with the film of a cell: position (3,), target (3,), field of view [degree]."""
    return {
        "type": "perspective",
        "fov": angle,
        "near_clip": 1e-6,
        "far_clip": 1e12,
        "to_world": mi.ScalarTransform4f().look_at(position, target, (0, 1, 0)),
        "film": {
            "type": "hdrfilm",
            "width": SIDE,
            "height": SIDE,
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent"},
    }


def rgb(value: float) -> dict[str, Any]:
    """A grey spectrum."""
    return {"type": "rgb", "value": [value] * 3}
