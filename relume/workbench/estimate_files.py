"""Estimates on disk: one EXR file with means, variances and how they were made.

The file has a part for each level of an `Estimate`: `pixels`, `blocks` and `whole`, each with the
channels `mean.R` ... `variance.B` in single precision. The first part carries `relume`, a JSON
object: `runs`, the number of independent pictures, and what the writer tells of them.
"""

import json
import os
from pathlib import Path

import numpy as np
import OpenEXR

from relume.workbench.statistics import Estimate, Level

LEVELS = ("pixels", "blocks", "whole")
CHANNELS = "RGB"


def write(path, estimate, runs, made):
    """Write an estimate; a file of that name is replaced when the new one is complete.

    Args:
        path: the file, `.exr`; its folder must exist.
        estimate: `Estimate` from runs.
        runs: number of independent pictures, 2 or more.
        made: how they were made, a dictionary of JSON values.
    """
    about = json.dumps({"runs": runs} | made, ensure_ascii=False)
    height, width = estimate.pixels.mean.shape[:2]
    # All parts of a file share the display window.
    window = (np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32))
    parts = []
    for name in LEVELS:
        header = {
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION,
            "displayWindow": window,
        }
        if not parts:
            header["relume"] = about
        level = getattr(estimate, name)
        channels = {
            f"{field}.{letter}": np.ascontiguousarray(values[..., c], dtype=np.float32)
            for field, values in (("mean", level.mean), ("variance", level.variance))
            for c, letter in enumerate(CHANNELS)
        }
        parts.append(OpenEXR.Part(header, channels, name))
    temporary = Path(path).with_name(f"{Path(path).name}.{os.getpid()}")
    try:
        OpenEXR.File(parts).write(str(temporary))
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def read(path):
    """Read what `write` wrote.

    Returns:
        The `Estimate` and the dictionary of how it was made, with `runs`.

    Raises:
        ValueError: the file cannot be read, or is not of this form.
    """
    try:
        file = OpenEXR.File(str(path), separate_channels=True)
        parts = {part.name(): part for part in file.parts}
        made = json.loads(parts["pixels"].header["relume"])
        levels = {name: _level(parts[name], made["runs"]) for name in LEVELS}
    except (RuntimeError, KeyError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: no estimate: {error}") from None
    return Estimate(**levels), made


def _level(part, runs):
    mean, variance = (
        np.stack([part.channels[f"{field}.{c}"].pixels for c in CHANNELS], axis=-1).astype(float)
        for field in ("mean", "variance")
    )
    return Level(mean, variance, np.full_like(variance, runs - 1))
