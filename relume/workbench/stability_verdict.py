"""From the runs of a cell to its verdict: `exact`, `refused`, `degrades` or `fails`.

The error is that of the picture's mean radiance, in units of the known answer; its noise interval
comes from the scatter of independent runs. A cell is

- `exact` where the error lies within its noise, or below `NEGLIGIBLE`, and an error above `WANTED`
  would have been seen;
- `fails` where a value is not finite, where radiance is below 0, where the error is significant and
  above `LIMIT`, and where the scene is refused;
- `degrades` else: by an error up to `LIMIT`, or by noise that hides errors above `WANTED`.

An exact method is given another verdict with the probability `FALSE_ALARMS` for each cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from relume.workbench import statistics

FALSE_ALARMS = 1e-3
"""How often the error of an exact method lies outside its interval."""

POWER = 0.95
"""Probability with which an error of the size `sees` is found."""

NEGLIGIBLE = 1e-3
"""Error that counts as none: rounding, and answers that hold in a limit."""

WANTED = 0.01
"""Smallest error that a cell should be able to see."""

LIMIT = 0.05
"""Error above which a method fails."""

ROUNDING = 1e-5
"""Part of a colour's largest value by which another of its values may be below 0."""


@dataclass(frozen=True)
class Measurement:
    """What was measured of a cell.

    Attributes:
        error: relative error of the mean of that channel where it is most significant.
        half_width: of its interval, at the level 1 - `FALSE_ALARMS` for all channels together.
        sees: smallest error that is found with probability `POWER`.
        not_finite, negative: shares of the values of all runs.
        firefly: largest pixel of any run, in units of the answer.
        samples: number of samples.
        seconds: time of the runs.
        said: what the translation, a warning or the refusal says of it; empty if nothing.
        refused: whether the scene was not rendered at all.
        forbidden: whether the scene language forbids the input; then `refused` means that it was
            refused for that.
    """

    error: float = 0.0
    half_width: float = 0.0
    sees: float = NEGLIGIBLE
    not_finite: float = 0.0
    negative: float = 0.0
    firefly: float = 0.0
    samples: int = 0
    seconds: float = 0.0
    said: str = ""
    refused: bool = False
    forbidden: bool = False

    @property
    def verdict(self) -> str:
        """`exact`, `refused`, `degrades` or `fails`."""
        if self.forbidden:
            return "refused" if self.refused else "fails"
        if self.refused or self.not_finite or self.negative:
            return "fails"
        if abs(self.error) > max(self.half_width, NEGLIGIBLE):
            return "fails" if abs(self.error) > LIMIT else "degrades"
        return "exact" if self.sees <= WANTED else "degrades"

    @property
    def silent(self) -> bool:
        """Whether it fails and nothing says so."""
        return self.verdict == "fails" and not self.said

    def text(self) -> str:
        """The verdict in words."""
        if self.forbidden:
            return "refused as it must be" if self.refused else "fails: forbidden, but not refused"
        if self.refused:
            return "fails: refused"
        if self.not_finite or self.negative:
            kinds = ((self.not_finite, "not finite"), (self.negative, "negative"))
            return "fails: " + ", ".join(f"{share:.2g} {kind}" for share, kind in kinds if share)
        interval = f"{100 * self.error:+.3g} % ± {100 * self.half_width:.1g} %"
        if self.verdict == "exact":
            return f"exact: {interval}"
        if abs(self.error) <= max(self.half_width, NEGLIGIBLE):
            return f"degrades: noisy, {interval}"
        return f"{self.verdict}: {interval}"


class RunStatistics:
    """The mean radiances of a cell's runs, and what is wrong with their values.

    Args:
        expected: known mean, a number or three.
        scale: radiance in units of which errors are given.
        to_xyz: (3, 3), from the pictures' RGB to XYZ if they are rendered by wavelengths. Light of
            one wavelength is a colour that RGB cannot hold, so that one of its values is below 0
            and has to be; X, Y and Z are below 0 where radiance is.
    """

    def __init__(
        self,
        expected: float | Sequence[float],
        scale: float,
        to_xyz: np.ndarray | None = None,
    ) -> None:
        self.expected = np.broadcast_to(np.asarray(expected, float), 3)
        self.scale = float(scale)
        self.to_xyz = to_xyz
        self.means: list[np.ndarray] = []
        self.not_finite = self.negative = self.values = 0
        self.largest = 0.0

    def add(self, picture: np.ndarray) -> None:
        """Take a picture, (height, width, 3)."""
        finite = np.isfinite(picture)
        picture = np.where(finite, picture, 0.0)
        self.values += picture.size
        self.not_finite += picture.size - int(finite.sum())
        self.negative += int(self._below_zero(picture).sum())
        self.largest = max(self.largest, float(picture.max()))
        self.means.append(picture.mean(axis=(0, 1), dtype=float))

    def _below_zero(self, picture: np.ndarray) -> np.ndarray:
        """Which values are those of radiance below 0, (height, width, 3)."""
        if self.to_xyz is None:
            return picture < 0
        largest = np.abs(picture).max(axis=-1, keepdims=True)
        return picture @ self.to_xyz.T < -ROUNDING * largest

    def measurement(self, **about: Any) -> Measurement:
        """The `Measurement` so far; `about` are its attributes that do not follow from the runs."""
        means = np.array(self.means)
        variance = means.var(axis=0, ddof=1) / len(means)
        dof = np.full(3, len(means) - 1.0)
        each = -np.expm1(np.log1p(-FALSE_ALARMS) / 3)
        widths = statistics.half_width(variance, dof, 1 - each)
        errors = means.mean(axis=0) - self.expected
        channel = int(np.argmax(np.abs(errors) - widths))
        half_width = widths[channel] / self.scale
        missed = statistics.half_width(variance, dof, 2 * POWER - 1)[channel] / self.scale
        return Measurement(
            error=float(errors[channel] / self.scale),
            half_width=float(half_width),
            sees=float(max(NEGLIGIBLE, half_width + missed)),
            not_finite=self.not_finite / self.values,
            negative=self.negative / self.values,
            firefly=self.largest / self.scale,
            **about,
        )
