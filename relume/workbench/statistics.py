"""Statistics of rendered pictures: from many independent pictures to an error with its interval.

A method is known by its runs: independent pictures of the same thing. `Runs` takes them one after
the other and gives an `Estimate`: mean, variance of the mean and degrees of freedom of each pixel,
of each block of pixels and of the whole picture. Blocks and the whole are means within one run
before their variance is taken, so pixels of one run may depend on each other. A picture without
runs becomes an estimate by `from_picture`.

Two estimates are compared by Welch's t, which is turned into a standard normal score z by Hill's
formula, so that a score means the same for few and for many runs. Of m tests the largest |z| counts
against Šidák's level 1 - (1 - rate)^(1/m).
"""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

BLOCKS = 16
"""Blocks along the longer side of a picture."""

ROUNDING = 4 * float(np.finfo(np.float32).eps)
"""Relative standard error that any mean of float32 pictures has at least."""

NORMAL = NormalDist()


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
    def rejected(self):
        """Number of scores above the threshold."""
        return int((np.abs(self.z) > self.threshold).sum())

    @property
    def differ(self):
        """Whether a difference is found."""
        return self.counts and self.rejected > 0

    def place(self, size):
        """Index of the largest `size` among scores above the threshold; of |z| if there is none."""
        z = np.abs(self.z)
        size = np.where(z > self.threshold, size, -1) if self.rejected else z
        return np.unravel_index(size.argmax(), size.shape)


def block_side(height, width):
    """Side of the square blocks of a picture [pixel]; at least 4."""
    return max(4, -(-max(height, width) // BLOCKS))


def block_means(picture):
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


def block_sizes(height, width):
    """Number of pixels of each block: (rows, columns)."""
    side = block_side(height, width)
    counts = (np.diff(np.r_[np.arange(0, n, side), n]) for n in (height, width))
    return np.multiply.outer(*counts)


def from_blocks(values, shape):
    """Spread values of blocks over their pixels.

    Args:
        values: shape (rows, columns, ...).
        shape: of the picture, beginning with (height, width).
    """
    side = block_side(*shape[:2])
    return values.repeat(side, axis=0)[: shape[0]].repeat(side, axis=1)[:, : shape[1]]


class _Moments:
    """Running mean and sum of squared deviations (Welford, Technometrics 4, 1962)."""

    def __init__(self):
        self.count = 0
        self.mean = self.squares = 0.0

    def add(self, value):
        self.count += 1
        deviation = value - self.mean
        self.mean = self.mean + deviation / self.count
        self.squares = self.squares + deviation * (value - self.mean)

    def level(self):
        n = self.count
        variance = self.squares / ((n - 1) * n)
        return Level(self.mean, variance, np.full_like(variance, n - 1))


class Runs:
    """Independent pictures of the same thing; memory does not grow with their number.

    Attributes:
        not_finite: values that were NaN or infinite; they count as 0.
        negative: values below 0.
    """

    def __init__(self):
        self.not_finite = self.negative = 0
        self._levels = (_Moments(), _Moments(), _Moments())

    @property
    def count(self):
        """Pictures so far."""
        return self._levels[0].count

    def add(self, picture):
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

    def estimate(self):
        """The `Estimate`.

        Raises:
            ValueError: fewer than two pictures.
        """
        if self.count < 2:
            raise ValueError(f"{self.count} pictures: a variance needs 2 or more")
        return Estimate(*(moments.level() for moments in self._levels))


def from_picture(picture, other, step=0.0):
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
    sums, count = 0.0, 0.0
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


def normal_score(t, dof):
    """The standard normal score with the tail probability of Student's t.

    Args:
        t: Student's t.
        dof: degrees of freedom, 3 or more for three digits.

    Source: Hill, Algorithm 395: Student's t-distribution, CACM 13, 1970.
    """
    a = dof - 0.5
    b = 48 * a * a
    y = a * np.log1p(t * t / dof)
    series = (((-0.4 * y - 3.3) * y - 24) * y - 85.5) / (0.8 * y * y + 100 + b) + y + 3
    return np.sign(t) * (series / b + 1) * np.sqrt(y)


def half_width(variance, dof, confidence):
    """Half-width of the confidence interval of a mean with an estimated variance."""
    z = -NORMAL.inv_cdf((1 - confidence) / 2)
    low, high = np.zeros_like(dof, dtype=float), np.full_like(dof, 1e6, dtype=float)
    for _ in range(60):  # bisection for the t that has this score
        middle = (low + high) / 2
        below = normal_score(middle, dof) < z
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return high * np.sqrt(variance)


def difference(a, b):
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


def threshold(rate, tests):
    """|z| that all of `tests` standard normal scores stay below, but for a share `rate` of cases.

    Source: Šidák, Rectangular confidence regions, JASA 62, 1967; it holds for dependent scores too.
    """
    level = -np.expm1(np.log1p(-rate) / tests)
    return -NORMAL.inv_cdf(level / 2)


def equal_means(a, b, rate, counts=True):
    """Test two levels for equal means.

    Args:
        a: `Level`.
        b: `Level` of the same shape.
        rate: how often means that are all equal may be told to differ, such as 0.01.
        counts: as `Scores`.

    Returns:
        `Scores`.
    """
    d = difference(a, b)
    t = np.divide(d.mean, np.sqrt(d.variance), out=np.zeros_like(d.mean), where=d.variance > 0)
    return Scores(normal_score(t, d.dof), threshold(rate, t.size), counts)


def pooled(estimate):
    """Blocks and pixels of an estimate, their variances at least the average of the neighbourhood.

    A region that by chance saw none of the rare bright paths shows neither their light nor their
    variance; the blocks around it do. Without this, methods with different noise and the same mean
    would be told to differ. Light that fewer than about 20 paths of all runs found in such a
    neighbourhood may still be missed together with its variance, and be told to be a difference.

    Returns:
        `Level` of the blocks and `Level` of the pixels; the neighbourhood is 3x3 blocks.
    """

    def at_least(level, average):
        return Level(level.mean, np.maximum(level.variance, average), level.dof)

    pixels, blocks = estimate.pixels, estimate.blocks
    average = _mean_of_nine(block_means(pixels.variance))
    return (
        at_least(blocks, _mean_of_nine(blocks.variance)),
        at_least(pixels, from_blocks(average, pixels.mean.shape)),
    )


def _mean_of_nine(values):
    """Mean over each block and its neighbours; those at an edge count twice beyond it."""
    padded = np.pad(values, ((1, 1), (1, 1), (0, 0)), mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, (3, 3), (0, 1)).mean(axis=(-2, -1))


def all_levels(a, b, rate):
    """Test the whole picture, its blocks and its pixels.

    Pixels do not count where one side is a lone picture: how much a single one of its pixels may
    stray by chance cannot be told from the others.

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


def ratio(a, b, confidence):
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
