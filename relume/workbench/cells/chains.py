"""Chains: what Metropolis renders may miss, stick to, or do with next to nothing.

The bootstrap finds no light, or one path of a million; a picture of one pixel; two chains.
"""

from __future__ import annotations

import math

import mitsuba as mi

from relume.workbench.cells.dictionaries import camera, rgb
from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import box, diffuse, emission, text

CHAINS = ("pssmlt", "erpt")


@family("albedo", (0, 0.5, 0.9, 0.99, 0.999), *CHAINS)
def white_room_of_chains(albedo: float) -> Case:
    """Inside a closed box that emits 1 the radiance is L = 1 + albedo L = 1 / (1 - albedo); deep
    paths draw more numbers than a chain keeps."""
    walls = box(*diffuse(albedo), emission(1))
    return Case(text(*walls, camera=(0, 0, 0.5), angle=60), 1 / (1 - albedo), spp=64)


@family("side of the picture [pixel]", (1, 2, 16, 128), *CHAINS)
def small_films(side: float) -> Case:
    """As white room: L = 1 / (1 - 0.5) = 2, for films of one pixel and more."""
    walls = box(*diffuse(0.5), emission(1))
    scene = text(*walls, camera=(0, 0, 0.5), angle=60, IMAGE=f"{side} {side}")
    return Case(scene, 2.0, spp=max(16, 4096 // int(side) ** 2))


@family("radiance of the walls", (0.0, 1e-30, 1e-12, 1e12, 1e30), *CHAINS)
def no_light_to_strong_light(radiance: float) -> Case:
    """A black box that emits L shows L; nothing is found by the bootstrap where L = 0."""
    walls = box(*diffuse(0), emission(radiance))
    scene = text(*walls, camera=(0, 0, 0.5), angle=60)
    return Case(scene, radiance, scale=radiance or 1.0)


@family("angle of the light [degree]", (30.0, 10.0, 3.0, 1.0), *CHAINS)
def found_by_chance(angle: float) -> Case:
    """A floor of albedo 1/2 below a disk of the angle t about the normal, for which no light
    sampling looks: 1 / sin² t paths are traced until one finds it. The irradiance is
    pi sin² t times the disk's radiance, 2 / sin² t, so that the floor's radiance is 1."""
    t = math.radians(angle)
    T = mi.ScalarTransform4f
    lamp = T().translate([0, 1, 0]).rotate([1, 0, 0], 90).scale(math.tan(t))
    floor = T().rotate([1, 0, 0], -90).scale(0.05)
    scene = {
        "type": "scene",
        "integrator": {"type": "pssmlt", "paths": {"type": "path", "max_depth": 2}},
        "sensor": camera((0.5, 0.1, 0), (0, 0, 0), 0.05),
        "floor": {
            "type": "rectangle",
            "to_world": floor,
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.5)},
        },
        "lamp": {
            "type": "disk",
            "to_world": lamp,
            "light": {
                "type": "area",
                "radiance": rgb(2 / math.sin(t) ** 2),
                "sampling_weight": 0.0,
            },
        },
        "dark": {"type": "constant", "radiance": rgb(0.0)},
    }
    return Case(scene, 1.0, spp=256)


@family("chains", (2, 16, 1024), "pssmlt")
def few_chains(chains: float) -> Case:
    """As white room: L = 1 / (1 - 0.8) = 5, by two chains and by a thousand."""
    paths = {"type": "path"}
    scene = {
        "type": "scene",
        "integrator": {"type": "pssmlt", "chains": chains, "fallback": False, "paths": paths},
        "sensor": camera((0, 0, 0.5), (0, 0, 0), 60),
        "cube": {
            "type": "cube",
            "flip_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.8)},
            "light": {"type": "area", "radiance": rgb(1.0)},
        },
    }
    return Case(scene, 5.0, spp=128)
