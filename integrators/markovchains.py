r"""Markov chains in primary sample space and the films they fill.

A chain walks in primary sample space (see `primarysamples`) with density proportional to a target
function I. Its state is a row of numbers. A proposal is either a large step, a new row, or a small
one, in which every number moves a little; it is accepted with probability a = min(1, I'/I). Both
the proposal, with weight a, and the current state, with weight 1 - a, go to the film (expected
values).

**Rows without end.** A path draws k numbers, k depending on those drawn. I does not depend on the
others, so given the first k these are uniform, and may be drawn anew before each step without
changing the density (a Gibbs step). So a small step moves the numbers that the current path drew
and takes fresh ones from there on, and only the numbers of accepted paths are written. The same
argument covers paths that draw more than `STORED` numbers: those past the end are fresh in every
proposal, their density is the same both ways, and detailed balance holds with them as part of the
state, which is never traced again.

**No proposal is stored.** Its numbers are a function of the state, the chain, the step and the
dimension, computed when the path asks for them, and again when an accepted path is written.

**Same seed, same picture.** The film is a sum of 64-bit integers, so the order in which threads add
to it does not matter. Weights are bounded, and the unit is chosen so that no sum can overflow.
"""

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from relume.integrators.primarysamples import (
    MUTATIONS,
    hash_u32,
    key,
    moved,
    uniform,
)
from relume.integrators.uniformsamples import on_film, seeds_of
from relume.sensors.colors import LUMINANCE, absolute_luminance

STORED = 128
"""Numbers of a state that are kept."""

LARGE, ACCEPT, SIZE = 0xFFFFFFF0, 0xFFFFFFF1, 0xFFFFFFF3
"""Dimensions of the random numbers that are no part of a path."""

LAYERS = 3
"""Films of the chains: 0 of their large steps, 1 and 2 of the two halves of the chains."""

LIMIT = 2.0**61
"""Largest sum that a film may hold: with room for rounding below 2^63."""


@dataclass(frozen=True)
class Walk:
    """How chains walk.

    Attributes:
        steps: mutations of each chain.
        large: probability of large steps, 0 to 1.
        mutation: key of `MUTATIONS`.
        s1, s2: sizes of the mutation.
        share: c >= 0 of the weights w1 = c / (c + I) of uniform samples and w2 = I / (c + I) of
            chains, in units of I.
        caps: of each half of the chains, above which the I of large steps do not count in `target`.
    """

    steps: int
    large: float
    mutation: str
    s1: float
    s2: float
    share: float = 0.0
    caps: tuple = (math.inf, math.inf)


@dataclass(frozen=True)
class Walked:
    """What chains found.

    Attributes:
        film: (LAYERS, pixels, 3) float64: sums of w1 f over large steps, and for each half of the
            chains the sums of w2 f / I over all states.
        large: (chains,) number of large steps.
        target, luminance, squared: (chains,) sums over large steps of I, at most the cap each, of
            luminance Y and of Y².
        accepted_large, accepted_small: (chains,) counts of accepted steps.
        longest: (chains,) longest run of rejections.
    """

    film: np.ndarray
    large: np.ndarray
    target: np.ndarray
    luminance: np.ndarray
    squared: np.ndarray
    accepted_large: np.ndarray
    accepted_small: np.ndarray
    longest: np.ndarray


def walk_chains(paths, importance, index, half, count, seeds, walk):
    """Walk Markov chains.

    Args:
        paths: `Paths`.
        importance: (pixels,) float32 above 0: I is the luminance times that of its pixel.
        index: (chains,) integers, which uniform sample of its half a chain starts from.
        half: (chains,) integers, 0 or 1.
        count: samples of a half.
        seeds: two integers, of the uniform samples and of the chains.
        walk: `Walk`.

    Returns:
        `Walked`.
    """
    bound = walk.steps * len(index) / (min(LUMINANCE) * float(importance.min()))
    units = [2.0 ** np.floor(np.log2(LIMIT / (bound * x))) for x in (walk.share or 1, 1)]
    film = dr.zeros(mi.Int64, LAYERS * paths.pixels * 3)
    inputs = {
        "importance": mi.Float(aligned(importance, np.float32)),
        "index": mi.UInt32(aligned(index, np.uint32)),
        "half": mi.UInt32(aligned(half, np.uint32)),
        "count": dr.opaque(mi.UInt32, count),
        "seeds": [dr.opaque(mi.UInt32, seed) for seed in seeds],
        "steps": dr.opaque(mi.UInt32, walk.steps),
        "large": dr.opaque(mi.Float, walk.large),
        "share": dr.opaque(mi.Float, walk.share),
        "caps": [dr.opaque(mi.Float, float(cap)) for cap in walk.caps],
        "units": [dr.opaque(mi.Float, float(unit)) for unit in units],
    }
    offset, s1, s2 = MUTATIONS[walk.mutation][0], walk.s1, walk.s2
    found, left, places = _walk(paths, film, lambda r, q: offset(r, q, s1, s2), **inputs)
    dr.eval(film, found, left, places)
    # The states at the end, in a kernel of their own: a film is written by one loop at a time.
    for worth, place in zip(left, places, strict=True):
        for i in range(3):
            deposit(film, worth[i], place + i, True)
    dr.eval(film)
    sums = film.numpy().astype(float).reshape(LAYERS, paths.pixels, 3)
    sums /= np.array([units[0], units[1], units[1]])[:, None, None]
    return Walked(sums, *(values.numpy().astype(float) for values in found))


