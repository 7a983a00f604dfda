"""Profiles of diffusion against their formulas, and the density of what is drawn from them."""

import math

import mitsuba as mi
import numpy as np
import pytest

from relume.bsdfs.subsurface import SubsurfaceMedium
from relume.integrators.diffusion import PROFILES, radius_of_tail, sample_channel, tail
from tests.integrators.translucent_scenes import boundary, hemispherical


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def test_radius_inverts_the_tail():
    """tail(radius_of_tail(share)) = share to 2e-5 from 1 - 1e-4 down to 1e-7, any absorption."""
    share = np.concatenate([10.0 ** -np.linspace(0.05, 7, 60), 1 - 10.0 ** -np.linspace(1, 4, 20)])
    for z in (1e-4, 1.0, 1e4):
        for k in (0.0, 1e-3, 0.1, 1.0, 10.0):
            r = radius_of_tail(mi.Float(z), mi.Float(k / z), mi.Float(share))
            back = np.array(tail(mi.Float(z), mi.Float(k / z), r))
            np.testing.assert_allclose(back, share, rtol=1e-4 if k > 1 else 2e-5)


@pytest.mark.parametrize("empty", range(3))
def test_no_channel_of_probability_0_is_drawn(empty):
    """By no number in [0, 1), however the sums of probabilities are rounded: the last was, by
    the last number below 1, for one spectrum in six. The others are drawn as often as they are
    to be."""
    weights = np.random.default_rng(1).random((3, 10_000)).astype(np.float32)
    weights[empty] = 0
    for u in (0.0, 0.5, 1 - 2.0**-24):
        channel, p = sample_channel(mi.Spectrum(weights), mi.Float(u))
        assert not (np.array(channel) == empty).any()
        below = np.cumsum(np.array(p, float), axis=0)
        np.testing.assert_array_equal(np.array(p)[empty], 0)
        if u == 0.5:
            expected = np.sum(below <= u, axis=0)
            assert np.mean(np.array(channel) == expected) > 0.999


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("profile", PROFILES)
def test_density_of_radii(profile, chance):
    """The density is normalized, and the radii drawn follow it (chi² of 16 cells)."""
    ones = mi.Spectrum(1)
    medium = SubsurfaceMedium(ones * 0.9, ones * 0.1, ones * 0, mi.Float(1.3), mi.Float(6), ones)
    kernel = PROFILES[profile](medium, mi.Float(1e9))
    n = 2_000_000
    r = (np.arange(n) + 0.5) * (6 / n)
    p = np.array(kernel.pdf(mi.Float(r)))[0] * 2 * np.pi * r
    assert p.sum() * (6 / n) == pytest.approx(1, abs=2e-4)
    u = chance.rng().random(chance.samples(400_000)).astype(np.float32)
    drawn = np.array(kernel.sample_radius(mi.UInt32(0), mi.Float(u)))
    edges = np.linspace(0, 6, 17)
    expected = np.add.reduceat(p, (edges[:-1] * n / 6).astype(int)) * (6 / n) * len(u)
    observed, _ = np.histogram(drawn, edges)
    dof = len(expected) - 1
    # Wilson and Hilferty: the cube root of chi² over its degrees of freedom is nearly normal.
    cube_root = (np.sum((observed - expected) ** 2 / expected) / dof) ** (1 / 3)
    z = (cube_root - (1 - 2 / (9 * dof))) / math.sqrt(2 / (9 * dof))
    chance.judge(0.5 * math.erfc(z / math.sqrt(2)))


def test_profiles_are_the_formulas():
    """R(r) of Jensen et al. 2001, eq. 4, and Christensen and Burley 2015, eq. 3 and 8, float64.

    The latter over the mean of 1 - F from outside, of which the plugin has a fit, to 0.3 %.
    """
    sigma_s, sigma_a, g, eta = np.array([0.9, 2, 5]), np.array([0.1, 0.5, 0.01]), 0.5, 1.3
    spectra = (mi.Spectrum(np.broadcast_to(x, 3).tolist()) for x in (sigma_s, sigma_a, g))
    medium = SubsurfaceMedium(*spectra, mi.Float(eta), mi.Float(0), mi.Spectrum(1))
    sigma_t, A = sigma_s * (1 - g) + sigma_a, boundary(eta)
    alpha, sigma_tr = sigma_s * (1 - g) / sigma_t, np.sqrt(3 * sigma_a * sigma_t)
    r = np.geomspace(1e-3, 10, 50)[:, None]
    R = 0
    for z in (1 / sigma_t, (1 + 4 / 3 * A) / sigma_t):
        d = np.hypot(r, z)
        R = R + alpha / (4 * np.pi) * z * (sigma_tr + 1 / d) * np.exp(-sigma_tr * d) / d**2
    got = PROFILES["standard"](medium, mi.Float(1e9)).value(mi.Float(r.ravel()))
    np.testing.assert_allclose(np.array(got).T, R, rtol=1e-4)

    k = np.sqrt(3 * (1 - alpha))
    R_d = alpha / 2 * (1 + np.exp(-4 / 3 * A * k)) * np.exp(-k)
    d = 1 / sigma_t / (1.85 - R_d + 7 * np.abs(R_d - 0.8) ** 3)
    R = R_d * (np.exp(-r / d) + np.exp(-r / (3 * d))) / (8 * np.pi * d * r)
    got = PROFILES["normalized"](medium, mi.Float(1e9)).value(mi.Float(r.ravel()))
    np.testing.assert_allclose(np.array(got).T, R / (1 - hemispherical(eta)), rtol=3e-3)
