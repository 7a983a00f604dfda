r"""Path tracer for surfaces (`surfacepath`)
========================================

.. list-table::
   * - Parameter, type
     - Description
   * - min_depth: integer
     - Shortest path that counts: 2 leaves out emitters that are seen, 3 direct light, too.
       (Default: 1)
   * - max_depth: integer
     - Longest path: 1 shows emitters alone, 2 adds direct light; -1 for no limit. (Default: -1)
   * - rr_depth: integer
     - Depth from which Russian roulette ends paths. (Default: 5)
   * - hide_emitters: boolean
     - Leave out emitters that are seen directly; rays pass through their shapes.
       (Default: false)
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators.common import NO_LIMIT, path_depths, power_heuristic
from relume.integrators.seethrough import Surfaces

from relume.registration import on_every_variant

LOSSLESS = 1 - 1e-5
"""Share of the light that a bounce keeps at least to count as one that loses nothing."""

PATIENCE = 256
"""Bounces without loss, on average, after which roulette ends a path."""


def define():
    """Define and register the plugin under the variant in use."""

    @dataclass
    class Path:
        """State of a path: its next ray, what it has found, and its last vertex that scattered."""

        ray: mi.Ray3f
        L: mi.Spectrum
        β: mi.Spectrum
        η: mi.Float
        depth: mi.UInt32
        seen: mi.Bool
        dispersed: mi.Bool
        active: mi.Bool
        vertex: mi.Interaction3f
        pdf: mi.Float
        delta: mi.Bool

    class SurfacePath(mi.SamplingIntegrator):
        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            if not dr.is_jit_v(mi.Float) or mi.is_polarized:
                raise ValueError(
                    f"surfacepath does not work in {mi.variant()}, but in llvm_ad_rgb, "
                    "llvm_ad_mono, llvm_ad_spectral and their counterparts cuda_ad_*"
                )
            self.max_depth, self.rr_depth = path_depths(props)
            self.min_depth = props.get("min_depth", 1)
            if self.min_depth < 1:
                raise ValueError(f"min_depth is {self.min_depth}, but must be 1 or more")

        def with_depth_range(self, min_depth, max_depth):
            """The same integrator for the light of paths of some lengths alone."""
            longest = min(max_depth, self.max_depth)
            return mi.load_dict(
                {
                    "type": "surfacepath",
                    "min_depth": max(min_depth, self.min_depth),
                    "max_depth": -1 if longest == NO_LIMIT else longest,
                    "rr_depth": self.rr_depth,
                    "hide_emitters": self.hide_emitters,
                }
            )

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            surfaces = Surfaces(scene)
            path = self.started(scene, ray, active)
            bound = self.max_depth if self.bounded(surfaces) else None
            while dr.hint(path.active, max_iterations=bound, label="Surface path tracer"):
                self.step(surfaces, scene, sampler, path)
            return path.L, path.seen, []

        def bounded(self, surfaces):
            """Whether the longest path bounds the number of surfaces that a path meets."""
            return self.max_depth != NO_LIMIT and not surfaces.see_through and not self.hide_emitters

        def started(self, scene, ray, active):
            """A path at its sensor."""
            shows = scene.environment() is not None and not self.hide_emitters
            return Path(
                ray=mi.Ray3f(ray),
                L=mi.Spectrum(0),
                β=mi.Spectrum(1),
                η=mi.Float(1),
                depth=mi.UInt32(0),
                seen=mi.Bool(shows),
                dispersed=mi.Bool(False),
                active=mi.Bool(active) & (self.max_depth > 0),
                vertex=dr.zeros(mi.Interaction3f),
                pdf=mi.Float(1),
                delta=mi.Bool(True),
            )

        def step(self, surfaces, scene, sampler, path):
            """Trace one ray and scatter where it ends."""
            active = path.active
            # Embree's coherent traversal gains a tenth for neighbouring rays from the camera.
            ordered = path.depth == 0 if not getattr(sampler, "unordered", False) else False
            si = scene.ray_intersect(
                path.ray, ray_flags=mi.RayFlags.All, coherent=ordered, active=active
            )
            bsdf = si.bsdf()
            T = bsdf.eval_null_transmission(si, active) if surfaces.see_through else None
            hidden = self.hidden(si, path)
            self.add_emission(surfaces, scene, si, T, path)

            # ------------------------- direct light -------------------------

            goes_on = active & (path.depth + 1 < self.max_depth) & si.is_valid() & ~hidden
            active_em = goes_on & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            if self.min_depth > 2:
                active_em &= path.depth + 2 >= self.min_depth
            ds, em_weight = scene.sample_emitter_direction(
                si, sampler.next_2d(), not surfaces.see_through, active_em
            )
            active_em &= ds.pdf != 0
            if dr.grad_enabled(si.p):  # of a sampled point that stays
                ds.d = dr.normalize(ds.p - si.p)
                Le = scene.eval_emitter_direction(si, ds, active_em)
                em_weight = dr.select(ds.pdf != 0, Le / dr.detach(ds.pdf), 0)

            # --------------- BSDF evaluation and sampling in one call ---------------

            scatters = goes_on
            if surfaces.see_through:  # the last vertex of the longest path may be seen through
                through = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
                scatters = active & si.is_valid() & ~hidden & (goes_on | through)
            ctx = mi.BSDFContext()
            if surfaces.disperse:
                ctx.type_mask |= HERO_WAVELENGTH
            f, pdf, bs, weight = bsdf.eval_pdf_sample(
                ctx, si, si.to_local(ds.d), sampler.next_1d(), sampler.next_2d(), scatters
            )
            mis = dr.detach(dr.select(ds.delta, 1, power_heuristic(ds.pdf, pdf)))
            direct = f * em_weight * mis
            if surfaces.see_through:
                active_em &= dr.any(direct != 0)
                direct *= surfaces.transmittance(scene, si, ds, active_em)
            path.L[active_em] = dr.fma(path.β, direct, path.L)

            # ------------------------- next ray -------------------------

            ray = si.spawn_ray(si.to_world(bs.wo))
            if dr.grad_enabled(ray):  # of a sampled direction that stays
                ray = dr.detach(ray)
                f, pdf = bsdf.eval_pdf(ctx, si, si.to_local(ray.d), scatters)
                weight[pdf > 0] = f / dr.detach(pdf)
            passes = hidden
            known = hidden
            if surfaces.see_through:
                passes |= scatters & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
                known |= passes & dr.any(T != 0)
            if self.hide_emitters:
                ray.d = dr.select(hidden, path.ray.d, ray.d)
                ray.o = dr.select(hidden, si.offset_p(ray.d), ray.o)
                weight = dr.select(hidden, 1, weight)
            if surfaces.disperse:
                parts = ~path.dispersed & ((bs.sampled_type & HERO_WAVELENGTH) != 0)
                weight *= dr.select(parts, mi.Float(len(mi.Spectrum())), 1)
                path.dispersed |= parts & scatters
            path.ray = ray
            path.seen |= active & si.is_valid() & ~passes
            self.follow(sampler, path, weight, bs, si, passes, known, goes_on | passes)

        def hidden(self, si, path):
            """Whether rays have met emitters that are not to be seen."""
            if not self.hide_emitters:
                return mi.Bool(False)
            return path.active & (path.depth == 0) & (si.shape.emitter() != None)  # noqa: E711

        def add_emission(self, surfaces, scene, si, T, path):
            """Add the light of the emitter that a ray has met."""
            ds = mi.DirectionSample3f(scene, si, path.vertex)
            pdf_em = scene.pdf_emitter_direction(path.vertex, ds, path.active & ~path.delta)
            shown = mi.Bool(path.active)
            if self.min_depth > 1:
                shown &= path.depth + 1 >= self.min_depth
            if self.hide_emitters:
                shown &= path.depth > 0
            Le = ds.emitter.eval(si, shown) * dr.detach(power_heuristic(path.pdf, pdf_em))
            if surfaces.masked_lamps:
                Le *= surfaces.shining(si.shape, T)
            path.L = dr.fma(path.β, Le, path.L)

        def follow(self, sampler, path, weight, bs, si, passes, known, goes_on):
            """Take a step's weight into the path, and end it by roulette."""
            path.β *= weight
            path.η *= dr.select(passes, 1, bs.eta)
            # Emitter sampling sees through surfaces, too: it stays with the last that scattered.
            path.vertex = dr.select(known, path.vertex, mi.Interaction3f(si))
            path.pdf = dr.select(known, path.pdf, bs.pdf)
            delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            path.delta = dr.select(known, path.delta, delta)

            path.depth[si.is_valid() & ~passes] += 1
            β_max = dr.max(path.β)
            survival = dr.minimum(β_max * dr.square(path.η), 1)
            lossless = dr.max(weight) * dr.square(bs.eta) >= LOSSLESS
            n = mi.Float(path.depth)
            survival = dr.select(lossless, dr.minimum(survival, 1 - 2 / (n + PATIENCE)), survival)
            survival = dr.detach(survival)
            roulette = (path.depth >= self.rr_depth) & ~passes
            survives = sampler.next_1d() < survival
            path.β[roulette] *= dr.rcp(survival)
            path.active = goes_on & (~roulette | survives) & (β_max != 0)

        def to_string(self):
            return (
                f"SurfacePath[min_depth={self.min_depth}, max_depth={self.max_depth}, "
                f"rr_depth={self.rr_depth}, hide_emitters={self.hide_emitters}]"
            )

    mi.register_integrator("surfacepath", SurfacePath)


on_every_variant(define)
