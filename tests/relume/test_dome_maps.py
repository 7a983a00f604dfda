"""The formulas of the dome maps: numpy and Dr.Jit compute the same, and section 11.5 says what."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.dome_maps import FORMULAS, Numpy

EXAMPLES = {
    "transposed": [((0, 0, 1), (0, None)), ((-1, 0, 0), (0.5, 0.5)), ((0, -1, 0), (0.5, 0.75))],
    "panoramic": [((0, 0, -1), (0.5, 0.5)), ((1, 0, 0), (0.75, 0.5)), ((0, 1, 0), (None, 1))],
    "angular": [((0, 0, -1), (0.5, 0.5)), ((1, 0, 0), (0.75, 0.5)), ((0, -1, 0), (0.5, 0.25))],
    "angular_mirrored": [((0, 0, 1), (0.5, 0.5)), ((1, 0, 0), (0.75, 0.5))],
    "equirectangular": [((1, 0, 0), (0.5, 0.5)), ((0, 0, 1), (0.75, 0.5)), ((0, -1, 0), (None, 1))],
    "hemisphere": [((0, 1, 0), (0.5, 0.5)), ((0, 0, 1), (1, 0.5)), ((1, 0, 0), (0.5, 1))],
}
"""Directions with their place in the picture, read off the table of section 11.5; None where a
whole column or row shows one direction."""


@pytest.mark.parametrize("name", FORMULAS)
def test_axes(name):
    """Where the axes lie in the picture."""
    for n, expected in EXAMPLES[name]:
        for found, wanted in zip(FORMULAS[name](Numpy, *np.array(n, float)), expected, strict=True):
            assert wanted is None or found == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("name", FORMULAS)
def test_dr_jit_computes_what_numpy_does(name):
    """In double precision to 1e-14, at 1000 directions and close to the axes."""
    mi.set_variant("llvm_ad_rgb")
    n = np.random.default_rng(1).normal(size=(3, 1000))
    n = np.concatenate([n, 1e-7 * n[:, :3] + np.eye(3), 1e-7 * n[:, :3] - np.eye(3)], axis=1)
    n /= np.linalg.norm(n, axis=0)
    Float64 = dr.llvm.ad.Float64
    found = FORMULAS[name](dr, *(Float64(x) for x in n))
    for ours, theirs in zip(FORMULAS[name](Numpy, *n), found, strict=True):
        assert ours == pytest.approx(np.array(theirs), abs=1e-14)
