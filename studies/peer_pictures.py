"""Renders on the original program's sub-pixels, and how a picture of ours is judged by one of its.

The program takes its sub-pixels at their centres, without jitter: edges alias. Ours are taken at
the same points, so that edges alias alike and what is left is a difference or noise.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from relume import translator
from relume.loading import load_scene, variant_and_threads
from relume.sensors.pixelsamples import sample_pixels

ENVIRONMENT = {"LUMINANCE_CUTOFF": "0"}
MOST_SAMPLES = 2**20
"""Samples of one launch."""

MEAN = 0.01
"""Difference of the means of a channel, relative, that passes."""

BLOCK, IN_BLOCK, FLOOR = 8, 0.03, 0.1
"""Side of a block [pixel]; difference of its mean that passes, relative to it and to `FLOOR` of the
picture's mean."""

AT_EDGES = 0.2
"""What of the difference between neighbours passes in a block."""

SIGMAS, DARK = 5.0, 1e-5
"""Standard errors, and radiance, that pass in addition."""

SHIFTS = 2
"""Features may not match better elsewhere: at shifts of up to so many pixels."""

MIRRORS = {
    "left-right": lambda picture: picture[:, ::-1],
    "top-bottom": lambda picture: picture[::-1],
    "turned": lambda picture: picture[::-1, ::-1],
    "transposed": lambda picture: picture.swapaxes(0, 1),
}

FEATURES, MATCH, BETTER = 0.02, 0.9, 0.01
"""Least share of the gradients' square in the picture's for a picture to have features; least
correlation of the gradients with those of the reference; how much more is better elsewhere."""


@dataclass(frozen=True)
class Picture:
    """A picture and the standard error of each value, linear RGB, (height, width, 3)."""

    mean: np.ndarray
    error: np.ndarray


@dataclass
class Judgement:
    """What a picture was found to be.

    Attributes:
        ratio: of the means, for each channel.
        block: the largest difference of a block, relative; its place (row, column) in blocks.
        place: correlation of the gradients, None without features.
        faults: what does not pass, in words.
    """

    ratio: list[float]
    block: float = 0.0
    where: tuple[int, int] = (0, 0)
    place: float | None = None
    faults: list[str] = field(default_factory=list)


