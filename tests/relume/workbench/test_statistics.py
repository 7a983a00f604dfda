"""Statistics of pictures: exact small cases, false alarms as stated, power, a lone picture's noise.

`RATE` is the rate of false alarms that is asked for. How many of 200 pairs raise one is judged by
the binomial law, and so is how many differences are found of those that ought to be.
"""

import math

import numpy as np
import pytest

from relume.workbench import estimates, statistics
from relume.workbench.estimates import Level, Runs

RATE = 0.01
PAIRS = 200
SHAPE = (24, 32, 3)


def gathered(draw, runs=32):
    """The estimate of pictures from `draw`."""
    taken = Runs()
    for _ in range(runs):
        taken.add(draw())
    return taken.estimate()


def alarms(a, b):
    """Which of the three levels differ."""
    scores = statistics.all_levels(a, b, RATE)
    return [name for name, level in scores.items() if level.differ]


# ---- exact cases


def test_mean_and_variance_of_each_level():
    rng = np.random.default_rng(1)
    pictures = rng.random((5, 24, 30, 3))
    estimate = gathered(iter(pictures).__next__, 5)
    blocks = np.array([estimates.block_means(picture) for picture in pictures])
    whole = pictures.mean(axis=(1, 2), keepdims=True)[:, 0]
    for level, values in (
        (estimate.pixels, pictures),
        (estimate.blocks, blocks),
        (estimate.whole, whole[:, None]),
    ):
        np.testing.assert_allclose(level.mean, values.mean(axis=0), rtol=1e-12)
        np.testing.assert_allclose(level.variance, values.var(axis=0, ddof=1) / 5, rtol=1e-9)
        assert (level.dof == 4).all()


def test_blocks_at_the_edges_are_smaller():
    picture = np.zeros((10, 9, 3))
    picture[8:, 8:] = 1
    assert estimates.block_side(10, 9) == 4
    assert estimates.block_sizes(10, 9).tolist() == [[16, 16, 4], [16, 16, 4], [8, 8, 2]]
    means = estimates.block_means(picture)
    assert means.shape == (3, 3, 3) and means[2, 2, 0] == 1 and means.sum() == 3
    np.testing.assert_array_equal(estimates.from_blocks(means, (10, 9)), picture)


def test_the_score_has_the_tail_of_students_t():
    """Critical values of two-sided 5, 1 and 0.1 % from the standard tables of t."""
    rows = ((1, 12.7062, 0.05), (3, 5.84091, 0.01), (7, 3.49948, 0.01), (30, 3.64596, 0.001))
    for dof, t, level in rows:
        z = statistics.normal_score(t, dof)
        assert math.erfc(z / math.sqrt(2)) == pytest.approx(level, rel=2e-5)
        assert statistics.normal_score(-t, dof) == -z


def test_the_score_far_in_the_tail():
    """At t = 8 with 31 degrees of freedom, against the density integrated by Simpson's rule."""
    nu, t = 31, np.linspace(8, 400, 400_001)
    log_norm = math.lgamma((nu + 1) / 2) - math.lgamma(nu / 2) - 0.5 * math.log(nu * math.pi)
    density = np.exp(log_norm - (nu + 1) / 2 * np.log1p(t * t / nu))
    weights = np.full(t.size, 2.0)
    weights[1::2], weights[[0, -1]] = 4, 1
    tail = (weights * density).sum() * (t[1] - t[0]) / 3
    z = statistics.normal_score(8.0, nu)
    assert math.erfc(z / math.sqrt(2)) / 2 == pytest.approx(tail, rel=1e-3)


@pytest.mark.parametrize("dof", [40.0, 200.0, 1e9])
def test_scores_where_the_tail_probability_underflows(dof):
    """They grow evenly across that place, and stay numbers: steps of log t change the slope of z
    over log t by no more than their size."""
    t = np.geomspace(20, 1e12, 2000)
    steps = np.diff(statistics.normal_score(t, dof)) / np.diff(np.log(t))
    assert np.isfinite(steps).all() and (steps > 0).all()
    np.testing.assert_allclose(steps[1:], steps[:-1], rtol=0.03)


def test_half_widths_are_those_of_students_t():
    """t for 95 %: 4.30265 at 2 degrees of freedom, 2.36462 at 7, 1.95996 at very many."""
    variances, dof = np.array([1.0, 4.0, 1.0]), np.array([2.0, 7.0, 1e9])
    widths = statistics.half_width(variances, dof, 0.95)
    np.testing.assert_allclose(widths, [4.30265, 2 * 2.36462, 1.95996], rtol=3e-6)


def test_sidaks_threshold():
    """One test at 5 %: 1.95996. Ten: each at 1 - 0.95^(1/10) = 0.0051162, two-sided 2.79953."""
    assert statistics.threshold(0.05, 1) == pytest.approx(1.95996, abs=1e-5)
    z = statistics.threshold(0.05, 10)
    assert (1 - math.erfc(z / math.sqrt(2))) ** 10 == pytest.approx(0.95, abs=1e-9)


