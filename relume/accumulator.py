"""The sum of passes: the picture so far, and the variance of its pixels.

The same set of passes gives the same accumulator, bit for bit, in whatever order they were added
and merged; see `relume.exact`.

For each pixel and channel there are the weight W (samples per pixel), the sum S of the samples and
the sum Q of the squares of independent observations, each times its weight. Samples are
observations of weight 1. A pass that is independent only as a whole is one observation of weight
spp, its mean. With n observations the picture is S / W, and the variance of that mean is estimated
without bias by (Q - S^2 / W) / ((n - 1) W).
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
        observations: independent observations of each pixel.
        sum: `ExactSum` of shape (3, pixels).
        squares: `ExactSum` of shape (3, pixels).
    """

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.done = PassSet()
        self.observations = 0
        self.sum = ExactSum((3, width * height))
        self.squares = ExactSum((3, width * height))

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
        if found.squares is None:
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

    def image(self) -> np.ndarray:
        """The picture so far: linear RGB, (height, width, 3) float32; NaN where nothing is."""
        if not self.done:
            return np.full((self.height, self.width, 3), np.nan, np.float32)
        return self._picture(self.sum.value() / self.spp).astype(np.float32)

    def variance(self) -> np.ndarray:
        """Variances of the picture's values: (height, width, 3) float64; NaN where unknown."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
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
