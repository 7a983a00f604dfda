"""Henyey and Greenstein's function and its inverse belong together."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.phasefunctions.henyeygreenstein import henyey_greenstein, sample_henyey_greenstein


@pytest.mark.parametrize("g", [0.0, 0.3, -0.7, 0.9, -0.99])
def test_density_is_the_derivative_of_the_inverse(g):
    """Proves: samples have the density p, 2 pi p dx/dxi = 1, and the mean cosine is g."""
    mi.set_variant("llvm_ad_rgb")
    n = 4000
    x, edges = (
        np.array(sample_henyey_greenstein(mi.Float(g), mi.Float(xi)))
        for xi in ((np.arange(n) + 0.5) / n, np.arange(n + 1) / n)
    )
    p = np.array(henyey_greenstein(mi.Float(g), mi.Float(x)))
    assert edges[0] == 0 and edges[-1] == pytest.approx(2, rel=1e-5)
    inner = slice(n // 50, -n // 50)
    np.testing.assert_allclose((2 * np.pi * p * np.diff(edges) * n)[inner], 1, rtol=5e-3)
    assert np.sign(g or 1) * np.mean(1 - x) == pytest.approx(g, abs=1e-4)


@pytest.mark.parametrize("g", [1.0, -1.0])
def test_dirac_lobes(g):
    mi.set_variant("llvm_ad_rgb")
    x = sample_henyey_greenstein(mi.Float(g), dr.arange(mi.Float, 10) / 10)
    assert np.all(np.array(x) == 0)
    assert np.all(np.array(henyey_greenstein(mi.Float(g), x)) == 0)
