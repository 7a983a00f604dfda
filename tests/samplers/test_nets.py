"""The digital sequence: nets in pairs, points in general, and the order in which they come."""

import itertools

import numpy as np
import pytest

from relume.samplers import nets
from studies.nets import phi

POINTS = 1024


@pytest.fixture(scope="module")
def coordinates():
    """The first points by the definition, C_d i over GF(2): (POINTS, dimensions) in [0, 1)."""
    bits = np.arange(POINTS)[:, None] >> np.arange(nets.BITS) & 1
    digits = np.einsum("drc,ic->idr", nets.matrices(), bits) % 2
    return digits @ 0.5 ** np.arange(1, nets.BITS + 1)


@pytest.mark.parametrize("pair", range(nets.DIMENSIONS // 2))
def test_pairs_of_dimensions_are_sequences_of_nets(coordinates, pair):
    """Each block of 2^m points, m = 0 ... 10, has one point in every box of 2^-k by 2^(k - m)."""
    points = coordinates[:, 2 * pair : 2 * pair + 2]
    for m, k in itertools.combinations_with_replacement(range(11), 2):
        m, k = max(m, k), min(m, k)
        x, y = (points * (2**k, 2 ** (m - k))).astype(int).T
        boxes = (x << (m - k) | y).reshape(-1, 2**m)
        assert (np.sort(boxes) == np.arange(2**m)).all(), (m, k)


def test_all_dimensions_together_are_better_than_random_ones(coordinates):
    """The mean square error that the search made small, over that of as many independent points,
    is below 1 for all powers of two; with the same order for all pairs it is higher from 8 on."""
    weights = phi()

    def error(points, m):
        factors = 1 + weights[(points[: 2**m] * 2**nets.BITS).astype(int)]
        return (factors.prod(axis=1).mean() - 1) * 2**m / (1.5 ** points.shape[1] - 1)

    alike = np.tile(coordinates[:, :2], nets.DIMENSIONS // 2)
    for m in range(2, 11):
        assert error(coordinates, m) < 1
        assert error(coordinates[:, :8], m) < (1, 1, 0.9, 0.8, 0.7, 0.6, 0.55, 0.5, 0.4)[m - 2]
        assert m < 3 or error(alike[:, :8], m) > error(coordinates[:, :8], m)


def test_the_table_holds_the_points(coordinates):
    """A point is the ^ of the words of both bytes of its index, bits reversed."""
    reverse = np.array([int(f"{byte:08b}"[::-1], 2) for byte in range(256)])
    i = np.arange(POINTS)
    low, high = nets.table()
    words = low[:, reverse[i & 255]] ^ high[:, reverse[i >> 8]]
    digits = np.stack([words & 0xFFFF, words >> 16], axis=1).reshape(nets.DIMENSIONS, POINTS)
    value = (digits[..., None] >> np.arange(16) & 1) @ 0.5 ** np.arange(1, 17)
    assert np.array_equal(value.T, coordinates)
