"""Light around a black hole that spins: its shadow, and the same in other coordinates."""

import mitsuba as mi
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.integrators.metrics.geodesics import follow, metric, towards


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


class BoyerLindquist:
    """A ray in Boyer and Lindquist's coordinates, in double precision (Fuerst and Wu 2004).

    Args:
        p: point in the scene.
        d: direction of the ray against the light.
        a: spin.
    """

    def __init__(self, p, d, a):
        self.a = a
        (x, y, z), m = p, -np.asarray(d)
        u = x * x + y * y + z * z - a * a
        r = np.sqrt((u + np.sqrt(u * u + 4 * a * a * z * z)) / 2)
        theta, phi = np.arccos(z / r), np.arctan2(y, x)
        s, c, R = np.sin(theta), np.cos(theta), np.sqrt(r * r + a * a)
        out = m[0] * np.cos(phi) + m[1] * np.sin(phi)
        self.S, self.D = r * r + a * a * c * c, r * r - 2 * r + a * a
        S, D = self.S, self.D
        rd = R * (r * s * out + R * c * m[2]) / S
        td = (R * c * out - r * s * m[2]) / S
        fd = (-m[0] * np.sin(phi) + m[1] * np.cos(phi)) / (R * s)
        E = np.sqrt((S - 2 * r) * (rd**2 / D + td**2) + D * s * s * fd**2)
        self.L = (S * D * fd - 2 * a * r * E) * s * s / ((S - 2 * r) * E)
        self.start = np.array([r, theta, phi, rd * S / (D * E), td * S / E])
        self.kappa = self.start[4] ** 2 + self.L**2 / s**2 + a * a * s * s

    def slope(self, _, y):
        r, theta, _, pr, pt = y
        a, L, s, c = self.a, self.L, np.sin(theta), np.cos(theta)
        S, D = r * r + a * a * c * c, r * r - 2 * r + a * a
        force = ((1 - r) * self.kappa + 2 * r * (r * r + a * a) - 2 * a * L) / (S * D)
        return -np.array([
            pr * D / S, pt / S, (2 * a * r + (S - 2 * r) * L / s**2) / (S * D),
            force - 2 * pr**2 * (r - 1) / S, s * c / S * (L**2 / s**4 - a * a),
        ])  # fmt: skip

    def far(self, R=1e6):
        """Direction of its place at a great distance."""

        def away(_, y):
            return y[0] - R

        away.terminal = True
        end = solve_ivp(self.slope, (0, 4 * R), self.start, "DOP853", events=away,
                        rtol=1e-10, atol=1e-10).y[:, -1]  # fmt: skip
        _, theta, phi, *_ = end
        return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@pytest.mark.parametrize("a", [0.9, -0.6])
def test_rays_off_the_equator(a):
    """Asymptotic directions as integrated in other coordinates."""
    rng = np.random.default_rng(3)
    p = np.array([20.0, 3.0, 8.0])[:, None] + 4 * rng.normal(size=(3, 6))
    aim = 7 * rng.normal(size=(3, 6)) - p
    d = aim / np.linalg.norm(aim, axis=0)
    _, captured, out, _ = follow(metric("kerr", spin=a), p, d)
    want = np.array([BoyerLindquist(p[:, i], d[:, i], a).far() for i in np.flatnonzero(~captured)])
    assert len(want) >= 4
    assert np.abs(out[~captured] - want).max() < 1e-4


def edges(a):
    """Impact parameters of the prograde and the retrograde edge, seen from the equator."""
    r = 2 * (1 + np.cos(2 / 3 * np.arccos(np.array([-a, a]))))
    return np.array([-1, 1]) * (np.sqrt(r) * 3 - np.array([a, -a]))


@pytest.mark.parametrize("a", [0.0, 0.5, 0.99])
def test_edges_of_the_shadow(a):
    """Within a tenth of a pixel of 1000 across 20 M; the near edge is at -Y, seen from +X."""
    R, tenth = 200.0, 2e-3
    hole = metric("kerr", spin=a)
    for edge in edges(a):
        ends = edge - np.sign(edge) * tenth, edge + np.sign(edge) * tenth
        angles = [
            brentq(lambda t, b=b: BoyerLindquist((R, 0, 0), towards(t), a).L + b, -0.1, 0.1)
            for b in ends
        ]
        p = np.array([[R, R], [0, 0], [0, 0]])
        _, captured, _, _ = follow(hole, p, towards(np.array(angles)))
        assert captured.tolist() == [True, False], (a, edge)


