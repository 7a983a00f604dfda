"""Which paths roulette ends, and what survivors are worth."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.integrators.common import (
    DIM,
    FAINTEST,
    MIRRORS,
    russian_roulette,
    usual_throughput,
)


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def settled(bounces, passes=()):
    """The usual throughput after bounces of (albedo, delta); some surfaces are passed straight."""
    usual, β, depth = mi.Float(0), mi.Spectrum(1), mi.UInt32(0)
    for k, (albedo, delta) in enumerate(bounces):
        β *= albedo
        depth += k not in passes
        usual = usual_throughput(
            usual, β, mi.Float(1), depth, mi.Bool(k not in passes), mi.Bool(delta)
        )
    return usual[0]


MATT, MIRROR = (0.3, False), (0.9, True)


@pytest.mark.parametrize(
    ("bounces", "passes", "expected"),
    [
        ([MATT], (), 0.3),
        ([MATT, MATT, (0.5, False)], (), 0.3),
        ([MIRROR, MIRROR, MATT, MIRROR, MATT], (), 0.9**2 * 0.3),
        ([MIRROR] * (MIRRORS - 1), (), 0),
        ([MIRROR] * MIRRORS + [MATT], (), 0.9**MIRRORS),
        ([(1.0, False), MATT], (0,), 0.3),
        ([(3.0, False), MATT], (), 1),
    ],
)
def test_usual_is_what_the_first_wide_scattering_leaves(bounces, passes, expected):
    """By way of mirrors, of so many at most; what is passed straight on is no scattering."""
    assert settled(bounces, passes) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("usual", [0.0, 0.02, 0.25, 1.0])
@pytest.mark.parametrize("eta", [1.0, 1.5])
def test_survivors_are_worth_what_ended(usual, eta):
    """q = min(1, η² β / (DIM u)), by counting 2^16 numbers; β / q for those that go on."""
    n = 2**16
    u = (dr.arange(mi.Float, n) + 0.5) / n
    for b in np.geomspace(1e-3, 2, 9).tolist():
        left, lives = russian_roulette(
            mi.Spectrum(0.5 * b, b, 0), mi.Float(eta), mi.Float(usual), mi.Float(0.5),
            mi.UInt32(3), mi.Bool(True), u,
        )  # fmt: skip
        q = min(1, eta**2 * b / (DIM * max(usual, FAINTEST)))
        share = np.array(lives).mean()
        assert share == pytest.approx(q, abs=1 / n)
        assert np.array(left)[:, 0] == pytest.approx([0.5 * b / q, b / q, 0], rel=1e-4)


def test_a_path_that_does_not_decide_goes_on():
    """Before its depth has come roulette leaves it and what it carries as they are."""
    left, lives = russian_roulette(
        mi.Spectrum(1e-4), mi.Float(1), mi.Float(1), mi.Float(0.5), mi.UInt32(1), mi.Bool(False),
        mi.Float(0.999),
    )  # fmt: skip
    assert lives[0] and np.array(left).ravel() == pytest.approx(1e-4)
