"""Error curves: from independent pictures at growing numbers of samples to slopes and times.

With pictures I_1 .. I_n of a method at one number of samples, the reference R and its variance V,
and the weights w of relMSE,

    G_ij = mean(w (I_i - R) (I_j - R)) - mean(w V)

has the expectation bias² for i != j and bias² + variance for i = j: the noise of R is subtracted.
So the error is the mean of its diagonal and bias² that of the rest, without any assumption on the
noise: pixels of one picture may depend on each other, as those of Markov chains do. Intervals are
the jackknife's, over the pictures.

Source: Celarek et al., Quantifying the Error of Light Transport Algorithms, Computer Graphics Forum
38, 2019 (many short renders; the reference's variance); Efron and Stein, The Jackknife Estimate of
Variance, Annals of Statistics 9, 1981.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from relume.workbench import measures, statistics
from relume.workbench.estimates import Estimate

CONFIDENCE = 0.95

Interval: TypeAlias = tuple[np.ndarray, np.ndarray]
"""Values and the half-widths of their intervals."""

LEAST_LEVELS = 3
"""Numbers of samples that a slope needs."""


@dataclass(frozen=True)
class Curve:
    """What was measured of one method.

    Attributes:
        name: of the method.
        spp: (levels,) samples of a pixel, growing.
        gram: (levels, runs, runs) matrices G.
        shared: (levels,) variances of bias² by the noise of the reference, the same for all runs.
        wall: (levels, runs) durations [s].
        cpu: (levels, runs) processor times [s].
        first: duration of the very first render beyond that of the next one [s]: compilation.
        not_finite: values that were NaN or infinite; they count as 0.
    """

    name: str
    spp: np.ndarray
    gram: np.ndarray
    shared: np.ndarray
    wall: np.ndarray
    cpu: np.ndarray
    first: float
    not_finite: int

    @property
    def runs(self) -> int:
        """Independent pictures at each number of samples."""
        return self.gram.shape[1]

    def time(self, clock: str = "wall") -> np.ndarray:
        """Median time of a render at each number of samples [s]; `clock` is `wall` or `cpu`."""
        return np.median(getattr(self, clock), axis=1)

    def error(self) -> Interval:
        """relMSE with the half-width of its interval, (levels,) each; the reference's noise
        is subtracted."""
        return jackknife(error, self.gram)

    def bias2(self) -> Interval:
        """bias² of relMSE with the half-width of its interval, (levels,) each."""
        return jackknife(bias2, self.gram, self.shared)

    def biased(self) -> bool:
        """Whether the bias at the most samples is more than chance and the reference explain."""
        value, half = jackknife(bias2, self.gram[-1:], self.shared[-1:], confidence=0.999)
        return bool(value[0] > half[0])

    def error_at(self, times: np.ndarray, clock: str = "wall") -> np.ndarray:
        """The error after some times: straight in the logarithms between the points, infinite
        before the first; beyond the last the variance falls with the samples and the bias stays.

        Args:
            times: [s].
            clock: `wall` or `cpu`.
        """
        e, known = error(self.gram), self.time(clock)
        x = np.log(np.maximum.accumulate(known))
        y = np.log(np.maximum(e, 2.0**-1022))
        floor = max(float(bias2(self.gram)[-1]), 0.0) if self.biased() else 0.0
        spp = self.spp[-1] + (times - known[-1]) / each(known, self.spp)
        beyond = floor + (e[-1] - floor) * self.spp[-1] / np.maximum(spp, self.spp[-1])
        inside = np.exp(np.interp(np.log(times), x, y, left=np.inf))
        return np.where(times > known[-1], beyond, inside)

    def slope(self, x: np.ndarray | None = None) -> tuple[float, float] | None:
        """Slope of log error over log x with the half-width of its interval.

        Args:
            x: (levels,); None for the numbers of samples.

        Returns:
            Two numbers; None if there are fewer than `LEAST_LEVELS` errors above 0.
        """
        x = np.log(self.spp if x is None else x)
        seen = error(self.gram) > 0
        if seen.sum() < LEAST_LEVELS:
            return None

        def fitted(gram: np.ndarray) -> float:
            e = error(gram)[seen]
            return np.polyfit(x[seen], np.log(e), 1)[0] if (e > 0).all() else np.nan

        value, half = jackknife(fitted, self.gram)
        return float(value), float(half)

    def time_to(self, target: float, clock: str = "wall") -> tuple[float, float]:
        """Time until the error falls to a target [s], with the interval of its logarithm.

        Between the measured points it is interpolated; beyond the last one the variance is taken to
        fall with the number of samples and the bias to stay.

        Args:
            target: relMSE.
            clock: `wall` or `cpu`.

        Returns:
            Time and half-width of log time; time infinite where the bias is above the target.
        """
        times, stays = self.time(clock), self.biased()

        def found(gram: np.ndarray) -> float:
            floor = max(float(bias2(gram)[-1]), 0.0) if stays else 0.0
            return math.log(reached(target, times, error(gram), self.spp, floor))

        value, half = jackknife(found, self.gram)
        return math.exp(value), float(half)


def front(
    curves: Sequence[Curve], clock: str = "wall", steps: int = 256
) -> tuple[np.ndarray, np.ndarray]:
    """The Pareto front of several curves: the least error after each time.

    Args:
        curves: list of `Curve`.
        clock: `wall` or `cpu`.
        steps: number of times.

    Returns:
        Times from the first point of all to the last [s], and the errors: (steps,) each.
    """
    ends = [curve.time(clock)[[0, -1]] for curve in curves]
    times = np.geomspace(min(first for first, _ in ends), max(last for _, last in ends), steps)
    return times, np.min([curve.error_at(times, clock) for curve in curves], axis=0)


def on_front(curve: Curve, others: Sequence[Curve], clock: str = "wall") -> np.ndarray:
    """Whether no other curve is below the points of a curve: (levels,) of bool."""
    times, e = curve.time(clock), error(curve.gram)
    return np.all([e <= other.error_at(times, clock) for other in others], axis=0)


def gram(pictures: np.ndarray, reference: Estimate) -> tuple[np.ndarray, float]:
    """The matrix G of one number of samples, and the variance that the reference gives its bias².

    Args:
        pictures: (runs, height, width, 3), finite.
        reference: `estimates.Estimate`.

    Returns:
        (runs, runs) and a number.
    """
    w, V = measures.weight(reference.pixels.mean), reference.pixels.variance
    off = np.asarray(pictures, dtype=float) - reference.pixels.mean
    flat = (np.sqrt(w) * off).reshape(len(off), -1)
    count = flat.shape[1]
    d = off.mean(axis=0)
    # Var mean(w (d² - V)) <= 4 mean(w² d² V) / count, d being off by the noise of R: delta method.
    shared = 4 * float((w**2 * d**2 * V).mean()) / count
    return flat @ flat.T / count - float((w * V).mean()), shared


def error(gram: np.ndarray) -> np.ndarray:
    """Mean of the diagonals of (levels, runs, runs)."""
    return np.trace(gram, axis1=1, axis2=2) / gram.shape[1]


def bias2(gram: np.ndarray) -> np.ndarray:
    """Mean of what is off the diagonals of (levels, runs, runs)."""
    runs = gram.shape[1]
    return (gram.sum(axis=(1, 2)) - runs * error(gram)) / (runs * (runs - 1))


def jackknife(
    function: Callable[[np.ndarray], np.ndarray | float],
    gram: np.ndarray,
    shared: np.ndarray | float = 0.0,
    confidence: float = CONFIDENCE,
) -> Interval:
    """The value of a function of the runs, and the half-width of its interval.

    Args:
        function: from (levels, runs, runs) to a number or an array.
        gram: (levels, runs, runs), 3 runs or more.
        shared: variance of what all runs have in common.
        confidence: of the interval.

    Returns:
        Value and half-width; the latter is NaN or infinite where the value is.
    """
    runs = gram.shape[1]
    keep = ~np.eye(runs, dtype=bool)
    without = np.array([function(gram[:, k][:, :, k]) for k in keep])
    value = np.asarray(function(gram))
    with np.errstate(invalid="ignore"):
        variance = (runs - 1) * without.var(axis=0)
    dof = np.full(value.shape, runs - 1.0)
    return value, statistics.half_width(variance + shared, dof, confidence)


def each(times: np.ndarray, spp: np.ndarray) -> float:
    """Time of one more sample of a pixel [s], without what a render takes besides."""
    more = (times[-1] - times[0]) / (spp[-1] - spp[0])
    return more if more > 0 else times[-1] / spp[-1]


def reached(
    target: float, times: np.ndarray, errors: np.ndarray, spp: np.ndarray, floor: float = 0.0
) -> float:
    """Time at which an error curve falls to a target.

    Args:
        target: error.
        times: (levels,) growing [s].
        errors: (levels,).
        spp: (levels,) samples of a pixel.
        floor: the part of the last error that stays.

    Returns:
        Time [s]; infinite if the target is not above the floor; the first time if the curve begins
        below the target.
    """
    (below,) = np.nonzero(errors <= target)
    if len(below) and below[0] == 0:
        return float(times[0])
    if len(below):
        k = below[0]
        low = max(float(errors[k]), 1e-3 * target)  # noise may take it to 0
        share = math.log(errors[k - 1] / target) / math.log(errors[k - 1] / low)
        return float(times[k - 1] * (times[k] / times[k - 1]) ** share)
    if target <= floor:
        return math.inf
    needed = spp[-1] * (errors[-1] - floor) / (target - floor)
    return float(times[-1] + each(times, spp) * (needed - spp[-1]))
