"""`hgrgb`: Henyey-Greenstein for each channel, exact from g = -1 to 1."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from mitsuba.python.chi2 import ChiSquareTest, PhaseFunctionAdapter, SphericalDomain

from relume import phasefunctions  # noqa: F401  registers the plugin
from relume.workbench.statistics import Level

G = (0.0, 1e-4, 0.3, -0.5, 0.9, 0.99, -0.99, 1.0, -1.0)


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def spectral(rgb):
    mi.set_variant("llvm_ad_spectral")
    yield
    mi.set_variant("llvm_ad_rgb")


def load(*g):
    return mi.load_dict({"type": "hgrgb", "g": list(np.broadcast_to(g, 3).astype(float))})


def interaction(count, wavelengths=None):
    """Interactions of light that travels along a fixed slanting direction."""
    mei = dr.zeros(mi.MediumInteraction3f, count)
    mei.wi = -dr.normalize(mi.Vector3f(0.36, 0.48, 0.8))
    if wavelengths is not None:
        mei.wavelengths = wavelengths
    return mei


def drawn(phase, count, rng, wavelengths=None):
    """`count` samples: cosines (count,), weights (count, channels), densities (count,)."""
    u = rng.random((3, count)).astype(np.float32)
    mei = interaction(count, wavelengths)
    wo, weight, pdf = phase.sample(
        mi.PhaseFunctionContext(None), mei, mi.Float(u[0]), mi.Point2f(u[1:]), True
    )
    return np.array(dr.dot(-mei.wi, wo), float), np.array(weight, float).T, np.array(pdf, float)


def mean(values):
    """`Level` of the mean of independent values, (N, ...)."""
    n = len(values)
    variance = values.var(axis=0, ddof=1) / n
    return Level(values.mean(axis=0), variance, np.full(variance.shape, n - 1.0))


def at(phase, cos, wavelengths=None):
    """Value (N, channels) and density (N,) at cosines (N,)."""
    mei = interaction(len(cos), wavelengths)
    x = mi.Float(cos.astype(np.float32))
    wo = mi.Frame3f(-mei.wi).to_world(mi.Vector3f(dr.safe_sqrt(1 - x * x), 0, x))
    value, pdf = phase.eval_pdf(mi.PhaseFunctionContext(None), mei, wo, True)
    return np.array(value, float).T, np.array(pdf, float)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("g", G)
def test_mean_cosine_is_g(chance, g):
    """The mean cosine of Henyey-Greenstein is g, also at 1 and -1: standard error below 6e-4."""
    cos, weight, pdf = drawn(load(g), chance.samples(2**20), chance.rng())
    assert np.all(np.isfinite(weight)) and np.all(pdf > 0)
    assert np.allclose(weight, 1, atol=1e-6)
    # Around 2, so that precision and allowance are absolute ones, of half their size.
    chance.equal(mean(2 + cos), 2 + g, allowed=1e-6, precision=5e-4)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "g", [(0.9, 0.3, -0.5), (1.0, 0.5, 0.5), (1.0, -1.0, 0.0), (1.0, 1.0, -0.2)]
)
def test_channels_keep_their_means(chance, g):
    """Weighted by its channel, the samples that all channels share have mean weight 1 and the mean
    cosine of each; no weight exceeds the number of channels."""
    cos, weight, _ = drawn(load(*g), chance.samples(2**20), chance.rng())
    assert weight.max() <= 3 * (1 + 1e-6)
    chance.equal(mean(weight), 1.0, allowed=1e-6, precision=2e-3, of=2)
    chance.equal(mean(2 + weight * cos[:, None]), 2 + np.array(g), precision=2e-3, of=2)


@pytest.mark.parametrize("g", [0.0, 0.3, -0.5, 0.9, -0.99])
def test_value_against_the_formula(g):
    """The manual's formula in double precision, to 1e-5 of it; the density is the value where all
    channels are equal."""
    cos = np.concatenate([np.linspace(-1, 1, 201), [1 - 1e-6, -1 + 1e-6]]).astype(np.float32)
    cos = cos.astype(float)
    expected = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cos) ** 1.5)
    value, pdf = at(load(g), cos)
    # A direction in single precision lies up to 1e-7 off: more where the lobe is steep.
    assert np.allclose(value, expected[:, None], rtol=2e-3 if abs(g) > 0.95 else 1e-4)
    assert np.allclose(pdf, value[:, 0], rtol=1e-6)


def test_dirac_lobes_have_no_value():
    """g = 1 and -1 are met by sampling alone; the other channels keep theirs."""
    value, pdf = at(load(1.0, -1.0, 0.0), np.linspace(-1, 1, 21))
    assert np.all(value[:, :2] == 0)
    assert np.allclose(value[:, 2], 1 / (4 * np.pi)) and np.allclose(pdf, value[:, 2] / 3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("g", [(0.0, 0.0, 0.0), (0.8, 0.1, -0.6), (-0.7, -0.7, -0.7)])
def test_chi_square(g, chance):
    """Samples follow the density."""
    numbers = ", ".join(map(str, g))
    sample, pdf = PhaseFunctionAdapter("hgrgb", f'<vector name="g" value="{numbers}"/>')
    test = ChiSquareTest(
        domain=SphericalDomain(), sample_func=sample, pdf_func=pdf, sample_dim=3,
        sample_count=2**20, res=101, ires=8, seed=chance.seed(),
    )
    assert test.run(significance_level=0, quiet=True), test.messages
    chance.judge(test.p_value)


@pytest.mark.parametrize("g", [1.1, -2.0, float("nan")])
def test_range(g):
    """Beyond [-1, 1] there is no such phase function: an error that names the range."""
    with pytest.raises(RuntimeError, match="must be from -1 to 1"):
        load(g)


@pytest.mark.false_alarms(1e-3)
def test_spectral_interpolation(spectral, chance):
    """Red above 611 nm, blue below 464 nm, green at 549 nm, linear between: mean cosines of the
    wavelengths by their weights."""
    wavelengths = mi.Spectrum(650.0, 420.0, 549.0, 580.0)
    expected = [0.9, -0.3, 0.2, 0.2 + 0.7 * 31 / 62]
    count = chance.samples(2**20)
    cos, weight, _ = drawn(load(0.9, 0.2, -0.3), count, chance.rng(), wavelengths)
    chance.equal(mean(2 + weight * cos[:, None]), 2 + np.array(expected), precision=2e-3)


def test_parameters_follow_traverse():
    phase = load(0.5)
    parameters = mi.traverse(phase)
    parameters["g"] = mi.Color3f(-0.5)
    parameters.update()
    assert abs(drawn(phase, 2**16, np.random.default_rng(0))[0].mean() + 0.5) < 0.01
    assert "g=" in str(phase)
