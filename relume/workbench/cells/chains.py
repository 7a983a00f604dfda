"""Chains: what Metropolis renders may miss, stick to, or do with next to nothing.

The bootstrap finds no light, or one path of a million; a picture of one pixel; two chains.
"""

from __future__ import annotations

import math
from typing import Any

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


ANGLES = (30.0, 10.0, 3.0, 1.0)


def disk_over_a_floor(angle: float, integrator: dict[str, Any], weight: float) -> Case:
    """A floor of albedo 1/2, that shows 1, below a disk of the angle [degree] about the normal.

    Args:
        angle: half of what the disk subtends.
        integrator: entry of the scene.
        weight: `sampling_weight` of the lamp.
    """
    t = math.radians(angle)
    T = mi.ScalarTransform4f
    lamp = T().translate([0, 1, 0]).rotate([1, 0, 0], 90).scale(math.tan(t))
    floor = T().rotate([1, 0, 0], -90).scale(0.05)
    scene = {
        "type": "scene",
        "integrator": integrator,
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
                "sampling_weight": weight,
            },
        },
        "dark": {"type": "constant", "radiance": rgb(0.0)},
    }
    return Case(scene, 1.0, spp=256)


@family(
    "angle of the light [degree]",
    ANGLES,
    *CHAINS,
    why="One path in 1 / sin² t meets the lamp, 33 at 10 degrees and 3283 at 1 degree, and chains "
    "start only from what uniform samples find: the relative deviation of a mean of N paths is "
    "sqrt((1 / sin² t - 1) / N). A chain's mutations find no lamp that its start has not: a share "
    "of 0.25 of the 1.7e7 samples of a cell are uniform, which leaves 0.28, 0.9 and 2.8 % at 10, 3 "
    "and 1 degrees, and 0.9, 3 and 9 % for the interval of 99.9 %, as measured. The lamp is one "
    "that no emitter sampling may use; no scene file has such a lamp.",
)
def found_by_chance(angle: float) -> Case:
    """A floor of albedo 1/2 below a disk of the angle t about the normal, for which no light
    sampling looks: 1 / sin² t paths are traced until one finds it. The irradiance is
    pi sin² t times the disk's radiance, 2 / sin² t, so that the floor's radiance is 1."""
    chains = {"type": "pssmlt", "paths": {"type": "path", "max_depth": 2}}
    return disk_over_a_floor(angle, chains, 0.0)


@family("angle of the light [degree]", ANGLES, "bdpt", "surfacepath")
def found_from_both_ends(angle: float) -> Case:
    """As found by chance, but that lamps are sampled: 1."""
    return disk_over_a_floor(angle, {"type": "bdpt", "max_depth": 2}, 1.0)


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
