r"""Profiles of diffusion: how much light that enters at one point leaves at another.

A profile is made for the media behind the points where light leaves. `value(d)` is the exitance at
the distance d [1/area] for a unit of power that has passed the boundary; `sample_radius` draws
distances in a plane with the density `pdf`. All are closed forms or exact inverses, not tables.

**standard**: Jensen et al., "A Practical Model for Subsurface Light Transport", SIGGRAPH 2001,
eq. 4. With :math:`d_j^2 = r^2 + z_j^2`, :math:`z_r = 1/\sigma_t'` and
:math:`z_v = z_r (1 + 4A/3)`,

.. math::
    R(r) = \frac{\alpha'}{4 \pi} \sum_j z_j (1 + \sigma_{tr} d_j)
    \frac{e^{-\sigma_{tr} d_j}}{d_j^3}

Of the light of one source, the share :math:`e^{-\sigma_{tr} (d - z)} z/d` leaves farther than r, so
a radius is drawn by solving :math:`x + \sigma_{tr} z (e^x - 1) = -\ln(share)` for
:math:`x = \ln(d/z)`.

**directional**: Frisvad, Hachisuka, Kjeldsen, "Directional Dipole Model for Subsurface Scattering",
ACM TOG 34(1), 2014: depends on the direction in which light enters. Distances are drawn by the
standard profile and a source nearer to the surface.

**normalized**: Christensen and Burley, "Approximate Reflectance Profiles for Efficient Subsurface
Scattering", 2015, for perpendicular illumination: with :math:`l = 1/\sigma_t'`, the albedo a and
:math:`s = 1.85 - a + 7 |a - 0.8|^3`,

.. math::
    R(r) = \frac{a s (e^{-s r/l} + e^{-s r/(3l)})}{8 \pi l r}

a is the closed form :math:`R_d` of the standard profile, so that both have the same albedo, and the
distribution :math:`F_t` of leaving light is normalized, as in the directional one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.bsdfs.subsurface import (
    TINY,
    SubsurfaceMedium,
    boundary_factor,
    diffuse_reflectance,
    reduced,
)

TRUNCATED_SHARE, NEGLIGIBLE_SHARE = 1e-3, 1e-6
"""Share of the light, at most, that a search without a radius of its own leaves out: of pictures,
and of their derivatives, to which the radius adds nothing, though it depends on the medium."""


def tail(z: mi.Spectrum, sigma_tr: mi.Spectrum, r: mi.Float) -> mi.Spectrum:
    """Return the share of a source's light that leaves farther than r; z its depth."""
    d = dr.sqrt(dr.fma(r, r, z * z))
    return z / d * dr.exp(-sigma_tr * r * (r / (d + z)))


def radius_of_tail(z: mi.Float, sigma_tr: mi.Float, share: mi.Float) -> mi.Float:
    """Return the r for which ``tail(z, sigma_tr, r)`` is `share`, in (0, 1]."""
    k, c = sigma_tr * z, -dr.log(share)
    # Convex and rising: from above the root, Newton's steps fall monotonically.
    x = dr.minimum(c, dr.log(1 + c / dr.maximum(k, 1e-20)))
    for _ in range(5):
        growth = dr.exp(x)
        x -= (x + k * (growth - 1) - c) / (1 + k * growth)
    x = dr.maximum(x, 0)
    # d^2 - z^2 = z^2 (e^x - 1)(e^x + 1), where e^x - 1 must not cancel for small x.
    below = dr.select(x < 1e-2, x * dr.fma(x, dr.fma(x, 1 / 6, 0.5), 1), dr.exp(x) - 1)
    return z * dr.sqrt(below * (below + 2))


def component(spectrum: mi.Spectrum, channel: mi.UInt32) -> mi.Float:
    """Return the entry of a spectrum that the index array `channel` names."""
    result = mi.Float(spectrum[0])
    for i in range(1, len(spectrum)):
        result = dr.select(channel == i, spectrum[i], result)
    return result


