"""Steps over what nothing is in: half balls against walks in double precision, and fog around a
white sphere where it matters where walks come out, against the theory of diffusion."""

from types import SimpleNamespace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import relume  # noqa: F401  registers the plugins
from relume.integrators.spherejumps import EXTRAPOLATED

SIGMA = 1000.0


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def cosine_law(rng, n):
    """Directions by the cosine law about the normals n, (N, 3)."""
    z = rng.uniform(-1, 1, len(n))
    phi, s = rng.uniform(0, 2 * np.pi, len(n)), np.sqrt(1 - z * z)
    d = n + np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=1)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def walked(tau, R, count, seed):
    """Walks from the top of a white ball of the radius R around the origin, to the distance tau.

    Returns:
        Where and in which direction they leave, (N, 3), how often the ball has reflected them, and
        how often they were scattered.
    """
    rng = np.random.default_rng(seed)
    top = np.array([0, 0, R])
    x, counts = np.tile(top, (count, 1)), np.zeros((count, 2), int)
    d = cosine_law(rng, x / R)
    found = []
    while len(x):
        y = x - top
        b, c = (y * d).sum(axis=1), (y * y).sum(axis=1) - tau**2
        out = -b + np.sqrt(np.maximum(b * b - c, 0))
        b, c = (x * d).sum(axis=1), np.maximum((x * x).sum(axis=1) - R**2, 0)
        D = np.sqrt(np.maximum(b * b - c, 0))
        ball = np.where((b < 0) & (b * b > c), c / np.maximum(D - b, 1e-300), np.inf)
        s = rng.exponential(size=len(x))
        t = np.minimum(np.minimum(out, ball), s)
        leaves, reflected = t == out, (t == ball) & (t < out)
        x = x + t[:, None] * d
        found.append((x[leaves] - top, d[leaves], counts[leaves]))
        n = np.where(reflected[:, None], x, 0)
        n[reflected] /= np.linalg.norm(n[reflected], axis=1, keepdims=True)
        x[reflected] = R * n[reflected]
        even = rng.normal(size=x.shape)
        d = np.where(reflected[:, None], cosine_law(rng, n), even)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        counts = counts + np.stack([reflected, ~reflected], axis=1)
        x, d, counts = x[~leaves], d[~leaves], counts[~leaves]
    x, d, counts = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return x, d, *counts.T


def test_half_balls():
    """Heights, cosines and losses of `leap`, to four standard errors of the walks and 0.001."""
    from relume.integrators.boundaries import Anchor
    from relume.integrators.walkjumps import LEVEL, leap
    from relume.integrators.walkmedia import Coefficients
    from relume.integrators.walks import Walk

    tau, lost, a, count = 20.0, 5e-5, 1 - 2e-6, 60_000
    x, d, reflections, scatterings = walked(tau, tau / LEVEL, count, 5)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(3, 400_000)
    anchor = Anchor.none(mi.Point3f(0))
    anchor.n, anchor.k = mi.Vector3f(0, 0, -1), mi.Float(-LEVEL / tau)
    anchor.absorbed = mi.Float(lost)
    lanes = dr.full(mi.Bool, True, 400_000)
    walk = Walk.beginning(anchor, mi.Vector3f(0, 0, 1), mi.Spectrum(1), mi.UInt32(0), lanes)
    around = SimpleNamespace(clearances=SimpleNamespace(two=lambda p, active: (p.x, p.x + 1e3)))
    inner = Coefficients(mi.Spectrum(1), mi.Spectrum(a), mi.Spectrum(0))
    leap(around, sampler, anchor, inner, mi.Bool(False), walk, lanes)
    found, way = np.array(walk.x, float).T, np.array(walk.d, float).T
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.full(len(found), tau), rel=1e-5)
    exact, scale = x / tau, found / tau
    for a_values, b_values in (
        (exact[:, 2], scale[:, 2]),
        ((exact * d).sum(axis=1), (scale * way).sum(axis=1)),
        (d[:, 2], way[:, 2]),
    ):
        error = a_values.std() / count**0.5
        assert b_values.mean() == pytest.approx(a_values.mean(), abs=4 * error + 0.001)
    loss = lost * reflections.mean() + (1 - np.float32(a)) * scatterings.mean()
    assert 1 - walk.β.x[0] == pytest.approx(loss, rel=0.03)
    assert abs(found[:, :2].mean(axis=0)).max() < 0.01 * tau


def slope(outer):
    """How light on a white sphere of radius 1 in white fog grows with y under a sky of 1 + 0.9 y.

    Diffusion: L = A (r + c / r^2) y with L' = 0 on the sphere. At the end of the fog, under light
    of the cosine mu, L + z_0 L' / sigma = z_0 mu: the weight of what comes in at mu is sqrt(3)/2 mu
    H(mu), of which z_0 is the mean cosine.
    """
    end = outer + 0.5 / outer**2 + EXTRAPOLATED / SIGMA * (1 - outer**-3)
    return 1.5 * 0.9 * EXTRAPOLATED / end


@pytest.mark.false_alarms(1e-3)
def test_white_sphere_in_fog(chance, level):
    """Mean, and slope from the dark side to the bright one, under 100 mean free paths of fog."""
    theta = (np.arange(64) + 0.5) / 64 * np.pi
    sky = np.tile((1 + 0.9 * np.cos(theta)).astype(np.float32)[:, None, None], (1, 128, 3))
    fog = mi.load_dict({"type": "homogeneous", "albedo": 1.0, "sigma_t": SIGMA})
    white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
    made = mi.load_dict(
        {
            "type": "scene",
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky)},
            "end": {"type": "sphere", "radius": 1.1, "bsdf": {"type": "null"}, "interior": fog},
            "sphere": {"type": "sphere", "bsdf": white, "exterior": fog},
        }
    )
    paths = mi.load_dict({"type": "randomwalk", "rr_depth": 100})
    n = chance.samples(3000)
    found = []
    for _ in range(8):
        y = chance.rng().uniform(-1, 1, n).astype(np.float32)
        p = mi.Vector3f(mi.Float(np.sqrt(1 - y * y)), mi.Float(y), 0)
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(chance.seed(), n)
        ray = mi.Ray3f(mi.Point3f((1 + 0.1 / SIGMA) * p), -p)
        L, _, _ = paths.sample(made, sampler, ray, fog, mi.Bool(True))
        L = np.array(L.y, float)
        grows = ((L - L.mean()) * y).mean() / (y * y).mean()
        found.append([L.mean(), grows])
    chance.equal(level(found), [1.0, slope(1.1)], allowed=2e-3, precision=0.02)
