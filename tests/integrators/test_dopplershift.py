"""Colours in the sight of a moving camera, by closed forms."""

import mitsuba as mi
import numpy as np
import pytest

from relume import integrators  # noqa: F401  registers the plugins

BETA = 0.6
AHEAD, ASIDE, BEHIND = [1, 0, 0], [0, 1, 0], [-1, 0, 0]
FACTORS = np.array([2.0, 1.25, 0.5])
"""sqrt((1 + β) / (1 - β)), γ, and sqrt((1 - β) / (1 + β))."""


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def seen(radiance, wavelengths=None, **parameters):
    """What a moving camera sees of a uniform sky ahead, aside and behind, as the world has it."""
    scene = mi.load_dict({"type": "scene", "sky": {"type": "constant", "radiance": radiance}})
    entry = {"type": "dopplershift", "velocity": [BETA, 0, 0], "nested": {"type": "path"}}
    integrator = mi.load_dict(entry | parameters)
    ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(0), mi.Vector3f(*np.array(
        [AHEAD, ASIDE, BEHIND], float).T)))  # fmt: skip
    if wavelengths is not None:
        ray.wavelengths = mi.Spectrum(*wavelengths)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, 3)
    L, _, _ = integrator.sample(scene, sampler, ray)
    return np.array(L).T


def test_beaming():
    """Without a shift of colours, D^4 as a whole."""
    L = seen({"type": "rgb", "value": [1, 2, 3]}, share=0.0)
    assert np.allclose(L, FACTORS[:, None] ** 4 * [1, 2, 3], rtol=1e-5)


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_lines(share):
    """A green line of 546.1 nm is moved and given to the primaries by Gauss functions."""
    L = seen({"type": "rgb", "value": [0, 1, 0]}, share=share)
    lines = np.array([700, 546.1, 435.8])
    moved = 546.1 / (1 + (FACTORS - 1) * share)
    fade = np.exp(-np.maximum(0, np.maximum(380 - moved, moved - 750)) / 50)
    shifted = np.exp(-(((moved[:, None] - lines) / 100) ** 2) / 2) * fade[:, None]
    beamed = FACTORS[:, None] ** 4 * [0, 1, 0]
    assert np.allclose(L, share * shifted + (1 - share) * beamed, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("variant", ["llvm_ad_spectral"], indirect=True)
def test_wavelengths(variant):
    """In spectral variants the radiance is D^5 times that at the wavelength D λ."""
    spectrum = {"type": "irregular", "wavelengths": "200, 1000", "values": "2, 10"}
    wavelengths = [400.0, 450, 600, 700]
    L = seen(spectrum, wavelengths, velocity=[0.1, 0, 0])
    D = np.sqrt(np.array([1.1 / 0.9, 1 / (1 - 0.01), 0.9 / 1.1]))[:, None]
    assert np.allclose(L, D**5 * D * np.array(wavelengths) / 100, rtol=1e-5)


@pytest.mark.parametrize("variant", ["llvm_ad_mono"], indirect=True)
def test_grey(variant):
    assert np.allclose(seen(1.0)[:, 0], FACTORS**4, rtol=1e-5)


def test_bad_parameters():
    for bad, message in (({"share": 2.0}, "share is 2"), ({"velocity": [0, 1, 1]}, "velocity is")):
        with pytest.raises(RuntimeError, match=message):
            seen(1.0, **bad)
