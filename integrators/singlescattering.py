"""Single scattering in a translucent object: free flight, phase function, and the way out."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.bsdfs.subsurface import SubsurfaceMedium
from relume.integrators.diffusion import component, fresnel_transmission, sample_channel
from relume.phasefunctions.henyeygreenstein import henyey_greenstein, sample_henyey_greenstein
from relume.phasefunctions.hgrgb import toward

MAX_G = 0.999
"""Largest magnitude of g in the phase function: beyond, its peak exceeds what float32 resolves."""


def no_medium() -> SubsurfaceMedium:
    """The `SubsurfaceMedium` of lanes that have none."""
    zero = mi.Spectrum(0)
    one, none = mi.Float(1), mi.Float(0)
    return SubsurfaceMedium(zero, mi.Spectrum(0), mi.Spectrum(0), one, none, mi.Spectrum(0))


def clamped(g: mi.Spectrum) -> mi.Spectrum:
    """Return the mean cosine as the phase function takes it."""
    return dr.clip(g, -MAX_G, MAX_G)


def phase(medium: SubsurfaceMedium, before: mi.Vector3f, after: mi.Vector3f) -> mi.Spectrum:
    """Return Henyey and Greenstein's phase function per channel [1/sr].

    Args:
        medium: `SubsurfaceMedium`.
        before: direction of travel before.
        after: direction of travel after.
    """
    g = clamped(medium.g)
    # 1 - |cos|, free of cancellation.
    ahead, back = 0.5 * dr.squared_norm(after - before), 0.5 * dr.squared_norm(after + before)
    x = dr.select(g >= 0, mi.Spectrum(ahead), mi.Spectrum(back))
    return mi.Spectrum(henyey_greenstein(g, x))


def phase_mixture(
    medium: SubsurfaceMedium, throughput: mi.Spectrum, before: mi.Vector3f, after: mi.Vector3f
) -> mi.Float:
    """Return the density of `sample_phase` [1/sr], at its two directions."""
    _, p = sample_channel(throughput, mi.Float(0))
    return dr.sum(p * dr.detach(phase(medium, before, after)))


def sample_phase(
    medium: SubsurfaceMedium,
    throughput: mi.Spectrum,
    d: mi.Vector3f,
    sample1: mi.Float,
    sample2: mi.Point2f,
) -> mi.Vector3f:
    """Draw a direction of travel by the phase function of one channel.

    Args:
        medium: `SubsurfaceMedium`.
        throughput: ``mi.Spectrum``, the weights of the channels.
        d: direction of travel before.
        sample1: uniform variate for the channel.
        sample2: ``mi.Point2f``, uniform variates for the direction.
    """
    channel, _ = sample_channel(throughput, sample1)
    g = component(dr.detach(clamped(medium.g)), channel)
    x = sample_henyey_greenstein(g, sample2.x)
    sin_phi, cos_phi = dr.sincos(dr.two_pi * sample2.y)
    sin = dr.safe_sqrt(x * (2 - x))
    local = mi.Vector3f(sin * cos_phi, sin * sin_phi, 1 - x)
    return mi.Frame3f(toward(-d, g)).to_world(local)


def sample_distance(
    medium: SubsurfaceMedium, throughput: mi.Spectrum, distance: mi.Float, sample: mi.Point2f
) -> tuple[mi.Bool, mi.Float, mi.Spectrum]:
    """Draw where a path inside scatters, with the channels weighed by the throughput.

    Args:
        medium: `SubsurfaceMedium`.
        throughput: ``mi.Spectrum``.
        distance: to the other side of the object.
        sample: ``mi.Point2f``, uniform variates.

    Returns:
        (whether it scatters, distance to the point, weight).
    """
    sigma_t = medium.sigma_s + medium.sigma_a
    channel, p = sample_channel(throughput, sample.x)
    s = -dr.log(1 - sample.y) / dr.maximum(component(dr.detach(sigma_t), channel), 1e-30)
    scatters = s < distance
    s = dr.minimum(s, distance)
    T = dr.exp(-sigma_t * s)
    pdf = dr.sum(p * dr.detach(T) * dr.select(scatters, dr.detach(sigma_t), 1))
    weight = T * dr.select(scatters, medium.sigma_s, 1)
    return scatters, s, dr.select(pdf > 0, weight / dr.select(pdf > 0, pdf, 1), 0)


def leave_straight(
    medium: SubsurfaceMedium, si: mi.SurfaceInteraction3f, w: mi.Vector3f, before: mi.Vector3f
) -> mi.Spectrum:
    """Follow a path that has scattered inside straight out of the boundary.

    Args:
        medium: `SubsurfaceMedium`.
        si: on the boundary, `si.t` from the point of scattering.
        w: direction of travel.
        before: direction of travel before the scattering.

    Returns:
        ``mi.Spectrum``: phase function, attenuation and transmittance (see
        `relume.integrators.dipole`).
    """
    cos = dr.dot(w, si.sh_frame.n)
    F_t, cos_t = fresnel_transmission(dr.maximum(cos, 0), medium.eta)
    bent = dr.fma(si.sh_frame.n, cos_t - cos / medium.eta, w / medium.eta)
    ratio = cos / dr.maximum(cos_t, 1e-6)
    t = dr.select(dr.isfinite(si.t), si.t, 0)  # 0 times infinity is a NaN gradient
    T = dr.exp(-(medium.sigma_s + medium.sigma_a) * t * ratio)
    value = medium.tint * phase(medium, before, bent) * T * (F_t * ratio)
    return dr.select(cos > 0, value, 0)
