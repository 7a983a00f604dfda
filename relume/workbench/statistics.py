"""Tests of rendered pictures: whether two estimates have the same means, and by how much not.

Two estimates are compared by Welch's t, which is turned into the standard normal score z of the
same tail probability, so that a score means the same for few and for many runs. Of m tests the
largest |z| counts against Šidák's level 1 - (1 - rate)^(1/m).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, special

from relume.workbench.estimates import Estimate, Level, block_means, from_blocks

ROUNDING = 4 * 2.0**-23
"""Relative standard error that any mean of float32 pictures has at least."""

UNDERFLOW = 1e-300
"""Tail probability below which its logarithm is taken from an asymptotic formula."""


@dataclass(frozen=True)
class Scores:
    """Scores of m simultaneous two-sided tests for equal means.

    Attributes:
        z: normal scores, of the level's shape; the sign is that of the first mean less the second.
        threshold: |z| that all stay below, but for the stated rate of false alarms.
        counts: whether a score above it means a difference.
    """

    z: np.ndarray
    threshold: float
    counts: bool = True

    @property
    def rejected(self) -> int:
        """Number of scores above the threshold."""
        return int((np.abs(self.z) > self.threshold).sum())

    @property
    def differ(self) -> bool:
        """Whether a difference is found."""
        return self.counts and self.rejected > 0

    def place(self, size: np.ndarray) -> tuple[np.intp, ...]:
        """Index of the largest `size` among scores above the threshold; of |z| if there is none."""
        z = np.abs(self.z)
        size = np.where(z > self.threshold, size, -1) if self.rejected else z
        return np.unravel_index(size.argmax(), size.shape)


def normal_score(t: np.ndarray | float, dof: np.ndarray | float) -> np.ndarray:
    """The standard normal score with the tail probability of Student's t.

    Args:
        t: Student's t.
        dof: degrees of freedom, 1 or more.
    """
    x, nu = np.broadcast_arrays(np.abs(np.asarray(t, float)), np.asarray(dof, float))
    p = special.stdtr(nu, -x)
    z = -special.ndtri(p)
    far = p < UNDERFLOW
    if far.any():
        z = np.where(far, -special.ndtri_exp(_log_tail(x, nu)), z)
    return np.sign(t) * z


def _log_tail(t: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """log of the tail probability of Student's t, for large t: the density times
    (nu + t²) / (nu t), which tends to it as t² / nu goes to 0 and to infinity."""
    t = np.maximum(t, 1)
    log_density = -0.5 * np.log(nu) - special.betaln(nu / 2, 0.5)
    log_density = log_density - (nu + 1) / 2 * np.log1p(t * t / nu)
    return log_density + np.log((nu + t * t) / (nu * t))


def half_width(variance: np.ndarray, dof: np.ndarray, confidence: float | np.ndarray) -> np.ndarray:
    """Half-width of the confidence interval of a mean with an estimated variance."""
    return -special.stdtrit(dof, (1 - confidence) / 2) * np.sqrt(variance)


def difference(a: Level, b: Level) -> Level:
    """Difference of two levels, with its variance and Welch's degrees of freedom.

    Args:
        a: `Level`.
        b: `Level` of the same shape.

    Returns:
        `Level` of a - b.

    Source: Welch, The generalization of Student's problem, Biometrika 34, 1947.
    """
    variance = a.variance + b.variance
    with np.errstate(invalid="ignore"):
        dof = variance**2 / (a.variance**2 / a.dof + b.variance**2 / b.dof)
    floor = np.minimum(a.dof, b.dof)
    # Where both are free of noise, what is left is rounding.
    rounding = (ROUNDING * np.maximum(np.abs(a.mean), np.abs(b.mean))) ** 2
    return Level(a.mean - b.mean, variance + rounding, np.fmax(dof, floor))


def threshold(rate: float, tests: int) -> float:
    """|z| that all of `tests` standard normal scores stay below, but for a share `rate` of cases.

    Source: Šidák, Rectangular confidence regions, JASA 62, 1967; it holds for dependent scores too.
    """
    level = -np.expm1(np.log1p(-rate) / tests)
    return float(-special.ndtri(level / 2))


def equal_means(a: Level, b: Level, rate: float, counts: bool = True) -> Scores:
    """Test two levels for equal means.

    Args:
        a: `Level`.
        b: `Level` of the same shape.
        rate: how often equal means may be found to differ in any of the tests, such as 0.01.
        counts: as `Scores`.

    Returns:
        `Scores`.
    """
    d = difference(a, b)
    t = np.divide(d.mean, np.sqrt(d.variance), out=np.zeros_like(d.mean), where=d.variance > 0)
    return Scores(normal_score(t, d.dof), threshold(rate, t.size), counts)


def pooled(estimate: Estimate) -> tuple[Level, Level]:
    """Blocks and pixels of an estimate, their variances at least the average of the neighbourhood.

    A region that by chance saw none of the rare bright paths shows neither their light nor their
    variance; the blocks around it do. Without this, methods with different noise and the same mean
    would be found to differ. Light that fewer than about 20 paths of all runs found in such a
    neighbourhood may still be missed together with its variance, and be taken for a difference.

    Returns:
        `Level` of the blocks and `Level` of the pixels; the neighbourhood is 3x3 blocks.
    """

    def at_least(level: Level, average: np.ndarray) -> Level:
        return Level(level.mean, np.maximum(level.variance, average), level.dof)

    pixels, blocks = estimate.pixels, estimate.blocks
    average = _mean_of_nine(block_means(pixels.variance))
    return (
        at_least(blocks, _mean_of_nine(blocks.variance)),
        at_least(pixels, from_blocks(average, pixels.mean.shape)),
    )


def _mean_of_nine(values: np.ndarray) -> np.ndarray:
    """Mean over each block and its neighbours; those at an edge count twice beyond it."""
    return ndimage.correlate(values, np.full((3, 3, 1), 1 / 9), mode="nearest")


def all_levels(a: Estimate, b: Estimate, rate: float) -> dict[str, Scores]:
    """Test the whole picture, its blocks and its pixels.

    Pixels do not count where one side is a lone picture: how much a single one of its pixels may
    stray by chance cannot be inferred from the others.

    Args:
        a: `Estimate`.
        b: `Estimate` of the same shape.
        rate: how often two methods of equal expectation may fail any of the tests.

    Returns:
        Dictionary of `Scores` by `whole`, `blocks` and `pixels`.
    """
    each = -np.expm1(np.log1p(-rate) / 3)
    (blocks_a, pixels_a), (blocks_b, pixels_b) = pooled(a), pooled(b)
    return {
        "whole": equal_means(a.whole, b.whole, each),
        "blocks": equal_means(blocks_a, blocks_b, each),
        "pixels": equal_means(pixels_a, pixels_b, each, not (a.lone or b.lone)),
    }


def ratio(a: Level, b: Level, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Ratios of the means of two levels, with the half-widths of their intervals.

    Args:
        a: `Level`.
        b: `Level` of the same shape; the ratio is NaN where its mean is 0.
        confidence: such as 0.95.

    Returns:
        Ratio and half-width; linearized, so right for small relative errors of b.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        r = np.where(b.mean != 0, a.mean / b.mean, np.nan)
        scaled = Level(r * b.mean, r**2 * b.variance, b.dof)
        d = difference(Level(a.mean, a.variance, a.dof), scaled)
        return r, half_width(d.variance, d.dof, confidence) / np.abs(b.mean)
