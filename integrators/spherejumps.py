r"""From the middle of a ball inside a medium to its surface, in one step.

Deep in a medium a walk is scattered over and over at places that do not matter. If it scatters
evenly to all sides, in the middle of a ball that lies in the medium as a whole, then by symmetry it
leaves the ball anywhere with the same probability. Its weight W and the mean cosine m of its
direction to the normal there are functions of the ball's radius :math:`\tau` in mean free paths and
of the albedo a. With the eigenvalue :math:`\kappa = \tanh(\kappa / a)` of the transport equation
and the extrapolation length z_0 = 0.7104, from walks in double precision,

    W = (1 - 2.5 (1 - a)^2) x / sinh x,   x = kappa (tau + z_0),
    m = 0.7104 + 0.145 / tau + 0.55 / tau^2 + 0.23 (1 - a),

the cosines mu distributed as mu^gamma with the mean m (`tests/integrators/test_spherejumps.py` has
the measured differences). W is 1 where nothing is absorbed, whatever the radius.

Similarity: a medium of mean cosine g is taken for one that scatters evenly, of the extinction
sigma_t' = sigma_t (1 - a g), about the point to which g takes a walk on average, g / sigma_t'
farther on. All of this holds for balls of `LEAST` of these mean free paths or more, and only there
it is used: what is nearer to the boundary is followed scattering by scattering.

Source: J. T. Moon, B. Walter and S. R. Marschner, "Rendering Discrete Random Media Using
Precomputed Scattering Solutions", EGSR 2007 (shell transport functions); K. M. Case, F. de Hoffmann
and G. Placzek, "Introduction to the Theory of Neutron Diffusion", 1953 (kappa, z_0)."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

LEAST = 8.0
"""Radius of the smallest ball that is crossed in one step [reduced mean free path]."""

EXTRAPOLATED = 0.7104
"""Hopf's number: the extrapolation length of Milne's problem, and the mean cosine that leaves."""


def eigenvalue(a: Any) -> Any:
    """kappa for albedos a in [0, 1], by Newton's method from kappa^2 = 3 (1 - a) (1 - 0.4 (1 - a)).

    Where a is below 1/2 the start serves: what crosses a ball there is nothing.
    """
    c = 1 - a
    kappa = dr.sqrt(dr.maximum(3 * c * (1 - 0.4 * c), 0))
    for _ in range(3):
        # F = (kappa - tanh(kappa / a)) / kappa, free of its root at 0.
        inside = (kappa > 0.02) & (a > 0.5)
        k = dr.select(inside, kappa, 0.5)
        t = dr.tanh(k / dr.maximum(a, 0.5))
        step = (k - t) / (1 - (1 - t * t) / dr.maximum(a, 0.5))
        kappa = dr.select(inside, k - step, kappa)
    return kappa


def survival(tau: Any, a: Any, kappa: Any) -> Any:
    """W, the weight of walks from the middle of balls of the radius tau to their surface."""
    x = kappa * (tau + EXTRAPOLATED)
    e = dr.exp(-x)
    quotient = dr.select(x > 1e-3, 2 * x * e / dr.maximum(1 - e * e, 1e-12), 1 - x * x / 6)
    return quotient * dr.maximum(1 - 2.5 * dr.square(1 - a), 0)


def sample_exit(tau: mi.Float, a: mi.Float, sample1: Any, sample2: Any) -> tuple[Any, Any]:
    """Draw where walks leave balls about 0 of the radius 1, and their direction of travel there.

    Args:
        tau: radius [mean free path].
        a: albedo.
        sample1: ``mi.Point2f``, uniform variates for the point.
        sample2: ``mi.Point2f``, uniform variates for the direction.
    """
    u = mi.warp.square_to_uniform_sphere(sample1)
    m = EXTRAPOLATED + (0.145 + 0.55 / tau) / tau + 0.23 * (1 - a)
    gamma = (2 * m - 1) / (1 - m)
    mu = dr.power(sample2.x, 1 / (gamma + 1))
    sin_phi, cos_phi = dr.sincos(dr.two_pi * sample2.y)
    sin = dr.safe_sqrt(1 - mu * mu)
    return u, mi.Frame3f(u).to_world(mi.Vector3f(sin * cos_phi, sin * sin_phi, mu))
