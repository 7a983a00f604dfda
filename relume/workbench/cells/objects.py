"""One translucent object, however it is stored: in instances, parts, merged with another."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from relume.workbench.cells.dictionaries import camera, rgb
from relume.workbench.cells.family import Case, family
from relume.workbench.cells.translucency import ETA, radiance, returned

ALBEDO = 0.9
MATERIAL = {
    "type": "subsurface",
    "sigma_s": rgb(ALBEDO),
    "sigma_a": rgb(1 - ALBEDO),
    "eta": ETA,
    "level": -2,
}
REACH = 500.0
"""Half the side of a slab, in free paths."""


def strip(low: float, high: float, z: float = 0.0, bsdf: Any = None) -> Any:
    """A rectangle across Z that spans [low, high] along X; by default of a material of its own."""
    properties = mi.Properties()
    properties["bsdf"] = bsdf or mi.load_dict(MATERIAL)
    mesh = mi.Mesh("strip", 4, 2, props=properties)
    corners = [(low, -REACH, z), (high, -REACH, z), (high, REACH, z), (low, REACH, z)]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(corners).astype(np.float32)
    parameters["faces"] = np.array([0, 1, 2, 0, 2, 3], np.uint32)
    parameters.update()
    return mesh


def slab(shapes: dict[str, Any], **more: Any) -> Case:
    """A slab made of shapes, seen from above under a sky of 1."""
    scene = {
        "type": "scene",
        "integrator": {"type": "dipole", "rr_depth": 100},
        "sensor": camera((0, 0, 100), (0, 0, 0), 0.01),
        "sky": {"type": "constant", "radiance": rgb(1.0)},
    }
    return Case(scene | shapes | more, radiance(returned(ALBEDO)))


def grouped(shapes: dict[str, Any], count: int) -> dict[str, Any]:
    """Instances of shapes, the first in place, the others far below."""
    found: dict[str, Any] = {"group": {"type": "shapegroup"} | shapes}
    for k in range(count):
        place = mi.ScalarTransform4f().translate([0, 0, -50.0 * k])
        reference = {"type": "ref", "id": "group"}
        found[f"instance{k}"] = {"type": "instance", "to_world": place, "group": reference}
    return found


@family("number of parts", (1, 2, 8, 32), "dipole")
def slab_of_parts(count: int) -> Case:
    """Cut into strips, meshes of their own, across the middle of what is seen: a half space of
    albedo 0.9 returns R(inf)."""
    cuts = np.linspace(-4, 4, count + 1)
    cuts[0], cuts[-1] = -REACH, REACH
    return slab({f"strip{k}": strip(cuts[k], cuts[k + 1]) for k in range(count)})


@family("number of instances", (1, 2, 5), "dipole")
def slab_in_an_instance(count: int) -> Case:
    """In a group, repeated below where no light comes: a half space returns R(inf)."""
    return slab(grouped({"a": strip(-REACH, REACH)}, count))


@family("number of parts", (2, 8), "dipole")
def instance_of_parts(count: int) -> Case:
    """Parts in a group: a half space returns R(inf)."""
    cuts = np.linspace(-4, 4, count + 1)
    cuts[0], cuts[-1] = -REACH, REACH
    strips = {f"strip{k}": strip(cuts[k], cuts[k + 1]) for k in range(count)}
    return slab(grouped(strips, 1))


@family("distance [free path]", (1e-3, 0.1, 1), "dipole")
def slab_above_a_lit_one(distance: float) -> Case:
    """A lamp between two slabs shines on the lower one alone, in one mesh with the upper one: this
    returns R(inf) of the sky."""
    bsdf = mi.load_dict(MATERIAL)
    upper, lower = (strip(-REACH, REACH, z, bsdf) for z in (0.0, -distance))
    both = mi.load_dict({"type": "merge", "a": upper, "b": lower})
    lamp = {"type": "point", "position": [0, 0, -distance / 2], "intensity": 3.0 * distance**2}
    return slab({"slabs": both}, lamp=lamp)
