"""What else is seen in each pixel than light: albedo, normal, depth, position and object.

Layers of OpenEXR pictures, with the names that Blender and Nuke give them: `albedo.R`, `normal.X`,
`depth.Z`. Albedo and normal are means over the pixel, of the first surface that is not simply
crossed. The others are those of one ray through its middle, as means of two objects' depths are the
depth of neither; the aperture counts as a pinhole there.

Guides for denoising are albedo and normal behind mirrors and clear glass, too: what is seen in them
has edges of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.layer_names import LAYERS
from relume.sensors.colors import linear_rgb
from relume.sensors.pixelsamples import position_in_pixel
from relume.session import SAMPLES_PER_LAUNCH, CannotRender, Scene, Session

OBJECTS = "relume.objects"
"""Name of the text that tells the names of the numbers of `object.X`."""

GUIDES = ("denoising_albedo", "denoising_normal")

SPP = 32
"""Samples of a pixel of albedo and normal."""

MOST_BOUNCES = 16
"""Mirrors and panes after which a ray is given up."""

NOWHERE = 1e10
"""Depth and coordinates where nothing is seen, as Blender has them."""

SEED = 0xA0
"""Told apart from the seeds of passes."""

Planes = dict[str, np.ndarray]
"""Channels by name, (height, width) float32."""


class Layers:
    """The layers that a render is to have.

    Args:
        names: of `LAYERS`.

    Attributes:
        planes: their channels, once they are rendered.
        facts: what the picture says of them.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(dict.fromkeys(names))
        self.planes: Planes = {}
        self.facts: dict[str, str] = {}

    @property
    def missing(self) -> bool:
        """Whether they are still to be rendered."""
        return bool(self.names) and not self.planes

    def render(self, session: Session) -> None:
        """Render them; as `render_layers`."""
        self.planes = render_layers(session, self.names)
        if "object" in self.names:
            names = enumerate(object_names(session.scene), 1)
            self.facts[OBJECTS] = "\n".join(f"{number} {name}" for number, name in names)


def render_layers(session: Session, names: Iterable[str], spp: int = SPP) -> Planes:
    """Render layers of the scene that a session has loaded.

    Args:
        session: its variant is set.
        names: of `LAYERS`.
        spp: samples of a pixel of those that are means.

    Raises:
        CannotRender: the variant traces single rays.
    """
    if mi.variant().startswith("scalar"):
        raise CannotRender(f"{mi.variant()} renders no layers")
    names = set(names)
    planes: Planes = {}
    for follow, prefix in ((False, ""), (True, "denoising_")):
        if {f"{prefix}albedo", f"{prefix}normal"} & names:
            # In each of the two calls another function is traced: they are not one kernel.
            found = _rendered(session, spp, lambda *given, f=follow: mean_surface(*given, f))
            planes |= _channels(f"{prefix}albedo", found[:3])
            planes |= _channels(f"{prefix}normal", found[3:])
    if {"depth", "position", "object"} & names:
        found = _rendered(session, None, middle_surface)
        planes |= _channels("depth", found[:1])
        planes |= _channels("position", found[1:4])
        planes |= _channels("object", _numbers(session.scene)[found[4:].astype(int)])
    return {n: plane for n, plane in planes.items() if n.rpartition(".")[0] in names}


def object_names(scene: Scene) -> list[str]:
    """The objects of a scene, from number 1 on; `object_37` is that of line 37 of its file."""
    return list(dict.fromkeys(_name(shape) for shape in scene.shapes()))


# ---- what a ray sees


