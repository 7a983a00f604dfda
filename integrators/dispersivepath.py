r"""Path tracer for dispersive glass (``dispersivepath``)
=====================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``min_depth``
     - integer
     - Shortest path that counts, 1 or more: 2 leaves out emitters that are seen, 3 direct light,
       too. Default: 1.
   * - ``max_depth``
     - integer
     - Longest path: 1 shows emitters alone, 2 adds direct light; -1 for no limit. Default: -1.
   * - ``rr_depth``
     - integer
     - Depth from which Russian roulette ends paths, 1 or more. Default: 5.
   * - ``hide_emitters``
     - boolean
     - Must be false: emitters are always visible. Default: false.

The estimator is that of the stock ``path`` (emitter sampling and BSDF sampling combined by the
power heuristic) and, without dispersion, gives the same picture from the same random numbers. At
the first dispersive refraction of a path it drops all wavelengths but the first and multiplies the
throughput by their number, once: see `relume.bsdfs.dispersion`. It needs a spectral variant for
that; elsewhere it is a plain path tracer. Primal rendering only: to differentiate a scene use
``prb``, which treats dispersion without bias, if with more noise.

**Source.** A. Wilkie et al., "Hero Wavelength Spectral Sampling", Computer Graphics Forum 2014,
without its combination of techniques.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones; dispersion in the
spectral ones.

**Usage.**

.. code-block:: python

    {'type': 'dispersivepath', 'max_depth': 16}
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators.common import (
    PreviousVertex,
    emission,
    path_depths,
    power_heuristic,
    russian_roulette,
)
from relume.parameters import Range, whole


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""

    class DispersivePath(mi.SamplingIntegrator):
        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            if self.hide_emitters:
                raise ValueError("dispersivepath cannot hide emitters")
            self.max_depth, self.rr_depth = path_depths(props)
            self.min_depth = whole(props, "min_depth", 1, Range(1))

        def with_depth_range(self, min_depth, max_depth):
            """Return the same integrator for paths of these depths alone."""
            return mi.load_dict(
                {
                    "type": "dispersivepath",
                    "min_depth": max(min_depth, self.min_depth),
                    "max_depth": min(max_depth, self.max_depth),
                    "rr_depth": self.rr_depth,
                }
            )

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            ctx = mi.BSDFContext()
            ctx.type_mask |= HERO_WAVELENGTH
            wavelengths = len(mi.Spectrum())

            ray = mi.Ray3f(ray)
            L = mi.Spectrum(0)  # radiance
            β = mi.Spectrum(1)  # throughput
            η = mi.Float(1)  # product of the relative indices
            depth = mi.UInt32(0)
            seen = mi.Bool(scene.environment() is not None)  # does the camera ray show anything?
            dispersed = mi.Bool(False)  # is wavelength 0 the only one left?
            active = mi.Bool(active)

            previous = PreviousVertex.camera()

            while dr.hint(active, label="Dispersive path tracer"):
                # Embree's coherent traversal gains nothing here and loses a third under `pssmlt`.
                si = scene.ray_intersect(
                    ray, ray_flags=mi.RayFlags.All, coherent=False, active=active
                )

                # ---------------------------- emission ----------------------------

                shown = mi.Bool(active)
                if dr.hint(self.min_depth > 1, mode="scalar"):
                    shown &= depth + 1 >= self.min_depth
                L = dr.fma(β, emission(scene, si, previous, shown), L)
                active_next = active & (depth + 1 < self.max_depth) & si.is_valid()

                # ------------------------- emitter sampling -------------------------

                bsdf = si.bsdf()
                active_em = active_next & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
                if dr.hint(self.min_depth > 2, mode="scalar"):
                    active_em &= depth + 2 >= self.min_depth
                ds, em_weight = scene.sample_emitter_direction(
                    si, sampler.next_2d(), True, active_em
                )
                active_em &= ds.pdf != 0

                # --------------- BSDF evaluation and sampling in one call ---------------

                f, pdf, bs, weight = bsdf.eval_pdf_sample(
                    ctx,
                    si,
                    si.to_local(ds.d),
                    sampler.next_1d(),
                    sampler.next_2d(),
                    active_next,
                )
                mis = dr.select(ds.delta, 1, power_heuristic(ds.pdf, pdf))
                L[active_em] = dr.fma(β, f * em_weight * mis, L)

                # ------------------------- hero wavelength -------------------------

                disperses = ~dispersed & ((bs.sampled_type & HERO_WAVELENGTH) != 0)
                β *= weight * dr.select(disperses, mi.Float(wavelengths), 1)
                dispersed |= disperses & active_next

                # ------------------------- next vertex, roulette -------------------------

                ray = si.spawn_ray(si.to_world(bs.wo))
                η *= bs.eta
                seen |= active & si.is_valid()
                delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
                previous = PreviousVertex(mi.Interaction3f(si), bs.pdf, delta)

                depth[si.is_valid()] += 1
                β, goes_on = russian_roulette(β, η, depth, self.rr_depth, sampler.next_1d())
                active = active_next & goes_on

            return L, seen, []

        def to_string(self):
            return (
                f"DispersivePath[min_depth={self.min_depth}, max_depth={self.max_depth}, "
                f"rr_depth={self.rr_depth}]"
            )

    return DispersivePath
