r"""Smooth glass with Schlick's Fresnel term and dispersion (``schlickglass``)
==========================================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``int_ior``
     - float or string
     - Refractive index inside, behind the normal, above 0, or the name of a material, as in the
       stock ``dielectric``; may be below ``ext_ior``. Default: 1.5. Exposed.
   * - ``ext_ior``
     - float or string
     - Refractive index outside, likewise. Default: 1. Exposed.
   * - ``specular_reflectance``
     - spectrum or texture
     - Tint of what is reflected. Default: 1. Differentiable.
   * - ``specular_transmittance``
     - spectrum or texture
     - Tint of what is refracted. Default: 1. Differentiable.
   * - ``fresnel``
     - string
     - ``schlick`` or ``exact``. Default: ``schlick``.
   * - ``dispersion``
     - string
     - Formula of the refractive index, which replaces ``int_ior``: ``cauchy6``, ``sellmeier3`` or
       ``formula99``. Default: none.
   * - ``coefficients``
     - string
     - Numbers of the formula, separated by blanks, for wavelengths in micrometres (``formula99``:
       nanometres). Default: those of the formula.

With :math:`\theta` the angle on the outer side (of incidence when entering, of refraction when
leaving), :math:`n_1` the index on the side of the viewer and :math:`n_2` that on the other, F is
reflected and :math:`(1 - F) (n_1/n_2)^2` refracted; the square is the factor for radiance, and not
for importance.

.. math::
    F_{schlick} = F_0 + (1 - F_0) (1 - \cos\theta)^5, \qquad
    F_0 = \left(\frac{n_1 - n_2}{n_1 + n_2}\right)^2

``exact`` stands for Fresnel's formulas for unpolarized light. Reflection is total, F = 1, where
:math:`1 - (n_1/n_2)^2 (1 - \cos^2\theta_1) \le 0`.

The angle on the outer side makes F the same for both directions of a path. Schlick's term is not 0
for equal indices: it is :math:`(1 - \cos\theta)^5`. Where the indices are equal, refracted light
passes straight on and the lobe is a ``Null`` one, so that integrators that look for emitters
through index-matched boundaries (``volpath``) do so.

The dispersion formulas are those of `relume.bsdfs.dispersion`. They act in spectral variants;
elsewhere the index at 589.3 nm serves for all colours. Use the integrator ``surfacepath`` with
them: it follows one wavelength from the first dispersive refraction on. Stock integrators converge
to the same picture with more noise. Reflection keeps all wavelengths on one path, each with an F
of its own.

The tints have derivatives under ``path`` and other integrators that differentiate what they sample;
not under ``prb``, which asks materials for their value in a given direction, and that is 0 for a
mirror.

**Source.** C. Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Computer
Graphics Forum 1994, eq. 15; legacy manual, "Refractive index definition".

**Variants.** All but the polarized ones; dispersion in the spectral ones.

**Usage.**

.. code-block:: python

    {'type': 'schlickglass', 'dispersion': 'sellmeier3', 'coefficients':
     '1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653'}

.. code-block:: xml

    <bsdf type="schlickglass">
        <float name="int_ior" value="1.33"/>
        <string name="fresnel" value="exact"/>
    </bsdf>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH, SODIUM_D, index_squared, parse_coefficients
from relume.parameters import POSITIVE, check, choice, expose, refractive_index, text

RUNS_UNDER = ("scalar",)

FRESNEL = ("schlick", "exact")
INDICES = {"ext_ior": POSITIVE, "int_ior": POSITIVE}


def schlick(
    cos_i: mi.Float, cos_t: mi.Float, entering: mi.Bool, k: mi.Float, eta: mi.Float
) -> mi.Float:
    """Return Schlick's F, its angle on the outer side; `eta` the far index over the near one."""
    F_0 = dr.square(k / dr.square(1 + eta))
    x = 1 - dr.select(entering, cos_i, cos_t)
    x2 = x * x
    return dr.fma(1 - F_0, x2 * x2 * x, F_0)