@dr.syntax
def mean_surface(
    scene: mi.Scene,
    sensor: mi.Sensor,
    sampler: mi.Sampler,
    corner: mi.Point2f,
    u: mi.Point2f,
    size: mi.Vector2f,
    follow: bool,
) -> list[mi.Float]:
    """Albedo, up to 1, and normal of one sample of each pixel: six `mi.Float`.

    Args:
        scene: what is seen, with the other arguments as `sample_pixels` has them.
        sensor: likewise.
        sampler: likewise.
        corner: likewise.
        u: likewise.
        size: likewise.
        follow: whether mirrors and clear glass are followed.
    """
    position = (corner + position_in_pixel(sensor, u)) / size
    lens = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Point2f(0.5)
    wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0)
    ray, weight = sensor.sample_ray(0.0, wavelength, position, lens)
    ray = mi.Ray3f(ray)
    followed = mi.BSDFFlags.Delta | mi.BSDFFlags.Null if follow else mi.BSDFFlags.Null
    throughput, albedo = mi.Spectrum(1), mi.Spectrum(0)
    normal, bounces, active = mi.Normal3f(0), mi.UInt32(0), mi.Bool(True)
    while dr.hint(active, label="First surfaces"):
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        bsdf = si.bsdf()
        meets = active & si.is_valid()
        sample, f = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d(), meets)
        # Radiance is smaller in what refracts less, by the square of the index; albedo is not.
        f = dr.clip(mi.unpolarized_spectrum(f) * dr.square(dr.select(meets, sample.eta, 1)), 0, 1)
        passes = meets & mi.has_flag(sample.sampled_type, followed) & dr.any(f > 0)
        passes &= bounces < MOST_BOUNCES
        # A lamp is as bright as its light, up to white, and so are the surroundings.
        light = si.emitter(scene, active).eval(si, active & ~passes)
        light = dr.clip(mi.unpolarized_spectrum(light), 0, 1)
        ends = active & ~passes
        albedo = dr.select(ends, throughput * dr.maximum(dr.select(meets, f, 0), light), albedo)
        facing = si.sh_frame.n * dr.sign(-dr.dot(si.sh_frame.n, ray.d))
        normal = dr.select(ends & meets, facing, normal)
        throughput = dr.select(passes, throughput * f, throughput)
        ray = dr.select(passes, si.spawn_ray(si.to_world(sample.wo)), ray)
        bounces += 1
        active = passes
    color = dr.clip(linear_rgb(albedo * weight, ray.wavelengths), 0, 1)
    return [*color, *normal]


def middle_surface(
    scene: mi.Scene,
    sensor: mi.Sensor,
    _sampler: mi.Sampler,
    corner: mi.Point2f,
    _u: mi.Point2f,
    size: mi.Vector2f,
) -> list[mi.Float]:
    """Depth, position and registry number of the shape at the middle of each pixel: five values."""
    ray, _ = sensor.sample_ray(0.0, 0.5, (corner + 0.5) / size, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    seen = si.is_valid()
    depth = dr.select(seen, si.t, NOWHERE)
    point = dr.select(seen, si.p, NOWHERE)
    shape = dr.select(seen, dr.reinterpret_array(mi.UInt32, si.shape), 0)
    return [depth, *point, mi.Float(shape)]


# ---- arrays


def _rendered(session: Session, spp: int | None, surface: Callable[..., list[Any]]) -> np.ndarray:
    """Means of what `surface` finds in `spp` samples of each pixel: (values, height, width)."""
    width, height, count = session.width, session.height, spp or 1
    rows = max(1, SAMPLES_PER_LAUNCH // (count * width))
    parts = []
    for row in range(0, height, rows):
        pixels = min(rows, height - row) * width
        sampler = session.sensor.sampler().clone()
        seed = np.random.SeedSequence((session.seed, SEED, row)).generate_state(1)[0]
        sampler.seed(int(seed), pixels * count)
        per_pixel, first = dr.opaque(mi.UInt32, count), dr.opaque(mi.UInt32, row * width)
        pixel = dr.arange(mi.UInt32, pixels * count) // per_pixel + first
        y = pixel // dr.opaque(mi.UInt32, width)
        corner = mi.Point2f(pixel - y * width, y)
        size = mi.Vector2f(*(dr.opaque(mi.Float, x) for x in (width, height)))
        with dr.suspend_grad():
            found = surface(session.scene, session.sensor, sampler, corner, sampler.next_2d(), size)
        dr.eval(found)
        parts.append([dr.block_sum(values, count).numpy() for values in found])
    means = np.concatenate([np.asarray(part) for part in parts], axis=1) / count
    return means.reshape(len(means), height, width)


def _channels(layer: str, values: np.ndarray) -> Planes:
    return {
        f"{layer}.{channel}": np.nan_to_num(plane).astype(np.float32)
        for channel, plane in zip(LAYERS[layer], values, strict=True)
    }


def _name(shape: Any) -> str:
    """The object of a shape: the parts of a mesh are one."""
    return re.sub(r"^(object_\d+)_\d+$", r"\1", shape.id())


def _numbers(scene: Scene) -> np.ndarray:
    """Numbers of objects, from 1 on, by the registry number of a shape; 0 for none."""
    names, found = object_names(scene), {0: 0}
    for shape in scene.shapes():
        registered = int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
        found[registered] = names.index(_name(shape)) + 1
    table = np.zeros(max(found) + 1, np.float32)
    table[list(found)] = list(found.values())
    return table
