"""Walks from the middle of balls to their surface: formulas against walks in double precision."""

import mitsuba as mi
import numpy as np
import pytest

import relume  # noqa: F401  registers the plugins

ALBEDOS = np.array([1, 0.99, 0.95, 0.9])


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def walked(radius, count, seed):
    """Scatterings of isotropic walks from the middle of a ball, and cosines that they leave at."""
    rng = np.random.default_rng(seed)
    x, n = np.zeros((count, 3)), np.zeros(count, int)
    numbers, cosines = [], []
    while len(n):
        z, phi = rng.uniform(-1, 1, len(n)), rng.uniform(0, 2 * np.pi, len(n))
        sin = np.sqrt(1 - z * z)
        d = np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=1)
        b, c = (x * d).sum(axis=1), (x * x).sum(axis=1) - radius**2
        t = -b + np.sqrt(np.maximum(b * b - c, 0))
        s = rng.exponential(size=len(n))
        out = s >= t
        cosines.append(((x + t[:, None] * d) * d).sum(axis=1)[out] / radius)
        numbers.append(n[out])
        x, n = (x + s[:, None] * d)[~out], n[~out] + 1
    return np.concatenate(numbers), np.concatenate(cosines)


@pytest.mark.parametrize("radius", [8, 12])
def test_weight_and_cosine(radius):
    """Fixed seeds; four standard errors and, of what the fits leave, 0.004 of the weight and the
    cosine: in a walk an error of the cosine is one of its place in mean free paths."""
    from relume.integrators.spherejumps import eigenvalue, sample_exit, survival

    n, mu = walked(radius, 40_000, radius)
    random = np.random.default_rng(3).uniform(size=(4, 400_000)).astype(np.float32)
    u1, u2 = mi.Point2f(*random[:2]), mi.Point2f(*random[2:])
    for a in ALBEDOS:
        weights = a**n
        W = weights.mean()
        found = float(survival(mi.Float(radius), mi.Float(a), eigenvalue(mi.Float(a)))[0])
        assert found == pytest.approx(W, abs=4 * weights.std() / len(n) ** 0.5 + 0.002)
        m = (weights * mu).sum() / weights.sum()
        error = (weights * (mu - m)).std() / len(n) ** 0.5 / W
        u, d = sample_exit(mi.Float(radius), mi.Float(a), u1, u2)
        cosine = np.array(mi.Float(u.x * d.x + u.y * d.y + u.z * d.z), float)
        assert cosine.mean() == pytest.approx(m, abs=4 * error + 0.004)
        assert np.linalg.norm(np.array(u).mean(axis=1)) < 4 / 400_000**0.5


def test_eigenvalue():
    """kappa = tanh(kappa / a)."""
    from relume.integrators.spherejumps import eigenvalue

    a = np.array([0.6, 0.8, 0.9, 0.99, 0.999])
    kappa = np.array(eigenvalue(mi.Float(a.astype(np.float32))), float)
    assert kappa == pytest.approx(np.tanh(kappa / a), rel=2e-3)
