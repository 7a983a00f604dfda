"""A digital sequence of 16 dimensions in base 2 whose low-dimensional projections are good.

With digits of 4 bits it is a (0, 16)-sequence in base 16; each of the dimensions 4k to 4k + 3 taken
together a (0, 4)-sequence in base 4; each pair 2k, 2k + 1 a (0, 2)-sequence in base 2. So any two
dimensions of 256 points are stratified 16 by 16, and a pair at any power of two in all ways.

Dimension d of point i is C_d i over GF(2), the lowest bit of i and the first digit of the
coordinate first. With P_q(a) for the matrix of blocks binom(c, r) a^(c - r), a in GF(q), r and c
counting digits of base q, the matrices are

    C = P_2(b) P_4(g) P_16(h),    b in {0, 1},  g in {0, w},  h in {0, y, 2 y, 3 y},

w generating GF(4), and y GF(16) over it. P_q(a) P_q(b) = P_q(a + b), and P_2(1) or P_4(g) is a
matrix P_16 after a change of the digits of base 16 among themselves, which leaves nets what they
are: so all 16 are P_16 of different elements (Faure 1982, Niederreiter 1987).

Source: Ahmed, Skopenkov, Hadwiger and Wonka, Analysis and synthesis of digital dyadic sequences,
ACM Transactions on Graphics 42 (6), 2023.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

DIMENSIONS = 16

BITS = 16
"""Bits of the index: there are 2^16 points."""

Product = Callable[[int, int], int]
"""Multiplication in a field whose elements are numbered so that addition is ^."""


def multiply_2(a: int, b: int) -> int:
    """In GF(2)."""
    return a & b


def multiply_4(a: int, b: int) -> int:
    """In GF(4), of elements a0 + a1 w with w² = w + 1."""
    product = (a if b & 1 else 0) ^ (a << 1 if b & 2 else 0)
    return product ^ 7 if product & 4 else product


def multiply_16(a: int, b: int) -> int:
    """In GF(16), of elements a0 + a1 y over GF(4) with y² = y + w."""
    a0, a1, b0, b1 = a & 3, a >> 2, b & 3, b >> 2
    high = multiply_4(a1, b1)
    y = multiply_4(a0, b1) ^ multiply_4(a1, b0) ^ high
    return multiply_4(a0, b0) ^ multiply_4(high, 2) | y << 2


def pascal(a: int, product: Product, digit: int) -> np.ndarray:
    """P_q(a), q = 2^digit: (BITS, BITS) integers 0 and 1, upper triangular."""
    powers, blocks = 1, []
    for _ in range(BITS // digit):
        images = [product(powers, 1 << c) for c in range(digit)]
        blocks.append([[image >> r & 1 for image in images] for r in range(digit)])
        powers = product(powers, a)
    result = np.zeros((BITS, BITS), int)
    for r in range(BITS // digit):
        for c in range(r, BITS // digit):
            if c & r == r:  # binom(c, r) is odd (Lucas)
                rows, columns = r * digit, c * digit
                result[rows : rows + digit, columns : columns + digit] = blocks[c - r]
    return result


def matrices() -> np.ndarray:
    """The matrices C: (DIMENSIONS, BITS, BITS) integers 0 and 1."""
    return np.stack(
        [
            pascal(b, multiply_2, 1) @ pascal(g, multiply_4, 2) @ pascal(h, multiply_16, 4) % 2
            for h in (0, 4, 8, 12)
            for g in (0, 2)
            for b in (0, 1)
        ]
    )


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
