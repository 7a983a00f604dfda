r"""Light in curved space (``curvedspace``)
=======================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``metric``
     - string
     - ``schwarzschild``, a black hole without spin, ``kerr``, one that spins, or ``wormhole``.
       Default: schwarzschild.
   * - ``center``
     - point
     - Centre of the black hole [scene unit]. Default: 0, 0, 0.
   * - ``mass``
     - float
     - Mass M of the black hole as a length, half the Schwarzschild radius, above 0 [scene unit].
       Default: 1.
   * - ``spin``
     - float
     - For ``kerr``, the angular momentum a about +Z, within -1 and 1 [M]. Default: 0.
   * - ``observer``
     - string
     - Who sees rays from the sensor near a black hole: ``coordinate``, in whose sight directions
       are those of the scene's coordinates, or ``static``, an observer at rest, who measures
       angles. Default: coordinate.
   * - ``mouth_in``, ``mouth_out``
     - point
     - Centres of the mouths of a wormhole, of side 1 and side 2 [scene unit]. Default: 0, 0, 0.
   * - ``rho``
     - float
     - Radius of a wormhole's throat, above 0 [scene unit]. Default: 1.3.
   * - ``a``
     - float
     - Half the length of the throat, 0 or more [scene unit]. Default: 0.5.
   * - ``W``
     - float
     - Width of the zone before its mouths that bends light, above 0 [scene unit]. Default: 0.05.
   * - ``other``
     - scene
     - What is on side 2 of a wormhole, in coordinates of its own, which are those of
       ``mouth_out``. Default: both mouths are in the one scene.
   * - ``start_side``
     - integer
     - Side of the sensor, 1 or 2. Default: 1.
   * - ``geodesics_max_length``
     - integer
     - Most steps of a geodesic from a sensor or surface to the next, 1 or more; -1 for no limit.
       Default: 10000.
   * - ``sky``, ``sky2``
     - emitter
     - Environments that light comes from at infinity, on side 1 and side 2. Default: those of the
       scenes.
   * - (nested)
     - integrator
     - ``surfacepath``, whose depths, roulette and ``hide_emitters`` count. Required.

Rays from the sensor and from surfaces follow the paths of light in the metric, geodesics. Each is
integrated by the method of Cash and Karp, orders 5 and 4, with steps whose error in single
precision is :math:`2 \cdot 10^{-7}` of the distance from the centre and, where there are objects,
whose chords lie within :math:`3 \cdot 10^{-4}` of it. Chords are intersected with the scene as far
as they go, surfaces see the tangent of the path where it meets them, and a ray that leaves goes on
straight once less than :math:`2 \cdot 10^{-4}` rad of its deflection are left, which are added to
first order, and meets the sky in its asymptotic direction. Inside a horizon all is black.

**Black holes.** In units in which M and the speed of light at infinity are 1,

.. math::
    x'' = -3 L^2 x / r^5, \qquad L = |x \times x'|

is the law around one without spin, with the radius r of the scene for the areal radius. One with
spin is Kerr's; the scene shows the coordinates of Boyer and Lindquist on oblate spheroids,

.. math::
    x + i y = \sqrt{r^2 + a^2} \sin\theta\, e^{i \varphi}, \qquad z = r \cos\theta,

and light is followed in those of Kerr and Schild, which have no poles. To a ``coordinate`` observer
at the distance r the shadow of a hole without spin has the half angle :math:`\sin^2\alpha =
27 / (r^2 + 54/r)`, to a ``static`` one :math:`\sin\alpha = (3 \sqrt 3 / r) \sqrt{1 - 2/r}`.

**Wormholes** join two spaces by a throat of radius :math:`\rho` and length 2 a. At the proper
distance l from its middle spheres have the radius

.. math::
    r(l) = \rho + m (x \arctan x - \tfrac12 \log(1 + x^2)), \quad
    x = 2 (|l| - a) / (\pi m), \quad m = W / 1.42953,

and, with the impact parameter :math:`\beta` of the ray, in its plane,

.. math:: l'' = \beta^2 r'(l) / r^3, \qquad \psi' = \beta / r^2.

A direction from one mouth is the same from the other, so that what is beyond is seen mirrored.
Without ``other`` a ray that a surface sends, through whichever mouth it was seen, sees the mouth
at ``mouth_in``.

**What is not there.** Light is found by hits alone: no ray can be aimed at a lamp through curved
space. Lamps are to be large, or the sky; lights without a surface give nothing. A ray of a surface
begins in the scene's coordinates, whatever ``observer`` says. Light has no shift of its frequency,
except that of ``accretiondisk``.

A geodesic that has run out of steps is taken for one that the hole keeps inside 3 M, and for one
that leaves straight on elsewhere. ``unfinished()`` of the integrator tells how many there have been
since it was asked last.

**Source.** S. Chandrasekhar, "The Mathematical Theory of Black Holes", 1983; O. James, E. von
Tunzelmann, P. Franklin and K. Thorne, "Gravitational lensing by spinning black holes in
astrophysics, and in the movie Interstellar", Classical and Quantum Gravity 32 (2015), and
"Visualizing Interstellar's Wormhole", American Journal of Physics 83 (2015).

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'curvedspace', 'metric': 'schwarzschild', 'center': [0, 0, 10],
     'nested': {'type': 'surfacepath', 'max_depth': 8}}
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators.common import NO_LIMIT, nested_integrator
from relume.integrators.metrics import metric_of
from relume.integrators.metrics.metric import REST, Geodesic
from relume.integrators.seethrough import Surfaces
from relume.parameters import Range, whole

SHORTEST = 1e-9
"""Step [M, for wormholes scene unit] below which a geodesic cannot be followed."""


def surfaces_of(scenes: list[mi.Scene]) -> Surfaces:
    """What a path tracer has to reckon with in several scenes."""
    first, *others = (Surfaces(scene) for scene in scenes)
    for other in others:
        first.see_through |= other.see_through
        first.disperse |= other.disperse
        first.masked_lamps |= other.masked_lamps
        first.solid_lamps += other.solid_lamps
        first.backdrops += other.backdrops
    return first


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""

    @dataclass
    class Path:
        """State of a path.

        What is left of the chord to the end of `g` begins at `p`, where the geodesic's tangent is
        `d`; with `advance` the geodesic moves on first, with `final` it goes on straight.
        """

        L: mi.Spectrum
        β: mi.Spectrum
        η: mi.Float
        usual: mi.Float
        depth: mi.UInt32
        seen: mi.Bool
        dispersed: mi.Bool
        delta: mi.Bool
        active: mi.Bool
        p: mi.Point3f
        d: mi.Vector3f
        side: mi.UInt32
        g: Geodesic
        steps: mi.UInt32
        open: mi.Bool
        advance: mi.Bool
        final: mi.Bool
        sky: mi.UInt32
        unfinished: mi.UInt32

    class CurvedSpace(mi.SamplingIntegrator):
        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            self.nested = nested_integrator(props)
            if type(self.nested).__name__ != "SurfacePath":
                raise ValueError("curvedspace takes a nested surfacepath")
            self.metric = metric_of(props)
            most = whole(props, "geodesics_max_length", 10000, Range(-1))
            if most == 0:
                raise ValueError(f"geodesics_max_length is {most}, but must be 1 or more, or -1")
            self.max_steps = mi.UInt32(NO_LIMIT if most == -1 else most)
            self.skies = [props.get("sky", None)]
            self.other, self.start_side = None, 1
            if self.metric.sides == 2:
                self.skies.append(props.get("sky2", None))
                self.other = props.get("other", None)
                self.start_side = whole(props, "start_side", 1, Range(1, 2))
            self.count = dr.zeros(mi.UInt32, 1)
            dr.make_opaque(self.max_steps, self.count)

        def traverse(self, cb):
            cb.put("nested", self.nested, mi.ParamFlags.Differentiable)
            parts = {"sky": self.skies[0], "sky2": self.skies[-1], "other": self.other}
            for name, part in parts.items():
                if part is not None:
                    cb.put(name, part, mi.ParamFlags.Differentiable)

        def unfinished(self):
            """How many geodesics have run out of steps since this was asked last."""
            found = int(self.count[0])
            self.count = dr.zeros(mi.UInt32, 1)
            dr.make_opaque(self.count)
            return found

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            scenes = [scene, self.other or scene][: self.metric.sides]
            surfaces = surfaces_of(scenes)
            path = self.started(scenes, ray, active)
            wavelengths = ray.wavelengths
            while dr.hint(path.active, label="Geodesics"):
                self.march(scenes, surfaces, sampler, wavelengths, path)
            dr.scatter_reduce(dr.ReduceOp.Add, self.count, path.unfinished, 0, path.unfinished > 0)
            sky = path.β * self.sky(scenes, wavelengths, path)
            return path.L + dr.select(path.sky != 0, sky, 0), path.seen, []

        def started(self, scenes, ray, active):
            """A path at its sensor."""
            shows = not self.nested.hide_emitters
            side = mi.UInt32(self.start_side)
            g = self.metric.begin(ray.o, ray.d, side, camera=True)
            path = Path(
                L=mi.Spectrum(0),
                β=mi.Spectrum(1),
                η=mi.Float(1),
                usual=mi.Float(0),
                depth=mi.UInt32(0),
                seen=mi.Bool(shows and any(self.environments(scenes))),
                dispersed=mi.Bool(False),
                delta=mi.Bool(True),
                active=mi.Bool(active) & (self.nested.max_depth > 0),
                p=mi.Point3f(ray.o),
                d=mi.Vector3f(ray.d),
                side=side,
                g=g,
                steps=mi.UInt32(0),
                open=mi.Bool(True),
                advance=mi.Bool(True),
                final=mi.Bool(False),
                sky=mi.UInt32(0),
                unfinished=mi.UInt32(0),
            )
            self.arrive(path, path.active)
            return path

        def arrive(self, path, where):
            """Look where a geodesic has come to, and whether it ends or goes on straight."""
            captured = where & self.metric.captured(path.g)
            path.active &= ~captured
            path.seen |= captured
            path.open = dr.select(where, self.metric.in_scene(path.g), path.open)
            asymptote, rest = self.metric.asymptote(path.g)
            leaves = where & (rest < REST)
            path.final |= leaves
            path.d = dr.select(where, self.metric.direction(path.g), path.d)
            path.d = dr.select(leaves, asymptote, path.d)

        @dr.syntax
        def march(self, scenes, surfaces, sampler, wavelengths, path):
            """Follow one chord of the geodesic, and scatter where it meets a surface."""
            has_shapes = any(scene.shapes() for scene in scenes)
            g, taken = self.metric.step(path.g, has_shapes)
            moves = path.advance & ~path.final
            path.g = dr.select(moves, g, path.g)
            path.steps += 1
            there = path.active & (taken | ~moves)
            hit = mi.Bool(False)
            begun = mi.Bool(False)
            if dr.hint(has_shapes, mode="scalar"):
                chord = self.metric.point(path.g, path.side) - path.p
                length = dr.norm(chord)
                ray = mi.Ray3f(path.p, dr.select(path.final, path.d, chord / length))
                ray.maxt = dr.select(path.final, dr.largest(mi.Float), length)
                ray.wavelengths = wavelengths
                tests = there & path.open
                pi = self.intersect(scenes, ray, path.side, tests)
                hit = tests & pi.is_valid()
                if hit:
                    begun = self.meet(surfaces, sampler, path, ray, pi, length)

            on = there & ~hit
            gone = on & path.final
            path.sky = dr.select(gone, path.side, path.sky)
            path.active &= ~gone
            on &= ~path.final
            path.side = dr.select(on, self.metric.side(path.g), path.side)
            path.p = dr.select(on, self.metric.point(path.g, path.side), path.p)
            path.advance |= on
            self.arrive(path, on | begun)
            self.give_up(path)

        def intersect(self, scenes, ray, side, active):
            """What chords meet, each in the scene of its side."""
            if self.other is None:
                return scenes[0].ray_intersect_preliminary(ray, coherent=False, active=active)
            near, far = (
                scene.ray_intersect_preliminary(ray, coherent=False, active=active & (side == i))
                for i, scene in enumerate(scenes, 1)
            )
            return dr.select(side == 1, near, far)

        def give_up(self, path):
            """End geodesics that have run out of steps."""
            out = path.active & ~path.final
            out &= (path.steps >= self.max_steps) | ~(path.g.h > SHORTEST)
            bound = out & self.metric.bound(path.g)
            path.unfinished[out] += 1
            path.active &= ~bound
            path.seen |= bound
            path.final |= out

        def meet(self, surfaces, sampler, path, ray, pi, length):
            """Add the emission of a surface that a chord meets, and scatter there.

            Returns:
                Whether a new geodesic has begun.
            """
            si = pi.compute_surface_interaction(ray, mi.RayFlags.All)
            bend = dr.select(path.final, 0, si.t / length)
            tangent = dr.normalize(dr.lerp(path.d, self.metric.direction(path.g), bend))
            # A grazing tangent is not to come from behind.
            same = dr.dot(tangent, si.n) * dr.dot(ray.d, si.n) > 0
            tangent = dr.select(same, tangent, ray.d)
            si.wi = si.to_local(-tangent)
            dark = self.metric.dark(si.p)
            lit = ~dark
            bsdf = si.bsdf()
            hidden = lit & self.nested.hidden(si, path)
            T = bsdf.eval_null_transmission(si, lit) if surfaces.see_through else mi.Spectrum(0)
            self.add_emission(surfaces, si, T, path, lit & ~hidden)

            goes_on = lit & ~hidden & (path.depth + 1 < self.nested.max_depth)
            goes_on &= ~surfaces.unlit(si.shape, path.delta)
            scatters = mi.Bool(goes_on)
            if surfaces.see_through:
                scatters |= lit & ~hidden & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
            ctx = mi.BSDFContext()
            if surfaces.disperse:
                ctx.type_mask |= HERO_WAVELENGTH
            bs, weight = bsdf.sample(ctx, si, sampler.next_1d(), sampler.next_2d(), scatters)
            if surfaces.disperse:
                parts = scatters & ~path.dispersed & ((bs.sampled_type & HERO_WAVELENGTH) != 0)
                weight *= dr.select(parts, mi.Float(len(mi.Spectrum())), 1)
                path.dispersed |= parts
            passes = hidden
            if surfaces.see_through:
                passes |= scatters & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            weight = dr.select(hidden, 1, weight)

            path.seen |= ~passes
            path.depth[~passes] += 1
            delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            path.delta = dr.select(passes, path.delta, delta)
            self.nested.roulette(
                sampler, path, weight, dr.select(passes, 1, bs.eta), passes, goes_on
            )
            out = si.spawn_ray(dr.select(passes, ray.d, si.to_world(bs.wo)))
            path.p = out.o
            path.d = dr.select(passes, tangent, out.d)
            path.advance = ~passes
            path.final &= passes
            path.steps = dr.select(passes, path.steps, 0)
            if self.other is None:  # in one room, mirrors show one wormhole
                path.side = dr.select(passes, path.side, 1)
            g = self.metric.begin(out.o, out.d, path.side, camera=False)
            path.g = dr.select(passes, path.g, g)
            return ~passes

        def add_emission(self, surfaces, si, T, path, shown):
            """Add the light of the emitter that a path has met."""
            shown &= path.depth + 1 >= self.nested.min_depth
            Le = si.shape.emitter().eval(si, shown)
            if surfaces.masked_lamps:
                Le *= surfaces.shining(si.shape, T)
            path.L[shown] = dr.fma(path.β, Le, path.L)

        def environments(self, scenes):
            """The skies of the sides."""
            found = zip(self.skies, scenes, strict=True)
            return [scene.environment() if sky is None else sky for sky, scene in found]

        def sky(self, scenes, wavelengths, path):
            """What paths get that have left."""
            shown = path.depth + 1 >= self.nested.min_depth
            if self.nested.hide_emitters:
                shown &= path.depth > 0
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi = -path.d
            si.wavelengths = wavelengths
            L = mi.Spectrum(0)
            for side, sky in enumerate(self.environments(scenes), 1):
                if sky is not None:
                    here = shown & (path.sky == side)
                    L = dr.select(here, sky.eval(si, here), L)
            return L

        def to_string(self):
            parts = {"metric": type(self.metric).__name__, "nested": self.nested}
            parts |= self.metric.parameters()
            parts |= {"geodesics_max_length": self.max_steps, "start_side": self.start_side}
            parts |= {"sky": self.skies[0], "sky2": self.skies[-1], "other": self.other}
            return f"CurvedSpace[{', '.join(f'{name}={part}' for name, part in parts.items())}]"

    return CurvedSpace
