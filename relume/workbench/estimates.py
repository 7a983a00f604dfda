"""Estimates of pictures: from many independent pictures to means with their variances.

A method is known by its runs: independent pictures of the same thing. `Runs` takes them one after
the other and gives an `Estimate`: mean, variance of the mean and degrees of freedom of each pixel,
of each block of pixels and of the whole picture. Blocks and the whole are means within one run
before their variance is taken, so pixels of one run may depend on each other. A picture without
runs becomes an estimate by `from_picture`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

BLOCKS = 16
"""Blocks along the longer side of a picture."""


@dataclass(frozen=True)
class Level:
    """Means of one size of region.

    Attributes:
        mean: radiances.
        variance: variances of these means.
        dof: degrees of freedom of these variances.
    """

    mean: np.ndarray
    variance: np.ndarray
    dof: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """What is known of an expected picture.

    Attributes:
        pixels: `Level` of shape (height, width, 3).
        blocks: `Level` of shape (rows, columns, 3); see `blocks`.
        whole: `Level` of shape (1, 1, 3).
        lone: whether it is a picture whose noise was judged by that of its neighbouring pixels.
    """

    pixels: Level
    blocks: Level
    whole: Level
    lone: bool = False


def block_side(height: int, width: int) -> int:
    """Side of the square blocks of a picture [pixel]; at least 4."""
    return max(4, -(-max(height, width) // BLOCKS))


def block_means(picture: np.ndarray) -> np.ndarray:
    """Means of the blocks of a picture; those at the right and lower edge may be smaller.

    Args:
        picture: shape (height, width, ...).

    Returns:
        Shape (rows, columns, ...).
    """
    height, width = picture.shape[:2]
    side = block_side(height, width)
    y, x = np.arange(0, height, side), np.arange(0, width, side)
    sums = np.add.reduceat(np.add.reduceat(picture, y, axis=0), x, axis=1)
    sizes = block_sizes(height, width)
    return sums / sizes.reshape(*sizes.shape, *[1] * (sums.ndim - 2))


def block_sizes(height: int, width: int) -> np.ndarray:
    """Number of pixels of each block: (rows, columns)."""
    side = block_side(height, width)
    counts = (np.diff(np.r_[np.arange(0, n, side), n]) for n in (height, width))
    return np.multiply.outer(*counts)


def from_blocks(values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Spread values of blocks over their pixels.

    Args:
        values: shape (rows, columns, ...).
        shape: of the picture, beginning with (height, width).
    """
    side = block_side(*shape[:2])
    return values.repeat(side, axis=0)[: shape[0]].repeat(side, axis=1)[:, : shape[1]]


class _Moments:
    """Running mean and sum of squared deviations (Welford, Technometrics 4, 1962)."""

    def __init__(self) -> None:
        self.count = 0
        self.mean: Any = 0.0  # an array of the first value's shape from then on
        self.squares: Any = 0.0

    def add(self, value: np.ndarray) -> None:
        self.count += 1
        deviation = value - self.mean
        self.mean = self.mean + deviation / self.count
        self.squares = self.squares + deviation * (value - self.mean)

    def level(self) -> Level:
        n = self.count
        variance = self.squares / ((n - 1) * n)
        return Level(self.mean, variance, np.full_like(variance, n - 1))


class Runs:
    """Independent pictures of the same thing; memory does not grow with their number.

    Attributes:
        not_finite: values that were NaN or infinite; they count as 0.
        negative: values below 0.
    """

    def __init__(self) -> None:
        self.not_finite = self.negative = 0
        self._levels = (_Moments(), _Moments(), _Moments())

    @property
    def count(self) -> int:
        """Pictures so far."""
        return self._levels[0].count

    def add(self, picture: np.ndarray) -> None:
        """Take a picture of shape (height, width, 3)."""
        picture = np.asarray(picture, dtype=float)
        finite = np.isfinite(picture)
        self.not_finite += int((~finite).sum())
        picture = np.where(finite, picture, 0)
        self.negative += int((picture < 0).sum())
        whole = picture.mean(axis=(0, 1), keepdims=True)
        for moments, value in zip(
            self._levels, (picture, block_means(picture), whole), strict=True
        ):
            moments.add(value)

    def estimate(self) -> Estimate:
        """The `Estimate`.

        Raises:
            ValueError: fewer than two pictures.
        """
        if self.count < 2:
            raise ValueError(f"{self.count} pictures: a variance needs 2 or more")
        pixels, blocks, whole = (moments.level() for moments in self._levels)
        return Estimate(pixels, blocks, whole)


def from_picture(picture: np.ndarray, other: Estimate, step: np.ndarray | float = 0.0) -> Estimate:
    """The estimate that a single picture is, its noise judged by an estimate of the same thing.

    The difference of the two varies from a pixel to the next by the noise of both. What `other`
    does not account for is put down to the picture, shared among the pixels of each block and
    channel in proportion to the variance of `other`. This takes its noise as independent from pixel
    to pixel, and a true difference of the two as smooth; where it is not, as along edges, the noise
    is judged too large: the tests find less.

    Args:
        picture: finite, shape (height, width, 3).
        other: `Estimate` from runs.
        step: between the numbers that the picture's file can hold, (height, width, 1). Values are
            up to one step too low; where the picture is flat, all by the same, so that the error of
            a mean is no smaller than that of a value.

    Returns:
        `Estimate`.

    Source: Rice, Bandwidth choice for nonparametric regression, Annals of Statistics 12, 1984
    (variance from first differences).
    """
    picture = np.asarray(picture, dtype=float)
    shape = picture.shape
    difference = picture - other.pixels.mean
    sums: Any = 0.0
    count: Any = 0.0
    for axis in (0, 1):
        steps = np.diff(difference, axis=axis) ** 2 / 2
        pad = [(0, int(a == axis)) for a in (0, 1)]
        # A step belongs to the block of its first pixel.
        sums = sums + block_means(np.pad(steps, [*pad, (0, 0)]))
        count = count + block_means(np.pad(np.ones(steps.shape[:2]), pad))
    pixels = block_sizes(*shape[:2])[..., None]
    count = np.maximum(count, 1 / pixels[..., 0])[..., None]
    explained = block_means(other.pixels.variance)
    noise = np.maximum(sums / count - explained, 0)
    flat = from_blocks(explained, shape) == 0
    shared = np.where(flat, 1, other.pixels.variance)
    shared = shared * from_blocks(noise / np.where(explained == 0, 1, explained), shape)
    dof = np.broadcast_to(np.maximum(count * pixels, 1), noise.shape)
    share = pixels / pixels.sum()
    # Mean square of an error that is uniform in one step.
    rounding = np.broadcast_to(np.square(step) / 3, (*shape[:2], 1))
    return Estimate(
        Level(picture, shared + rounding, from_blocks(dof, shape)),
        Level(block_means(picture), noise / pixels + block_means(rounding), dof),
        Level(
            picture.mean(axis=(0, 1), keepdims=True),
            (share**2 * noise / pixels).sum(axis=(0, 1), keepdims=True)
            + rounding.mean(axis=(0, 1), keepdims=True),
            dof.sum(axis=(0, 1), keepdims=True),
        ),
        lone=True,
    )
