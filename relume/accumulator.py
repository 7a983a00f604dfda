"""The sum of passes: the picture so far, and the variance of its pixels.

The same set of passes gives the same accumulator, bit for bit, in whatever order they were added
and merged; see `relume.exact`.

For each pixel and channel there are the weight W (samples per pixel), the sum S of the samples and
the sum Q of the squares of independent observations, each times its weight. Samples are
observations of weight 1. A pass that is independent only as a whole is one observation of weight
spp, its mean. With n observations the picture is S / W, and the variance of that mean is estimated
without bias by (Q - S^2 / W) / ((n - 1) W).

Samples of two independent sequences have, instead of Q, the difference D of the sums over either
and the lead l = n1 - n2 of the first, n1 + n2 = W. If the means of sequences vary as 1 / n1 and
1 / n2, that of S / W is estimated without bias by n1 n2 / W^2 times the squared difference of the
two means, (D - S l / W)^2 / (W^2 - l^2).
"""

from __future__ import annotations

import numpy as np

from relume.exact import ExactSum
from relume.passes import Pass, PassSet


class Accumulator:
    """Passes added up.

    Args:
        width: of the picture [pixel].
        height: of the picture [pixel].

    Attributes:
        done: `PassSet` of what was added.
        observations: independent observations of each pixel; sequences, where there are two.
        lead: as l above; None where the samples are not of two sequences.
        sum: `ExactSum` of shape (3, pixels).
        squares: `ExactSum` of shape (3, pixels).
        difference: `ExactSum` of shape (3, pixels).
    """

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.done = PassSet()
        self.observations = 0
        self.sum = ExactSum((3, width * height))
        self.squares = ExactSum((3, width * height))
        self.difference = ExactSum((3, width * height))
        self.lead: int | None = None

    @property
    def spp(self) -> int:
        """Samples of a pixel so far."""
        return self.done.spp

    def add(self, found: Pass) -> None:
        """Add a pass.

        Raises:
            ValueError: it was added before.
        """
        self.done = self.done.with_pass(found.index, found.spp)
        self.sum.add(found.sum)
        if found.difference is not None:
            self.difference.add(found.difference)
            self._take_lead(found.lead)
        elif found.squares is None:
            self.observations += 1
            with np.errstate(over="ignore", invalid="ignore"):
                self.squares.add(found.sum * (found.sum / np.float32(found.spp)))
        else:
            self.observations += found.spp
            self.squares.add(found.squares)

    def merge(self, other: Accumulator) -> None:
        """Add all passes of another accumulator of the same render.

        Raises:
            ValueError: some were added before.
        """
        self.done = self.done.union(other.done)
        self.observations += other.observations
        self.sum.merge(other.sum)
        self.squares.merge(other.squares)
        if other.lead is not None:
            self.difference.merge(other.difference)
            self._take_lead(other.lead)

    def _take_lead(self, lead: int) -> None:
        self.lead = (self.lead or 0) + lead
        self.observations = 2 if abs(self.lead) < self.spp else 1

    def image(self) -> np.ndarray:
        """The picture so far: linear RGB, (height, width, 3) float32; NaN where nothing is."""
        if not self.done:
            return np.full((self.height, self.width, 3), np.nan, np.float32)
        return self._picture(self.sum.value() / self.spp).astype(np.float32)

    def variance(self) -> np.ndarray:
        """Variances of the picture's values: (height, width, 3) float64; NaN where unknown."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            if self.lead is not None:
                scatter = self.difference.value() - self.sum.value() * (self.lead / self.spp)
                return self._picture(scatter**2 / (self.spp**2 - self.lead**2))
            deviation = self.squares.value() - self.sum.value() ** 2 / max(self.spp, 1)
            n = self.observations
            # Below 0 by rounding alone.
            known = np.maximum(deviation, 0) / ((n - 1) * self.spp) if n > 1 else deviation * np.nan
        return self._picture(known)

    def noise(self) -> float:
        """Standard error of the picture's values, their root mean square relative to their mean.

        Returns:
            NaN where it is unknown.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            return float(np.sqrt(self.variance().mean()) / self.image().mean(dtype=float))

    def _picture(self, planes: np.ndarray) -> np.ndarray:
        return np.moveaxis(planes.reshape(3, self.height, self.width), 0, -1)