def render(scene: Path, spp: int, seed: int, dialect: str = "prender") -> Picture:
    """A scene on the centres of the sub-pixels that its file asks for.

    Args:
        scene: the scene file.
        spp: samples of a pixel; at least two are taken of each sub-pixel.
        seed: non-negative integer.
        dialect: of the translation.
    """
    # Their comments are in several encodings; what matters is ASCII.
    text = scene.read_bytes().decode("latin-1").replace("\r\n", "\n")
    document = translator.read_text(text, str(scene), ENVIRONMENT)
    translation = translator.translate(document, dialect, (scene.parent,))
    side = document.supersampling
    width, height = document.image
    repeats = max(2, round(spp / side**2))
    with variant_and_threads(translation):
        loaded = load_scene(translation)
        values = np.zeros((width * height * side**2, 3))
        squares = np.zeros_like(values)
        at_once = max(1, MOST_SAMPLES // len(values))
        for start in range(0, repeats, at_once):
            count = min(at_once, repeats - start)
            found = radiance(loaded, width, height, side, count, seed + start)
            values += found.sum(axis=1)
            squares += (found**2).sum(axis=1)
    mean = values / repeats
    variance = np.maximum(squares / repeats - mean**2, 0) / (repeats - 1)
    shape = (height, width, side**2, 3)
    error = np.sqrt(variance.reshape(shape).mean(axis=2) / side**2)
    return Picture(mean.reshape(shape).mean(axis=2), error)


def radiance(
    scene: mi.Scene, width: int, height: int, side: int, count: int, seed: int
) -> np.ndarray:
    """Linear RGB of `count` samples at each sub-pixel's centre, (pixels side², count, 3)."""
    sensor = scene.sensors()[0]
    total = width * height * side**2 * count
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, total)
    index = dr.arange(mi.UInt32, total) // count
    cell, pixel = index % side**2, index // side**2
    sample = (mi.Point2f(cell % side, cell // side) + 0.5) / side
    corner = mi.Point2f(pixel % width, pixel // width)
    size = mi.Vector2f(width, height)
    rgb = sample_pixels(scene, sensor, scene.integrator(), sampler, corner, sample, size)
    return np.array(rgb).T.reshape(-1, count, 3)


def with_error(picture: np.ndarray, error_of_mean: np.ndarray, noisy: np.ndarray) -> Picture:
    """A picture of the program with the standard error of each value.

    Of light that paths find by chance the variance is about in proportion to the radiance.

    Args:
        picture: (height, width, 3).
        error_of_mean: standard error of the mean of each channel, (3,).
        noisy: where there is noise at all, (height, width, 3): not on what shines.
    """
    lit = np.where(noisy, picture, 0)
    lit = np.minimum(lit, 4 * lit.mean(axis=(0, 1)))
    share = lit / np.maximum(lit.sum(axis=(0, 1)), 1e-9)
    return Picture(picture, error_of_mean * picture[..., 0].size * np.sqrt(share))


def judge(ours: Picture, theirs: np.ndarray, error_of_mean: np.ndarray) -> Judgement:
    """Judge a picture by the program's; arguments as `with_error`."""
    reference = with_error(theirs, error_of_mean, ours.error > 0)
    error = np.sqrt(ours.error**2 + reference.error**2)
    found = Judgement([])
    judge_means(found, ours.mean, theirs, error)
    judge_blocks(found, ours.mean, theirs, error)
    judge_places(found, ours.mean, theirs, error)
    return found


def edges(picture: np.ndarray) -> np.ndarray:
    """How far values differ among each pixel and its neighbours, (height, width, 3)."""
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(0, 1))
    return around.max(axis=(3, 4)) - around.min(axis=(3, 4))


def judge_means(
    found: Judgement, ours: np.ndarray, theirs: np.ndarray, error: np.ndarray
) -> None:
    """Means of the channels."""
    mean = theirs.mean(axis=(0, 1))
    sigma = np.sqrt((error**2).sum(axis=(0, 1))) / error[..., 0].size
    difference = ours.mean(axis=(0, 1)) - mean
    found.ratio = [round(float(r), 4) for r in 1 + difference / np.maximum(mean, 1e-9)]
    wrong = np.abs(difference) > MEAN * mean + SIGMAS * sigma + DARK
    for channel in np.flatnonzero(wrong):
        found.faults.append(f"mean of {('red', 'green', 'blue')[channel]}")


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of the blocks; what is left at the right and at the bottom are smaller ones."""
    rows, columns = (range(0, n, BLOCK) for n in picture.shape[:2])
    return np.array(
        [[picture[i : i + BLOCK, j : j + BLOCK].mean(axis=(0, 1)) for j in columns] for i in rows]
    )


def judge_blocks(
    found: Judgement, ours: np.ndarray, theirs: np.ndarray, error: np.ndarray
) -> None:
    """Means of blocks; where there are edges, a sub-pixel may fall on either side."""
    mean = blocks(theirs)
    scale = np.maximum(mean, FLOOR * theirs.mean(axis=(0, 1)))
    noise = SIGMAS * np.sqrt(blocks(error**2) / BLOCK**2)
    passes = IN_BLOCK * scale + noise + AT_EDGES * blocks(edges(theirs)) + DARK
    relative = (blocks(ours) - mean) / np.maximum(scale, 1e-9)
    excess = np.abs(blocks(ours) - mean) - passes
    k = np.unravel_index(np.argmax(excess / np.maximum(scale, 1e-9)), relative.shape)
    found.block, found.where = round(float(relative[k]), 4), (int(k[0]), int(k[1]))
    if (excess > 0).any():
        number = int((excess > 0).any(axis=2).sum())
        found.faults.append(f"{number} of {mean[..., 0].size} blocks")


def gradients(picture: np.ndarray) -> np.ndarray:
    """Differences of neighbours down and to the right, (2, height - 1, width - 1, 3)."""
    return np.stack([np.diff(picture, axis=0)[:, :-1], np.diff(picture, axis=1)[:-1]])


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Of two fields of gradients."""
    norm = np.sqrt((a**2).sum() * (b**2).sum())
    return float((a * b).sum() / norm) if norm > 0 else 0.0


def judge_places(
    found: Judgement, ours: np.ndarray, theirs: np.ndarray, error: np.ndarray
) -> None:
    """Places of edges and features: nowhere else may they match as well, nor mirrored."""
    reference, ours_d = gradients(theirs), gradients(ours)
    noise, whole = 4 * (error**2).sum(), (reference**2).sum()
    if whole - noise <= FEATURES**2 * (theirs**2).sum():
        return
    here = correlation(ours_d, reference)
    found.place = round(here, 3)
    # What noise leaves of the correlation at best.
    best = max(0.0, 1 - noise / whole)
    if here < MATCH * best:
        found.faults.append("features")
    for down in range(-SHIFTS, SHIFTS + 1):
        for right in range(-SHIFTS, SHIFTS + 1):
            if (down or right) and _elsewhere(ours_d, reference, down, right) > here + BETTER:
                found.faults.append(f"features {down} down, {right} right")
    for name, mirror in MIRRORS.items():
        other = mirror(theirs)
        if other.shape == theirs.shape:
            there = correlation(ours_d, gradients(other))
            if there > here + BETTER:
                found.faults.append(f"features {name}")


def _elsewhere(ours: np.ndarray, reference: np.ndarray, down: int, right: int) -> float:
    height, width = ours.shape[1:3]
    a = ours[:, max(down, 0) : height + min(down, 0), max(right, 0) : width + min(right, 0)]
    b = reference[:, max(-down, 0) : height - max(down, 0), max(-right, 0) : width - max(right, 0)]
    return correlation(a, b)
