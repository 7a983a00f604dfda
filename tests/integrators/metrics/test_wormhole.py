"""Wormholes: swept angles, Ellis's closed form, what is seen through the mouth."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy.special import ellipk

from tests.integrators.metrics.geodesics import PIXEL_TENTH, follow, metric, towards


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


def swept(hole, beta, R):
    """Angle that rays sweep, from infinity to infinity, and whether they came through."""
    p = np.array([R + 0 * beta, 0 * beta, 0 * beta])
    g, _, out, _ = follow(hole, p, towards(np.arcsin(beta / R)))
    turns = np.array(g.y[1])
    # ψ of the asymptote is ψ of the last place and less than a right angle.
    end = np.arctan2(out[:, 1], out[:, 0])
    end = turns + (end - turns + np.pi) % (2 * np.pi) - np.pi
    return end + np.arcsin(beta / R), np.array(g.y[0]) < 0


INSIDE, BEYOND = np.array([0.25, 0.5, 0.75, 0.9, 0.99]), np.array([1.01, 1.1, 1.5, 2, 3])


@pytest.mark.parametrize(
    ("rho", "a", "W", "through", "deflected"),
    [(1.3, 0.5, 0.05, [0.752142, 1.596595, 2.762682, 4.142658, 8.941968],
      [0.573570, 0.206940, 0.073452, 0.042654, 0.023534]),
     (1.0, 0.005, 0.05, [0.566733, 1.181375, 1.943998, 2.642067, 3.750218],
      [0.700847, 0.259383, 0.093639, 0.054703, 0.030322]),
     (1.0, 0.5, 0.43, [1.039217, 2.222695, 3.913441, 6.003819, 13.232419],
      [3.175410, 1.448197, 0.608489, 0.378962, 0.222739])],
)  # fmt: skip
def test_swept_angles(rho, a, W, through, deflected):
    """By quadrature, whose tails of the linear r are right to a part in 1e4 at worst."""
    hole = metric("wormhole", rho=rho, a=a, W=W)
    beta = rho * np.concatenate([INSIDE, BEYOND])
    angle, passed = swept(hole, beta, 2000.0)
    want = np.concatenate([through, np.pi + np.array(deflected)])
    assert passed.tolist() == [True] * 5 + [False] * 5
    assert np.abs(angle / want - 1).max() < 3e-5


def test_another_shape():
    """Ellis's wormhole, r² = ρ² + l², by its elliptic integrals."""
    hole = metric("wormhole", rho=1.0, a=0.0, W=0.05)

    def shape(l):
        r = dr.sqrt(1 + dr.square(l))
        return r, dr.abs(l) / r

    hole.shape = shape
    hole.distance = lambda r: dr.safe_sqrt(dr.square(r) - 1)
    beta = np.array([0.3, 0.8, 0.95, 1.05, 1.5, 4])
    angle, _ = swept(hole, beta, 1000.0)
    want = np.where(beta < 1, 2 * beta * ellipk(np.minimum(beta, 1) ** 2),
                    2 * ellipk(np.minimum(1 / beta, 1) ** 2))  # fmt: skip
    assert np.abs(angle / want - 1).max() < 3e-5


def test_edge_of_the_mouth():
    """The other side is seen within asin(ρ/r), to a tenth of a pixel."""
    r = np.array([1.5, 2, 5, 40])
    alpha = np.arcsin(1.3 / r)
    p = np.array([r, 0 * r, 0 * r])
    for sign in (-1, 1):
        g, _, _, _ = follow(metric("wormhole"), p, towards(alpha + sign * PIXEL_TENTH))
        assert ((np.array(g.y[0]) < 0) == (sign < 0)).all(), r


def test_sides_and_directions():
    """Through the middle to the other mouth, out in the direction from which one came."""
    hole = metric("wormhole", mouth_in=[1, 2, 3], mouth_out=[100, 0, 0])
    for side, start in ((1, [1, 2, 8]), (2, [100, 0, 5])):
        p, d = np.array(start, float)[:, None], np.array([[0.0], [0], [-1]])
        g, _, out, _ = follow(hole, p, d, side=side)
        assert np.array(hole.side(g)).tolist() == [3 - side]
        assert np.allclose(out, [[0, 0, 1]], atol=1e-5)
        end = np.array(hole.point(g, mi.UInt32(3 - side))).ravel()
        mouth = np.array([[1, 2, 3], [100, 0, 0]])[2 - side]
        assert np.allclose(end[:2], mouth[:2], atol=1e-4) and end[2] > mouth[2] + 1.3


def test_radii_and_distances():
    hole = metric("wormhole", rho=1.3, a=0.5, W=0.05)
    r = np.concatenate([1.3 + np.geomspace(1e-5, 1, 30), np.geomspace(3, 1e5, 20)])
    l = hole.distance(mi.Float(r))
    assert np.allclose(hole.shape(l)[0], r, rtol=1e-6)
    assert (np.array(l) >= 0.5).all()


def test_impact_parameter_is_kept():
    """p² + β²/r² = 1 along the ray."""
    hole = metric("wormhole", W=0.3)
    beta = np.linspace(0.05, 4, 80)
    p = np.array([9 + 0 * beta, 0 * beta, 0 * beta])
    g, *_ = follow(hole, p, towards(np.arcsin(beta / 9)))
    r, _ = hole.shape(g.y[0])
    assert np.abs(np.array(g.y[2] ** 2 + (g.k[0] / r) ** 2) - 1).max() < 1e-5


def test_bad_shapes():
    for bad in ({"rho": 0.0}, {"a": -1.0}, {"W": 0.0}):
        with pytest.raises(RuntimeError, match="must be"):
            metric("wormhole", **bad)
