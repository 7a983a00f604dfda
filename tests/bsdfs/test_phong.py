"""`phong` against a float64 transcription of its formula, and as a sampler and a surface."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from mitsuba.python.chi2 import SphericalDomain

EXPONENTS = [0, 0.5, 1, 5, 30, 128, 1000, 10_000]


def phong(exponent, rho_d=0.5, rho_s=0.2):
    return {
        "type": "phong",
        "diffuse_reflectance": {"type": "rgb", "value": rho_d},
        "specular_reflectance": {"type": "rgb", "value": rho_s},
        "exponent": exponent,
    }


def cos_alpha(i, o):
    """Cosine between o and the mirror direction of i, of the float32 directions' exact angles."""
    i, o = (w.astype(float) / np.linalg.norm(w.astype(float), axis=1)[:, None] for w in (i, o))
    return (i * [-1, -1, 1] * o).sum(1)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_eval_is_the_formula(exponent, at, pairs):
    """f cos theta_o on 10 000 pairs, relative 1e-4 down to where float32 runs out (1e-30).

    Below cos alpha = 0.01 float32 no longer resolves the cosine to 1e-4 (its last bit is 6e-8, and
    n multiplies the error); there the absolute error is at most 1e-6. At exponent 0 the lobe
    ends in a step: within 1e-6 of it either side is right.
    """
    for rho_d in (0.0, 0.5):
        bsdf = mi.load_dict(phong(exponent, rho_d, 0.7))
        wi, wo = pairs(bsdf, 1)
        got = np.array(bsdf.eval(mi.BSDFContext(), at(wi), mi.Vector3f(wo.T)))[1]
        c = cos_alpha(wi, wo)
        lobe = np.where(c > 0, (exponent + 2) / (2 * np.pi) * np.maximum(c, 0) ** exponent, 0)
        expected = (rho_d / np.pi + np.float32(0.7) * lobe) * wo[:, 2]
        resolved, step = np.abs(c) > 0.01, (np.abs(c) < 1e-6) & (exponent == 0)
        np.testing.assert_allclose(got[resolved], expected[resolved], rtol=1e-4, atol=1e-30)
        np.testing.assert_allclose(got[~step], expected[~step], rtol=1e-4, atol=1e-6)


class MirrorDomain:
    """wo by its components across the mirror direction, in units of 1/sqrt(n): narrow lobes."""

    def __init__(self, wi, exponent, extent=7):
        self.mirror = [float(-wi[0]), float(-wi[1]), float(wi[2])]
        self.unit, self.extent = exponent**-0.5, extent

    def bounds(self):
        return mi.ScalarBoundingBox2f([-self.extent] * 2, [self.extent] * 2)

    def aspect(self):
        return 1

    def map_forward(self, p):
        a, b = p.x * self.unit, p.y * self.unit
        frame = mi.Frame3f(mi.Vector3f(self.mirror))
        return frame.to_world(mi.Vector3f(a, b, dr.safe_sqrt(1 - a * a - b * b)))

    def map_backward(self, wo):
        local = mi.Frame3f(mi.Vector3f(self.mirror)).to_local(wo)
        return mi.Point2f(local.x, local.y) / self.unit

    def jacobian(self, wo):
        """Solid angle per unit of the domain: unit² / cos alpha."""
        return self.unit**2 / dr.dot(wo, mi.Vector3f(self.mirror))


def unit(degrees, azimuth):
    a, b = np.radians([degrees, azimuth])
    return np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])