def test_edges_in_the_table():
    """The closed form of the tests, by known numbers."""
    assert np.allclose(edges(0.5), [-4.096267, 6.138156], atol=1e-6)
    assert np.allclose(edges(0.99), [-2.251724, 6.983323], atol=1e-6)


def test_energy_angular_momentum_and_carters_constant_are_kept():
    rng = np.random.default_rng(5)
    p = 15 * rng.normal(size=(3, 200))
    p = p[:, np.linalg.norm(p, axis=0) > 5]
    d = rng.normal(size=p.shape)
    d /= np.linalg.norm(d, axis=0)
    hole = metric("kerr", spin=0.95)

    def constants(g):
        x, q = np.array(g.y[:3], np.float64), np.array(g.y[3:], np.float64)
        a = -0.95
        u = (x**2).sum(0) - a * a
        r = np.sqrt((u + np.sqrt(u * u + 4 * a * a * x[2] ** 2)) / 2)
        c = x[2] / r
        s = np.sqrt(1 - c * c)
        L = x[0] * q[1] - x[1] * q[0]
        pt = c / s * (x[0] * q[0] + x[1] * q[1]) - r * s * q[2]
        carter = pt**2 + c * c * (L**2 / s**2 - a * a)
        l = np.array([r * x[0] + a * x[1], r * x[1] - a * x[0], 0 * r]) / (r * r + a * a)
        l[2] = c
        f = 2 * r / (r * r + a * a * c * c)
        return L, carter, (q**2).sum(0) - 1 - f * (1 + (l * q).sum(0)) ** 2

    before = constants(hole.begin(mi.Point3f(*p), mi.Vector3f(*d), mi.UInt32(1), False))
    g, captured, _, _ = follow(hole, p, d)
    after = constants(g)
    free = ~captured
    assert free.sum() > 100
    assert np.abs(after[0] - before[0])[free].max() < 1e-4
    assert (np.abs(after[1] - before[1]) / (1 + np.abs(before[1])))[free].max() < 2e-4
    assert np.abs(after[2])[free].max() < 1e-5  # the Hamiltonian: p_t stays


def test_no_streaks_along_the_axis():
    """Rays that pass the poles leave as those beside them."""
    y = np.linspace(-1e-2, 1e-2, 41)
    p, d = np.array([30 + 0 * y, y, 0 * y]), np.array([-1 + 0 * y, 0 * y, 0.25 + 0 * y])
    _, captured, out, steps = follow(metric("kerr", spin=0.8), p, d / np.sqrt(1.0625))
    assert not captured.any()
    assert np.abs(np.diff(out, 2, axis=0)).max() < 3e-4
    assert steps.max() < steps.min() + 5


def test_static_observer():
    """Angles of an observer at rest: the tangent by the tetrad, in Boyer and Lindquist's metric."""
    a, p, n = 0.7, np.array([4.0, 1.0, 2.0]), np.array([-0.6, 0.48, 0.64])
    hole = metric("kerr", spin=a, observer="static")
    x = mi.Vector3f(p.tolist())
    seen = np.array(hole.seen_at_rest(x, mi.Vector3f(n.tolist()), hole.place(x))).ravel()
    h = 1e-6

    def point(q):
        r, theta, phi = q
        R = np.sqrt(r * r + a * a)
        return np.array([R * np.sin(theta) * np.cos(phi), R * np.sin(theta) * np.sin(phi),
                         r * np.cos(theta)])  # fmt: skip

    ray = BoyerLindquist(p, n, a)
    r, theta = ray.start[:2]
    axes = [(point(ray.start[:3] + h * e) - p) / h for e in np.eye(3)]
    S, D, s2 = ray.S, ray.D, np.sin(theta) ** 2
    lengths = np.sqrt([S / D, S, D * S * s2 / (S - 2 * r)])
    want = sum(
        n @ (axis / np.linalg.norm(axis)) / length * axis
        for axis, length in zip(axes, lengths, strict=True)
    )
    assert np.allclose(seen, want / np.linalg.norm(want), atol=1e-5)


def test_spin_out_of_range():
    with pytest.raises(RuntimeError, match="spin is 1"):
        metric("kerr", spin=1.0)
