from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.common import path_depths
from relume.integrators.eyesubpaths import trace_eye
from relume.integrators.lightsubpaths import trace_light
from relume.integrators.lightvertices import LightCache, LightVertices
from relume.integrators.sensorconnections import Pinhole
from relume.integrators.splats import SplatFilm
from relume.integrators.subpaths import Transport
from relume.sensors.colors import linear_rgb
from relume.sensors.pixelsamples import position_in_pixel

LIGHT_PATHS = 0.25
"""Light subpaths for each path of the camera."""

MOST_LIGHT_PATHS = 2**16
"""Most light subpaths of a launch."""

LEAST_LIGHT_PATHS = 2**10
"""Least light subpaths of a launch."""

SAMPLES_PER_LAUNCH = 2**18
"""Paths of the camera of a launch, at most, if there is one for each pixel."""

GROUPS = 32
"""Sets of wavelengths of a launch, in spectral variants."""

PILOT = 2**12
"""Light subpaths from which the mean number of their vertices is found."""


def define() -> type[mi.AdjointIntegrator]:
    """Return the plugin's class for the variant in use."""

    class BDPT(mi.AdjointIntegrator):
        def __init__(self, props):
            mi.AdjointIntegrator.__init__(self, props)
            if not dr.is_jit_v(mi.Float) or mi.is_polarized:
                raise ValueError(
                    f"bdpt does not work in {mi.variant()}, but in llvm_ad_rgb, "
                    "llvm_ad_mono, llvm_ad_spectral and their counterparts cuda_ad_*"
                )
            self.max_depth, self.rr_depth = path_depths(props)
            self.min_depth = props.get("min_depth", 1)
            if self.min_depth < 1:
                raise ValueError(f"min_depth is {self.min_depth}, but must be 1 or more")
            self.hide_emitters = props.get("hide_emitters", False)
            self.only = None

        def aov_names(self):
            return []

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            spp = spp or sensor.sampler().sample_count()
            entropy = int(np.array(seed).ravel()[0])
            film = sensor.film()
            with dr.suspend_grad():
                picture = self.render_image(scene, sensor, entropy, spp)
            film.prepare([])
            alpha = bool(film.flags() & +mi.FilmFlags.Alpha)
            block = film.create_block()
            columns = [picture[:, :3], picture[:, 3:]][: 1 + alpha]
            tensor = np.column_stack([*columns, np.ones(len(picture))]).astype(np.float32)
            block.tensor()[:] = mi.TensorXf(tensor.ravel(), block.tensor().shape)
            film.put_block(block)
            if develop:
                return film.develop()
            film.schedule_storage()
            return mi.TensorXf()

        def render_image(self, scene, sensor, seed, spp):
            """Mean colours and alpha: (pixels, 4) float64."""
            film = sensor.film()
            size = tuple(int(x) for x in film.crop_size())
            pixels = size[0] * size[1]
            pinhole = Pinhole.of(sensor, size)
            transport = Transport(scene, pinhole and pinhole.prepared(), self)
            vertices, scale = self.pilot(transport, sensor)
            transport.mean_vertices, transport.scale = vertices, scale
            per_launch = max(1, SAMPLES_PER_LAUNCH // pixels)
            sums = np.zeros((pixels, 4))
            for launch, first in enumerate(range(0, spp, per_launch)):
                count = min(per_launch, spp - first)
                own = np.random.SeedSequence((seed, launch)).generate_state(2)
                sums += count * self.launch(transport, sensor, [int(x) for x in own], count)
            return sums / spp

        def pilot(self, transport, sensor):
            """Mean number of vertices of a light subpath, and what it shows to the camera."""
            transport.set_ratios(1, 1)
            film = SplatFilm(sensor.film(), 1e-30)
            _, stored, shown = self.light(transport, sensor, 1, PILOT, film)
            dr.eval(stored, shown)
            mean, brings = (x.numpy().astype(float).mean() for x in (stored, shown))
            return 2.0 ** round(np.log2(max(mean, 0.25))), brings

        def light(self, transport, sensor, seed, count, film):
            """Trace light subpaths: `LightVertices`, how many each has kept, what each shows."""
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(seed, count)
            vertices = LightVertices(count, transport.partials)
            lane = dr.arange(mi.UInt32, count)
            u = self.wavelength_sample(lane // (count // GROUPS), seed)
            nowhere = dr.zeros(mi.SurfaceInteraction3f)
            wavelengths, weight = sensor.sample_wavelengths(nowhere, u)
            stored, shown = trace_light(
                transport, sampler, wavelengths, weight, vertices, film, count
            )
            return vertices, stored, shown

        def wavelength_sample(self, group, seed):
            """The variate of the wavelengths of a group: evenly spread over the groups."""
            shift = np.random.default_rng(seed).random()
            return (mi.Float(group) + dr.opaque(mi.Float, shift)) / GROUPS

        def launch(self, transport, sensor, seeds, spp):
            """Mean colours and alpha by `spp` samples of each pixel: (pixels, 4)."""
            film = sensor.film()
            width, height = (int(x) for x in film.crop_size())
            pixels = width * height
            wanted = min(LIGHT_PATHS * pixels * spp, MOST_LIGHT_PATHS)
            paths = max(LEAST_LIGHT_PATHS, math.ceil(wanted / GROUPS) * GROUPS)
            transport.set_ratios(paths / (pixels * spp), 1 / transport.mean_vertices)

            # -------------------------- from the lamps --------------------------

            splats = SplatFilm(film, transport.scale)
            vertices, stored, _ = self.light(transport, sensor, seeds[0], paths, splats)
            dr.eval(stored, vertices.numbers, splats.sums)
            cache = LightCache(vertices, stored, GROUPS if mi.is_spectral else 1)

            # -------------------------- from the camera --------------------------

            sampler = sensor.sampler().clone()
            sampler.set_sample_count(spp)
            sampler.set_samples_per_wavefront(spp)
            sampler.seed(seeds[1], pixels * spp)
            per_pixel, columns, seed = (
                dr.opaque(mi.UInt32, x) for x in (spp, width, seeds[1] & 0xFFFFFFFF)
            )
            lane = dr.arange(mi.UInt32, pixels * spp)
            pixel = lane // per_pixel
            y = pixel // columns
            corner = mi.Point2f(pixel - y * columns, y)
            position = (corner + position_in_pixel(sensor, sampler.next_2d())) / splats.size
            lens = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Point2f(0.5)
            group, u = mi.UInt32(0), mi.Float(0)
            if mi.is_spectral:  # a pixel's samples are spread over the groups
                group = (lane - pixel * per_pixel) * GROUPS // per_pixel
                group = (group + mi.sample_tea_32(pixel, seed)[0]) % GROUPS
                u = self.wavelength_sample(group, seeds[0])
            ray, weight = sensor.sample_ray_differential(
                sensor.shutter_open(), u, position, lens
            )
            L, seen = trace_eye(transport, sampler, ray, cache, group)
            color = linear_rgb(L * weight, ray.wavelengths)
            channels = [mi.Float64(x) for x in (*color, dr.select(seen, mi.Float(1), 0))]
            channels = [x + dr.zeros(mi.Float64, pixels * spp) for x in channels]
            dr.eval(channels)  # at once: a sum of what is not there yet runs the kernel
            found = np.stack([dr.block_sum(x, spp).numpy() for x in channels], -1) / spp
            found[:, :3] += splats.picture() * (pixels / paths)
            return found

        def to_string(self):
            return (
                f"BDPT[min_depth={self.min_depth}, max_depth={self.max_depth}, "
                f"rr_depth={self.rr_depth}, hide_emitters={self.hide_emitters}]"
            )

    return BDPT
