"""Where light has entered: probe rays on the surface that it leaves (King et al. 2013).

A. King, C. Kulla, A. Conty, M. Fajardo, "BSSRDF Importance Sampling", SIGGRAPH 2013 Talks: a point
is drawn on a disk around the point in question by the profile of diffusion, and a ray
perpendicular to the disk finds the surface there. The disk lies across one of three axes, the
profile is that of one channel, and multiple importance sampling combines all choices. Here the ray
visits every hit on the same object; one of them is kept, with a probability in proportion to what
it carries, for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.integrators.diffusion import Standard, sample_channel
from relume.integrators.translucentobjects import TranslucentObjects

AXES = (0.5, 0.25, 0.25)
"""Probabilities of the normal and the two tangents."""

MAX_HITS = 256
"""Surfaces that one probe ray visits at most."""

ROUNDING = 1e-6
"""Relative size of heights that are taken for the rounding of float32 positions."""

STEP = 8e-6
"""Relative length of the steps by which probes leave the hits behind them."""


@dataclass
class Entry:
    """A point where light enters.

    Attributes:
        ray, pi: ``mi.Ray3f`` and ``mi.PreliminaryIntersection3f`` that give the point.
        weight: ``mi.Spectrum``, the profile's `weight` over the density of the point.
    """

    ray: mi.Ray3f
    pi: mi.PreliminaryIntersection3f
    weight: mi.Spectrum


def choose_axis(n: mi.Normal3f, sample: mi.Float) -> tuple[mi.Frame3f, mi.Frame3f]:
    """Return the frame whose z is the drawn axis, among the normal `n` and two tangents."""
    frame = mi.Frame3f(n)
    first, second = sample < AXES[0], sample < AXES[0] + AXES[1]
    z = dr.select(first, frame.n, dr.select(second, frame.s, frame.t))
    x = dr.select(first, frame.s, dr.select(second, frame.t, frame.n))
    return frame, mi.Frame3f(x, dr.cross(z, x), z)


def density(
    profile: Standard, p_channel: mi.Spectrum, frame: mi.Frame3f, d: mi.Vector3f, n: mi.Normal3f
) -> mi.Float:
    """Return the density per area of the surface of a point at the offset `d` with normal `n`."""
    total = mi.Float(0)
    local_d, local_n = frame.to_local(d), frame.to_local(n)
    for p_axis, axis in zip(AXES, (2, 0, 1), strict=True):
        across = [local_d[i] for i in range(3) if i != axis]
        r = dr.sqrt(dr.fma(across[0], across[0], across[1] * across[1]))
        p = dr.sum(p_channel * profile.pdf(r))
        total = dr.fma(p_axis * dr.abs(local_n[axis]), p, total)
    return total


def is_same_primitive(
    one: mi.PreliminaryIntersection3f, other: mi.PreliminaryIntersection3f
) -> mi.Bool:
    """Whether two hits are on the same primitive of the same instance of a shape."""
    same = (one.shape == other.shape) & (one.instance == other.instance)
    return same & (one.prim_index == other.prim_index)


@dr.syntax
def find_entry(
    scene: mi.Scene,
    objects: TranslucentObjects,
    si: mi.SurfaceInteraction3f,
    profile: Standard,
    guide: Standard,
    throughput: mi.Spectrum,
    sample1: mi.Point2f,
    sample2: mi.Point2f,
    sample3: mi.Float,
    active: mi.Bool,
) -> Entry:
    """Draw a point where light that leaves at `si` has entered.

    Args:
        scene: the scene.
        objects: the scene's translucent ones.
        si: where light leaves.
        profile: of `relume.integrators.diffusion`, for the medium behind `si`.
        guide: the same without gradients, from which the point is drawn.
        throughput: ``mi.Spectrum`` of the path, which the choice of the channel follows.
        sample1: ``mi.Point2f``, uniform variates for channel and axis.
        sample2: ``mi.Point2f``, for the point on the disk.
        sample3: ``mi.Float``, for the choice among hits.
        active: lanes.

    Returns:
        `Entry`; its weight is 0 where no point was found.
    """
    channel, p_channel = sample_channel(throughput * guide.R_d, sample1.x)
    frame, disk = choose_axis(si.n, sample1.y)
    r = guide.sample_radius(channel, sample2.x)
    sin, cos = dr.sincos(dr.two_pi * sample2.y)
    offset = disk.to_world(mi.Vector3f(r * cos, r * sin, 0))

    # Heights below `rounding` cannot be told from 0; the ray has to be longer than that.
    rounding = ROUNDING * (1 + dr.max(dr.abs(si.p)))
    height = dr.sqrt(dr.maximum(guide.r_max * guide.r_max - r * r, 0)) + 16 * rounding
    first = dr.zeros(mi.Ray3f)
    first.o, first.d = dr.fma(height, disk.n, si.p + offset), -disk.n
    first.maxt, first.time, first.wavelengths = 2 * height, si.time, si.wavelengths

    step = STEP * (1 + dr.max(dr.abs(si.p)))
    own = objects.at(si, active)
    chosen = dr.zeros(mi.PreliminaryIntersection3f)
    value, chosen_weight, total = mi.Spectrum(0), mi.Float(1), mi.Float(0)
    chosen_p, chosen_distance = mi.Float(1), mi.Float(1)
    ray, t, u = mi.Ray3f(first), mi.Float(0), mi.Float(sample3)
    hits = mi.UInt32(0)
    last, last_side = dr.zeros(mi.PreliminaryIntersection3f), mi.Float(0)
    searching = mi.Bool(active)
    while dr.hint(searching, label="Probe"):
        pi = scene.ray_intersect_preliminary(ray, coherent=False, active=searching)
        searching &= pi.is_valid()
        hit = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal, searching)
        t += pi.t
        z = height - t
        z = dr.select(dr.abs(z) > rounding, z, 0)
        d = dr.fma(z, disk.n, offset)
        distance = dr.norm(d)
        # No line meets a triangle twice, nor one side of a sphere.
        side = dr.dot(hit.n, ray.d)
        again = is_same_primitive(pi, last) & (side * last_side > 0)
        last, last_side = mi.PreliminaryIntersection3f(pi), side
        same = searching & ~again & objects.at(hit, searching).is_same(own)
        same &= distance <= guide.r_max
        p = density(guide, p_channel, frame, d, hit.n)
        carried = guide.weight(distance) / dr.maximum(p, 1e-30)
        weight = dr.select(
            same & (p > 0), dr.mean(throughput * guide.value(distance)) / dr.maximum(p, 1e-30), 0
        )
        # Weighted reservoir; u stays uniform.
        total += weight
        share = weight / dr.maximum(total, 1e-30)
        take = (weight > 0) & (u < share)
        u = dr.select(take, u / dr.maximum(share, 1e-30), (u - share) / dr.maximum(1 - share, 1e-7))
        kept = mi.PreliminaryIntersection3f(pi)
        kept.t = mi.Float(t)
        chosen = dr.select(take, kept, chosen)
        value = dr.select(take, carried, value)
        chosen_p = dr.select(take, p, chosen_p)
        chosen_distance = dr.select(take, distance, chosen_distance)
        chosen_weight = dr.select(take, weight, chosen_weight)

        # Along the very line: `spawn_ray` steps aside, and grazing probes would miss their point.
        t += step
        ray.o, ray.maxt = first(t), 2 * height - t
        hits += 1
        searching &= (hits < MAX_HITS) & (ray.maxt > 0)

    found = total > 0
    scale = dr.select(found, total / chosen_weight, 0)
    attached = profile.weight(chosen_distance) / dr.maximum(chosen_p, 1e-30)
    value = dr.replace_grad(value, dr.select(found, attached, 0))
    return Entry(first, chosen, value * scale)
