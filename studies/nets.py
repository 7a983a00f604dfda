"""The search for the matrices of `owen`: which orders of pairs of dimensions go together.

    python -m studies nets

Prints `relume.samplers.nets.ORDERS`. Pair by pair, random matrices and then small changes of the
best are tried. What is least is the sum over m of the logarithm of

    mean over the first 2^m points of prod over d of (1 + phi(x_d)) - 1,

the mean square error of functions whose Walsh coefficients fall as 2^-l with the digits l that they
depend on, as where there are edges, over all digital shifts; phi is the sum of their squares.

Source: Dick and Pillichshammer, Digital nets and sequences, Cambridge 2010, chapter 12.
"""

import numpy as np

from relume.samplers.nets import BITS, ORDERS, pascal

LARGEST = 10
TRIES = 2500
SEED = 1
SIZES = np.arange(2, LARGEST + 1)


def add_arguments(parser):
    parser.add_argument("--tries", type=int, default=TRIES)


def phi():
    """The sum of squares, by the digits of a coordinate: (2^BITS,)."""
    x = np.arange(1 << BITS)
    zeros = np.where(x == 0, BITS, BITS - 1 - np.floor(np.log2(np.maximum(x, 1))).astype(int))
    return 0.5 * (1 - 2.0**-zeros) - np.where(x == 0, 0, 0.5 * 2.0 ** -(zeros + 1))


def coordinates(C):
    """Coordinates of the first points as integers, the first digit highest."""
    columns = C.T @ (1 << np.arange(BITS - 1, -1, -1))
    i = np.arange(1 << LARGEST)
    return np.bitwise_xor.reduce([np.where(i >> k & 1, columns[k], 0) for k in range(LARGEST)])


def errors(product):
    """Mean square errors of the first 2^m points, m in SIZES."""
    return np.array([product[: 1 << m].mean() - 1 for m in SIZES])


def merit(product):
    return np.log(errors(product)).sum()


def flip(A, random):
    """Change one entry above the diagonal of a matrix, in place."""
    r = random.integers(0, BITS - 1)
    A[r, random.integers(r + 1, BITS)] ^= 1


def changed(A, random):
    """A matrix with one or two entries above the diagonal changed."""
    A = A.copy()
    flip(A, random)
    if random.random() < 0.5:
        flip(A, random)
    return A


def run(given):
    weights, P = phi(), pascal()
    random = np.random.default_rng(SEED)

    def factor(A):
        return np.prod([1 + weights[coordinates(C)] for C in (A, P @ A % 2)], axis=0)

    found = [np.eye(BITS, dtype=int)]
    product = factor(found[0])
    while len(found) < len(ORDERS):
        tried = [
            np.triu(random.integers(0, 2, (BITS, BITS)), 1) + np.eye(BITS, dtype=int)
            for _ in range(given.tries)
        ]
        best = min(tried, key=lambda A: merit(product * factor(A)))
        least = merit(product * factor(best))
        for _ in range(given.tries):
            other = changed(best, random)
            value = merit(product * factor(other))
            if value < least:
                best, least = other, value
        found.append(best)
        product = product * factor(best)
    for A in found:
        print('    "' + " ".join(f"{c:x}" for c in A.T @ (1 << np.arange(BITS))) + '",')