def exact(
    cos_i: mi.Float, cos_t: mi.Float, _entering: mi.Bool, k: mi.Float, eta: mi.Float
) -> mi.Float:
    """Return Fresnel's F for unpolarised light.

    r_s = (c_i - eta c_t) / (c_i + eta c_t) and r_p likewise, multiplied by the denominators, with
    eta^2 c_t^2 = k + c_i^2 and k = eta^2 - 1: free of cancellation for nearly equal indices.
    """
    tiny = 1e-30
    eta2 = eta * eta
    r_s = k / dr.maximum(dr.square(dr.fma(eta, cos_t, cos_i)), tiny)
    r_p = k * dr.fma((eta2 + 1) * cos_i, cos_i, -1)
    r_p /= dr.maximum(eta2 * dr.square(dr.fma(eta, cos_i, cos_t)), tiny)
    return 0.5 * dr.fma(r_s, r_s, r_p * r_p)


def define() -> type[mi.BSDF]:
    """Return the plugin's class for the variant in use."""

    class SchlickGlass(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.specular_reflectance = props.get_texture("specular_reflectance", 1)
            self.specular_transmittance = props.get_texture("specular_transmittance", 1)
            self.fresnel = {"schlick": schlick, "exact": exact}[choice(props, "fresnel", FRESNEL)]
            self.ext_ior = mi.Float(refractive_index(props, "ext_ior", 1.0))
            self.dispersion, self.coefficients = "", []
            if "dispersion" in props:
                if "int_ior" in props:
                    raise ValueError("int_ior and dispersion exclude each other")
                formula = props["dispersion"]
                coefficients = parse_coefficients(formula, text(props, "coefficients"))
                int_ior = index_squared(formula, coefficients, SODIUM_D) ** 0.5
                if mi.is_spectral:
                    self.dispersion = formula
                    self.coefficients = [mi.Float(c) for c in coefficients]
            else:
                int_ior = refractive_index(props, "int_ior", 1.5)
            self.int_ior = mi.Float(int_ior)
            self.parameters_changed([])

        def traverse(self, cb):
            for name in ("specular_reflectance", "specular_transmittance"):
                cb.put(name, getattr(self, name), mi.ParamFlags.Differentiable)
            expose(self, cb, ("ext_ior",) if self.dispersion else tuple(INDICES))

        def parameters_changed(self, keys):
            check(self, INDICES, keys)
            matched = not self.dispersion and dr.all(self.int_ior == self.ext_ior)
            self.through = mi.BSDFFlags.Null if matched else mi.BSDFFlags.DeltaTransmission
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [
                kind | sides | (mi.BSDFFlags.SpatiallyVarying if t.is_spatially_varying() else 0)
                for kind, t in (
                    (mi.BSDFFlags.DeltaReflection, self.specular_reflectance),
                    (
                        self.through
                        | mi.BSDFFlags.NonSymmetric
                        | (HERO_WAVELENGTH if self.dispersion else 0),
                        self.specular_transmittance,
                    ),
                )
            ]
            self.m_flags = self.m_components[0] | self.m_components[1]
            dr.make_opaque(self.ext_ior, self.int_ior, self.coefficients)

        # ------------------------------ one boundary ------------------------------

        def boundary(self, wi, wavelengths):
            """Return (F, cos theta_2, n_2/n_1) for light seen from `wi`.

            Floats, or one value per wavelength where the index depends on it.
            """
            entering, cos_i = wi.z > 0, dr.abs(wi.z)
            ext2 = dr.square(self.ext_ior)
            if self.dispersion:
                int2 = index_squared(self.dispersion, self.coefficients, wavelengths)
                difference = int2 - ext2
            else:
                int2 = dr.square(self.int_ior)
                difference = (self.int_ior - self.ext_ior) * (self.int_ior + self.ext_ior)
            # k = (n_2/n_1)^2 - 1, so that equal indices leave every direction as it is.
            near2, far2 = dr.select(entering, ext2, int2), dr.select(entering, int2, ext2)
            difference = dr.select(entering, difference, -difference)
            k = difference / near2
            # From the sine, which keeps its digits where the cosine is nearly 1 (an index of 1000
            # lets out what is within a thousandth of the normal), and for `wi` of any length.
            sin2_i = dr.fma(wi.x, wi.x, wi.y * wi.y)
            cos_t2 = dr.fma(sin2_i, difference / far2, cos_i * cos_i)
            cos_t = dr.safe_sqrt(cos_t2)
            eta = dr.sqrt(far2 / near2)
            F = self.fresnel(cos_i, cos_t, entering, k, eta)
            return dr.select(cos_t2 > 0, dr.minimum(F, 1), 1), cos_t, eta

        def hero(self, ctx, sample):
            """Return (1 for the wavelength to follow and 0 for the others, its probability).

            See `relume.bsdfs.dispersion` for the two ways.
            """
            count = len(mi.Spectrum())
            if ctx.type_mask & HERO_WAVELENGTH:
                return mi.Spectrum([1] + [0] * (count - 1)), 1
            chosen = mi.UInt32(dr.minimum(sample * count, count - 1))
            picked = [dr.select(chosen == i, mi.Float(1), 0) for i in range(count)]
            return mi.Spectrum(picked), 1 / count

        # ------------------------------ interface of mi.BSDF ------------------------------

        def sample(self, ctx, si, sample1, sample2, active=True):
            has_r = ctx.is_enabled(mi.BSDFFlags.DeltaReflection, 0)
            has_t = ctx.is_enabled(self.through, 1)
            if not (has_r or has_t):
                return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0)

            F, cos_t, eta = self.boundary(si.wi, si.wavelengths)
            # F of each wavelength, F of the one followed, and the probability of a reflection.
            F_each, p_reflect, share, p_hero, mark = F, F, 1, 1, 0
            if self.dispersion:
                share, p_hero = self.hero(ctx, sample2.x)
                F, cos_t, eta = (dr.dot(share, x) for x in (F, cos_t, eta))
                p_reflect = F if p_hero == 1 else dr.mean(F_each)
                mark = HERO_WAVELENGTH if p_hero == 1 else 0

            tint_r = self.specular_reflectance.eval(si, active)
            tint_t = self.specular_transmittance.eval(si, active) * (share / p_hero)
            if ctx.mode == mi.TransportMode.Radiance:
                tint_t /= eta * eta
            if has_r and has_t:
                reflected = sample1 < F
                weight_r = tint_r * (F_each / dr.select(p_reflect > 0, p_reflect, 1))
                weight_t, pdf = tint_t, dr.select(reflected, p_reflect, (1 - F) * p_hero)
            else:
                reflected = mi.Bool(has_r)
                weight_r, weight_t, pdf = tint_r * F_each, tint_t * (1 - F), mi.Float(1)

            bs = dr.zeros(mi.BSDFSample3f)
            x, y, z = si.wi
            through = mi.Vector3f(-x / eta, -y / eta, dr.mulsign(-cos_t, z))
            bs.wo = dr.select(reflected, mi.Vector3f(-x, -y, z), through)
            bs.pdf = pdf
            bs.eta = dr.select(reflected, 1, eta)
            bs.sampled_type = dr.select(
                reflected,
                mi.UInt32(+mi.BSDFFlags.DeltaReflection),
                mi.UInt32(+self.through | mark),
            )
            bs.sampled_component = dr.select(reflected, mi.UInt32(0), mi.UInt32(1))
            return bs, dr.select(reflected, weight_r, weight_t) & active

        def eval(self, ctx, si, wo, active=True):
            return mi.Spectrum(0)

        def pdf(self, ctx, si, wo, active=True):
            return mi.Float(0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return mi.Spectrum(0), mi.Float(0)

        def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
            return *self.eval_pdf(ctx, si, wo), *self.sample(ctx, si, sample1, sample2, active)

        def eval_null_transmission(self, si, active=True):
            if self.through != mi.BSDFFlags.Null:
                return mi.Spectrum(0)
            F, _, _ = self.boundary(si.wi, si.wavelengths)
            return self.specular_transmittance.eval(si, active) * (1 - F) & active

        def to_string(self):
            index = f"int_ior={self.int_ior}"
            if self.dispersion:
                index = f"dispersion={self.dispersion}, coefficients={self.coefficients}"
            return (
                f"SchlickGlass[{index}, ext_ior={self.ext_ior}, fresnel={self.fresnel.__name__}, "
                f"specular_reflectance={self.specular_reflectance}, "
                f"specular_transmittance={self.specular_transmittance}]"
            )

    return SchlickGlass
