"""Light around a black hole without spin: closed forms."""

import mitsuba as mi
import numpy as np
import pytest
from scipy.optimize import brentq

from tests.integrators.metrics.geodesics import (
    CRITICAL,
    PIXEL_TENTH,
    angle_of,
    deflection,
    follow,
    metric,
    outside,
    towards,
)


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


def test_deflection():
    """From 2.65 to 500 Schwarzschild radii within 1e-4 rad of the elliptic integral."""
    R = 1e5
    b = 2 * np.array([2.65, 2.7, 3, 4, 5, 7, 10, 20, 50, 100, 200, 500])
    p = np.array([R + 0 * b, 0 * b, 0 * b])
    for chords in (False, True):
        _, captured, out, _ = follow(
            metric("schwarzschild"), p, towards(angle_of(b, R)), chords=chords
        )
        assert not captured.any()
        swept = deflection(b) + np.pi - [outside(x, R) for x in b]
        error = np.arctan2(out[:, 1], out[:, 0]) - swept
        assert np.abs((error + np.pi) % (2 * np.pi) - np.pi).max() < 1e-4


def test_table_of_deflections():
    """The elliptic integral of the tests itself, by numbers computed by quadrature."""
    b = 2 * np.array([2.65, 3.0, 10.0, 100.0])
    table = [3.557938042, 1.719388310, 0.236135995, 0.020299966]
    assert np.allclose(deflection(b), table, rtol=0, atol=2e-9)


@pytest.mark.parametrize("static", [False, True])
def test_edge_of_the_shadow(static):
    """A tenth of a pixel inside rays are captured, outside they leave."""
    r = np.array([4, 6, 10, 20, 50])
    if static:
        alpha = np.arcsin(CRITICAL / r * np.sqrt(1 - 2 / r))
    else:
        alpha = np.arcsin(np.sqrt(27 / (r**2 + 54 / r)))
    hole = metric("schwarzschild", observer="static" if static else "coordinate")
    p = np.array([r, 0 * r, 0 * r], float)
    for sign in (-1, 1):
        _, captured, _, _ = follow(hole, p, towards(alpha + sign * PIXEL_TENTH), camera=True)
        assert (captured == (sign < 0)).all(), r


def test_static_observers_send_rays_alone_that_begin_at_sensors():
    hole = metric("schwarzschild", observer="static")
    p, d = np.array([[4.0], [0], [0]]), towards(np.array([1.0]))
    b = []
    for camera in (True, False):
        g = hole.begin(mi.Point3f(*p), mi.Vector3f(*d), mi.UInt32(1), camera)
        b.append(np.sqrt(np.array(g.k[0])[0] / 3))
    s = np.sin(1.0)
    assert np.allclose(b, [4 * s / np.sqrt(0.5), 4 * s / np.sqrt(1 - 0.5 * s * s)], rtol=1e-5)


def test_einstein_ring():
    """Light from straight behind at infinity comes in a ring."""
    R = 30.0
    b = brentq(lambda b: deflection(b) - outside(b, R), 6, 25)
    alpha = angle_of(b, R) + PIXEL_TENTH * np.array([-1, 1])
    p = np.array([[R, R], [0, 0], [0, 0]])
    _, _, out, _ = follow(metric("schwarzschild"), p, towards(alpha))
    assert out[0, 1] < 0 < out[1, 1] and (out[:, 0] < -0.99).all()


def test_energy_and_angular_momentum_are_kept():
    rng = np.random.default_rng(1)
    p = 20 * rng.normal(size=(3, 200))
    p = p[:, np.linalg.norm(p, axis=0) > 8]
    d = rng.normal(size=p.shape)
    d /= np.linalg.norm(d, axis=0)
    hole = metric("schwarzschild")
    begun = hole.begin(mi.Point3f(*p), mi.Vector3f(*d), mi.UInt32(1), False)
    g, captured, _, _ = follow(hole, p, d)
    x, v = np.array(g.y[:3]), np.array(g.y[3:])
    momentum = np.cross(x.T, v.T)
    before = np.cross(np.array(begun.y[:3]).T, np.array(begun.y[3:]).T)
    free = ~captured
    assert free.sum() > 100
    assert np.abs(momentum - before)[free].max() < 1e-5 * np.abs(before).max()
    r = np.linalg.norm(x, axis=0)
    E2 = (v**2).sum(0) - 2 * (momentum**2).sum(1) / r**3
    assert np.abs(E2 - 1)[free].max() < 1e-5


def test_units_of_mass_and_center():
    """A hole of five units of mass elsewhere is the same one, larger."""
    hole = metric("schwarzschild", mass=5.0, center=[10, -20, 30])
    b, R = np.array([6.0]), 40.0
    p = np.array([[10 + 5 * R], [-20], [30]])
    _, _, out, _ = follow(hole, p, towards(angle_of(b, R)))
    swept = deflection(b) + np.pi - outside(b[0], R)
    assert np.allclose(out[0, :2], [np.cos(swept[0]), np.sin(swept[0])], atol=1e-4)


@pytest.mark.parametrize(
    ("parameter", "message"),
    [({"mass": 0.0}, "mass is 0"), ({"observer": "moving"}, "observer is 'moving'"),
     ({"metric": "godel"}, "metric is 'godel'"), ({"spin": 0.5}, "spin")],
)  # fmt: skip
def test_bad_parameters(parameter, message):
    with pytest.raises(RuntimeError, match=message):
        metric(**({"name": "schwarzschild"} | {("name" if k == "metric" else k): v
                                               for k, v in parameter.items()}))  # fmt: skip
