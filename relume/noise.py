"""The noise of a picture as advice: what less of it would cost, and when enough was rendered.

Noise is what `Accumulator.noise` tells: the standard error of the picture's values, as root mean
square, over their mean. It falls as the root of the number of samples, or faster where these are
spread evenly: what the advice tells is the most that it would take.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from relume.accumulator import Accumulator
from relume.progress import Progress

WISHED = 0.01
"""Noise that the advice speaks of."""

MOST = 2**20
"""Samples of a pixel after which a render ends that waits for its noise alone."""

LEAST = 8
"""Observations of a pixel without which its noise is not judged."""

GROWTH = 1.1
"""The noise is judged when there are so many times the samples of the last time: each judgement is
another chance to be wrong."""

CONFIDENCE = 2.33
"""Standard errors by which the noise must lie below its goal: one side of 99 %."""

UNITS = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))


def advice(noise: float, seconds: float) -> str:
    """The noise in words, and what 1 % would take.

    Args:
        noise: relative to the mean, finite.
        seconds: that the render took so far.
    """
    text = f"noise of a pixel: {in_words(noise)}"
    if noise <= WISHED:
        return text
    factor = (noise / WISHED) ** 2
    time = f" ({duration(seconds * factor)})" if seconds > 0 else ""
    return f"{text}; 1 % would take {significant(factor)} times the samples{time}"


def in_words(ratio: float) -> str:
    """A ratio to the mean: in percent, or where it is large how many times the mean."""
    if ratio < 2:
        return f"{significant(100 * ratio)} % of the mean"
    return f"{significant(ratio)} times its mean"


def significant(value: float) -> str:
    """A number with two significant digits, and no exponent."""
    return np.format_float_positional(value, 2, unique=False, fractional=False, trim="-")


def duration(seconds: float) -> str:
    """A time in the largest unit of which it has two, such as `20 min`."""
    unit, name = next(((u, n) for u, n in UNITS if seconds >= 2 * u), UNITS[-1])
    return f"{significant(seconds / unit)} {name}"


def observations(accumulator: Accumulator) -> int:
    """Observations that make up a pixel: samples, where these are of two sequences."""
    return accumulator.observations if accumulator.lead is None else accumulator.spp


def upper_bound(accumulator: Accumulator) -> float:
    """What the noise is at most, by `CONFIDENCE`; NaN where it is unknown.

    The mean of the pixels' variances has an error of its own, that is taken from their spread. The
    spread is also that of the picture itself, so that the bound errs to the safe side.
    """
    variances = accumulator.variance().mean(axis=2)
    error = variances.std() / math.sqrt(variances.size)
    factor = math.sqrt(1 + CONFIDENCE * error / mean) if (mean := variances.mean()) > 0 else 1.0
    return accumulator.noise() * factor


class Goal:
    """Tells when the noise of a render is as low as was asked for.

    Args:
        noise: relative to the mean; None for never.
        all_spp: samples of a pixel at which the render ends in any case.

    Raises:
        ValueError: the noise is not above 0.
    """

    def __init__(self, noise: float | None, all_spp: int = MOST) -> None:
        if noise is not None and not 0 < noise < math.inf:
            raise ValueError(f"noise {noise}: expected more than 0 % of the mean")
        self.noise = noise
        self._all_spp, self._next, self._factor = all_spp, 0.0, math.nan

    def reached(self, accumulator: Accumulator) -> bool:
        """Whether enough was rendered; to be asked after each pass."""
        if self.noise is None or observations(accumulator) < LEAST:
            return False
        if accumulator.spp < self._next:
            return False
        self._next = GROWTH * accumulator.spp
        self._factor = accumulator.spp * (upper_bound(accumulator) / self.noise) ** 2
        return self._factor <= accumulator.spp

    def foreseen(self, progress: Progress) -> Progress:
        """Progress towards the goal rather than towards the most samples."""
        if self.noise is None or math.isnan(self._factor):
            return progress
        spp = int(min(max(self._factor, progress.spp), self._all_spp))
        passes = math.ceil(progress.passes * spp / max(progress.spp, 1))
        return dataclasses.replace(progress, all_passes=passes, all_spp=spp)
