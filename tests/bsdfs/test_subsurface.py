"""`subsurface` on its own: what other integrators see, and the protocol of `dipole`."""

import mitsuba as mi
import numpy as np
import pytest

from relume.bsdfs.subsurface import SUBSURFACE

MATERIAL = {
    "type": "subsurface",
    "eta": 1.4,
    "sigma_s": {"type": "rgb", "value": [3.0, 8.0, 99.0]},
    "sigma_a": {"type": "rgb", "value": [7.0, 2.0, 1.0]},
}
ALPHA = np.array([0.3, 0.8, 0.99])


def fresnel(cos, eta):
    """Fresnel's reflectance of unpolarised light from outside, float64."""
    cos_t = np.sqrt(1 - (1 - cos * cos) / eta**2)
    r_s, r_p = (cos - eta * cos_t) / (cos + eta * cos_t), (eta * cos - cos_t) / (eta * cos + cos_t)
    return (r_s**2 + r_p**2) / 2


def closed_form(alpha, eta):
    """R_d of Jensen et al. 2001, eq. 15, with their polynomial for F_dr."""
    F_dr = -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta
    A, k = (1 + F_dr) / (1 - F_dr), np.sqrt(3 * (1 - alpha))
    return alpha / 2 * (1 + np.exp(-4 / 3 * A * k)) * np.exp(-k)


def test_brdf_of_other_integrators(at, hemisphere):
    """Albedo F_t(o) R_d int F_t(i) cos/pi di, per channel, by quadrature of eval."""
    bsdf, cos_o = mi.load_dict(MATERIAL), 0.6
    z = (np.arange(100_000) + 0.5) / 100_000
    outside = np.mean(2 * z * (1 - fresnel(z, 1.4)))
    expected = (1 - fresnel(cos_o, 1.4)) * closed_form(ALPHA, 1.4) * outside
    wi = np.array([0.8, 0, cos_o])
    for channel in range(3):

        def f(wo, channel=channel):
            si = at(np.broadcast_to(wi, wo.shape))
            value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T.astype(np.float32)))
            return np.array(value)[channel].astype(float)

        assert hemisphere(f, 500) == pytest.approx(expected[channel], rel=1e-4)


def test_samples_of_other_integrators(pairs, at):
    """Diffuse samples carry eval / pdf; mirrored ones are as frequent as F."""
    bsdf, ctx = mi.load_dict(MATERIAL), mi.BSDFContext()
    wi, _ = pairs(bsdf, 1)
    u = np.random.default_rng(3).random((3, len(wi))).astype(np.float32)
    si = at(wi)
    bs, weight = bsdf.sample(ctx, si, mi.Float(u[0]), mi.Point2f(u[1:]))
    value, pdf = bsdf.eval_pdf(ctx, si, bs.wo)
    diffuse = np.array(bs.sampled_component) == 1
    ratio = np.array(value)[:, diffuse] / np.array(pdf)[diffuse]
    np.testing.assert_allclose(np.array(weight)[:, diffuse], ratio, rtol=2e-4)
    np.testing.assert_allclose(np.array(bs.pdf)[diffuse], np.array(pdf)[diffuse], rtol=1e-4)
    F = fresnel(wi[:, 2].astype(float), 1.4)
    # The two can differ by rounding alone, where the variate is next to F.
    assert np.mean(diffuse != (u[0] >= F)) < 1e-3


def test_ways_are_drawn_with_their_probability(at):
    """Mirror, diffusion and refraction, on a grid of the number that chooses among them."""
    bsdf, ctx = mi.load_dict(MATERIAL), mi.BSDFContext()
    ctx.type_mask |= SUBSURFACE
    u = (np.arange(100_000) + 0.5) / 100_000
    si = at(np.broadcast_to([0.8, 0, 0.6], (len(u), 3)))
    bs, _ = bsdf.sample(ctx, si, mi.Float(u), mi.Point2f(0.3, 0.6))
    way, pdf = np.array(bs.sampled_component), np.array(bs.pdf)
    for k in range(3):
        assert np.mean(way == k) == pytest.approx(pdf[way == k].mean(), abs=3e-5)


def test_no_way_of_probability_0_is_drawn(at):
    """At level -2 nothing is refracted from the front, even by the last number below 1, which
    rounding took to 1 at about one angle in ten: a weight without end."""
    bsdf, ctx = mi.load_dict(MATERIAL | {"level": -2}), mi.BSDFContext()
    ctx.type_mask |= SUBSURFACE
    cos = np.linspace(0.01, 1, 1000)
    si = at(np.stack([np.sqrt(1 - cos * cos), 0 * cos, cos], axis=1))
    bs, weight = bsdf.sample(ctx, si, mi.Float(1 - 2**-24), mi.Point2f(0.3, 0.6))
    assert set(np.array(bs.sampled_component)) == {1}
    assert np.isfinite(np.array(weight)).all()


@pytest.mark.parametrize("mask", [0, SUBSURFACE])
@pytest.mark.parametrize("eta", [0.7, 1.0, 1.3, 3.0])
def test_is_valid_everywhere(mask, eta, at, assert_valid):
    """No NaN, no negative value, unit directions, from both sides, at any index."""
    ctx = mi.BSDFContext()
    ctx.type_mask |= mask
    assert_valid(mi.load_dict(MATERIAL | {"eta": eta}), at, ctx)


@pytest.mark.false_alarms(1e-3)
def test_furnace_of_other_integrators(chance, furnace):
    """A white material loses what the two transmittances lose: F + (1 - F)^2, F the mean."""
    white = {"type": "subsurface", "sigma_a": 0.0, "eta": 1.3}
    z = (np.arange(100_000) + 0.5) / 100_000
    F = np.mean(2 * z * fresnel(z, 1.3))
    chance.equal(furnace(white, 32), F + (1 - F) ** 2, allowed=1e-3, precision=2e-3)


@pytest.mark.parametrize(
    "parameters",
    [{"eta": 0.0}, {"eta": -1.0}, {"level": 0}, {"scale": -1.0}, {"r_max": -1.0}],
)
def test_refuses(parameters):
    """Values without meaning are refused by name."""
    with pytest.raises(RuntimeError, match=next(iter(parameters))):
        mi.load_dict({"type": "subsurface", **parameters})
