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
argument covers paths that draw more than `STATE_SIZE` numbers: those past the end are fresh in
every proposal, their density is the same both ways, and detailed balance holds with them as part of
the state, which is never traced again.

**No proposal is stored.** Its numbers are a function of the state, the chain, the step and the
dimension, computed when the path asks for them, and again when an accepted path is written.

**Same seed, same picture.** The film is a sum of 64-bit integers, so the order in which threads add
to it does not matter. Weights are bounded, and the unit is chosen so that no sum can overflow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.hashes import hash_u32
from relume.integrators.primarysamples import MUTATIONS, PathSampler, key, perturb, uniform
from relume.integrators.uniformsamples import stratified_rows, with_film_position
from relume.sensors.colors import LUMINANCE, absolute_luminance

STATE_SIZE = 128
"""Numbers of a state that are stored."""

DIM_LARGE_STEP, DIM_ACCEPT, DIM_STEP_SIZE = 0xFFFFFFF0, 0xFFFFFFF1, 0xFFFFFFF3
"""Dimensions of the random numbers that are no part of a path."""

FILM_LAYERS = 3
"""Films of the chains: 0 of their large steps, 1 and 2 of the two halves of the chains."""

MAX_FILM_SUM = 2.0**61
"""Largest sum that a film may hold: with room for rounding below 2^63."""


@dataclass(frozen=True)
class ChainParameters:
    """How chains move.

    Attributes:
        steps: mutations of each chain.
        large_step_probability: 0 to 1.
        mutation: key of `MUTATIONS`.
        s1, s2: sizes of the mutation.
        c: 0 or more, of the weights w1 = c / (c + I) of uniform samples and w2 = I / (c + I) of
            chains, in units of I.
        caps: of each half of the chains, above which the I of large steps do not count in `target`.
    """

    steps: int
    large_step_probability: float
    mutation: str
    s1: float
    s2: float
    c: float = 0.0
    caps: tuple = (math.inf, math.inf)


@dataclass(frozen=True)
class ChainResults:
    """What chains have found.

    Attributes:
        film: (FILM_LAYERS, pixels, 3) float64: sums of w1 f over large steps, and for each half of
            the chains the sums of w2 f / I over all states.
        large_steps: (chains,) how many.
        target, luminance, squared: (chains,) sums over large steps of I, at most the cap each, of
            luminance Y and of Y².
        accepted_large, accepted_small: (chains,) counts of accepted steps.
        longest_rejection: (chains,) longest run of rejected proposals.
    """

    film: np.ndarray
    large_steps: np.ndarray
    target: np.ndarray
    luminance: np.ndarray
    squared: np.ndarray
    accepted_large: np.ndarray
    accepted_small: np.ndarray
    longest_rejection: np.ndarray


def run_chains(
    paths: PathSampler,
    importance: np.ndarray,
    index: np.ndarray,
    half: np.ndarray,
    count: int,
    seeds: Sequence[int],
    parameters: ChainParameters,
) -> ChainResults:
    """Run Markov chains.

    Args:
        paths: `PathSampler`.
        importance: (pixels,) float32 above 0: I is the luminance times that of its pixel.
        index: (chains,) integers, which uniform sample of its half a chain starts from.
        half: (chains,) integers, 0 or 1.
        count: samples of a half.
        seeds: two integers, of the uniform samples and of the chains.
        parameters: `ChainParameters`.

    Returns:
        `ChainResults`.
    """
    bound = parameters.steps * len(index) / (min(LUMINANCE) * float(importance.min()))
    units = [2.0 ** np.floor(np.log2(MAX_FILM_SUM / (bound * x))) for x in (parameters.c or 1, 1)]
    film = dr.zeros(mi.Int64, FILM_LAYERS * paths.pixels * 3)
    inputs = {
        "importance": mi.Float(aligned_copy(importance, np.float32)),
        "index": mi.UInt32(aligned_copy(index, np.uint32)),
        "half": mi.UInt32(aligned_copy(half, np.uint32)),
        "count": dr.opaque(mi.UInt32, count),
        "seeds": [dr.opaque(mi.UInt32, seed) for seed in seeds],
        "steps": dr.opaque(mi.UInt32, parameters.steps),
        "p_large": dr.opaque(mi.Float, parameters.large_step_probability),
        "c": dr.opaque(mi.Float, parameters.c),
        "caps": [dr.opaque(mi.Float, float(cap)) for cap in parameters.caps],
        "units": [dr.opaque(mi.Float, float(unit)) for unit in units],
    }
    offset, s1, s2 = MUTATIONS[parameters.mutation][0], parameters.s1, parameters.s2
    figures, left, places = _run(paths, film, lambda r, q: offset(r, q, s1, s2), **inputs)
    dr.eval(film, figures, left, places)
    # The states at the end, in a kernel of their own: a film is written by one loop at a time.
    for value, place in zip(left, places, strict=True):
        for i in range(3):
            splat(film, value[i], place + i, True)
    dr.eval(film)
    sums = film.numpy().astype(float).reshape(FILM_LAYERS, paths.pixels, 3)
    sums /= np.array([units[0], units[1], units[1]])[:, None, None]
    return ChainResults(sums, *(values.numpy().astype(float) for values in figures))