def chi2_cases():
    """30 parameter sets: 22 on the sphere with both lobes, 8 narrow ones across the mirror ray."""
    cases = []
    for k in range(22):
        material = phong((0, 1, 5, 30, 60)[k % 5], 0.4 * (k % 2), 0.6)
        wi = unit((0, 20, 45, 60, 75, 85)[k % 6], 40 * k)
        cases.append((material, wi, SphericalDomain(), lambda wo: 1, mi.BSDFContext()))
    lobe = mi.BSDFContext()
    lobe.component = 0
    for k in range(8):
        exponent, wi = (100, 500, 2000, 10_000)[k % 4], unit((0, 30)[k // 4], 30 * k)
        domain = MirrorDomain(wi, exponent)
        cases.append((phong(exponent), wi, domain, domain.jacobian, lobe))
    return cases


@pytest.mark.false_alarms(1e-3)
def test_sample_follows_pdf(chi2):
    """chi² on 30 parameter sets, exponents 0 to 10 000, from 0 to 85 degrees."""
    chi2(chi2_cases())


@pytest.mark.false_alarms(1e-3)
def test_sample_follows_pdf_in_coarse_cells(chi2):
    """A million samples in a hundred cells: an error of 2 % that is spread widely is found."""
    chi2(chi2_cases()[:22:3], ires=100, sample_count=1_000_000, res=7)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_weight_is_eval_over_pdf(exponent, at, directions):
    """Weights equal eval / pdf, and rho_s (n+2)/(n+1) cos theta_o without a diffuse part."""
    for rho_d in (0.0, 0.4):
        bsdf = mi.load_dict(phong(exponent, rho_d, 1.0))
        wi = directions(10_000, 3)
        u = np.random.default_rng(4).random((3, len(wi))).astype(np.float32)
        ctx, si = mi.BSDFContext(), at(wi)
        bs, weight = bsdf.sample(ctx, si, mi.Float(u[0]), mi.Point2f(u[1:]))
        value, pdf = bsdf.eval_pdf(ctx, si, bs.wo)
        drawn = np.array(bs.pdf) > 0
        weight, pdf = np.array(weight)[0][drawn], np.array(pdf)[drawn]
        np.testing.assert_allclose(weight, np.array(value)[0][drawn] / pdf, rtol=1e-4)
        np.testing.assert_allclose(np.array(bs.pdf)[drawn], pdf, rtol=1e-5)
        if rho_d == 0:
            closed = (exponent + 2) / (exponent + 1) * np.array(bs.wo)[2][drawn]
            np.testing.assert_allclose(weight, closed, rtol=1e-4)


@pytest.mark.parametrize("exponent", [0, 5, 100])
@pytest.mark.parametrize("degrees", [0, 60, 85])
def test_pdf_integrates_to_what_leaves_the_surface(exponent, degrees, at, hemisphere):
    """1 less the share of the lobe below the horizon, by the manual's sampling in float64."""
    bsdf = mi.load_dict(phong(exponent, 0.3, 0.3))
    wi = unit(degrees, 25)
    integral = hemisphere(
        lambda wo: np.array(
            bsdf.pdf(mi.BSDFContext(), at(np.broadcast_to(wi, wo.shape)), mi.Vector3f(wo.T))
        ).astype(float)
    )
    u, v = np.meshgrid(*[(np.arange(1000) + 0.5) / 1000] * 2)
    alpha = np.arccos(v ** (1 / (exponent + 1)))
    # Height of the sample above the surface: the mirror direction is `degrees` off the normal.
    z = np.cos(alpha) * wi[2] + np.sin(alpha) * np.cos(2 * np.pi * u) * np.hypot(wi[0], wi[1])
    assert integral == pytest.approx(0.5 + 0.5 * (z > 0).mean(), abs=2e-3)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_reciprocity(exponent, at, pairs):
    bsdf = mi.load_dict(phong(exponent))
    wi, wo = pairs(bsdf, 11)
    ctx = mi.BSDFContext()
    there = np.array(bsdf.eval(ctx, at(wi), mi.Vector3f(wo.T)))[0] / wo[:, 2]
    back = np.array(bsdf.eval(ctx, at(wo), mi.Vector3f(wi.T)))[0] / wi[:, 2]
    np.testing.assert_allclose(there, back, rtol=1e-5)


def test_albedo(albedo):
    """rho_s = 1: exactly 1 at normal incidence; cos theta for a narrow lobe aside.

    The lobe (n+2)/(2 pi) cos^n alpha cos theta_o integrates to 1 where alpha = theta_o. Narrow
    lobes see a constant cosine: (n+2)/(n+1) cos theta. At 80 degrees half of it is cut off.
    """
    for exponent in (0, 5, 100):
        assert albedo(mi.load_dict(phong(exponent, 0, 1)), 0) == pytest.approx(1, abs=1e-3)
    assert albedo(mi.load_dict(phong(1000, 0, 1)), 45) == pytest.approx(0.707, abs=2e-3)
    for exponent in (30, 100, 1000):
        assert 0.17 <= albedo(mi.load_dict(phong(exponent, 0, 1)), 80) <= 0.23


def test_albedo_stays_below_one(albedo):
    for exponent in (0, 1, 10, 200):
        bsdf = mi.load_dict(phong(exponent, 0, 1))
        for angle in (0, 15, 30, 60, 80, 89):
            assert albedo(bsdf, angle, 500) <= 1 + 1e-3


@pytest.mark.false_alarms(1e-3)
def test_white_furnace(mean_albedo, furnace, chance):
    """A sphere under a sky of 1 shows its mean albedo."""
    material = phong(20, 0.3, 0.6)
    expected = mean_albedo(mi.load_dict(material))
    chance.equal(furnace(material, 32), expected, allowed=5e-4, precision=2e-3)


@pytest.mark.parametrize("exponent", [*EXPONENTS, 1e6])
def test_all_values_are_valid(exponent, at, assert_valid):
    for rho_d, rho_s in ((0, 0), (0, 1), (1, 0), (0.5, 0.5)):
        assert_valid(mi.load_dict(phong(exponent, rho_d, rho_s)), at)
