"""Estimates on disk: one EXR file with means, variances and how they were made.

The file has a part for each level of an `Estimate`: `pixels`, `blocks` and `whole`, each with the
channels `mean.R` ... `variance.B` in single precision. The first part carries `relume`, a JSON
object: `runs`, the number of independent pictures, and what the writer says of them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from relume.accumulator import Accumulator
from relume.output import replacing
from relume.workbench.estimates import Estimate, Level, block_means, block_sizes

LEVELS = ("pixels", "blocks", "whole")
CHANNELS = "RGB"


def write(path: str | Path, estimate: Estimate, runs: int, made: dict[str, Any]) -> None:
    """Write an estimate; a file of that name is replaced when the new one is complete.

    Args:
        path: the file, `.exr`; its folder is made.
        estimate: `Estimate` from runs.
        runs: number of independent pictures, 2 or more.
        made: how they were made, a dictionary of JSON values.

    Raises:
        OutputError: it cannot be written.
    """
    about = json.dumps({"runs": runs} | made, ensure_ascii=False)
    height, width = estimate.pixels.mean.shape[:2]
    # All parts of a file share the display window.
    window = (np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32))
    parts: list[OpenEXR.Part] = []
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
    with replacing(Path(path)) as temporary:
        OpenEXR.File(parts).write(str(temporary))


def holds_estimate(path: str | Path) -> bool:
    """Whether a file is an EXR that claims to be of this form."""
    if Path(path).suffix.lower() != ".exr" or not Path(path).is_file():
        return False
    try:
        return "relume" in OpenEXR.File(str(path), header_only=True).header()
    except (RuntimeError, ValueError):
        return False


def read(path: str | Path) -> tuple[Estimate, dict[str, Any]]:
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
    except (RuntimeError, KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: no estimate: {error}") from None
    if not all(_sound(level) for level in levels.values()):
        raise ValueError(f"{path}: no estimate: its numbers are not sound")
    return Estimate(**levels), made


def from_passes(accumulator: Accumulator) -> Estimate | None:
    """The estimate that the samples of a render make, of which its passes keep more than the sum.

    Args:
        accumulator: `relume.accumulator.Accumulator`.

    Returns:
        `Estimate`; None where the variance is unknown: the pixels depend on each other, as those of
        a Metropolis render, there is but one sample, or values are not finite.

    Source: for the degrees of freedom of sums over pixels of two sequences, Satterthwaite, An
    approximate distribution of estimates of variance components, Biometrics Bulletin 2, 1946; the
    square of a variance with one degree of freedom averages to three times that of the true one.
    """
    mean, variance = accumulator.image().astype(float), accumulator.variance()
    finite = np.isfinite(mean).all() and np.isfinite(variance).all()
    spread = accumulator.lead is not None
    if not finite or not (spread or accumulator.observations == accumulator.spp):
        return None
    sizes = block_sizes(*mean.shape[:2])[..., None]
    each = [(mean, variance), (block_means(mean), block_means(variance) / sizes)]
    whole = [values.mean(axis=(0, 1), keepdims=True) for values in (mean, variance)]
    each.append((whole[0], whole[1] / sizes.sum()))
    dof = accumulator.observations - 1
    pixels, blocks, all_ = (Level(m, v, np.full_like(v, dof)) for m, v in each)
    if spread:
        blocks = _summed(blocks, block_means(variance**2), sizes)
        all_ = _summed(all_, (variance**2).mean(axis=(0, 1), keepdims=True), sizes.sum())
    return Estimate(pixels, blocks, all_)


def _summed(level: Level, squares: np.ndarray, size: np.ndarray) -> Level:
    """A level of means over `size` pixels of one degree of freedom each, and of the mean square of
    their variances, with its degrees of freedom."""
    with np.errstate(invalid="ignore"):
        dof = 3 * size * (level.variance * size) ** 2 / squares
    return Level(level.mean, level.variance, np.clip(np.nan_to_num(dof, nan=1), 1, size))


def _level(part, runs):
    mean, variance = (
        np.stack([part.channels[f"{field}.{c}"].pixels for c in CHANNELS], axis=-1).astype(float)
        for field in ("mean", "variance")
    )
    return Level(mean, variance, np.full_like(variance, runs - 1))


def _sound(level):
    finite = np.isfinite(level.mean).all() and np.isfinite(level.variance).all()
    return finite and level.variance.min() >= 0 and level.dof.min() >= 1
