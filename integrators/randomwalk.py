r"""Path tracer with random walks inside objects (``randomwalk``)
==============================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``min_depth``
     - integer
     - Shortest path that counts, as in ``surfacepath``. Default: 1.
   * - ``max_depth``
     - integer
     - Longest path; each scattering in a medium counts as one bounce. -1 for no limit. Default: -1.
   * - ``rr_depth``
     - integer
     - Depth from which Russian roulette ends paths, 1 or more. Default: 5.
   * - ``hide_emitters``
     - boolean
     - Leave out emitters that are seen directly, as in ``surfacepath``. Default: false.

On surfaces it is ``surfacepath``. Where a path goes into a homogeneous medium (``interior``,
``exterior``, or that of the sensor), a walk takes it to the next surface. It takes the place of
``volpathmis`` in any scene with such media: the same light, as long as single precision lets
``volpathmis`` have it.

**Flights.** With the coefficients :math:`\sigma_{t,c}` and the throughput :math:`\beta_c` of the
channels c, a channel is drawn with the probability :math:`q_c = \beta_c / \sum_j \beta_j`, and the
length s from its exponential law. Where a flight ends at the distance t, by scattering or on a
surface,

.. math::
    \beta_c \leftarrow \beta_c \frac{\sigma_{t,c} \, e^{-\sigma_{t,c} t}}
                               {\sum_j q_j \sigma_{t,j} \, e^{-\sigma_{t,j} t}}, \qquad
    \beta_c \leftarrow \beta_c \frac{e^{-\sigma_{t,c} t}}{\sum_j q_j \, e^{-\sigma_{t,j} t}}

(but where nothing scatters there is nothing to draw, and light is weighted by what is left of it),
so that :math:`\sum_c \beta_c` stays what it is: no channel makes fireflies of another. At a
scattering :math:`\beta_c` loses what is absorbed, and the direction is drawn from the mixture of
the channels' phase functions with the same :math:`q_c`. ``isotropic``, ``hg`` and ``hgrgb`` are
known.

**Roulette** lets a walk live with the probability :math:`\min(1 - 10^{-6}, \eta^2 \max_c
\beta_c)`, at each scattering from ``rr_depth`` on. It ends no more than is absorbed, so that a walk
in a medium that absorbs nothing goes on until it leaves.

**Lamps on the way.** The light of a lamp is looked for at a point of each flight before the next
surface, drawn from the exponential law and, near lamps, by equal angles as seen from the lamp; in
parallel beams, within the beam (`relume.integrators.flightlights`). The power heuristic weighs it
against flights whose scattered rays meet the lamp. Where little is scattered, or little of the
light can arrive, this is done by chance.

**Far from everything** walks cross balls of 8 and more mean free paths in one step
(`relume.integrators.spherejumps`, with its formulas and their error): in a sphere in which nothing
else is, and in scenes of 40 mean free paths and more wherever no surface and no lamp is
(`relume.integrators.clearances`). Where lamps are looked for their light is left out in balls 10
mean free paths away from them: :math:`e^{-10}` of it. From a grey diffuse sphere that reflects
nearly all light a walk goes to the half ball around the point that it leaves, of at most 0.02 times
the sphere's radius, in which at most 0.001 of the light is lost (`relume.integrators.walkjumps`).
All of this is for media whose g and extinction do not differ between the channels, or that scatter
evenly, and without ``max_depth``.

**Where rays start.** A ray of single precision that starts at a point p of the world is off by
:math:`6 \cdot 10^{-8} |p|`, and Mitsuba starts it :math:`9 \cdot 10^{-5} (1 + |p|)` off the
surface: at a mean free path of :math:`10^{-4} |p|` all walks begin one free path below. Here
positions x are relative to the point of entry, the anchor, around which the surface is

.. math:: 2\, n \cdot x + k |x|^2 = 0

with the normal n and the curvature k: 0 for flat faces, :math:`\pm 1/R` for spheres. Flights end
there where this equation says. Other surfaces, and other faces of a mesh, are found by rays from
the anchor plus x; they start :math:`2 \cdot 10^{-6}` of the coordinates too early, and a surface
that the walk has left already is passed. Their error, :math:`10^{-7} |p|`, is that of the
coordinates themselves, to both sides alike: 0.01 mean free paths where those are :math:`10^{-5}
|p|`. In a sphere in which nothing else is, no ray is cast at all.

**Lamps** are looked for from inside media whose surface lets light pass straight on (``null``,
``mask``, index-matched ``schlickglass``), and where a lamp may be inside; elsewhere refraction
would bend the ray. Shadow rays cross such surfaces and the media behind them. A medium with
``sample_emitters`` false is left out.

Media that vary in space, and other phase functions, are refused. Walks that an open surface has let
out end at twice the radius of the scene.

**Source.** M. J.-Y. Chiang, P. Kutz and B. Burley, "Practical and Controllable Subsurface
Scattering for Production Path Tracing", SIGGRAPH 2016 Talks; A. Wilkie et al., "Hero Wavelength
Spectral Sampling", Computer Graphics Forum 2014 (the balance of channels); C. Kulla and M. Fajardo,
"Importance Sampling Techniques for Path Tracing in Participating Media", Computer Graphics Forum
2012 (equal angles); E. Veach, "Robust Monte
Carlo Methods for Light Transport Simulation", 1997.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'randomwalk', 'rr_depth': 9}
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.boundaries import FAR, Anchor
from relume.integrators.common import NO_LIMIT
from relume.integrators.flightlights import DARK, Flight
from relume.integrators.spherejumps import eigenvalue
from relume.integrators.surfacepath import define as define_surfacepath
from relume.integrators.walkjumps import jump, leap
from relume.integrators.walklights import add_light
from relume.integrators.walkmedia import chosen, mixture, sample_phase
from relume.integrators.walks import Walk, flight_end, light_through, nothing, tolerance
from relume.integrators.walksurroundings import Surroundings

RECORDING = dr.JitFlag.SymbolicScope
"""Whether a kernel is being recorded."""

STEP = 2.0**-24
"""Least probability with which roulette lets a walk live: that of a random number that is 0."""

CERTAIN = 1e12
"""Density of directions that no emitter sampling could have found [1/sr]."""

PATIENT = 1 - 1e-6
"""Most of the walks that go on after a scattering: in a closed room that loses nothing they end."""

GRAZING = 1e-5
"""Least cosine at which walks leave a surface: the rounding of normals must not turn them back."""


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""
    SurfacePath: Any = define_surfacepath()

    @dataclass
    class WalkingPath(SurfacePath.state):
        """A path that may go through media.

        It has the medium that its ray is in and, where it goes into one, its anchor; `open` tells
        whether light crosses the surface there straight on. A walk that has ended on a surface
        `probes` for it along the normal, and has come along `d`.
        """

        medium: mi.MediumPtr
        anchor: Anchor
        walks: mi.Bool
        open: mi.Bool
        probes: mi.Bool
        d: mi.Vector3f
        flight: Flight
        pi: mi.PreliminaryIntersection3f

    class RandomWalk(SurfacePath):
        plugin = "randomwalk"
        roulette_from = 5

        def __init__(self, props):
            super().__init__(props)
            self.kept = None

        def surroundings(self, scene, medium):
            """The `Surroundings` of a scene; in a kernel that is being recorded those before it.

            There nothing can be evaluated, so chains of paths take those of their first samples.
            """
            if self.kept is None or self.kept[0] != scene.ptr or not dr.flag(RECORDING):
                self.kept = scene.ptr, Surroundings(scene, medium)
            return self.kept[1]

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            around = self.around = self.surroundings(scene, medium)
            path = self.set_out(scene, ray, medium, active)
            while dr.hint(path.active, label="Path tracer with random walks"):
                self.walk(around, scene, sampler, path)
                si = self.step(around, scene, sampler, path)
                self.go_in(around, si, path)
            return path.L, path.seen, []

        def set_out(self, scene, ray, medium, active):
            """A path at its sensor, which may be in a medium."""
            within = medium is not None
            return WalkingPath(
                **vars(self.started(scene, ray, active)),
                medium=mi.MediumPtr(medium) if within else dr.zeros(mi.MediumPtr),
                anchor=Anchor.none(ray.o),
                walks=mi.Bool(within),
                open=mi.Bool(True),
                probes=mi.Bool(False),
                d=mi.Vector3f(ray.d),
                flight=Flight.none(),
                pi=nothing(),
            )

        def met(self, scene, sampler, path):
            probe = path.ray.d
            ordered = False if getattr(sampler, "unordered", False) else path.depth == 0
            traced = path.active & ~path.pi.is_valid()
            pi = scene.ray_intersect_preliminary(path.ray, coherent=ordered, active=traced)
            pi = dr.select(traced, pi, path.pi)
            path.pi = nothing()
            si = pi.compute_surface_interaction(path.ray, mi.RayFlags.All, path.active)
            # A walk that has come to a surface leaves by it, however it grazes.
            n = dr.mulsign(mi.Vector3f(si.n), dr.dot(si.n, probe))
            d = dr.fma(dr.maximum(GRAZING - dr.dot(path.d, n), 0), n, path.d)
            probes = path.probes & si.is_valid()
            si.wi = dr.select(probes, si.to_local(-dr.normalize(d)), si.wi)
            path.probes = mi.Bool(False)
            return si

        def go_in(self, around, si, path):
            """Let paths go into the media beyond the surfaces that they have met."""
            d = path.ray.d
            meets = path.active & si.is_valid()
            crosses = meets & si.is_medium_transition()
            path.medium = dr.select(crosses, si.target_medium(d), path.medium)
            path.walks = meets & (path.medium != None)  # noqa: E711
            path.anchor = dr.select(path.walks, around.known.anchor(si, d, path.walks), path.anchor)
            null = mi.has_flag(si.bsdf().flags(), mi.BSDFFlags.Null)
            path.open = dr.select(crosses, null, path.open)

        def lamp_density(self, scene, ds, path):
            found = super().lamp_density(scene, ds, path)
            if not self.around.lit:
                return found
            return found * self.around.lamps.density(ds.emitter, path.flight, path.active)

        def scattered(self, path, si, bs, where):
            super().scattered(path, si, bs, where)
            path.flight.T = dr.select(where, 0, path.flight.T)

        def transmittance(self, surfaces, scene, si, ds, path, lit):
            ray = si.spawn_ray_to(ds.p)
            medium = dr.select(si.is_medium_transition(), si.target_medium(ray.d), path.medium)
            return light_through(scene, surfaces, medium, ray, ds, mi.Float(0), mi.Float(FAR), lit)

        @dr.syntax
        def walk(self, around, scene, sampler, path):
            """Follow the paths that are inside media until they meet a surface, or end."""
            media, anchor, medium = around.media, path.anchor, path.medium
            walks = path.active & path.walks
            inner = media.coefficients(medium, path.ray.wavelengths, walks)
            η2 = dr.square(path.η)
            lights = walks & (path.open | around.lamps_inside) & medium.use_emitter_sampling()
            lights &= dr.max(inner.albedo) > 0
            kappa = eigenvalue(inner.reduced_albedo)
            walk = Walk.beginning(anchor, path.ray.d, path.β, path.depth, walks)
            if dr.hint(around.leaps and self.max_depth == NO_LIMIT, mode="scalar"):
                leaps = walks & (anchor.absorbed < 1)
                if leaps:
                    leap(around, sampler, anchor, inner, lights, walk, leaps)
            while dr.hint(walk.inside, label="Random walk"):
                scatters, flight = self.fly(
                    around, scene, sampler, path, medium, inner, lights, walk
                )
                # Where a scattering begins, and what it leaves.
                walk.β *= dr.select(scatters, inner.albedo, 1)
                walk.depth[scatters] += 1
                walk.inside &= ~scatters | (walk.depth < self.max_depth)
                q = mixture(walk.β)
                w, weight, pdf = sample_phase(
                    media, inner.g, q, walk.d, sampler.next_1d(), sampler.next_2d()
                )
                if dr.hint(around.lit, mode="scalar"):
                    walk.vertex = dr.select(scatters, walk.x, walk.vertex)
                    walk.pdf = dr.select(scatters, pdf, walk.pdf)
                    walk.flight = dr.select(scatters, flight, walk.flight)
                if dr.hint(around.media.similar and self.max_depth == NO_LIMIT, mode="scalar"):
                    jumps = scatters & anchor.alone & (anchor.k > 0) & ~lights
                    if dr.hint(around.clearances.known, mode="scalar"):
                        jumps = scatters & (~anchor.alone | (anchor.k > 0) & ~lights)
                    if jumps:
                        jumps = jump(around, sampler, anchor, inner, kappa, lights, walk, jumps)
                    walk.pdf = dr.select(jumps, CERTAIN, walk.pdf)
                    scatters &= ~jumps
                walk.d = dr.select(scatters, w, walk.d)
                walk.β *= dr.select(scatters, weight, 1)
                # No light is lost for ever, however long the walk: what survives has β η² = 1.
                β_max = dr.max(walk.β)
                survival = dr.minimum(η2 * β_max, PATIENT)
                decides = scatters & (walk.depth >= self.rr_depth)
                # Nothing is left of walks that single precision takes for black: no 0/0 of them.
                survives = (sampler.next_1d() < survival) & (survival >= STEP)
                walk.β = mi.Spectrum(dr.select(decides & survives, walk.β / survival, walk.β))
                walk.inside &= (~decides | survives) & (β_max != 0)
            self.come_out(walks, lights, walk, path)

        def fly(self, around, scene, sampler, path, medium, inner, lights, walk):
            """Take walks to the end of a flight; return which scatter there, and their `Flight`."""
            media, anchor, sigma_t = around.media, path.anchor, inner.sigma_t
            q = mixture(walk.β)
            sigma = chosen(q, sigma_t, sampler.next_1d()) if media.chromatic else sigma_t[0]
            # Of a channel that meets nothing, not 0/0.
            drawn = dr.select(sigma > 0, -dr.log(1 - sampler.next_1d()) / sigma, FAR)
            s = dr.select(walk.left > 0, walk.left, drawn)
            # Where nothing scatters, all goes straight on to a surface.
            straight = dr.max(inner.albedo) == 0
            s = dr.select(straight, FAR, s)
            reach = dr.select(lights, DARK / dr.min(sigma_t), 0) if around.lit else 0
            end = flight_end(scene, anchor, medium, walk, dr.maximum(s, reach), walk.inside)
            arrives = walk.inside & (end.t <= s)
            way = dr.select(end.stale, 0, dr.minimum(end.t, s))
            flight = Flight.none()
            if around.lit:
                T = dr.select(lights, dr.minimum(end.t, reach), 0)
                flight = Flight.of(walk.x, walk.d, way, T, q, sigma_t)
                lit = walk.inside & lights & ~end.stale & (walk.depth + 1 < self.max_depth)
                lit &= walk.depth + 2 >= self.min_depth
                add_light(around, scene, sampler, path, inner, flight, walk, lit)
            T = dr.exp(-sigma_t * way)
            if media.chromatic:
                f = dr.select(arrives, T, sigma_t * T)
                walk.β *= dr.select(end.stale | straight, 1, f / dr.sum(q * f))
            walk.β *= dr.select(straight, T, 1)
            scatters = walk.inside & ~arrives & ~end.stale
            walk.x = dr.select(walk.inside, dr.fma(way, walk.d, walk.x), walk.x)
            walk.n = dr.select(arrives, end.n, walk.n)
            walk.o = dr.select(arrives, end.o, walk.o)
            walk.pi = dr.select(arrives, end.pi, walk.pi)
            walk.left = dr.select(end.stale, s, 0)
            walk.start = dr.select(end.stale, end.beyond, 0)
            walk.fresh &= ~scatters
            walk.arrived |= arrives
            walk.inside &= ~arrives
            # Open surfaces let walks out of the scene.
            p = anchor.p + walk.x
            walk.inside &= dr.squared_norm(p - around.center) < dr.square(around.radius)
            return scatters, flight

        def come_out(self, walks, lights, walk, path):
            """Take what has become of walks into their paths."""
            scattered = walk.depth > path.depth
            path.active &= ~walks | walk.arrived
            path.L += walk.L
            path.β = walk.β
            path.depth = walk.depth
            path.seen |= scattered
            p = path.anchor.p + walk.x
            here = dr.zeros(mi.Interaction3f)
            here.p = path.anchor.p + walk.vertex
            path.vertex = dr.select(scattered & lights, here, path.vertex)
            path.pdf = dr.select(scattered & lights, walk.pdf, path.pdf)
            path.delta = dr.select(scattered, ~lights, path.delta)
            flight = walk.flight
            flight.o += mi.Vector3f(path.anchor.p)
            path.flight = dr.select(scattered & lights, flight, path.flight)
            path.d = walk.d
            path.pi = walk.pi
            path.probes = walk.arrived & ~walk.pi.is_valid()
            o = dr.fma(-4 * tolerance(p, path.anchor.extent), walk.n, p)
            probe = mi.Ray3f(o, walk.n, path.ray.time, path.ray.wavelengths)
            ray = mi.Ray3f(walk.o, walk.d, path.ray.time, path.ray.wavelengths)
            ray = dr.select(path.probes, probe, ray)
            path.ray = dr.select(walk.arrived, ray, path.ray)

        def to_string(self):
            return super().to_string().replace("SurfacePath", "RandomWalk")

    return RandomWalk
