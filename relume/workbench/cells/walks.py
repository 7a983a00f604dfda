"""Long paths: albedos near 1, mirrors that face each other, and where a path is cut."""

from __future__ import annotations

from relume.workbench.cells.dictionaries import camera, rgb
from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import PATHS, box, diffuse, emission, text


@family("albedo", (0, 0.5, 0.9, 0.97, 0.99, 0.999, 0.9999), *PATHS)
def white_room(albedo: float) -> Case:
    """Inside a closed box that emits 1 the radiance is L = 1 + albedo L = 1 / (1 - albedo)."""
    walls = box(*diffuse(albedo), emission(1))
    return Case(text(*walls, camera=(0, 0, 0.5), angle=60), 1 / (1 - albedo), spp=16)


@family("DEPTH, after which roulette sets in", (0, 1, 2, 8, 64, 1e3, 1e6), *PATHS)
def start_of_roulette(depth: float) -> Case:
    """As white room: L = 1 / (1 - 0.8) = 5, whenever roulette sets in."""
    walls = box(*diffuse(0.8), emission(1))
    return Case(text(*walls, camera=(0, 0, 0.5), angle=60, depth=depth), 5.0, spp=16)


@family("reflectance", (0.5, 0.9, 0.97, 0.99, 0.999, 0.9999), *PATHS)
def facing_mirrors(reflectance: float) -> Case:
    """A box of mirrors that emit 1 has L = 1 + r L = 1 / (1 - r): every path is as long as any."""
    walls = box(f"color {reflectance} {reflectance} {reflectance}", "reflection specular",
                emission(1))  # fmt: skip
    return Case(text(*walls, camera=(0, 0, 0.5), angle=60), 1 / (1 - reflectance), spp=16)


@family("max_depth", (1, 2, 3, 5, 10, 100, 1000), *PATHS)
def longest_path(max_depth: float) -> Case:
    """In a closed box of albedo 0.8 that emits 1 the paths of up to n segments carry
    1 + 0.8 + ... + 0.8^(n - 1)."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": max_depth},
        "sensor": camera((0, 0, 0.5), (0, 0, 0), 60),
        "cube": {
            "type": "cube",
            "flip_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.8)},
            "light": {"type": "area", "radiance": rgb(1.0)},
        },
    }
    return Case(scene, (1 - 0.8**max_depth) / (1 - 0.8))
