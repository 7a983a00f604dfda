"""Giant spheres as rooms and floors, infinite planes, and surfaces that coincide."""

from __future__ import annotations

import math

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import (
    PATHS,
    box,
    diffuse,
    emission,
    plane,
    sphere,
    text,
    uvplane,
)
from relume.workbench.cells.sizes import OFFSETS, RADII, WHITE_SKY

GIANTS = (10, 100, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8)
SIDES = tuple(tuple(sign * (k == axis) for k in range(3)) for axis in range(3) for sign in (-1, 1))
"""The six unit vectors along the axes."""


@family("radius of the walls, half side 1", GIANTS, "giant spheres")
def room_of_spheres(radius: float) -> Case:
    """Six spheres of albedo 1/2 that emit 1 bound the view on all sides: L = 1 + L / 2 = 2."""
    walls = [
        sphere([(1 + radius) * x for x in n], radius, *diffuse(0.5), emission(1)) for n in SIDES
    ]
    return Case(text(*walls, camera=(0, 0, 0.5), angle=60), 2.0)


@family("radius, camera at the height 1", GIANTS, "giant spheres")
def ground_of_a_sphere(radius: float) -> Case:
    """The top of a sphere of albedo 1/2 under a lamp as in lit floor: rho L (R/h)² = 1/2."""
    ground = sphere((0, -radius, 0), radius, *diffuse(0.5))
    lamp = sphere((0, 4, 0), 0.5, emission(64), *diffuse(0))
    return Case(text(ground, lamp, camera=(0, 1, 3), angle=0.5), 0.5)


@family("half side [scene unit]", RADII, "infinite planes")
def room_of_planes(scale: float) -> Case:
    """Six planes of albedo 1/2 that emit 1: L = 1 + L / 2 = 2."""
    walls = [
        plane([scale * x for x in n], [-x for x in n], *diffuse(0.5), emission(1)) for n in SIDES
    ]
    return Case(text(*walls, camera=(0, 0, scale / 2), angle=60), 2.0)


@family("distance from the origin along each axis, half side 1", OFFSETS, "infinite planes")
def room_of_planes_by_place(offset: float) -> Case:
    """As room of planes: 2."""
    walls = [
        plane([offset + x for x in n], [-x for x in n], *diffuse(0.5), emission(1)) for n in SIDES
    ]
    here = (offset,) * 3
    camera = (offset, offset, offset + 0.5)
    return Case(text(*walls, camera=camera, target=here, angle=60), 2.0)


@family("elevation of the camera [degree]", (45, 10, 1, 0.5, 0.1), "infinite planes")
def plane_from_low_above(elevation: float) -> Case:
    """A plane of albedo 1/2 under a sky of radiance 1 has radiance 1/2 up to the horizon."""
    e = math.radians(elevation)
    floor = plane((0, 0, 0), (0, 1, 0), *diffuse(0.5))
    camera = (0, 3 * math.sin(e), 3 * math.cos(e))
    return Case(text(floor, camera=camera, angle=0.01, BACKGROUND=WHITE_SKY), 0.5)


@family("gap between the surfaces [scene unit]", (0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2), *PATHS)
def two_floors(gap: float) -> Case:
    """One floor of albedo 1/2 on another under a sky of radiance 1: whichever is met, its radiance
    is 1/2."""
    upper, lower = (
        uvplane((-500, y, -500), (0, 0, 1000), (1000, 0, 0), *diffuse(0.5)) for y in (0, -gap)
    )
    return Case(text(upper, lower, camera=(0, 1, 3), angle=10, BACKGROUND=WHITE_SKY), 0.5)


@family("half side [scene unit]", RADII, *PATHS)
def sealed_box(scale: float) -> Case:
    """A closed box under a sky of radiance 1 is dark inside: 0, in units of the sky."""
    low, high = (-scale,) * 3, (scale,) * 3
    walls = box(*diffuse(0.8), low=low, high=high)
    scene = text(*walls, camera=(0, 0, scale / 2), angle=60, BACKGROUND=WHITE_SKY)
    return Case(scene, 0.0, scale=1.0)


@family("distance from the origin along each axis, half side 1", OFFSETS, *PATHS)
def sealed_box_by_place(offset: float) -> Case:
    """As sealed box: 0."""
    walls = box(*diffuse(0.8), low=(offset - 1,) * 3, high=(offset + 1,) * 3)
    here = (offset,) * 3
    camera = (offset, offset, offset + 0.5)
    scene = text(*walls, camera=camera, target=here, angle=60, BACKGROUND=WHITE_SKY)
    return Case(scene, 0.0, scale=1.0)


@family("height of the camera over the size of the scene", (1e-4, 1e-2, 1, 100, 1e4), *PATHS)
def planes_at_the_horizon(height: float) -> Case:
    """A floor and a ceiling of radiance 1, seen from between them, leave no gap at the horizon."""
    floor = plane((0, 0, 0), (0, 1, 0), emission(1), *diffuse(0))
    ceiling = plane((0, 2 * height, 0), (0, -1, 0), emission(1), *diffuse(0))
    size = sphere((0, 0.5, 9), 0.5, *diffuse(0))
    scene = text(floor, ceiling, size, camera=(0, height, 0), target=(0, height, -1), angle=1)
    return Case(scene, 1.0)


@family("lean of the plane [degree]", (0, 10, 45, 80), *PATHS)
def half_of_the_view(lean: float) -> Case:
    """A plane of radiance 1 through the foot of the camera fills half of what it sees."""
    normal = (math.sin(math.radians(lean)), math.cos(math.radians(lean)), 0)
    floor = plane((0, 0, 0), normal, emission(1), *diffuse(0))
    foot = 1 / math.cos(math.radians(lean))
    size = sphere((0, 0.5, 9), 0.5, *diffuse(0))
    scene = text(floor, size, camera=(0, foot, 0), target=(0, foot, -1), angle=10)
    return Case(scene, 0.5, spp=1024)