def aligned_copy(values: np.ndarray, dtype: type) -> np.ndarray:
    """Copy an array (n,) to a multiple of 64 bytes.

    Dr.Jit takes arrays where they lie, and compiles other kernels for those that lie elsewhere.
    """
    size = len(values) * np.dtype(dtype).itemsize
    memory = np.empty(size + 64, np.uint8)
    start = -memory.ctypes.data % 64
    copy: np.ndarray = memory[start : start + size].view(dtype)
    copy[:] = values
    return copy


def masked(mask: mi.Bool, value: Any) -> Any:
    """Return `value` where `mask` holds, else 0, to be added to a sum."""
    return dr.select(mask, value, 0)


@dr.syntax
def _run(
    paths, film, offset, importance, index, half, count, seeds, steps, p_large, c, caps, units
):
    chain = key(dr.arange(mi.UInt32, dr.width(index)), seeds[1])
    own, position = stratified_rows(paths, index, half, count, seeds[0])
    layer = (half + 1) * (paths.pixel_count * 3)
    cap = dr.select(half == 0, caps[0], caps[1])

    u = dr.alloc_local(mi.Float, STATE_SIZE)
    drawn = mi.UInt32(0)
    f, I, pixel = mi.Color3f(0), mi.Float(0), mi.UInt32(0)
    # Expected visits of the state so far, by the chain and by large steps alone.
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
        is_large = first | (uniform(keyed, mi.UInt32(DIM_LARGE_STEP)) < p_large)
        q = uniform(keyed, mi.UInt32(DIM_STEP_SIZE))

        def number(d, keyed=keyed, q=q, is_large=is_large, drawn=drawn, first=first):
            r = uniform(keyed, d)
            fresh = is_large | (d >= drawn)
            old = u.read(dr.minimum(d, STATE_SIZE - 1), ~fresh)
            moved = perturb(old, offset(r, q))
            if paths.held:
                moved = dr.select((d >= paths.held.start) & (d < paths.held.stop), old, moved)
            value = dr.select(fresh, r, moved)
            return dr.select(first, with_film_position(position, d, value), value)

        # ------------------------------ proposal ------------------------------

        f_new, pixel_new, drawn_new = paths.trace(number)
        Y = absolute_luminance(f_new)
        I_new = Y * dr.gather(mi.Float, importance, pixel_new)
        a = dr.select(I > 0, dr.minimum(1, I_new / I), 1)
        accept = first | (uniform(keyed, mi.UInt32(DIM_ACCEPT)) < a)
        weight += 1 - a
        weight_new, large_new = a, dr.select(is_large, mi.Float(1), 0)

        # ----------------- what is left for good is added to the film -----------------

        I_left = dr.select(accept, I, I_new)
        f_left = dr.select(accept, f, f_new) / (I_left + c)
        place = dr.select(accept, pixel, pixel_new) * 3
        w = dr.select(accept, weight, weight_new) * units[1]
        w_large = dr.select(accept, weight_large, large_new) * c * units[0]
        shown = ~first & (I_left > 0)
        for i in range(3):
            splat(film, f_left[i] * w, place + layer + i, shown)
            splat(film, f_left[i] * w_large, place + i, shown & (w_large > 0))

        # ------------------------------ next state ------------------------------

        d = mi.UInt32(0)
        end = masked(accept, dr.minimum(drawn_new, STATE_SIZE))
        while dr.hint(d < end, label="Accepted numbers"):
            u.write(number(d), d)
            d += 1
        f[accept], I[accept], pixel[accept] = f_new, I_new, pixel_new
        drawn[accept] = dr.minimum(drawn_new, STATE_SIZE)
        weight[accept], weight_large[accept] = masked(~first, weight_new), masked(~first, large_new)

        # ------------------------------ figures ------------------------------

        counted = is_large & ~first
        n_large += masked(counted, mi.UInt32(1))
        sum_I += masked(counted, dr.minimum(I_new, cap))
        sum_Y += masked(counted, Y)
        sum_YY += masked(counted, Y * Y)
        accepted_large += masked(counted & accept, mi.UInt32(1))
        accepted_small += masked(~is_large & accept, mi.UInt32(1))
        run = dr.select(accept, 0, run + 1)
        longest = dr.maximum(longest, run)
        step += 1

    figures = n_large, sum_I, sum_Y, sum_YY, accepted_large, accepted_small, longest
    value = dr.select(I > 0, f / (I + c), 0)
    left = value * weight * units[1], value * weight_large * c * units[0]
    return figures, left, (pixel * 3 + layer, pixel * 3)


def splat(film: mi.Int64, value: mi.Float, index: mi.UInt32, active: mi.Bool) -> None:
    """Add the integer nearest to a value to a film."""
    # Direct: other modes keep a film for each thread.
    dr.scatter_add(film, mi.Int64(dr.round(value)), index, active, mode=dr.ReduceMode.Direct)
