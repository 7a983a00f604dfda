r"""Translucent material behind a smooth boundary (``subsurface``)
==============================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``sigma_s``
     - spectrum or texture
     - Scattering coefficient, 0 or more [1/scene unit]. Default: 1. Differentiable.
   * - ``sigma_a``
     - spectrum or texture
     - Absorption coefficient, 0 or more [1/scene unit]. Default: 0. Differentiable.
   * - ``scale``
     - float
     - Factor of both coefficients, 0 or more. Default: 1. Exposed.
   * - ``g``
     - spectrum or texture
     - Mean cosine of the phase function (Henyey-Greenstein), in [-1, 1]. Default: 0.
       Differentiable.
   * - ``eta``
     - float
     - Refractive index inside over that outside, above 0. Default: 1.3. Exposed.
   * - ``r_max``
     - float
     - Radius of the search for points where light enters, 0 or more [scene unit]; with 0 it is as
       far as light goes. Default: 0. Exposed.
   * - ``level``
     - integer
     - -1: all orders of scattering; -2: multiple scattering alone. Default: -1.
   * - ``specular_reflectance``
     - spectrum or texture
     - Tint of what the boundary reflects. Default: 1. Differentiable.
   * - ``specular_transmittance``
     - spectrum or texture
     - Tint of what passes the boundary, once inwards and once outwards. Default: 1.
       Differentiable.
   * - ``object``
     - string
     - Name of the object: surfaces of one name share a medium, whether they touch or not. Default:
       empty, for surfaces that are one object as far as they are connected.

The surface of a homogeneous scattering medium, with Fresnel's formulas for unpolarized light at
the boundary. It is meant for the integrator ``dipole``, which finds where light that leaves here
has entered, and whose manual page has the model. Values given as textures are those of the point
where light leaves. The medium is on the side away from the normal. From behind, the boundary is
that of clear glass for light that was not scattered (level -1), or black (level -2).

For any other integrator the material is its limit of small distances, the BRDF

.. math::
    f(i, o) = \frac{R_d F_t(i) F_t(o)}{\pi}

beside the mirror of strength :math:`F = 1 - F_t`, with :math:`R_d` the total diffuse reflectance.
It is black from behind. Under ``prb`` its derivatives are too large, like those of the stock
``plastic``: there a mirrored ray counts as one of the diffuse part. Under ``path`` they are right.

**Source.** H. W. Jensen, S. Marschner, M. Levoy and P. Hanrahan, "A Practical Model for Subsurface
Light Transport", SIGGRAPH 2001, section 2.4.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'subsurface', 'eta': 1.5, 'scale': 10.0,
     'sigma_s': {'type': 'rgb', 'value': [2.19, 2.62, 3.0]},
     'sigma_a': {'type': 'rgb', 'value': [0.0021, 0.0041, 0.0071]}}

.. code-block:: xml

    <bsdf type="subsurface">
        <float name="eta" value="1.5"/>
        <float name="scale" value="10"/>
        <rgb name="sigma_s" value="0.73, 0.87, 1"/>
        <rgb name="sigma_a" value="0.0007, 0.0014, 0.0024"/>
    </bsdf>
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.parameters import ANY, NOT_NEGATIVE, POSITIVE, Range, check, expose, number, text, whole

SUBSURFACE = 1 << 25
"""Bit outside ``mi.BSDFFlags``. In `m_flags` it marks the material; in ``BSDFContext.type_mask`` it
says that the integrator can find the other end of a way through the medium; and then, in
``BSDFSample3f.sampled_type``, it marks samples that go on inside: with ``DiffuseReflection`` by
diffusion, with a delta lobe straight along ``wo``."""

LEVELS = (-1, -2)
RANGES = {
    "sigma_s": NOT_NEGATIVE,
    "sigma_a": NOT_NEGATIVE,
    "g": Range(-1.0, 1.0),
    "scale": NOT_NEGATIVE,
    "eta": POSITIVE,
    "r_max": NOT_NEGATIVE,
}
TEXTURES = ("sigma_s", "sigma_a", "g", "specular_reflectance", "specular_transmittance")

TINY = 1e-12
"""Least sum of coefficients [1/scene unit] that is told from zero."""

STRAIGHT = 0.25
"""About the share of light that a dense medium returns after one scattering, at most. Samples are
divided between the mirror, diffusion and the straight way inside by what each returns."""


@dataclass
class SubsurfaceMedium:
    """The medium behind a point: what `Subsurface.medium` returns.

    Attributes:
        sigma_s, sigma_a: ``mi.Spectrum``, coefficients [1/scene unit].
        g: ``mi.Spectrum``, mean cosine of the phase function.
        eta: ``mi.Float``, relative index.
        r_max: ``mi.Float``, search radius [scene unit], 0 for none.
        tint: ``mi.Spectrum``, factor of light that passes the boundary once.
    """

    sigma_s: mi.Spectrum
    sigma_a: mi.Spectrum
    g: mi.Spectrum
    eta: mi.Float
    r_max: mi.Float
    tint: mi.Spectrum


def reduced(medium: SubsurfaceMedium) -> tuple[mi.Spectrum, mi.Spectrum, mi.Spectrum]:
    """Return (sigma_s', sigma_t', alpha') of the similar medium that scatters isotropically."""
    sigma_s = medium.sigma_s * (1 - medium.g)
    sigma_t = dr.maximum(sigma_s + medium.sigma_a, TINY)
    return sigma_s, sigma_t, sigma_s / sigma_t


def internal_reflectance(eta: mi.Float) -> mi.Float:
    """Return F_dr, the mean Fresnel reflectance of diffuse light from inside.

    Egan and Hilgeman's fits as in Jensen et al. 2001, and for eta < 1 Donner and Jensen 2005.
    """
    inv = dr.rcp(eta)
    above = dr.fma(dr.fma(-1.440, inv, 0.710), inv, dr.fma(0.0636, eta, 0.668))
    below = dr.fma(dr.fma(dr.fma(0.0636, inv, -0.3319), inv, 0.7099), inv, -0.4399)
    return dr.clip(dr.select(eta >= 1, above, below), 0, 0.999)


def boundary_factor(eta: mi.Float) -> mi.Float:
    """Return A = (1 + F_dr) / (1 - F_dr)."""
    F_dr = internal_reflectance(eta)
    return (1 + F_dr) / (1 - F_dr)


def diffuse_reflectance(alpha: mi.Spectrum, A: mi.Float) -> mi.Spectrum:
    """Return R_d, the share of light entering that leaves again (Jensen et al. 2001, eq. 15).

    Args:
        alpha: reduced albedo in [0, 1].
        A: from `boundary_factor`.
    """
    k = dr.safe_sqrt(3 * dr.maximum(1 - alpha, 0))
    return 0.5 * alpha * (1 + dr.exp(-4 / 3 * A * k)) * dr.exp(-k)


def define() -> type[mi.BSDF]:
    """Return the plugin's class for the variant in use."""

    class Subsurface(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.sigma_s = props.get_unbounded_texture("sigma_s", 1.0)
            self.sigma_a = props.get_unbounded_texture("sigma_a", 0.0)
            self.g = props.get_unbounded_texture("g", 0.0)
            self.specular_reflectance = props.get_texture("specular_reflectance", 1.0)
            self.specular_transmittance = props.get_texture("specular_transmittance", 1.0)
            self.scale = mi.Float(number(props, "scale", 1.0))
            self.eta = mi.Float(number(props, "eta", 1.3))
            self.r_max = mi.Float(number(props, "r_max", 0.0))
            self.object = text(props, "object")
            self.level = whole(props, "level", LEVELS[0], ANY)
            if self.level not in LEVELS:
                raise ValueError(f"level is {self.level}, but must be -1 or -2")
            self.set_flags()
            self.parameters_changed([])

        def set_flags(self):
            front, back = mi.BSDFFlags.FrontSide, mi.BSDFFlags.BackSide
            varying = any(getattr(self, name).is_spatially_varying() for name in TEXTURES)
            extra = mi.BSDFFlags.SpatiallyVarying if varying else 0
            self.m_components = [
                mi.BSDFFlags.DeltaReflection | front | back | extra,
                mi.BSDFFlags.DiffuseReflection | front | extra | SUBSURFACE,
                mi.BSDFFlags.DeltaTransmission | front | back | mi.BSDFFlags.NonSymmetric | extra,
            ]
            self.m_flags = self.m_components[0] | self.m_components[1] | self.m_components[2]

        def traverse(self, cb):
            for name in TEXTURES:
                cb.put(name, getattr(self, name), mi.ParamFlags.Differentiable)
            expose(self, cb, ("scale", "eta", "r_max"))

        def parameters_changed(self, keys):
            check(self, RANGES, keys)
            dr.make_opaque(self.scale, self.eta, self.r_max)

        def medium(self, si, active=True):
            """Return the `SubsurfaceMedium` behind the point `si`."""
            return SubsurfaceMedium(
                sigma_s=self.scale * dr.maximum(self.sigma_s.eval(si, active), 0),
                sigma_a=self.scale * dr.maximum(self.sigma_a.eval(si, active), 0),
                g=dr.clip(self.g.eval(si, active), -1, 1),
                eta=mi.Float(self.eta),
                r_max=mi.Float(self.r_max),
                tint=self.specular_transmittance.eval(si, active),
            )

        def albedo(self, si, active):
            """Return R_d, with the tints of both passages."""
            medium = self.medium(si, active)
            R_d = diffuse_reflectance(reduced(medium)[2], boundary_factor(self.eta))
            return R_d * medium.tint * medium.tint

        def shares(self, si, F, active):
            """Return how samples are divided, for integrators that know the protocol.

            Returns:
                (share of the mirror in all of them, by what comes back; share of diffusion in
                those below the boundary).
            """
            alpha = reduced(self.medium(si, active))[2]
            R_d = dr.mean(diffuse_reflectance(alpha, boundary_factor(self.eta)))
            straight = STRAIGHT if self.level == -1 else 0
            below = (1 - F) * dr.minimum(R_d + straight, 1)
            mirror = F * dr.mean(self.specular_reflectance.eval(si, active))
            total = mirror + below
            mirror = dr.select(total > 0, mirror / dr.select(total > 0, total, 1), F)
            diffusion = R_d / (R_d + straight) if straight else mi.Float(1)
            return dr.select(si.wi.z > 0, mirror, F), diffusion

        # ------------------------------ interface of mi.BSDF ------------------------------

        def sample(self, ctx, si, sample1, sample2, active=True):
            subsurface = bool(ctx.type_mask & SUBSURFACE)
            F, cos_t, eta_it, eta_ti = mi.fresnel(si.wi.z, self.eta)
            front = si.wi.z > 0
            p, share = self.shares(si, F, active) if subsurface else (F, mi.Float(1))
            p, share = dr.detach(p), dr.detach(share)
            # Again uniform, where not mirrored; rounded to 1 it would take a way of probability 0.
            u = (sample1 - p) / dr.maximum(1 - p, 1e-6)
            u = dr.minimum(u, dr.one_minus_epsilon(mi.Float))
            mirrored = sample1 < p
            diffused = ~mirrored & front & (u < share)
            refracted = ~mirrored & ~diffused

            bs = dr.zeros(mi.BSDFSample3f)
            lambert = mi.warp.square_to_cosine_hemisphere(sample2)
            bs.wo = dr.select(
                diffused,
                lambert,
                dr.select(mirrored, mi.reflect(si.wi), mi.refract(si.wi, cos_t, eta_ti)),
            )
            bs.pdf = dr.select(mirrored, p, 1 - p) * dr.select(
                diffused, share, dr.select(front & refracted, 1 - share, 1)
            )
            bs.eta = dr.select(refracted, eta_it, 1)
            bs.sampled_component = dr.select(
                mirrored, mi.UInt32(0), dr.select(diffused, mi.UInt32(1), mi.UInt32(2))
            )
            bs.sampled_type = dr.select(
                mirrored,
                mi.UInt32(+mi.BSDFFlags.DeltaReflection),
                dr.select(
                    diffused,
                    mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
                    mi.UInt32(+mi.BSDFFlags.DeltaTransmission),
                ),
            )
            tint = self.specular_transmittance.eval(si, active & ~mirrored)
            if subsurface:
                # Radiance is smaller by eta^2 outside than inside.
                through = tint * dr.square(eta_ti) / dr.select(front, 1 - share, 1)
                weight = dr.select(diffused, tint / share, through)
                bs.sampled_type |= dr.select(
                    diffused | (front ^ mirrored), mi.UInt32(SUBSURFACE), 0
                )
                active = active & (front | (self.level == -1))
            else:
                F_i = mi.fresnel(lambert.z, self.eta)[0]
                bs.pdf[diffused] *= mi.warp.square_to_cosine_hemisphere_pdf(lambert)
                weight = self.albedo(si, active & diffused) * (1 - F_i)
                active = active & front
            tint = self.specular_reflectance.eval(si, active & mirrored & front)
            weight = dr.select(mirrored, dr.select(front, tint, 1), weight)
            weight *= dr.select(mirrored, F, 1 - F) / dr.select(mirrored, p, 1 - p)
            return bs, weight & active

        def eval_pdf(self, ctx, si, wo, active=True):
            if ctx.type_mask & SUBSURFACE:
                return mi.Spectrum(0), mi.Float(0)
            active = active & (si.wi.z > 0) & (wo.z > 0)
            F_o, F_i = mi.fresnel(si.wi.z, self.eta)[0], mi.fresnel(wo.z, self.eta)[0]
            pdf = (1 - F_o) * dr.inv_pi * wo.z
            value = self.albedo(si, active) * (1 - F_i) * pdf
            return value & active, dr.select(active, pdf, 0)

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
            value, pdf = self.eval_pdf(ctx, si, wo, active)
            return value, pdf, *self.sample(ctx, si, sample1, sample2, active)

        def eval_diffuse_reflectance(self, si, active=True):
            return self.albedo(si, active)

        def to_string(self):
            textures = ", ".join(f"{name}={getattr(self, name)}" for name in TEXTURES)
            return (
                f"Subsurface[scale={self.scale}, eta={self.eta}, r_max={self.r_max}, "
                f"level={self.level}, object={self.object!r}, {textures}]"
            )

    return Subsurface
