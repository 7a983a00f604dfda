r"""Path tracer for surfaces (``surfacepath``)
============================================

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
     - Depth from which Russian roulette ends paths, 1 or more. Default: 2.
   * - ``hide_emitters``
     - boolean
     - Leave out emitters that are seen directly: rays from the sensor pass through their shapes
       and end on nothing where they would reach the environment. Default: false.

Emitter sampling and BSDF sampling are combined by the power heuristic. Where light meets no
surface that it can cross straight on, the picture is that of the stock ``path``, from the same
random numbers as long as roulette does not end paths. What is different:

**Light crosses surfaces.** A ray to a lamp goes on through every surface with a ``Null`` lobe (
``mask``, ``null``, ``thindielectric``, index-matched ``schlickglass``) with the share T of
``BSDF.eval_null_transmission``. A ray that crosses one by BSDF sampling keeps the density of the
direction in which light last scattered, so that both count the same paths. These surfaces do not
lengthen a path, and a ray that meets nothing else is transparent (alpha). Where a BSDF passes light
without telling its T (``shadowcatcher``) emitter sampling sees a solid surface and BSDF sampling
takes over. A scene without such surfaces does not pay for them.

**A lamp with a mask** shines as far as it is there: its radiance is multiplied by the opacity. In
stock integrators it shines fully.

**A backdrop** (``apparentlamp``) shows what it emits where the sensor sees it, straight or by way
of mirrors and glass, and is not lit there.

**Dispersion.** At the first dispersive refraction of a path all wavelengths but the first are
dropped and the throughput is multiplied by their number (`relume.bsdfs.dispersion`), in spectral
variants and in scenes that disperse.

**Roulette** lets a path live with the probability

.. math:: q = \min\Bigl(1, \frac{\eta^2 \max_\lambda \beta_\lambda}{0.4\,u}\Bigr)

of its throughput :math:`\beta` and the product :math:`\eta` of the relative indices that it has
crossed. A path counts in its pixel as far as its throughput is that of the others there: u is
:math:`\eta^2 \max_\lambda \beta_\lambda` after the first scattering that is none of a mirror or
of glass, at the latest after the eighth, from 0.1 to 1, so that what is seen of dark things has
paths as long as what is seen of bright ones (``make study-roulette``). The throughput of what
survives is 0.4 u or more, so that a closed room of any albedo a below 1 has its
radiance :math:`1/(1 - a)` from paths of about :math:`1/(1 - a)` bounces. (``path`` ends one in
twenty bounces at least; the weight of the others grows without bound.) After a bounce that loses
less than a part in 100 000 q is at most :math:`1 - 2/(n + 256)` at depth n, or light between
perfect mirrors would never end: of paths that lose nothing a share of about
:math:`(1 + n/256)^{-2}` is left after n bounces. Nothing is cut off, and the mean stays right.

Derivatives are those of ``path``: sampled directions stay, values change. There are none for the
share of light that passes a surface by BSDF sampling.

**Source.** E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, chapters 9
and 10; J. Arvo and D. Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990; A. Wilkie et
al., "Hero Wavelength Spectral Sampling", Computer Graphics Forum 2014.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'surfacepath', 'max_depth': 16}
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators.common import (
    NO_LIMIT,
    path_depths,
    power_heuristic,
    russian_roulette,
    usual_throughput,
)
from relume.integrators.seethrough import Surfaces
from relume.parameters import Range, whole


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""

    @dataclass
    class Path:
        """State of a path: its next ray, what it has found, and its last vertex that scattered."""

        ray: mi.Ray3f
        L: mi.Spectrum
        β: mi.Spectrum
        η: mi.Float
        usual: mi.Float
        depth: mi.UInt32
        seen: mi.Bool
        dispersed: mi.Bool
        active: mi.Bool
        vertex: mi.Interaction3f
        pdf: mi.Float
        delta: mi.Bool

    class SurfacePath(mi.SamplingIntegrator):
        plugin = "surfacepath"
        state = Path
        roulette_from = 2

        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            self.max_depth, self.rr_depth = path_depths(props, roulette=self.roulette_from)
            self.min_depth = whole(props, "min_depth", 1, Range(1))

        def with_depth_range(self, min_depth, max_depth):
            """The same integrator for the light of paths of some lengths alone."""
            longest = min(max_depth, self.max_depth)
            return mi.load_dict(
                {
                    "type": self.plugin,
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
            while dr.hint(path.active, label="Surface path tracer"):
                self.step(surfaces, scene, sampler, path)
            return path.L, path.seen, []

        def started(self, scene, ray, active):
            """A path at its sensor."""
            shows = scene.environment() is not None and not self.hide_emitters
            return Path(
                ray=mi.Ray3f(ray),
                L=mi.Spectrum(0),
                β=mi.Spectrum(1),
                η=mi.Float(1),
                usual=mi.Float(0),
                depth=mi.UInt32(0),
                seen=mi.Bool(shows),
                dispersed=mi.Bool(False),
                active=mi.Bool(active) & (self.max_depth > 0),
                vertex=dr.zeros(mi.Interaction3f),
                pdf=mi.Float(1),
                delta=mi.Bool(True),
            )

        def step(self, surfaces, scene, sampler, path):
            """Trace one ray and scatter where it ends; return what it meets."""
            si = self.met(scene, sampler, path)
            bsdf = si.bsdf()
            flags = bsdf.flags()
            T = bsdf.eval_null_transmission(si, path.active) if surfaces.see_through else None
            hidden = self.hidden(si, path)
            self.add_emission(surfaces, scene, si, T, path)

            meets = path.active & si.is_valid() & ~hidden
            goes_on = meets & (path.depth + 1 < self.max_depth)
            goes_on &= ~surfaces.unlit(si.shape, path.delta)
            scatters = mi.Bool(goes_on)  # a copy
            if surfaces.see_through:  # so may the end of the longest path be
                scatters |= meets & mi.has_flag(flags, mi.BSDFFlags.Null)

            # ---------------- direct light, BSDF evaluated and sampled at once ----------------

            lit = goes_on & mi.has_flag(flags, mi.BSDFFlags.Smooth)
            ds, Le, lit = self.lamp(surfaces, scene, sampler, si, path, lit)
            ctx = mi.BSDFContext()
            if surfaces.disperse:
                ctx.type_mask |= HERO_WAVELENGTH
            f, pdf, bs, weight = bsdf.eval_pdf_sample(
                ctx, si, si.to_local(ds.d), sampler.next_1d(), sampler.next_2d(), scatters
            )
            mis = dr.select(ds.delta, 1, power_heuristic(ds.pdf, pdf))
            direct = f * Le * dr.detach(mis)
            if surfaces.see_through:
                lit &= dr.any(direct != 0)
                direct *= self.transmittance(surfaces, scene, si, ds, path, lit)
            path.L[lit] = dr.fma(path.β, direct, path.L)

            # ---------------------------- next ray and weight ----------------------------

            ray = si.spawn_ray(si.to_world(bs.wo))
            if dr.grad_enabled(ray):  # derivatives of the value in a direction that stays
                ray = dr.detach(ray)
                f, pdf = bsdf.eval_pdf(ctx, si, si.to_local(ray.d), scatters)
                weight[pdf > 0] = f / dr.detach(pdf)
            if surfaces.disperse:
                parts = ~path.dispersed & ((bs.sampled_type & HERO_WAVELENGTH) != 0)
                weight *= dr.select(parts, mi.Float(len(mi.Spectrum())), 1)
                path.dispersed |= parts & scatters
            passes = known = mi.Bool(False)
            if surfaces.see_through:
                passes = scatters & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
                known = passes & dr.any(T != 0)
            if self.hide_emitters:
                ray = dr.select(hidden, si.spawn_ray(path.ray.d), ray)
                weight = dr.select(hidden, 1, weight)
                passes, known = passes | hidden, known | hidden

            path.ray = ray
            path.seen |= path.active & si.is_valid() & ~passes
            path.depth[si.is_valid() & ~passes] += 1
            # Emitter sampling sees through surfaces, too: it stays where light last scattered.
            self.scattered(path, si, bs, ~known)
            self.roulette(sampler, path, weight, dr.select(passes, 1, bs.eta), passes, goes_on)
            return si

        def scattered(self, path, si, bs, where):
            """Note where a surface has scattered a path last, and how."""
            path.vertex = dr.select(where, mi.Interaction3f(si), path.vertex)
            path.pdf = dr.select(where, bs.pdf, path.pdf)
            delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            path.delta = dr.select(where, delta, path.delta)

        def met(self, scene, sampler, path):
            """What the ray of a path meets."""
            # Embree's coherent traversal gains for neighbouring rays from the camera alone.
            ordered = False if getattr(sampler, "unordered", False) else path.depth == 0
            return scene.ray_intersect(
                path.ray, ray_flags=mi.RayFlags.All, coherent=ordered, active=path.active
            )

        def hidden(self, si, path):
            """Whether rays have met emitters that are not to be seen."""
            if not self.hide_emitters:
                return mi.Bool(False)
            return path.active & (path.depth == 0) & (si.shape.emitter() != None)  # noqa: E711

        def add_emission(self, surfaces, scene, si, T, path):
            """Add the light of the emitter that a ray has met."""
            ds = mi.DirectionSample3f(scene, si, path.vertex)
            pdf_em = self.lamp_density(scene, ds, path)
            shown = mi.Bool(path.active)
            if self.min_depth > 1:
                shown &= path.depth + 1 >= self.min_depth
            if self.hide_emitters:
                shown &= path.depth > 0
            Le = ds.emitter.eval(si, shown) * dr.detach(power_heuristic(path.pdf, pdf_em))
            if surfaces.masked_lamps:
                Le *= surfaces.shining(si.shape, T)
            path.L = dr.fma(path.β, Le, path.L)

        def lamp_density(self, scene, ds, path):
            """Density with which emitter sampling draws the point that a path has found."""
            return scene.pdf_emitter_direction(path.vertex, ds, path.active & ~path.delta)

        def lamp(self, surfaces, scene, sampler, si, path, lit):
            """A sampled point of an emitter, its weight, and whether it lights the surface.

            Surfaces that light crosses are left to `Surfaces.transmittance`.
            """
            if self.min_depth > 2:
                lit &= path.depth + 2 >= self.min_depth
            ds, Le = scene.sample_emitter_direction(
                si, sampler.next_2d(), not surfaces.see_through, lit
            )
            lit &= ds.pdf != 0
            if surfaces.spheres:
                lit &= ~surfaces.light_themselves(si, ds)
            if dr.grad_enabled(si.p):  # the surface moves, the sampled point stays
                ds.d = dr.normalize(ds.p - si.p)
                L = scene.eval_emitter_direction(si, ds, lit)
                Le = dr.select(lit, L / dr.detach(ds.pdf), 0)
            return ds, Le, lit

        def transmittance(self, surfaces, scene, si, ds, path, lit):
            """What is left of the light of a sampled point of a lamp where it arrives."""
            return surfaces.transmittance(scene, si, ds, lit)

        def roulette(self, sampler, path, weight, eta, passes, goes_on):
            """Take a step's weight into the path, and end it in proportion to what is left."""
            path.β *= weight
            path.η *= eta
            path.usual = usual_throughput(
                path.usual, path.β, path.η, path.depth, ~passes, path.delta
            )
            kept = dr.max(weight) * dr.square(eta)
            decides = (path.depth >= self.rr_depth) & ~passes
            path.β, survives = russian_roulette(
                path.β, path.η, path.usual, kept, path.depth, decides, sampler.next_1d()
            )
            path.active = (goes_on | passes) & survives

        def to_string(self):
            return (
                f"SurfacePath[min_depth={self.min_depth}, max_depth={self.max_depth}, "
                f"rr_depth={self.rr_depth}, hide_emitters={self.hide_emitters}]"
            )

    return SurfacePath