def test_scores_of_two_means():
    """Difference 3.49948 (1 %, two-sided, by the tables of t for 7), standard error 1, dof 7."""
    a = Level(np.array([3.49948]), np.array([1.0]), np.array([7.0]))
    exact = Level(np.array([0.0]), np.array([0.0]), np.array([1e9]))
    (z,) = statistics.equal_means(a, exact, 0.01).z
    assert math.erfc(z / math.sqrt(2)) == pytest.approx(0.01, rel=3e-3)


def test_welchs_degrees_of_freedom():
    """Of equal variances with 7 each: 14; of 4 with 7 and 1 with 3: 25 / (16/7 + 1/3) = 9.54545."""
    a = Level(np.ones(2), np.array([1.0, 4.0]), np.array([7.0, 7.0]))
    b = Level(np.ones(2), np.array([1.0, 1.0]), np.array([7.0, 3.0]))
    d = statistics.difference(a, b)
    np.testing.assert_allclose(d.variance, [2, 5])
    np.testing.assert_allclose(d.dof, [14, 9.545454], rtol=1e-6)


def test_ratio_and_its_interval():
    """2/1 with standard errors 0.02 and 0.01: the error is sqrt(0.02² + 2² 0.01²) = 0.02828."""
    a = Level(np.array([2.0, 1.0]), np.array([4e-4, 0.0]), np.full(2, 1e9))
    b = Level(np.array([1.0, 0.0]), np.array([1e-4, 0.0]), np.full(2, 1e9))
    ratio, half = statistics.ratio(a, b, 0.95)
    assert ratio[0] == 2 and half[0] == pytest.approx(1.95996 * 0.0282843, rel=1e-4)
    assert np.isnan(ratio[1])


def test_values_that_are_no_numbers_are_counted_and_left_out():
    picture = np.ones(SHAPE)
    picture[0, 0, 0], picture[0, 1, 0], picture[1, 0, 2] = np.nan, np.inf, -1
    taken = Runs()
    taken.add(picture)
    with pytest.raises(ValueError, match="1 pictures: a variance needs 2"):
        taken.estimate()
    taken.add(np.ones(SHAPE))
    assert (taken.not_finite, taken.negative, taken.count) == (2, 1, 2)
    assert taken.estimate().pixels.mean[0, 0, 0] == 0.5


def test_without_noise_rounding_agrees_and_more_differs():
    black, one = (gathered(lambda v=v: np.full(SHAPE, v), 8) for v in (0.0, 1.0))
    rounded, other = (gathered(lambda v=v: np.full(SHAPE, v), 8) for v in (1 + 1e-7, 1 + 1e-4))
    assert alarms(black, black) == alarms(one, rounded) == []
    assert alarms(one, other) == alarms(black, one) == ["whole", "blocks", "pixels"]


def test_the_place_is_the_largest_of_those_above_the_threshold():
    scores = statistics.Scores(np.array([[5.0, -6.0, 2.0]]), 4.0)
    assert scores.rejected == 2
    assert scores.place(np.array([[0.3, 0.2, 0.9]])) == (0, 0)
    assert statistics.Scores(scores.z, 7.0).place(np.array([[0.3, 0.2, 0.9]])) == (0, 1)


# ---- false alarms

DISTRIBUTIONS = {  # all of mean 1
    "normal": lambda rng: rng.normal(1, 0.3, SHAPE),
    "exponential": lambda rng: rng.exponential(1, SHAPE),
    "lognormal": lambda rng: rng.lognormal(-0.5, 1, SHAPE),
    "one path in 30": lambda rng: 30.0 * (rng.random(SHAPE) < 1 / 30),
    "one path in 1000": lambda rng: 1000.0 * (rng.random(SHAPE) < 1 / 1000),
    "correlated": lambda rng: rng.exponential(1, (1, 1, 3)) + rng.normal(0, 0.3, SHAPE),
}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "one, other",
    [
        ("normal", "normal"),
        ("exponential", "normal"),
        ("lognormal", "exponential"),
        ("one path in 30", "normal"),
        ("one path in 1000", "one path in 1000"),
        ("correlated", "correlated"),
    ],
)
def test_false_alarms_are_no_more_than_stated(one, other, chance):
    """Of pixels with the same mean and unlike noise; `correlated`: one run shifts all pixels."""
    rng, pairs = chance.rng(), chance.samples(PAIRS)
    draws = [lambda d=DISTRIBUTIONS[name]: d(rng) for name in (one, other)]
    false = sum(bool(alarms(*(gathered(draw) for draw in draws))) for _ in range(pairs))
    chance.rare(false, pairs, RATE)


# ---- power


