"""A digital sequence of 16 dimensions in base 2, good in pairs of dimensions and in all together.

Dimension d of point i is C_d i over GF(2), the lowest bit of i and the first digit of the
coordinate first. Each pair of dimensions has the matrices A and P A with Pascal's matrix P of
binom(c, r) mod 2 and A upper triangular with ones on its diagonal. With A = 1 that is the sequence
of van der Corput and Sobol' (1967), a (0, 2)-sequence; A changes the order of its points within
each block of 2^m, which is free: so every pair is a (0, 2)-sequence, and how the pairs go together
depends on the matrices A. These were searched for, pair by pair (`studies/nets.py`).
"""

from __future__ import annotations

import numpy as np

BITS = 16
"""Bits of the index: there are 2^16 points."""

ORDERS = (
    "1 2 4 8 10 20 40 80 100 200 400 800 1000 2000 4000 8000",
    "1 3 7 e 15 3a 69 e3 19d 34c 5a3 f4f 18b2 2de6 5d42 d84f",
    "1 2 6 9 1a 30 40 a5 179 3db 73a c1c 1e90 29f2 5201 e5e2",
    "1 2 5 b 1a 39 5d 93 184 206 577 bd4 1704 3bd7 53ee fe51",
    "1 2 4 a 12 21 53 c1 11c 2b6 651 e9b 19f8 3f17 6d2d 9fed",
    "1 2 6 8 1d 32 6e eb 135 273 54b e50 1db5 214c 78a8 d098",
    "1 2 7 d 14 30 43 bd 1f6 363 426 f5a 1e41 3742 6234 e3f9",
    "1 3 4 e 16 35 79 d3 163 26e 7d2 b53 182d 3199 4b06 cb74",
)
"""The matrices A: their columns as hexadecimal numbers, bit r being row r."""

DIMENSIONS = 2 * len(ORDERS)


def pascal() -> np.ndarray:
    """The matrix P: (BITS, BITS) integers 0 and 1; binom(c, r) is odd where c & r = r (Lucas)."""
    r, c = np.indices((BITS, BITS))
    return (r & c == r).astype(int)


def matrices() -> np.ndarray:
    """The matrices C: (DIMENSIONS, BITS, BITS) integers 0 and 1."""
    columns = np.array([[int(word, 16) for word in line.split()] for line in ORDERS])
    orders = columns[:, None, :] >> np.arange(BITS)[:, None] & 1
    return np.stack([C for A in orders for C in (A, pascal() @ A % 2)])


def table() -> np.ndarray:
    """Coordinates by half an index, for two dimensions at a time.

    Returns:
        uint32, (2, DIMENSIONS / 2, 256): those of indices whose upper and lower byte alone is not
        0, by that byte with its bits reversed. The lower half of a word is the coordinate in the
        even dimension, the upper half that in the odd one, both with the first digit in the lowest
        bit. A point is the ^ of two words.
    """
    columns = (matrices() << np.arange(BITS)[:, None]).sum(axis=1)  # (DIMENSIONS, BITS)
    words = columns[0::2] | columns[1::2] << BITS
    # Bit 7 of a reversed byte is bit 0 of the byte.
    reversed_byte = np.arange(256)[:, None] >> np.arange(7, -1, -1) & 1
    halves = [
        np.bitwise_xor.reduce(words[:, None, first : first + 8] * reversed_byte, axis=-1)
        for first in (0, 8)
    ]
    return np.stack(halves).astype(np.uint32)
