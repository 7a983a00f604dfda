r"""Bidirectional path tracing with a cache of light vertices (``bdpt``)
====================================================================

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
   * - ``merge_radius``
     - float
     - Radius in which vertices of both ends are merged [widths of a pixel in the middle of the
       film, at the median distance of what is lit]; 0 for none, 0.5 is a good one. Default: 0.

Paths begin at the lamps and at the camera. The picture is that of ``surfacepath``, with masks,
lamps with masks, backdrops and dispersion as there, but for one kind of light that no path of a
camera finds: that of lamps without size (spots, beams, suns) which mirrors or glass send on to
matt surfaces. A path of n edges is found in up to n + 1 ways, with s vertices from the lamp and t
from the camera:

- s = 0: it meets a lamp. s = 1: emitter sampling.
- t = 1: each vertex of a light subpath that can be seen is connected to the camera, if it has a
  lens to a point of that.
- s, t > 1: each vertex of the camera's subpaths is connected with one vertex, drawn from a cache of
  those of all light subpaths (Davidovič et al.). There is one light subpath for four
  samples, and one for each in scenes with lamps without size.
- With ``merge_radius``, vertices of the camera are merged with all light vertices near them, if
  neither of their two edges can be connected.

The balance heuristic weighs them by

.. math::
    w_{s,t} = \frac{n_{s,t}\,p_{s,t}}{\sum_{i + j = s + t} n_{i,j}\,p_{i,j}}, \qquad
    n_{0,t} = n_{1,t} = 1, \quad n_{s,1} = r, \quad n_{s,t} = \kappa

with p the density of the path by that way, r the light subpaths for each sample, and
:math:`\kappa` one over their mean number of vertices, of which a few thousand subpaths, always the
same, tell the power of two. Sums of ratios of densities are carried along the subpaths (Georgiev).

**Merging.** Light that mirrors or glass hide from both ends, such as a caustic seen in a mirror or
the ground of a pool, is found by merging alone (Georgiev et al.), but for lamps that are hit by
chance. A vertex takes the flux of the N light
subpaths within the radius R as arriving there,

.. math::
    L = \frac{1}{\pi R^2 N} \sum_j f\,\Phi_j\,w_j, \qquad
    n = \frac{\pi R^2 N}{\max(1, \pi R_{px}^2\, m)}

with n the samples of this way in the weights: the m samples of a pixel share light subpaths. Light
is blurred within R, and what is merged is biased thereby. R falls with the eighth root of the
number of launches (Knaus and Zwicker), so the mean of all passes is right in the end: who renders
in passes sets the attribute ``pass_index``, 0 for the first.

**Adjoint.** Light subpaths scatter by ``TransportMode.Importance``, without the
:math:`(n_1/n_2)^2` that radiance has, and with the factor

.. math::
    \frac{|\omega_i \cdot n_s|\,|\omega_o \cdot n_g|}{|\omega_i \cdot n_g|\,|\omega_o \cdot n_s|}

for shading normals :math:`n_s` (Veach, eq. 5.19).

**What cannot be reached.** Emitters of which no light subpath can begin (such as a shape that tells
no points of itself) and cameras without a pinhole and without the lens of ``thinlens`` or
``screencamera`` (nor if rays of the latter leave its lens on both sides) are left to the other
ways, whose weights then are those of path tracing, or of path tracing with connections.
Media are not rendered, and there are no derivatives: take ``surfacepath``, or ``prb``.

**Numbers.** Paths of the camera draw from the sensor's sampler, and from ``owen`` in all renders of
relume; subpaths of the lamps draw independent numbers. Light that arrives at the film from lamps is
summed in integers, so the picture depends on scene, parameters, seed and samples alone, bit for
bit. Positions on the film are drawn from its reconstruction filter, with signs. In spectral
variants a render has 32 sets of wavelengths evenly spread, shared by a 32nd of all subpaths each.

**Limits.** Without merging, caustics seen in mirrors and through glass are as hard to find as for a
path tracer, and those of lamps without size are missing there. Rough glass and mirrors in front of
caustics are left to connections. Light of meshes with smooth normals that shine is as stock emitter
sampling has it.

**Source.** E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, chapters 5
and 10; T. Davidovič, J. Křivánek, M. Hašan and P. Slusallek, "Progressive Light Transport
Simulation on the GPU", ACM Transactions on Graphics 2014; I. Georgiev, J. Křivánek, T. Davidovič
and P. Slusallek, "Light Transport Simulation with Vertex Connection and Merging", ACM Transactions
on Graphics 2012, and I. Georgiev, "Implementing Vertex Connection and Merging", Saarland University
2012; C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", ACM
Transactions on Graphics 2011.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'bdpt', 'max_depth': 16}
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.bidirectionalpaths import BidirectionalSampler
from relume.integrators.common import NO_LIMIT, path_depths
from relume.integrators.emission import bounding_sphere
from relume.integrators.eyesubpaths import trace_eye
from relume.integrators.lightstarts import Emission
from relume.integrators.lightsubpaths import trace_light
from relume.integrators.lightvertices import LightCache, LightVertices
from relume.integrators.merging import LightGrid, pixel_width, radius_of
from relume.integrators.metropolis import fill
from relume.integrators.sensorconnections import Pinhole
from relume.integrators.splats import SplatFilm
from relume.integrators.subpaths import Transport
from relume.parameters import NOT_NEGATIVE, Range, flag, number, whole
from relume.sensors.colors import linear_rgb

LIGHT_PATHS, LIGHT_PATHS_OF_POINTS = 0.25, 1.0
"""Light subpaths for each path of the camera; where lamps have no size only they find caustics."""

MOST_LIGHT_PATHS = 2**17
"""Most light subpaths of a launch."""

LEAST_LIGHT_PATHS = 2**10
"""Least light subpaths of a launch."""

SAMPLES_PER_LAUNCH = 2**18
"""Paths of the camera of a launch, at most, if there is one for each pixel."""

GROUPS = 32
"""Sets of wavelengths of a launch, in spectral variants."""

PILOT = 2**12
"""Light subpaths from which the mean number of their vertices is found."""

NO_GRADIENTS = "bdpt has no derivatives: differentiate by surfacepath, or by prb"


@dataclass(frozen=True)
class Pilot:
    """What a few light subpaths tell.

    Attributes:
        vertices: mean number that one has, a power of two.
        shown: mean luminance that one shows to the camera.
        pixel: width that one sees at their vertices, 0 where none are merged.
    """

    vertices: float
    shown: float
    pixel: float


def light_paths(emission: Emission) -> float:
    """Light subpaths for each path of the camera."""
    return LIGHT_PATHS_OF_POINTS if emission.has_points else LIGHT_PATHS


def define() -> type[mi.AdjointIntegrator]:
    """Return the plugin's class for the variant in use."""

    class BDPT(mi.AdjointIntegrator):
        takes_points = True  # `render_image` draws from the sampler that it is given

        def __init__(self, props):
            mi.AdjointIntegrator.__init__(self, props)
            self.max_depth, self.rr_depth = path_depths(props, roulette=2)
            self.min_depth = whole(props, "min_depth", 1, Range(1))
            self.hide_emitters = flag(props, "hide_emitters", False)
            self.merge_radius = number(props, "merge_radius", 0.0, NOT_NEGATIVE)
            self.pass_index = 0
            self.only = None  # the one way (s, t) that tests want to see, with the weight 1

        def render_forward(self, *args, **kwargs):
            raise ValueError(NO_GRADIENTS)

        def render_backward(self, *args, **kwargs):
            raise ValueError(NO_GRADIENTS)

        def aov_names(self):
            return []

        def path_sampler(self, scene, sensor):
            """What traces single paths for Markov chains."""
            return BidirectionalSampler(scene, sensor, self)

        def from_camera(self):
            """The path tracer that finds the same light, but what only light subpaths find."""
            return mi.load_dict(self.as_dict("surfacepath", self.min_depth, self.max_depth))

        def with_depth_range(self, min_depth, max_depth):
            """The same integrator for the light of paths of some lengths alone."""
            return mi.load_dict(self.as_dict("bdpt", min_depth, max_depth))

        def as_dict(self, kind, min_depth, max_depth):
            """An integrator of another kind for paths of some lengths alone."""
            longest = min(max_depth, self.max_depth)
            return {
                "type": kind,
                "min_depth": max(min_depth, self.min_depth),
                "max_depth": -1 if longest == NO_LIMIT else longest,
                "rr_depth": self.rr_depth,
                "hide_emitters": self.hide_emitters,
            }

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            return self.render_by(self.render_image, scene, sensor, seed, spp, develop)

        def render_by(self, render_image, scene, sensor, seed, spp, develop):
            """`render`, with the pixels by a function like `render_image`."""
            sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            spp = spp or sensor.sampler().sample_count()
            entropy = int(np.array(seed).ravel()[0])
            film = sensor.film()
            if film.flags() & +mi.FilmFlags.Special:
                raise ValueError(f"bdpt fills films of colours, no {film.class_name()}")
            with dr.suspend_grad():
                picture = render_image(scene, sensor, entropy, spp)
            alpha = bool(film.flags() & +mi.FilmFlags.Alpha)
            fill(film, [picture[:, :3], picture[:, 3]][: 1 + alpha])
            if develop:
                return film.develop()
            film.schedule_storage()
            return mi.TensorXf()

        def render_image(self, scene, sensor, seed, spp, points=None):
            """Mean colours and alpha: (pixels, 4) float64.

            Args:
                scene: `mi.Scene`.
                sensor: its sensor.
                seed: non-negative integer.
                spp: samples of a pixel.
                points: from the pixel of each lane and the number of its sample, both
                    ``mi.UInt32``, to the sampler of the camera's paths; None for the sensor's.
            """
            film = sensor.film()
            width, height = (int(x) for x in film.crop_size())
            pixels = width * height
            pinhole = Pinhole.of(sensor, (width, height))
            transport = Transport(scene, pinhole.prepared() if pinhole else None, self)
            pilot = self.pilot(transport, sensor)
            per_launch = max(1, SAMPLES_PER_LAUNCH // pixels)
            before = self.pass_index * math.ceil(spp / per_launch)
            sums = np.zeros((pixels, 4))
            for launch, first in enumerate(range(0, spp, per_launch)):
                count = min(per_launch, spp - first)
                radius = radius_of(self.merge_radius, before + launch)
                own = np.random.SeedSequence((seed, launch)).generate_state(2)
                seeds = [int(x) for x in own]
                samples = range(first, first + count)
                found = self.launch(transport, sensor, pilot, seeds, samples, points, radius)
                sums += count * found
            return sums / spp

        def pilot(self, transport, sensor):
            """What a few light subpaths tell: `Pilot`."""
            transport.set_ratios(1, 1, 1)
            vertices, *found = self.light(transport, sensor, 1, PILOT, SplatFilm(sensor.film(), 1))
            dr.eval(found)
            stored, shown, power = (x.numpy().astype(float).mean() for x in found)
            if not shown and transport.pinhole:  # as if it lit all of the scene
                _, radius = bounding_sphere(transport.scene)
                shown = power / float(transport.pinhole.det[0]) / radius**2
            width = pixel_width(sensor, vertices, found[0]) if transport.ν is not None else 0.0
            if not width:  # no light is there
                transport.ν = None
            return Pilot(2.0 ** round(np.log2(max(stored, 0.25))), shown, width)

        def light(self, transport, sensor, seed, count, film):
            """Trace light subpaths: `LightVertices`, and what `trace_light` returns."""
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(seed, count)
            vertices = LightVertices(count, transport.partials)
            if not transport.emission.emits:
                nothing = dr.zeros(mi.Float, count)
                return vertices, mi.UInt32(nothing), nothing, nothing
            lane = dr.arange(mi.UInt32, count)
            u = self.wavelength_sample(lane // dr.opaque(mi.UInt32, count // GROUPS), seed)
            nowhere = dr.zeros(mi.SurfaceInteraction3f)
            wavelengths, weight = sensor.sample_wavelengths(nowhere, u)
            found = trace_light(transport, sampler, wavelengths, weight, vertices, film, count)
            return vertices, *found

        def wavelength_sample(self, group, seed):
            """The variate of the wavelengths of a group: evenly spread over the groups."""
            shift = np.random.default_rng(seed).random()
            return (mi.Float(group) + dr.opaque(mi.Float, shift)) / GROUPS

        def launch(self, transport, sensor, pilot, seeds, samples, points, radius):
            """Mean colours and alpha by a range of the samples of each pixel: (pixels, 4).

            Vertices are merged in a radius in pixels.
            """
            spp = len(samples)
            film = sensor.film()
            width, height = (int(x) for x in film.crop_size())
            pixels = width * height
            wanted = light_paths(transport.emission) * pixels * spp
            wanted = min(wanted, MOST_LIGHT_PATHS)
            paths = max(LEAST_LIGHT_PATHS, math.ceil(wanted / GROUPS) * GROUPS)
            groups = GROUPS if mi.is_spectral else 1
            # Samples of a pixel that merge with the same light vertices count as one.
            sharing = max(1, math.pi * radius**2 * spp / groups)
            disks = paths / groups * math.pi * (radius * pilot.pixel) ** 2
            transport.set_ratios(paths / (pixels * spp), 1 / pilot.vertices, disks / sharing)

            # -------------------------- from the lamps --------------------------

            splats = SplatFilm(film, pilot.shown)
            vertices, stored, *_ = self.light(transport, sensor, seeds[0], paths, splats)
            dr.eval(stored, vertices.numbers, splats.sums)
            cache = LightCache(vertices, stored, groups)
            grid = None
            if transport.ν is not None:
                grid = LightGrid(vertices, stored, cache.slots, groups, radius * pilot.pixel)

            # -------------------------- from the camera --------------------------

            per_pixel, columns, seed = (
                dr.opaque(mi.UInt32, x) for x in (spp, width, seeds[1] & 0xFFFFFFFF)
            )
            lane = dr.arange(mi.UInt32, pixels * spp)
            pixel = lane // per_pixel
            if points is None:
                sampler = sensor.sampler().clone()
                sampler.set_sample_count(spp)
                sampler.set_samples_per_wavefront(spp)
                sampler.seed(seeds[1], pixels * spp)
            else:
                first = dr.opaque(mi.UInt32, samples.start)
                sampler = points(pixel, lane - pixel * per_pixel + first)
            y = pixel // columns
            corner = mi.Point2f(pixel - y * columns, y)
            within, sign = splats.filter.place(corner, sampler.next_2d(), splats.size)
            position = (corner + within) / splats.size
            lens = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Point2f(0.5)
            group, u = mi.UInt32(0), mi.Float(0)
            if mi.is_spectral:  # a pixel's samples are spread over the groups
                group = (lane - pixel * per_pixel) * GROUPS // per_pixel
                group = (group + mi.sample_tea_32(pixel, seed)[0]) % GROUPS
                u = self.wavelength_sample(group, seeds[0])
            ray, weight = sensor.sample_ray_differential(sensor.shutter_open(), u, position, lens)
            L, seen = trace_eye(transport, sampler, ray, cache, grid, group)
            color = linear_rgb(L * weight * sign, ray.wavelengths)
            channels = [mi.Float64(x) for x in (*color, dr.select(seen, sign, 0))]
            channels = [x + dr.zeros(mi.Float64, pixels * spp) for x in channels]
            dr.eval(channels)  # at once: a sum of what is not there yet runs the kernel
            found = np.stack([dr.block_sum(x, spp).numpy() for x in channels], -1) / spp
            found[:, :3] += splats.picture() * (pixels / paths)
            return found

        def to_string(self):
            return (
                f"BDPT[min_depth={self.min_depth}, max_depth={self.max_depth}, "
                f"rr_depth={self.rr_depth}, hide_emitters={self.hide_emitters}, "
                f"merge_radius={self.merge_radius}]"
            )

    return BDPT
