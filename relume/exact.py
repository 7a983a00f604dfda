"""Sums of pictures that do not depend on the order of summation: exact, rounded once at the end.

Floating-point addition is not associative, so a picture summed in another order, or in parts on
several machines, would differ in its last bits. Here every float32 is split into integer multiples
of fixed powers of two, 2^-180, 2^-140 ... 2^100, each summed separately. Such a sum is exact in
double precision up to 2^53 units, each value brings at most 2^39 of them, and carries keep it
there, so no bit is ever lost between the smallest float32 and 2^25 times the largest.

Source: Demmel and Nguyen, Parallel reproducible summation, IEEE Transactions on Computers 64, 2015,
of which this is the variant that keeps all bins.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

STEP = 40
"""Bits between two levels."""

LEVELS = tuple(range(-180, 101, STEP))
"""Exponents of the units: the smallest float32 is 2^-149, the largest below 2^128."""

CARRY = 2**12
"""Most sums between two carries: 2^12 times 2^39 units, and what was there, are below 2^53."""

TILE = 2**15
"""Values handled at a time: they stay in the cache."""


class ExactSum:
    """The sum of float32 arrays of one shape.

    Values that are infinite or NaN are summed separately by the rules of IEEE 754, which do not
    depend on the order either.

    Args:
        shape: of the arrays.

    Attributes:
        levels: dictionary of float64 arrays by the exponent of their unit, those in use.
        special: float32 sum of the values that are not finite, or None.
    """

    def __init__(self, shape: Sequence[int]) -> None:
        self.shape = tuple(shape)
        self.levels: dict[int, np.ndarray] = {}
        self.special: np.ndarray | None = None
        self._sums = 0

    def add(self, values: np.ndarray) -> None:
        """Add an array.

        Args:
            values: float32, of the sum's shape.
        """
        values = np.ascontiguousarray(values, np.float32).reshape(-1)
        finite = np.isfinite(values)
        if not finite.all():
            self._add_special(np.where(finite, np.float32(0), values).reshape(self.shape))
            values = np.where(finite, values, np.float32(0))
        self._make_room()
        for first in range(0, values.size, TILE):
            tile = slice(first, first + TILE)
            self._add_tile(values[tile].astype(np.float64), tile)

    def merge(self, other: ExactSum) -> None:
        """Add another sum of the same shape."""
        other.carry()
        self._make_room()
        for exponent, plane in other.levels.items():
            self._plane(exponent)[:] += plane.reshape(-1)
        if other.special is not None:
            self._add_special(other.special)

    def carry(self) -> None:
        """Bring the sum into its canonical form, the same whatever the order of summation was.

        Every level but the last holds from -2^39 up to, but not, 2^39 units, and some other value
        than 0.
        """
        for exponent in LEVELS[:-1]:
            if exponent in self.levels:
                for first in range(0, self.levels[exponent].size, TILE):
                    self._carry_tile(exponent, slice(first, first + TILE))
        used = [e for e in LEVELS if e in self.levels and self.levels[e].any()]
        self.levels = {e: self.levels[e] for e in used}
        self._sums = 0

    def value(self) -> np.ndarray:
        """The sum, float64, wrong by less than 2^-51 of itself; NaN and infinities where due."""
        self.carry()
        total = np.zeros(self.shape)
        for plane in self.levels.values():
            total += plane
        return total if self.special is None else total + self.special

    def _add_tile(self, values: np.ndarray, tile: slice) -> None:
        largest = np.abs(values).max()
        for exponent in reversed(LEVELS):
            if largest < 2.0 ** (exponent - 1):
                continue
            # Adding and subtracting 1.5 * 2^52 units rounds to whole units.
            rounder = 1.5 * 2.0 ** (52 + exponent)
            whole = values + rounder
            whole -= rounder
            self._plane(exponent)[tile] += whole
            values -= whole
            if not values.any():
                return

    def _carry_tile(self, exponent: int, tile: slice) -> None:
        plane = self._plane(exponent)[tile]
        carried = np.floor(np.ldexp(plane, -exponent - STEP) + 0.5)
        if carried.any():
            carried = np.ldexp(carried, exponent + STEP)
            plane -= carried
            self._plane(exponent + STEP)[tile] += carried

    def _add_special(self, values: np.ndarray) -> None:
        with np.errstate(invalid="ignore"):
            self.special = values if self.special is None else self.special + values

    def _plane(self, exponent: int) -> np.ndarray:
        if exponent not in self.levels:
            self.levels[exponent] = np.zeros(self.shape)
        return self.levels[exponent].reshape(-1)

    def _make_room(self) -> None:
        self._sums += 1
        if self._sums >= CARRY:
            self.carry()
