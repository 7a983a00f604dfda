"""Accumulators: the picture, its variance, and passes in any order."""

import numpy as np
import pytest

from relume.accumulator import Accumulator
from relume.passes import Pass

PIXELS = 8


def sampled(index, spp, whole=False, seed=None):
    """A pass of known samples: exponential, of mean 2 and variance 4."""
    rng = np.random.default_rng(index if seed is None else seed)
    samples = rng.exponential(2, (spp, 3, PIXELS)).astype(np.float32)
    squares = None if whole else (samples**2).sum(axis=0)
    return Pass(index, spp, samples.sum(axis=0), squares)


def added(passes):
    result = Accumulator(4, 2)
    for found in passes:
        result.add(found)
    return result


def of_two_sequences(index, spp, start, seed):
    """A pass of which the even samples from `start` on belong to one sequence, the odd ones to the
    other."""
    rng = np.random.default_rng(seed)
    samples = rng.exponential(2, (spp, 3, PIXELS)).astype(np.float32)
    sign = 1 - 2 * ((start + np.arange(spp)) % 2)
    difference = (samples * sign[:, None, None]).sum(axis=0, dtype=np.float32)
    return Pass(index, spp, samples.sum(axis=0), difference=difference, lead=int(sign.sum()))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("sizes", [(4, 10, 10), (1, 2, 5), (3, 3)])
def test_the_variance_of_two_sequences_is_that_of_the_mean(sizes, chance, level):
    """Of 1500 renders, whose passes may give one sequence more than the other, the estimated
    variance of the mean averages to the true one, 4 / samples."""
    starts = np.cumsum((0, *sizes[:-1]))
    renders = [
        added(
            of_two_sequences(i, n, s, chance.seed())
            for i, (n, s) in enumerate(zip(sizes, starts, strict=True))
        )
        for _ in range(1500)
    ]
    variances = level([r.variance().mean() for r in renders])
    chance.equal(variances, 4 / sum(sizes), precision=0.02)
    assert renders[0].lead == sum(sizes) % 2 and renders[0].observations == 2


def test_two_sequences_merge_and_one_alone_tells_no_noise():
    passes = [of_two_sequences(i, 3, 3 * i, i) for i in range(6)]
    expected = added(passes)
    merged = added(passes[:1:-1])
    merged.merge(added(passes[:2]))
    assert np.array_equal(merged.variance(), expected.variance())
    assert (merged.lead, merged.observations) == (expected.lead, 2) == (0, 2)
    one = added([of_two_sequences(0, 1, 0, 0)])
    assert np.isnan(one.variance()).all() and one.observations == 1


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("whole", [False, True])
def test_the_variance_is_that_of_the_mean(whole, chance, level):
    """Of 400 renders of 40 samples each, in unequal passes, the estimated variance of the mean
    averages to the true one, 4 / 40, and so does the scatter of the renders about the mean 2."""
    sizes = (4, 10, 10, 10, 6)
    renders = [
        added(sampled(i, spp, whole, chance.seed()) for i, spp in enumerate(sizes))
        for _ in range(400)
    ]
    variances = level([r.variance().mean() for r in renders])
    scatter = level([np.square(r.image() - 2).mean() for r in renders])
    chance.equal(variances, 0.1, precision=0.02, of=2)
    chance.equal(scatter, 0.1, precision=0.02, of=2)
    assert renders[0].observations == (5 if whole else 40)


def test_noise_is_relative_to_the_mean():
    """Exponential samples have the standard error 1/sqrt(n) of their mean; here 24 values."""
    assert added([sampled(0, 900)]).noise() == pytest.approx(1 / 30, rel=0.05)


def test_the_same_passes_in_any_order_give_the_same_bits():
    passes = [sampled(i, 3) for i in range(40)]
    expected = added(passes)
    backwards = added(passes[:11:-1])
    backwards.merge(added(passes[5:12]))
    backwards.merge(added(passes[:5]))
    assert np.array_equal(backwards.image(), expected.image())
    assert np.array_equal(backwards.variance(), expected.variance())
    assert backwards.done == expected.done and backwards.spp == 120


def test_no_pass_counts_twice():
    accumulator = added([sampled(0, 3), sampled(1, 3)])
    before = accumulator.image()
    with pytest.raises(ValueError, match="pass 1 is there twice"):
        accumulator.add(sampled(1, 3))
    with pytest.raises(ValueError, match="pass 0 is there twice"):
        accumulator.merge(added([sampled(0, 3)]))
    assert np.array_equal(accumulator.image(), before)


def test_nothing_is_known_without_samples_and_no_variance_of_one():
    assert np.isnan(added([]).image()).all() and np.isnan(added([]).noise())
    assert np.isnan(added([sampled(0, 9, whole=True)]).variance()).all()


def test_pixels_are_in_rows_from_the_top():
    values = np.arange(3 * PIXELS, dtype=np.float32).reshape(3, PIXELS)
    image = added([Pass(0, 1, values, values)]).image()
    assert image.shape == (2, 4, 3) and image[1, 2].tolist() == [6, 14, 22]
