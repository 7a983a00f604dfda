"""Steps of walks across what nothing is in: balls around them, and half balls on white spheres."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.boundaries import Anchor
from relume.integrators.spherejumps import LEAST, sample_exit, survival
from relume.integrators.walkmedia import Coefficients, mixture
from relume.integrators.walks import Walk, tolerance

UNLIT = 10.0
"""Mean free paths after which the light of lamps is left out: e^-10 of it."""

LEVEL = 0.02
"""Radius of the largest half ball around a point of a sphere, in units of its radius."""

LOSSLESS = 1e-3
"""Largest share of the light that may be lost in a half ball; its square is left out."""


def jump(
    around: Any,
    sampler: mi.Sampler,
    anchor: Anchor,
    inner: Coefficients,
    kappa: mi.Spectrum,
    lights: mi.Bool,
    walk: Walk,
    active: mi.Bool,
) -> mi.Bool:
    """Take walks to the surface of the largest ball around them; return which of them.

    In the ball no light is looked for: lamps are `UNLIT` mean free paths away.

    Args:
        around: what walks have to reckon with.
        sampler: of random numbers.
        anchor: where the walks have set out.
        inner: the medium.
        kappa: `eigenvalue` of its reduced albedo.
        lights: whether lamps are looked for.
        walk: the walks.
        active: lanes.
    """
    reduced, a = inner.reduced, inner.reduced_albedo
    q = mixture(walk.β)
    way = dr.fma(inner.g[0] / reduced[0], walk.d, walk.x)
    r = anchor.depth(way)
    if around.clearances.known:
        p = anchor.p + way
        apart = around.clearances.at(p, active) - tolerance(p, anchor.extent)
        apart -= dr.select(lights, UNLIT / dr.min(inner.sigma_t), 0)
        r = dr.select(anchor.alone, r, apart)
    active &= r * dr.min(reduced) > LEAST
    tau, mean_a = r * dr.sum(q * reduced), dr.sum(q * a)
    u, d = sample_exit(tau, mean_a, sampler.next_2d(), sampler.next_2d())
    walk.x = dr.select(active, dr.fma(r, u, way), walk.x)
    walk.d = dr.select(active, d, walk.d)
    walk.β *= dr.select(active, survival(r * reduced, a, kappa), 1)
    return active


def leap(
    around: Any,
    sampler: mi.Sampler,
    anchor: Anchor,
    inner: Coefficients,
    lights: mi.Bool,
    walk: Walk,
    active: mi.Bool,
) -> None:
    """Take walks from where they leave a white sphere to a half ball around that point.

    With its radius tau in mean free paths, they come back to the sphere 3/8 tau times on the way
    and are scattered 1/2 tau^2 + 0.9 tau times. Of the height t of where they leave, from 0 on the
    sphere to 1, the density is 1 + (2 t - 1) / tau. Both are from walks in double precision
    (`tests/integrators/test_walkjumps.py`).

    Args:
        around: what walks have to reckon with.
        sampler: of random numbers.
        anchor: where the walks have set out.
        inner: the medium.
        lights: whether lamps are looked for.
        walk: the walks.
        active: lanes.
    """
    reduced = dr.max(inner.reduced)
    _, r = around.clearances.two(anchor.p, active)
    r -= tolerance(anchor.p, anchor.extent)
    r -= dr.select(lights, UNLIT / dr.min(inner.sigma_t), 0)
    r = dr.minimum(r, LEVEL / dr.abs(anchor.k))
    tau, a = r * reduced, inner.reduced_albedo
    lost = tau * (0.375 * anchor.absorbed + (1 - a) * (0.5 * tau + 0.9))
    active &= (dr.max(lost) < LOSSLESS) & (r * dr.min(inner.reduced) > 2 * LEAST)
    u, d = sample_exit(tau, dr.min(a), sampler.next_2d(), sampler.next_2d())
    # From even to the law of heights, over what of the ball is on this side of the surface.
    cos, horizon = dr.dot(u, anchor.n), 0.5 * anchor.k * r
    even, low = 0.5 * (1 - cos), 1 - dr.rcp(tau)
    t = 2 * even / (low + dr.sqrt(dr.fma(low, low, 4 * even / tau)))
    turned = dr.lerp(horizon, 1, t)
    side = dr.normalize(dr.fma(-cos, anchor.n, u))
    v = dr.fma(dr.safe_sqrt(1 - turned * turned), side, -turned * anchor.n)
    d = mi.Frame3f(v).to_world(mi.Frame3f(u).to_local(d))
    walk.x = dr.select(active, r * v, walk.x)
    walk.d = dr.select(active, d, walk.d)
    walk.β *= dr.select(active, 1 - lost, 1)
    walk.fresh &= ~active