def sample_channel(weights: mi.Spectrum, sample: mi.Float) -> tuple[mi.UInt32, mi.Spectrum]:
    """Draw a channel in proportion to `weights`, a spectrum.

    Returns:
        (index, probability of each channel); all are equally likely where the weights are 0. A
        channel of probability 0 is never drawn, however the sums are rounded.
    """
    weights = dr.detach(weights)
    total = dr.sum(weights)
    p = dr.select(total > 0, weights / dr.select(total > 0, total, 1), 1 / len(weights))
    channel, bound = mi.UInt32(0), mi.Float(0)
    for i in range(len(weights) - 1):
        bound += p[i]
        channel[(sample >= bound) & (p[i + 1] > 0)] = i + 1
    return channel, p


def fresnel_moment_1(eta: mi.Float) -> mi.Float:
    """Return 2 C_1, the first moment of Fresnel's F (d'Eon and Irving 2011, appendix)."""
    below = (0.919317, -3.4793, 6.75335, -7.80989, 4.98554, -1.36881)
    above = (-9.23372, 22.2272, -20.9292, 10.2291, -2.54396, 0.254913)
    return dr.select(eta < 1, polynomial(eta, below), polynomial(eta, above))


def fresnel_moment_2(eta: mi.Float) -> mi.Float:
    """Return 3 C_2, the second moment of Fresnel's F (d'Eon and Irving 2011, appendix)."""
    below = (0.828421, -2.62051, 3.36231, -1.95284, 0.236494, 0.145787)
    above = (-1641.1, 1213.67, -568.556, 164.798, -27.0181, 1.91826)
    falling = polynomial(dr.rcp(eta), (0, 1376.53, -656.175, 135.926))
    return dr.select(eta < 1, polynomial(eta, below), polynomial(eta, above) + falling)


def polynomial(x: mi.Float, coefficients: Sequence[float]) -> mi.Float:
    """Return the sum of ``coefficients[i] x^i``."""
    result = 0
    for c in reversed(coefficients):
        result = result * x + c
    return result


def fresnel_transmission(cos: mi.Float, eta: mi.Float) -> tuple[mi.Float, mi.Float]:
    """Return (Fresnel's F_t from outside, cosine inside)."""
    F, cos_t, _, _ = mi.fresnel(cos, eta)
    return 1 - F, dr.abs(cos_t)


@dataclass
class ExitPoint:
    """Where light leaves the medium: position and normal."""

    p: mi.Point3f
    n: mi.Normal3f