@pytest.mark.false_alarms(1e-3)
def test_two_percent_in_the_mean_is_found(chance):
    """Power above 99 %: the mean's standard error is 1 / sqrt(768 * 32) = 0.64 % of each side
    for one sample of an exponential in a pixel; with 8 samples (a gamma distribution) 0.23 %, of
    the difference 0.32 %. 2 % lies 6.2 of these off; the threshold is 3.3 of them."""
    rng = chance.rng()

    def run(scale):
        return gathered(lambda: rng.gamma(8, scale / 8, SHAPE))

    found = [alarms(run(1.02), run(1.0)) for _ in range(50)]
    missed = sum("whole" not in names for names in found)
    chance.rare(missed, 50, 0.01)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "place, change, level",
    [
        ((slice(4, 8), slice(8, 12)), 1.5, "blocks"),
        ((5, 9), 8.0, "pixels"),
    ],
)
def test_a_change_of_one_place_is_found_there(place, change, level, chance):
    """Power above 99 %. Standard errors of the difference: of a block of 16 pixels with 8 samples
    a run 2.2 % against a change of 50 %; of a pixel 9 % (its floor, the average of the
    neighbourhood), or by its own, larger variance 50 %, against a change of 700 %."""
    rng = chance.rng()
    mean = np.ones(SHAPE)
    mean[place] = change

    def run(mean):
        return gathered(lambda: mean * rng.gamma(8, 1 / 8, SHAPE))

    hits = 0
    for _ in range(20):
        scores = statistics.all_levels(run(mean), run(np.ones(SHAPE)), RATE)[level]
        worst = scores.place(np.abs(scores.z))
        where = (1, 2) if level == "blocks" else place
        hits += scores.rejected > 0 and worst[:2] == where and scores.z[worst] > 0
    chance.rare(20 - hits, 20, 0.01)


# ---- a picture without runs


@pytest.mark.false_alarms(1e-3)
def test_noise_of_a_lone_picture(chance, level):
    """It comes back beside the noise of the other: a standard deviation of 0.1, in every second
    column of 0.3, where the other has three times its noise, too.

    The noise N = T - E of a block, T that of the difference and E that of the other's mean, is
    shared in the ratios v / E of the other's variances. These scatter by r = 2 / 31, E of 16 pixels
    by R = r (0.9² + 0.1²) / 8 (squares, relative), and both together by r w / 8 where columns have
    the share w: to the first order a mean is off by (R - r w / 8) T / N.
    """
    rng, shape, found = chance.rng(), (48, 64, 3), []
    deviation = np.where(np.arange(64) % 2, 0.3, 0.1)[:, None]
    for _ in range(48):
        other = gathered(lambda: rng.normal(1, 3 * deviation, shape))
        estimate = estimates.from_picture(rng.normal(1, deviation, shape), other)
        columns = (estimate.pixels.variance[:, k::2].mean() for k in (0, 1))
        found.append([*columns, estimate.whole.variance.mean() * (48 * 64)])
    r, share = 2 / 31, np.array([0.1, 0.9])
    off = (r * np.sum(share**2) / 8 - r * share / 8) * (1 + 3**2 / 32)
    expected = [*(np.array([0.1, 0.3]) ** 2 * (1 + off)), (0.1**2 + 0.3**2) / 2]
    chance.equal(level(found), expected, allowed=2e-3, precision=6e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("noise", ["none", "normal", "exponential", "lognormal"])
def test_false_alarms_against_a_lone_picture(noise, chance):
    rng, pairs = chance.rng(), chance.samples(PAIRS)
    ramp = np.linspace(0.5, 1.5, SHAPE[1])[:, None]
    draw = DISTRIBUTIONS.get(noise, lambda rng: np.ones(SHAPE))
    false = 0
    for _ in range(pairs):
        other = gathered(lambda: ramp * rng.exponential(1, SHAPE))
        false += bool(alarms(other, estimates.from_picture(ramp * draw(rng), other)))
    chance.rare(false, pairs, RATE)


@pytest.mark.parametrize("steps, found", [(0.4, []), (4.4, ["whole", "blocks"])])
def test_a_step_between_the_pictures_numbers_is_no_difference(steps, found):
    """A flat picture, cut to whole steps as RGBE does, against one that is exact."""
    exact = gathered(lambda: np.full(SHAPE, 0.4), 8)
    cut = np.full(SHAPE, 0.4 - steps / 256)
    assert alarms(exact, estimates.from_picture(cut, exact, 1 / 256)) == found


@pytest.mark.false_alarms(1e-3)
def test_a_lone_picture_that_is_1_percent_too_bright_is_found(chance):
    """Power above 90 %. Standard errors of the mean of 3072 pixels: 0.2 % of the picture with noise
    0.1, 0.1 % of the runs; 1 % lies 4.5 of these off in each channel, the threshold is 3.3."""
    rng = chance.rng()
    shape, found = (48, 64, 3), 0
    for _ in range(20):
        other = gathered(lambda: rng.gamma(32, 1 / 32, shape))
        picture = rng.normal(1.01, 0.1, shape)
        found += "whole" in alarms(other, estimates.from_picture(picture, other))
    chance.rare(20 - found, 20, 0.1)


@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 40, 3), (5, 1, 3)])
def test_the_smallest_pictures(shape):
    rng = np.random.default_rng(23)
    a = gathered(lambda: rng.random(shape), 8)
    b = estimates.from_picture(np.full(shape, 0.5), a)
    for level in statistics.all_levels(a, b, RATE).values():
        assert np.isfinite(level.z).all()
