r"""Path tracer with diffusion below surfaces (``dipole``)
======================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``profile``
     - string
     - ``standard``, ``directional`` or ``normalized``. Default: ``standard``.
   * - ``max_depth``
     - integer
     - Longest path: 1 shows emitters alone, 2 adds direct light; -1 for no limit. A way through a
       medium counts as one bounce. Default: -1.
   * - ``rr_depth``
     - integer
     - Depth from which Russian roulette ends paths, 1 or more. Default: 5.
   * - ``hide_emitters``
     - boolean
     - Hide directly visible emitters. Default: false.

A path tracer for all surfaces but those of the material ``subsurface``. There light that is
not mirrored leaves by

.. math::
    L_o(x_o, o) = \int_A \int S(x_i, i; x_o, o)\, L_i(x_i, i)\, (n_i \cdot i)\, di\, dA(x_i)

**Multiple scattering.** `relume.integrators.diffusion` has the three kernels, ``standard``,
``directional`` and ``normalized``:

.. math::
    S &= F_t(i)\, R(|x_o - x_i|)\, F_t(o) / \pi \\
    S &= F_t(i)\, S_d(x_i, i; x_o)\, F_t(o) \\
    S &= F_t(i)\, R(|x_o - x_i|)\, F_t(o) / (\pi c), \qquad
         c = \frac{1}{\pi} \int F_t(o)\, (n \cdot o)\, do

:math:`F_t` is Fresnel's transmittance. The points :math:`x_i` are found by probe rays on the same
object (see `relume.integrators.probing`); from there the path goes on as from a diffuse surface,
with emitter sampling.

**Single scattering** (level -1, ``standard`` alone; the other profiles include it). The path
refracts into the medium and scatters where an exponential law says, at x. A straight line with the
direction w then leads from x through the boundary at :math:`x_i`, at a distance s from x. For the
angles :math:`\theta` outside and :math:`\theta'` inside, Jensen et al., section 2.5, take
:math:`s' = s \cos\theta / \cos\theta'` for the length of the refracted way, so that

.. math::
    L(x, w')\, dw' = F_t(w)\, e^{-\sigma_t s'} L_i(x_i, w)
    \frac{\cos\theta}{\cos\theta'}\, dw

The last factor, that of the solid angle, is not in the paper; with it, and with the factor
:math:`1/\eta^2` of radiance at :math:`x_o`, flat boundaries under distant light are exact. g is
clamped to the range from -0.999 to 0.999 here, not in :math:`\sigma_s' = (1 - g) \sigma_s`.

**No scattering** (level -1). Light that crosses the object without scattering is refracted at the
boundary as by clear glass.

Roulette is that of ``surfacepath``, and scenes without ``subsurface`` are rendered by
``surfacepath`` itself.

**Gradients.** The textures of ``subsurface``, and what ``surfacepath`` differentiates in other
materials, have unbiased derivatives: points, directions and distances are drawn without them, what
these carry has them. Every step of the paths is kept for that, so memory grows with samples and
depth: render small pictures, and limit ``max_depth``.

**Source.** H. W. Jensen, S. Marschner, M. Levoy and P. Hanrahan, "A Practical Model for Subsurface
Light Transport", SIGGRAPH 2001 (``standard`` and single scattering); J. R. Frisvad, T. Hachisuka
and T. K. Kjeldsen, "Directional Dipole Model for Subsurface Scattering", ACM TOG 34(1), 2014
(``directional``); P. H. Christensen and B. Burley, "Approximate Reflectance Profiles for Efficient
Subsurface Scattering", 2015 (``normalized``).

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'dipole', 'profile': 'standard', 'max_depth': 16}
"""

from __future__ import annotations

from contextlib import contextmanager

import drjit as dr
import mitsuba as mi

from relume.bsdfs.subsurface import SUBSURFACE
from relume.integrators.common import (
    PreviousVertex,
    emission,
    path_depths,
    power_heuristic,
    russian_roulette,
    usual_throughput,
)
from relume.integrators.diffusion import NEGLIGIBLE_SHARE, PROFILES, TRUNCATED_SHARE, ExitPoint
from relume.integrators.probing import find_entry
from relume.integrators.seethrough import Surfaces
from relume.integrators.translucentmaterials import TranslucentMaterials, medium_of
from relume.integrators.vertices import (
    Interior,
    at_crossing,
    at_entry,
    at_scattering,
    at_surface,
    sample_emitter,
    through_medium,
)
from relume.parameters import choice