class Standard:
    """The dipole of Jensen et al. 2001.

    Args:
        medium: `relume.bsdfs.subsurface.SubsurfaceMedium`.
        extent: largest distance in the scene [scene unit].
        left_out: share of the light beyond the search radius, at most.
    """

    includes_single_scattering = False
    """Whether the profile has the light that is scattered only once."""

    def __init__(
        self, medium: SubsurfaceMedium, extent: mi.Float, left_out: float = TRUNCATED_SHARE
    ) -> None:
        _, sigma_t, self.alpha = reduced(medium)
        A = boundary_factor(medium.eta)
        self.R_d = diffuse_reflectance(self.alpha, A)
        self.sigma_tr = dr.safe_sqrt(3 * medium.sigma_a * sigma_t)
        self.eta = medium.eta
        self.z_r = dr.rcp(sigma_t)
        self.z_v = self.z_r * (1 + 4 / 3 * A)
        # Both bounds of the tail: that of the distance and that of absorption.
        reach = dr.minimum(
            self.z_v / left_out, self.z_v - dr.log(left_out) / self.sigma_tr
        )
        reach = dr.max(dr.select(self.alpha > 0, reach, 0))
        self.r_max = dr.minimum(dr.select(medium.r_max > 0, medium.r_max, reach), extent)
        self.prepare()

    def prepare(self) -> None:
        far = dr.exp(-self.sigma_tr * (self.z_v - self.z_r))
        self.sources = [(self.z_r, 1 / (1 + far)), (self.z_v, far / (1 + far))]

    def spread(self, z: mi.Spectrum, r: mi.Float) -> mi.Spectrum:
        """Return the density [1/area] of the light of one source, of the depth z, that leaves."""
        d = dr.sqrt(dr.fma(r, r, z * z))
        absorbed = dr.exp(-self.sigma_tr * r * (r / (d + z)))
        return 0.5 * dr.inv_pi * z * dr.fma(self.sigma_tr, d, 1) * absorbed / (d * d * d)

    def value(self, d: mi.Float) -> mi.Spectrum:
        """Return R(d) per channel [1/area]."""
        strengths = ((z, dr.exp(-self.sigma_tr * z)) for z in (self.z_r, self.z_v))
        both = sum(strength * self.spread(z, d) for z, strength in strengths)
        return mi.Spectrum(dr.select(self.alpha > 0, 0.5 * self.alpha * both, 0))

    def weight(self, d: mi.Float) -> mi.Spectrum:
        """Return what a pair of points carries before the direction of incidence is known."""
        return self.value(d)

    def pdf(self, r: mi.Float) -> mi.Spectrum:
        """Return the density of `sample_radius`, per channel and area of the plane."""
        p = mi.Spectrum(0)
        for z, share in self.sources:
            within = dr.maximum(1 - tail(z, self.sigma_tr, self.r_max), 1e-6)
            p += share * self.spread(z, r) / within
        return dr.select(r <= self.r_max, p, 0)

    def sample_radius(self, channel: mi.UInt32, sample: mi.Float) -> mi.Float:
        """Draw a distance up to `r_max` by the profile of a channel."""
        sigma_tr = component(self.sigma_tr, channel)
        z, u, left = mi.Float(1), mi.Float(0), mi.Float(sample)
        waiting = mi.Bool(True)
        for depth, share in self.sources:
            p = component(share, channel)
            here = waiting & ((left < p) | (share is self.sources[-1][1]))
            z[here] = component(depth, channel)
            u[here] = left / dr.maximum(p, 1e-20)
            left -= p
            waiting &= ~here
        within = 1 - tail(z, sigma_tr, self.r_max)
        r = radius_of_tail(z, sigma_tr, dr.maximum(1 - dr.clip(u, 0, 1) * within, 1e-7))
        return dr.minimum(r, self.r_max)

    @staticmethod
    def entering(
        medium: SubsurfaceMedium, leaves: ExitPoint, si: mi.SurfaceInteraction3f, wi: mi.Vector3f
    ) -> mi.Spectrum:
        """Return the rest of the kernel, without the cosine.

        Args:
            medium: `relume.bsdfs.subsurface.SubsurfaceMedium`.
            leaves: `ExitPoint`, where the light leaves.
            si: where it enters.
            wi: local direction to the light, above the surface.
        """
        return medium.tint * (fresnel_transmission(wi.z, medium.eta)[0] * dr.inv_pi)


class Normalized(Standard):
    """The fit of Christensen and Burley 2015."""

    includes_single_scattering = True

    def prepare(self) -> None:
        s = 1.85 - self.R_d + 7 * dr.power(dr.abs(self.R_d - 0.8), 3)
        self.d = self.z_r / s
        self.within = 1 - 0.25 * dr.exp(-self.r_max / self.d)
        self.within -= 0.75 * dr.exp(-self.r_max / (3 * self.d))
        self.exit = dr.rcp(1 - fresnel_moment_1(dr.rcp(self.eta)))

    def density(self, r: mi.Float) -> mi.Spectrum:
        """Return R(r) / a."""
        x = dr.maximum(r / self.d, 1e-6)
        return (dr.exp(-x) + dr.exp(-x / 3)) / (8 * dr.pi * x * dr.square(self.d))

    def value(self, d: mi.Float) -> mi.Spectrum:
        return mi.Spectrum(dr.select(self.alpha > 0, self.exit * self.R_d * self.density(d), 0))

    def pdf(self, r: mi.Float) -> mi.Spectrum:
        return dr.select(r <= self.r_max, self.density(r) / dr.maximum(self.within, 1e-6), 0)

    def sample_radius(self, channel: mi.UInt32, sample: mi.Float) -> mi.Float:
        wide = sample >= 0.25
        u = dr.select(wide, (sample - 0.25) / 0.75, 4 * sample)
        scale = component(self.d, channel) * dr.select(wide, mi.Float(3), 1)
        return -scale * dr.log(1 - u * (1 - dr.exp(-self.r_max / scale)))


