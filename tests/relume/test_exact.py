"""Exact sums: against rational arithmetic, in any order and grouping, over the whole range."""

from fractions import Fraction

import numpy as np
import pytest

from relume import exact
from relume.exact import ExactSum

BITS = np.random.default_rng(1)
FINITE = BITS.integers(0, 2**32, (300, 40), np.uint32).view(np.float32)
FINITE = np.where(np.isfinite(FINITE), FINITE, np.float32(1))
"""Every bit pattern alike: magnitudes from 1e-45 to 3e38, both signs."""


def summed(arrays):
    total = ExactSum(arrays[0].shape)
    for values in arrays:
        total.add(values)
    return total


def state(total):
    total.carry()
    special = None if total.special is None else total.special.tobytes()
    return {e: plane.tobytes() for e, plane in total.levels.items()}, special


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e30])
def test_sums_are_those_of_rational_arithmetic(scale):
    """The levels hold the exact sum; the rounded one is within 2^-51 of it."""
    some = np.where(np.abs(FINITE) < scale, FINITE, np.float32(scale / 3))
    total = summed(some)
    value = total.value()
    for k in range(some.shape[1]):
        true = sum(Fraction(float(x)) for x in some[:, k])
        assert sum(Fraction(float(plane[k])) for plane in total.levels.values()) == true
        assert abs(Fraction(float(value[k])) - true) <= abs(true) / 2**51


def test_orders_and_groups_do_not_count():
    """Sums of shuffled arrays, and of shuffled arrays in parts, have the same bytes."""
    expected = state(summed(FINITE))
    for seed in range(4):
        random = np.random.default_rng(seed)
        shuffled = random.permutation(FINITE)
        assert state(summed(shuffled)) == expected
        cuts = np.sort(random.integers(1, len(shuffled), 5))
        parts = [summed(part) for part in np.split(shuffled, np.unique(cuts))]
        random.shuffle(parts)
        for part in parts[1:]:
            parts[0].merge(part)
        assert state(parts[0]) == expected


def test_plain_sums_would_depend_on_the_order():
    """The test above has power: double precision alone differs."""
    plain = {np.add.reduce(np.random.default_rng(s).permutation(FINITE[:, 0])).tobytes()
             for s in range(4)}  # fmt: skip
    assert len(plain) > 1


def test_carries_lose_nothing(monkeypatch):
    """Carries at every sum give the same levels as none, and negative sums stay in few levels."""
    expected = state(summed(FINITE))
    monkeypatch.setattr(exact, "CARRY", 1)
    assert state(summed(FINITE)) == expected
    small = summed([np.float32([-0.25])] * 3)
    assert small.value() == [-0.75] and len(small.levels) == 1


def test_the_most_sums_between_carries_stay_exact():
    """4095 times the largest value of a level, 2^39 units, cancelled to the last unit."""
    large, small = np.float32([2.0**19]), np.float32([2.0**-20])
    total = summed([large] * (exact.CARRY - 2) + [small])
    for _ in range(exact.CARRY - 2):
        total.add(-large)
    assert total.value() == [2.0**-20]


def test_ties_between_levels_have_one_form():
    """Half a unit of the next level can be held in two ways; sums that meet there are equal."""
    half, one = np.float32([2.0**19]), np.float32([2.0**20])
    assert state(summed([half])) == state(summed([one, -half]))
    assert state(summed([-half])) == state(summed([half, -one]))


def test_what_is_not_finite_stays_so_in_any_order():
    inf, nan = np.float32(np.inf), np.float32(np.nan)
    rows = np.float32([[inf, inf, nan, 1, -inf], [1, -inf, 1, 2, 3], [2, 0, inf, 3, 4]])
    expected = [np.inf, np.nan, np.nan, 6, -np.inf]
    for order in ([0, 1, 2], [2, 1, 0], [1, 0, 2]):
        parts = summed(rows[order[:2]])
        parts.merge(summed(rows[order[2:]]))
        assert np.array_equal(parts.value(), expected, equal_nan=True)


def test_sums_larger_than_a_tile():
    values = np.arange(3 * exact.TILE + 7, dtype=np.float32).reshape(1, -1) / 3
    assert np.array_equal(summed([values] * 2).value(), 2 * values.astype(float))
