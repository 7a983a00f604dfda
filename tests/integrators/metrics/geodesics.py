"""Geodesics to their ends, and closed forms of Schwarzschild's, for the tests of metrics.

Lengths are in units of M.
"""

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.integrate import quad
from scipy.special import ellipk, ellipkinc

from relume import integrators  # noqa: F401  registers the plugins
from relume.integrators.metrics.metric import REST

CRITICAL = 3 * np.sqrt(3)
"""Impact parameter of the shadow's edge."""

PIXEL_TENTH = 1e-4
"""A tenth of a pixel [rad], of 1000 pixels across 1 rad."""


def metric(name, **parameters):
    """A metric as the integrator makes it."""
    entry = {"type": "curvedspace", "metric": name, "nested": {"type": "surfacepath"}}
    return mi.load_dict(entry | parameters).metric


@dr.syntax
def follow(metric, p, d, camera=False, chords=False, side=1):
    """The last state, whether it is captured, the asymptotic direction, and the count of steps."""
    p, d = mi.Point3f(*np.asarray(p, float)), mi.Vector3f(*np.asarray(d, float))
    g = metric.begin(p, d, mi.UInt32(side), camera)
    steps, active, captured, out = mi.UInt32(0), mi.Bool(True), mi.Bool(False), mi.Vector3f(0)
    while active:
        g, _ = metric.step(g, chords)
        steps += 1
        captured = metric.captured(g)
        asymptote, rest = metric.asymptote(g)
        out = mi.Vector3f(asymptote)
        active = ~captured & (rest >= REST) & (steps < 2000)
    assert dr.all(steps < 2000)
    return g, np.array(captured), np.array(out).T, np.array(steps)


def towards(angle):
    """Directions (3, n) in the XY plane from a point on +X, at an angle from the centre."""
    return np.array([-np.cos(angle), np.sin(angle), 0 * angle])


def nearest(b):
    """Closest approach."""
    return 2 * b / np.sqrt(3) * np.cos(np.arccos(-CRITICAL / b) / 3)


def deflection(b):
    """Total deflection from infinity to infinity by elliptic integrals."""
    r0 = nearest(b)
    Q = np.sqrt((r0 - 2) * (r0 + 6))
    m = (Q - r0 + 6) / (2 * Q)
    sine = np.sqrt((Q + 2 - r0) / (Q + 6 - r0))
    return 4 * np.sqrt(r0 / Q) * (ellipk(m) - ellipkinc(np.arcsin(sine), m)) - np.pi


def outside(b, R):
    """Angle that a ray sweeps between R, beyond its closest approach, and infinity."""
    return quad(lambda u: b / np.sqrt(1 - (b * u) ** 2 * (1 - 2 * u)), 0, 1 / R, epsabs=1e-12)[0]


def angle_of(b, R, static=False):
    """Angle from the direction to the centre in which an observer at R sends a ray of b."""
    f = 1 - 2 / R
    return np.arcsin(b * np.sqrt(f) / R) if static else np.arcsin(b / np.sqrt(R**2 + 2 * b**2 / R))