def aligned(values, dtype):
    """A copy of an array (n,) at a multiple of 64 bytes.

    Dr.Jit takes arrays where they lie, and compiles other kernels for those that lie elsewhere.
    """
    size = len(values) * np.dtype(dtype).itemsize
    memory = np.empty(size + 64, np.uint8)
    start = -memory.ctypes.data % 64
    copy = memory[start : start + size].view(dtype)
    copy[:] = values
    return copy


def added(mask, value):
    """`value` where `mask` holds, else 0: to be added to a sum."""
    return dr.select(mask, value, 0)


@dr.syntax
def _walk(
    paths, film, offset, importance, index, half, count, seeds, steps, large, share, caps, units
):
    chain = key(dr.arange(mi.UInt32, dr.width(index)), seeds[1])
    own, position = seeds_of(paths, index, half, count, seeds[0])
    p_large, c = large, share
    layer = (half + 1) * (paths.count * 3)
    cap = dr.select(half == 0, caps[0], caps[1])

    u = dr.alloc_local(mi.Float, STORED)
    drawn = mi.UInt32(0)
    f, I, pixel = mi.Color3f(0), mi.Float(0), mi.UInt32(0)
    # What the state has been worth so far, as a state of the chain and as a large step.
    weight, weight_large = mi.Float(0), mi.Float(0)

    n_large, sum_I, sum_Y, sum_YY = mi.UInt32(0), mi.Float(0), mi.Float(0), mi.Float(0)
    accepted_large, accepted_small = mi.UInt32(0), mi.UInt32(0)
    run, longest = mi.UInt32(0), mi.UInt32(0)

    step = mi.UInt32(0)
    while dr.hint(step <= steps, label="Markov chains"):
        # Step 0 takes the seed and shows nothing.
        first = step == 0
        keyed = hash_u32(chain[0] ^ (step * 0x85EBCA6B)), chain[1] + step
        keyed = dr.select(first, own[0], keyed[0]), dr.select(first, own[1], keyed[1])
        is_large = first | (uniform(keyed, mi.UInt32(LARGE)) < p_large)
        q = uniform(keyed, mi.UInt32(SIZE))

        def number(d, keyed=keyed, q=q, is_large=is_large, drawn=drawn, first=first):
            r = uniform(keyed, d)
            fresh = is_large | (d >= drawn)
            old = u.read(dr.minimum(d, STORED - 1), ~fresh)
            value = dr.select(fresh, r, moved(old, offset(r, q)))
            return dr.select(first, on_film(position, d, value), value)

        # ------------------------------ proposal ------------------------------

        f_new, pixel_new, drawn_new = paths.trace(number)
        Y = absolute_luminance(f_new)
        I_new = Y * dr.gather(mi.Float, importance, pixel_new)
        a = dr.select(I > 0, dr.minimum(1, I_new / I), 1)
        accept = first | (uniform(keyed, mi.UInt32(ACCEPT)) < a)
        weight += 1 - a
        weight_new, large_new = a, dr.select(is_large, mi.Float(1), 0)

        # ----------------- what goes for good is added to the film -----------------

        I_gone = dr.select(accept, I, I_new)
        f_gone = dr.select(accept, f, f_new) / (I_gone + c)
        place = dr.select(accept, pixel, pixel_new) * 3
        w = dr.select(accept, weight, weight_new) * units[1]
        w_large = dr.select(accept, weight_large, large_new) * c * units[0]
        shown = ~first & (I_gone > 0)
        for i in range(3):
            deposit(film, f_gone[i] * w, place + layer + i, shown)
            deposit(film, f_gone[i] * w_large, place + i, shown & (w_large > 0))

        # ------------------------------ next state ------------------------------

        d = mi.UInt32(0)
        end = added(accept, dr.minimum(drawn_new, STORED))
        while dr.hint(d < end, label="Accepted numbers"):
            u.write(number(d), d)
            d += 1
        f[accept], I[accept], pixel[accept] = f_new, I_new, pixel_new
        drawn[accept] = dr.minimum(drawn_new, STORED)
        weight[accept], weight_large[accept] = added(~first, weight_new), added(~first, large_new)

        # ------------------------------ figures ------------------------------

        counted = is_large & ~first
        n_large += added(counted, mi.UInt32(1))
        sum_I += added(counted, dr.minimum(I_new, cap))
        sum_Y += added(counted, Y)
        sum_YY += added(counted, Y * Y)
        accepted_large += added(counted & accept, mi.UInt32(1))
        accepted_small += added(~is_large & accept, mi.UInt32(1))
        run = dr.select(accept, 0, run + 1)
        longest = dr.maximum(longest, run)
        step += 1

    figures = n_large, sum_I, sum_Y, sum_YY, accepted_large, accepted_small, longest
    worth = dr.select(I > 0, f / (I + c), 0)
    left = worth * weight * units[1], worth * weight_large * c * units[0]
    return figures, left, (pixel * 3 + layer, pixel * 3)


def deposit(film, value, index, active):
    """Add the integer nearest to a value to a film."""
    # Direct: other modes keep a film for each thread.
    dr.scatter_add(film, mi.Int64(dr.round(value)), index, active, mode=dr.ReduceMode.Direct)
