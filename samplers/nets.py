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
    (
        0x1,
        0x2,
        0x4,
        0x8,
        0x10,
        0x20,
        0x40,
        0x80,
        0x100,
        0x200,
        0x400,
        0x800,
        0x1000,
        0x2000,
        0x4000,
        0x8000,
    ),
    (
        0x1,
        0x3,
        0x7,
        0xE,
        0x15,
        0x3A,
        0x69,
        0xE3,
        0x19D,
        0x34C,
        0x5A3,
        0xF4F,
        0x18B2,
        0x2DE6,
        0x5D42,
        0xD84F,
    ),
    (
        0x1,
        0x2,
        0x6,
        0x9,
        0x1A,
        0x30,
        0x40,
        0xA5,
        0x179,
        0x3DB,
        0x73A,
        0xC1C,
        0x1E90,
        0x29F2,
        0x5201,
        0xE5E2,
    ),
    (
        0x1,
        0x2,
        0x5,
        0xB,
        0x1A,
        0x39,
        0x5D,
        0x93,
        0x184,
        0x206,
        0x577,
        0xBD4,
        0x1704,
        0x3BD7,
        0x53EE,
        0xFE51,
    ),
    (
        0x1,
        0x2,
        0x4,
        0xA,
        0x12,
        0x21,
        0x53,
        0xC1,
        0x11C,
        0x2B6,
        0x651,
        0xE9B,
        0x19F8,
        0x3F17,
        0x6D2D,
        0x9FED,
    ),
    (
        0x1,
        0x2,
        0x6,
        0x8,
        0x1D,
        0x32,
        0x6E,
        0xEB,
        0x135,
        0x273,
        0x54B,
        0xE50,
        0x1DB5,
        0x214C,
        0x78A8,
        0xD098,
    ),
    (
        0x1,
        0x2,
        0x7,
        0xD,
        0x14,
        0x30,
        0x43,
        0xBD,
        0x1F6,
        0x363,
        0x426,
        0xF5A,
        0x1E41,
        0x3742,
        0x6234,
        0xE3F9,
    ),
    (
        0x1,
        0x3,
        0x4,
        0xE,
        0x16,
        0x35,
        0x79,
        0xD3,
        0x163,
        0x26E,
        0x7D2,
        0xB53,
        0x182D,
        0x3199,
        0x4B06,
        0xCB74,
    ),
)
"""The matrices A: their columns as numbers, bit r being row r."""

DIMENSIONS = 2 * len(ORDERS)


def pascal() -> np.ndarray:
    """The matrix P: (BITS, BITS) integers 0 and 1; binom(c, r) is odd where c & r = r (Lucas)."""
    r, c = np.indices((BITS, BITS))
    return (r & c == r).astype(int)


def matrices() -> np.ndarray:
    """The matrices C: (DIMENSIONS, BITS, BITS) integers 0 and 1."""
    orders = np.array(ORDERS)[:, None, :] >> np.arange(BITS)[:, None] & 1
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