SURFACE, ENTRY, INNER, CROSSING = range(4)
"""What the path does next: meets a surface; goes on from where light enters by diffusion; runs on
inside from the boundary; runs on from a point inside where it has scattered."""


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""

    class Dipole(mi.SamplingIntegrator):
        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            self.profile = choice(props, "profile", tuple(PROFILES))
            self.left_out = TRUNCATED_SHARE
            self.max_depth, self.rr_depth = path_depths(props, roulette=5)
            self.path = mi.load_dict(
                {
                    "type": "surfacepath",
                    "max_depth": props.get("max_depth", -1),
                    "rr_depth": self.rr_depth,
                    "hide_emitters": self.hide_emitters,
                }
            )

        def sample(self, scene, sampler, ray, medium=None, active=True):
            materials = TranslucentMaterials(scene)
            if not materials:
                return self.path.sample(scene, sampler, ray, medium, active)
            return self.trace(scene, sampler, mi.Ray3f(ray), mi.Bool(active), materials)

        @contextmanager
        def step_by_step(self):
            """Context in which loops are not recorded but run, each step kept for its derivatives.

            A recorded loop can only be run backwards if the number of its steps is bounded.
            Recorded conditionals within loops that are not make Dr.Jit 1.5 abort.
            """
            loops, conditionals = dr.JitFlag.SymbolicLoops, dr.JitFlag.SymbolicConditionals
            self.left_out = NEGLIGIBLE_SHARE
            with dr.scoped_set_flag(loops, False), dr.scoped_set_flag(conditionals, False):
                yield
            self.left_out = TRUNCATED_SHARE

        def render_forward(self, *args, **kwargs):
            with self.step_by_step():
                return super().render_forward(*args, **kwargs)

        def render_backward(self, *args, **kwargs):
            with self.step_by_step():
                super().render_backward(*args, **kwargs)

        def first_hit(self, scene, ray, active):
            """Return what a camera ray meets, behind the emitters if they are hidden."""
            pi = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
            if self.hide_emitters:
                skip = active & pi.is_valid() & (pi.shape.emitter() != None)  # noqa: E711
                si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal, skip)
                behind = self.skip_area_emitters(scene, si.spawn_ray(ray.d), True, skip)
                # Distances count from the camera.
                behind.t += dr.dot(si.spawn_ray(ray.d).o - ray.o, ray.d)
                pi = dr.select(skip, behind, pi)
            return pi

        @dr.syntax
        def trace(self, scene, sampler, ray, active, materials):
            profile = PROFILES[self.profile]
            surfaces = Surfaces(scene)
            extent = mi.Float(2 * scene.bbox().bounding_sphere().radius)
            dr.make_opaque(extent)
            ctx = mi.BSDFContext()
            ctx.type_mask |= SUBSURFACE

            L = mi.Spectrum(0)  # radiance
            β = mi.Spectrum(1)  # throughput
            η = mi.Float(1)  # product of the relative indices
            usual = mi.Float(0)  # throughput with which paths count as much as others
            depth = mi.UInt32(0)
            seen = mi.Bool(not self.hide_emitters and scene.environment() is not None)
            pi = self.first_hit(scene, ray, active)

            previous = PreviousVertex.camera()
            kind = mi.UInt32(SURFACE)
            interior = Interior.none()

            while dr.hint(active, label="Path tracer with diffusion"):
                si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)
                valid = si.is_valid()
                entry = active & (kind == ENTRY)
                met = materials.objects.at(si, active & valid)
                scatters, crossing = mi.Bool(False), mi.Bool(False)
                weight = mi.Spectrum(1)
                x = mi.Point3f(si.p)

                # ------------------------- inside a medium -------------------------

                if dr.hint(materials.refract, mode="scalar"):
                    inside, crossing = active & (kind == INNER), active & (kind == CROSSING)
                    scatters, distance, weight = through_medium(
                        interior, β, ray, si, met, sampler.next_2d(), inside, crossing
                    )
                    x = dr.select(scatters, ray(distance), x)
                    β *= weight
                    if dr.hint(profile.includes_single_scattering, mode="scalar"):
                        active &= ~scatters
                        scatters = mi.Bool(False)

                surface = active & ~(entry | scatters | crossing)

                # ---------------------------- emission ----------------------------

                if dr.hint(self.hide_emitters, mode="scalar"):
                    active &= (depth > 0) | valid | (kind != SURFACE)
                    surface &= active
                Le = emission(scene, si, previous, surface)
                T = mi.Spectrum(0)
                if dr.hint(surfaces.see_through, mode="scalar"):
                    T = si.bsdf(ray).eval_null_transmission(si, surface)
                    Le *= surfaces.shining(si.shape, T)
                L = dr.fma(β, Le, L)
                # On its way out a path is to meet the emitters that its last vertex has sampled.
                active_next = active & ((depth + 1 < self.max_depth) | crossing)
                active_next &= valid | scatters

                # ------------------------- emitter sampling -------------------------

                bsdf = si.bsdf(ray)
                smooth = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
                if dr.hint(not materials.has_blends, mode="scalar"):
                    smooth &= (bsdf.flags() & SUBSURFACE) == 0
                from_x = mi.SurfaceInteraction3f(si)
                from_x.p = x
                from_x.n = dr.select(scatters, 0, si.n)
                light = sample_emitter(
                    scene,
                    interior,
                    from_x,
                    ray.d,
                    sampler.next_2d(),
                    active_next & (entry | scatters | (surface & smooth)),
                    scatters,
                    materials,
                    surfaces,
                )

                # --------------- evaluation and sampling in one call ---------------

                d, u1, u2 = light.ds.d, sampler.next_1d(), sampler.next_2d()
                vertex = at_surface(bsdf, ctx, si, d, u1, u2, active_next & surface)
                if entry:
                    vertex = at_entry(profile, interior, si, d, u2)
                if dr.hint(materials.refract, mode="scalar"):
                    within = interior.medium
                    scattering = at_scattering(within, β, ray.d, d, light.arrives, u1, u2)
                    vertex = dr.select(scatters, scattering, vertex)
                    vertex = dr.select(crossing, at_crossing(within, ray.d), vertex)
                mis = dr.select(light.ds.delta, 1, power_heuristic(light.ds.pdf, vertex.pdf))
                L[light.active] = dr.fma(β, vertex.f * light.weight * mis, L)

                # ------------------------- next vertex -------------------------

                β *= vertex.weight
                η *= vertex.eta
                chosen = vertex.sampled_type
                goes_in = active_next & surface & ((chosen & SUBSURFACE) != 0)
                diffuses = goes_in & mi.has_flag(chosen, mi.BSDFFlags.DiffuseReflection)
                refracted = mi.has_flag(chosen, mi.BSDFFlags.DeltaTransmission)
                seen |= active_next & ~mi.has_flag(chosen, mi.BSDFFlags.Null)
                # Emitter sampling sees through surfaces, too: it stays where light last scattered.
                passes = active_next & surface & mi.has_flag(chosen, mi.BSDFFlags.Null)
                passes &= dr.any(T != 0)
                same_way = crossing | diffuses | passes
                delta = mi.has_flag(chosen, mi.BSDFFlags.Delta)
                here = PreviousVertex(mi.Interaction3f(from_x), vertex.pdf_w, delta)
                previous = dr.select(same_way, previous, here)
                depth[active_next & ~(same_way | (goes_in & refracted))] += 1
                interior.before = dr.select(scatters, ray.d, interior.before)
                interior.boundary = dr.select(goes_in, met, interior.boundary)
                if goes_in:
                    inner_bsdf = materials.translucent(bsdf)
                    interior.medium = dr.dispatch(inner_bsdf, medium_of, si, goes_in)
                    interior.exit = ExitPoint(mi.Point3f(si.p), mi.Normal3f(si.n))
                straight = mi.Ray3f(x, vertex.w, ray.time, ray.wavelengths)
                ray = dr.select(scatters, straight, si.spawn_ray(vertex.w))
                kind = dr.select(scatters, mi.UInt32(CROSSING), SURFACE)
                kind = dr.select(goes_in, dr.select(diffuses, mi.UInt32(ENTRY), INNER), kind)

                # ------------------------- roulette -------------------------

                kept = dr.max(weight * vertex.weight) * dr.square(vertex.eta)
                decides = (depth >= self.rr_depth) & ~passes
                usual = usual_throughput(usual, β, η, depth, active_next & ~same_way, delta)
                β, goes_on = russian_roulette(β, η, usual, kept, depth, decides, sampler.next_1d())
                active = active_next & goes_on

                # ------------------------- next hit -------------------------

                pi = scene.ray_intersect_preliminary(ray, coherent=False, active=active & ~diffuses)
                u1, u2, u3 = sampler.next_2d(), sampler.next_2d(), sampler.next_1d()
                diffuses &= active
                if diffuses:
                    below = profile(interior.medium, extent, self.left_out)
                    guide = profile(dr.detach(interior.medium), extent, self.left_out)
                    found = find_entry(
                        scene, materials.objects, dr.detach(si), below, guide, dr.detach(β),
                        u1, u2, u3, diffuses,
                    )  # fmt: skip
                    β = β * found.weight
                    ray = found.ray
                    pi = found.pi
                active &= ~diffuses | dr.any(β > 0)

            return L, seen, []

        def to_string(self):
            return (
                f"Dipole[profile={self.profile}, max_depth={self.max_depth}, "
                f"rr_depth={self.rr_depth}, hide_emitters={self.hide_emitters}]"
            )

    return Dipole