class Directional(Standard):
    """The directional dipole of Frisvad et al. 2014; `value` is the standard one's."""

    includes_single_scattering = True

    def prepare(self) -> None:
        super().prepare()
        # The ray source comes as near to the surface as D/3: half of the samples look there.
        near = self.z_r / 9
        halved = [(z, 0.5 * share) for z, share in self.sources]
        self.sources = [*halved, (near, mi.Spectrum(0.5))]

    def weight(self, d: mi.Float) -> mi.Spectrum:
        return mi.Spectrum(1)

    @staticmethod
    def entering(
        medium: SubsurfaceMedium, leaves: ExitPoint, si: mi.SurfaceInteraction3f, wi: mi.Vector3f
    ) -> mi.Spectrum:
        _, sigma_t, alpha = reduced(medium)
        eta, n_i, n_o = medium.eta, si.sh_frame.n, leaves.n
        F_t, cos_t = fresnel_transmission(wi.z, eta)
        w12 = dr.fma(n_i, wi.z / eta - cos_t, -si.to_world(wi) / eta)
        x = leaves.p - si.p
        r2 = dr.squared_norm(x)

        D = dr.rcp(3 * sigma_t)
        sigma_tr = dr.safe_sqrt(medium.sigma_a / D)
        d_e = 2.131 * D / dr.sqrt(dr.maximum(alpha, TINY))
        C_phi = 0.25 * (1 - fresnel_moment_1(eta))
        C_E = 0.5 * (1 - fresnel_moment_2(eta))
        A = (1 - C_E) / (2 * C_phi)

        def ray_source(x_dot_w, w_dot_n, x_dot_n, r2):
            r = dr.sqrt(r2)
            k = sigma_tr * r
            fluence = r2 / D + 3 * (1 + k) * x_dot_w
            slope = (1 + k) + 3 * D * (3 * (1 + k) + k * k) / r2 * x_dot_w
            flux = 3 * D * (1 + k) * w_dot_n - slope * x_dot_n
            return dr.exp(-k) / (r2 * r) * (C_phi * fluence - C_E * flux)

        # The real source, its distance corrected for light from the front and at edges (eq. 21).
        x_w, w_n = dr.dot(x, w12), dr.dot(w12, n_o)
        mu_0 = -w_n
        cos_beta = -dr.sqrt(dr.maximum(r2 - x_w * x_w, 0) / (r2 + d_e * d_e))
        lit = D * mu_0 * (D * mu_0 - 2 * d_e * cos_beta)
        edge = dr.rcp(dr.square(3 * (medium.sigma_s + medium.sigma_a)))
        d_r2 = r2 + dr.select(mu_0 > 0, lit, edge)
        real = ray_source(x_w, w_n, dr.dot(x, n_o), dr.maximum(d_r2, TINY * D * D))

        # The virtual source, mirrored in the plane whose normal is n*.
        side = dr.cross(n_i, x)
        length = dr.norm(side)
        n_star = dr.cross(x, side) / (dr.maximum(length, 1e-30) * dr.maximum(dr.sqrt(r2), 1e-30))
        n_star = dr.select(length > 1e-6 * dr.sqrt(r2), n_star, n_i)
        away = dr.dot(n_star, n_o)
        offset = 2 * A * d_e
        x_star = dr.dot(x, n_star)
        w_star = dr.dot(w12, n_star)
        virtual = ray_source(
            x_w - 2 * w_star * x_star + offset * w_star,
            w_n - 2 * w_star * away,
            dr.dot(x, n_o) - offset * away,
            dr.maximum(r2 - 2 * offset * x_star + offset * offset, TINY * D * D),
        )
        normalization = 4 * dr.square(dr.pi) * (1 - fresnel_moment_1(dr.rcp(eta)))
        S = dr.maximum(real - virtual, 0) * (F_t / normalization)
        return mi.Spectrum(dr.select((alpha > 0) & (F_t > 0), medium.tint * S, 0))


PROFILES = {"standard": Standard, "directional": Directional, "normalized": Normalized}
