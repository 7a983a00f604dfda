"""The light of lamps that is scattered on the flights of walks."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.boundaries import FAR
from relume.integrators.common import power_heuristic
from relume.integrators.flightlights import Flight
from relume.integrators.seethrough import SHADOW_EPSILON
from relume.integrators.walkmedia import Coefficients, mixture, phase_values
from relume.integrators.walks import Walk, light_through, tolerance

WORTH = 4.0
"""Light looked for on a flight, in units of what is scattered there; where that is less than one it
is by chance."""


def add_light(
    around: Any,
    scene: mi.Scene,
    sampler: mi.Sampler,
    path: Any,
    inner: Coefficients,
    flight: Flight,
    walk: Walk,
    lit: mi.Bool,
) -> None:
    """Add the light of a sampled point of a lamp that is scattered on a flight.

    Args:
        around: `walksurroundings.Surroundings`.
        scene: the scene.
        sampler: of random numbers.
        path: that walks: its anchor, medium and ray.
        inner: the medium.
        flight: from where the walk is, relative to the anchor.
        walk: the walk, before the flight.
        lit: lanes.
    """
    anchor, q, sigma_t = path.anchor, mixture(walk.β), inner.sigma_t
    sample = sampler.next_2d()
    lamp = around.lamps.chosen(scene, sample.x, lit)
    o = anchor.p + walk.x
    stretch = around.lamps.stretch(lamp, o, walk.d, flight.T, flight.sigma, lit)
    t, density = stretch.sample(q, sigma_t, sampler.next_1d(), sampler.next_1d())
    scattered = dr.max(walk.β * inner.albedo * (1 - dr.exp(-sigma_t * flight.T)))
    worth = dr.minimum(WORTH * scattered + dr.max(walk.β) * stretch.worth, 1)
    x = dr.fma(t, walk.d, walk.x)
    p = anchor.p + x
    if around.clearances.known:  # no light comes from nearer
        least = around.clearances.at(p, lit)
        worth *= dr.minimum(WORTH * dr.exp(-dr.min(sigma_t) * least), 1)
    lit &= sampler.next_1d() < worth
    lit &= density > 0
    here = dr.zeros(mi.Interaction3f)
    here.p, here.time, here.wavelengths = p, path.ray.time, path.ray.wavelengths
    ds, Le = scene.sample_emitter_direction(here, sample, False, lit)
    lit &= (ds.pdf != 0) & dr.any(Le != 0)
    off = tolerance(p, anchor.extent)
    ray = mi.Ray3f(dr.fma(-off, ds.d, p), ds.d, path.ray.time, path.ray.wavelengths)
    ray.maxt = (ds.dist + off) * (1 - SHADOW_EPSILON)
    own = dr.select(anchor.alone, anchor.distance(x, ds.d), FAR)
    ray.o = dr.select(anchor.alone, dr.fma(own - off, ds.d, p), ray.o)
    ray.maxt = dr.select(anchor.alone, ray.maxt - own, ray.maxt)
    left = light_through(scene, around, path.medium, ray, ds, off, own, lit)
    T = dr.exp(-sigma_t * t)
    β = walk.β * sigma_t * inner.albedo * T / (density * worth)
    f, pdf = phase_values(around.media, inner.g, mixture(β), walk.d, ds.d)
    # The same point by a flight that ends at t, and the phase function.
    pdf *= dr.sum(q * sigma_t * T)
    mis = dr.select(ds.delta, 1, power_heuristic(ds.pdf * density, pdf))
    walk.L = mi.Spectrum(walk.L + dr.select(lit, β * f * left * Le * mis, 0))
