"""Measures of error: exact small cases, debiasing, FLIP."""

import numpy as np
import pytest

from relume.workbench import measures
from relume.workbench.estimates import Estimate, Level, Runs


def known(mean, variance):
    """An estimate with given pixels."""
    mean = np.asarray(mean, dtype=float)
    level = Level(mean, np.broadcast_to(variance, mean.shape), np.full_like(mean, 31))
    return Estimate(level, level, level)


def test_rel_mse_of_two_pixels():
    """R = 1 and 3, m = 2: the denominators are 1.04 and 9.04; I - R = 0.1 and -0.3."""
    R = known([[[1.0] * 3, [3.0] * 3]], 0.001)
    I = known([[[1.1] * 3, [2.7] * 3]], 0.002)
    error, debiased = measures.rel_mse(I, R)
    assert error == pytest.approx((0.01 / 1.04 + 0.09 / 9.04) / 2, rel=1e-12)
    assert debiased == pytest.approx((0.009 / 1.04 + 0.089 / 9.04) / 2, rel=1e-12)
    noise = measures.noise(I, R.pixels.mean)
    assert noise == pytest.approx((0.002 / 1.04 + 0.002 / 9.04) / 2, rel=1e-12)


@pytest.mark.false_alarms(1e-3)
def test_debiasing_leaves_bias_and_variance_of_the_picture_alone(chance, level):
    """Bias b = 0.02, variances v of the means 1e-4 each: b² + 2 v as it is, b² + v debiased.

    Where the reference r is too low, b + a - r and the weight w are both too high: their covariance
    adds 2 b v |dw/dr| / w = 4 b v / 1.01. Terms of second order are below 1e-3.
    """
    rng, errors = chance.rng(), []
    for _ in range(16):
        a, reference = Runs(), Runs()
        for _ in range(25):
            a.add(rng.normal(1.02, 0.05, (64, 64, 3)))
            reference.add(rng.normal(1, 0.05, (64, 64, 3)))
        errors.append(measures.rel_mse(a.estimate(), reference.estimate()))
    expected = (np.array([6e-4, 5e-4]) + 4 * 0.02 * 1e-4 / 1.01) / 1.01
    chance.equal(level(errors), expected, allowed=1e-3, precision=5e-3)


def test_a_black_reference_has_no_relative_error():
    black = known(np.zeros((2, 2, 3)), 0)
    assert measures.rel_mse(known(np.ones((2, 2, 3)), 0), black) == (0, 0)


def test_efficiency_does_not_depend_on_the_number_of_samples():
    assert measures.efficiency(0.02, 10) == pytest.approx(5)
    assert measures.efficiency(0.01, 20) == pytest.approx(5)
    assert measures.efficiency(0, 20) is None and measures.efficiency(0.1, 0) is None


def test_flip_sees_what_differs_and_no_more():
    pytest.importorskip("flip_evaluator")
    reference = np.random.default_rng(5).random((24, 32, 3))
    changed = reference.copy()
    changed[4:8, 4:8] *= 4
    errors, mean = measures.flip(changed, reference)
    assert errors.shape == (24, 32) and 0 < mean < 1 and errors.max() <= 1
    assert errors[5, 5] > 0.1 and errors[20, 28] < 1e-3
    assert measures.flip(reference, reference)[1] == 0


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_flip_does_not_depend_on_the_unit(scale):
    pytest.importorskip("flip_evaluator")
    reference = np.random.default_rng(5).random((8, 8, 3))
    _, mean = measures.flip(reference * 1.1, reference)
    _, scaled = measures.flip(reference * 1.1 * scale, reference * scale)
    assert scaled == pytest.approx(mean, rel=1e-4)
    assert measures.flip(reference, reference * 0) is None
