"""What the plugins share, above all the BRDF Lambert plus one glossy lobe (`ward`, `phong`)."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.parameters import check

GRAZING = 1e-9
"""Smallest cosine between a direction and the normal that still counts as above the surface."""


def polar(r: mi.Float, phi: mi.Float) -> tuple[mi.Float, mi.Float]:
    """Return the point (r cos phi, r sin phi) as a pair; `phi` in radians."""
    sin_phi, cos_phi = dr.sincos(phi)
    return r * cos_phi, r * sin_phi


def share(part: mi.Spectrum, other: mi.Spectrum) -> mi.Float:
    """Return the share of `part` in the sum of two, over all channels, without gradients."""
    a, b = (dr.sum(dr.abs(dr.detach(value))) for value in (part, other))
    return dr.select(a + b > 0, a / dr.select(a + b > 0, a + b, 1), 0.5)


def diffuse_plus_lobe() -> type[mi.BSDF]:
    """Return the base class of BRDFs f = rho_d/pi + rho_s f_lobe, for the variant in use.

    A plugin derives from the class and supplies the lobe for rho_s = 1 by three methods:

    - ``shape(si, active)``: the lobe's parameters at `si`, handed on to the other two;
    - ``lobe(shape, wi, wo)``: (f_lobe cos theta_o, density of ``sample_lobe`` at `wo` in 1/sr),
      where both cosines are at least `GRAZING`;
    - ``sample_lobe(shape, wi, sample)``: a direction drawn from that density. What falls below
      the surface is lost: the density integrates to the part that does not.

    Component 0 is the glossy lobe, component 1 the diffuse one. A lobe is chosen in proportion to
    the sum of its reflectance over the channels at the point in question, so that textures
    without a known mean (vertex colours) serve as well. Both depolarize. ``ranges`` has the ranges
    of the lobe's parameters.
    """

    class DiffusePlusLobe(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.diffuse_reflectance = props.get_texture("diffuse_reflectance", 0.5)
            self.specular_reflectance = props.get_texture("specular_reflectance", 0.2)

        def set_lobes(self, textures, extra=0):
            """Set the lobe flags; `textures` drive the lobe's shape, `extra` flags mark it."""
            side = mi.BSDFFlags.FrontSide
            glossy, diffuse = (
                kind | side | (mi.BSDFFlags.SpatiallyVarying if varying else 0)
                for kind, varying in (
                    (
                        mi.BSDFFlags.GlossyReflection | extra,
                        any(
                            t.is_spatially_varying() for t in (self.specular_reflectance, *textures)
                        ),
                    ),
                    (
                        mi.BSDFFlags.DiffuseReflection,
                        self.diffuse_reflectance.is_spatially_varying(),
                    ),
                )
            )
            self.m_components = [glossy, diffuse]
            self.m_flags = glossy | diffuse

        def traverse(self, cb):
            for name in ("diffuse_reflectance", "specular_reflectance", *self.ranges):
                cb.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys):
            check(self, self.ranges, keys)

        # ------------------------------ shared by all queries ------------------------------

        def surface(self, ctx, si, active):
            """Return (rho_d, rho_s, probability of the lobe, shape), masked by `ctx`."""
            rho_d, rho_s = mi.UnpolarizedSpectrum(0), mi.UnpolarizedSpectrum(0)
            if ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 1):
                rho_d = self.diffuse_reflectance.eval(si, active)
            if ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                rho_s = self.specular_reflectance.eval(si, active)
            return rho_d, rho_s, share(rho_s, rho_d), self.shape(si, active)

        def value_and_pdf(self, surface, wi, wo, active):
            """Return (f cos theta_o, pdf of ``draw``) and the mask of what lies above."""
            rho_d, rho_s, p_lobe, shape = surface
            active = active & (wi.z >= GRAZING) & (wo.z >= GRAZING)  # the caller keeps its own
            # Lanes below the surface get harmless directions: 0 times their NaN is a NaN gradient.
            up = mi.Vector3f(0, 0, 1)
            wi, wo = dr.select(active, wi, up), dr.select(active, wo, up)
            lobe, pdf_lobe = self.lobe(shape, wi, wo)
            lambert = wo.z * dr.inv_pi
            value = dr.fma(rho_s, lobe, rho_d * lambert)
            pdf = dr.lerp(lambert, pdf_lobe, p_lobe)
            return mi.depolarizer(value) & active, dr.select(active, pdf, 0)

        def draw(self, surface, si, sample1, sample2, active):
            """Sample a lobe by `sample1`, a direction by `sample2`; see ``mi.BSDF.sample``."""
            _, _, p_lobe, shape = surface
            glossy = sample1 < p_lobe
            # Manual, "reflection diffuse": phi = 2 pi xi_1, theta = acos sqrt(1 - xi_2).
            x, y = polar(dr.sqrt(sample2.y), dr.two_pi * sample2.x)
            lambert = mi.Vector3f(x, y, dr.sqrt(1 - sample2.y))
            bs = mi.BSDFSample3f(
                dr.select(glossy, self.sample_lobe(shape, si.wi, sample2), lambert)
            )
            value, bs.pdf = self.value_and_pdf(surface, si.wi, bs.wo, active)
            bs.eta = 1.0
            bs.sampled_type = dr.select(
                glossy,
                mi.UInt32(+mi.BSDFFlags.GlossyReflection),
                mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
            )
            bs.sampled_component = dr.select(glossy, mi.UInt32(0), mi.UInt32(1))
            drawn = bs.pdf > 0
            return bs, (value / dr.select(drawn, bs.pdf, 1)) & drawn

        # ------------------------------ interface of mi.BSDF ------------------------------

        def sample(self, ctx, si, sample1, sample2, active=True):
            return self.draw(self.surface(ctx, si, active), si, sample1, sample2, active)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.value_and_pdf(self.surface(ctx, si, active), si.wi, wo, active)

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
            surface = self.surface(ctx, si, active)
            value, pdf = self.value_and_pdf(surface, si.wi, wo, active)
            bs, weight = self.draw(surface, si, sample1, sample2, active)
            return value, pdf, bs, weight

        def eval_diffuse_reflectance(self, si, active=True):
            return self.diffuse_reflectance.eval(si, active)

    return DiffusePlusLobe
