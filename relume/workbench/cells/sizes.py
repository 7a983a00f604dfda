"""Sizes and places: radii, scales and distances from the origin that may be beyond float32."""

from __future__ import annotations

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import PATHS, box, diffuse, emission, plane, sphere, text

SCALES = (1e-3, 1e-2, 0.1, 1, 10, 100, 1e3, 1e4, 1e5, 1e6)
RADII = (1e-4, *SCALES)
OFFSETS = (0, 1, 10, 100, 1e3, 1e4, 1e5, 1e6)
WHITE_SKY = "1 1 1"


@family("radius [scene unit]", RADII, *PATHS)
def grey_ball(radius: float) -> Case:
    """A ball of albedo 1/2 under a sky of radiance 1 has radiance 1/2: no ray that leaves a convex
    body meets it again."""
    ball = sphere((0, 0, 0), radius, *diffuse(0.5))
    return Case(text(ball, camera=(0, 0, 3 * radius), BACKGROUND=WHITE_SKY), 0.5)


@family("radius [scene unit]", RADII, *PATHS)
def shining_hollow_ball(radius: float) -> Case:
    """Inside a sphere of albedo 1/2 that emits 1 the radiance is L = 1 + L / 2 = 2."""
    ball = sphere((0, 0, 0), radius, *diffuse(0.5), emission(1))
    return Case(text(ball, camera=(0, 0, 0.1 * radius), angle=60), 2.0)


def shining_box(scale: float, offset: float) -> list[str]:
    """A cube around a point on the diagonal of space."""
    low, high = (offset - scale,) * 3, (offset + scale,) * 3
    return box(*diffuse(0.5), emission(1), low=low, high=high)


@family("half side [scene unit]", RADII, *PATHS)
def shining_box_by_size(scale: float) -> Case:
    """Inside a closed cube of albedo 1/2 that emits 1 the radiance is L = 1 + L / 2 = 2."""
    return Case(text(*shining_box(scale, 0), camera=(0, 0, scale / 2), angle=60), 2.0)


@family("distance from the origin along each axis, half side 1", OFFSETS, *PATHS)
def shining_box_by_place(offset: float) -> Case:
    """Inside a closed cube of albedo 1/2 that emits 1 the radiance is L = 1 + L / 2 = 2."""
    here = (offset, offset, offset)
    camera = (offset, offset, offset + 0.5)
    return Case(text(*shining_box(1, offset), camera=camera, target=here, angle=60), 2.0)


def lit_floor(scale: float, offset: float) -> str:
    """A floor under a sphere lamp, its foot seen from aside; all lengths times `scale`."""
    at = lambda *p: tuple(offset + scale * x for x in p)  # noqa: E731
    floor = plane(at(0, 0, 0), (0, 1, 0), *diffuse(0.5))
    lamp = sphere(at(0, 4, 0), 0.5 * scale, emission(64), "color 0 0 0", "reflection diffuse")
    return text(floor, lamp, camera=at(0, 1, 3), target=at(0, 0, 0), angle=0.5)


@family("size of the scene over 5 [scene unit]", RADII, *PATHS)
def lit_floor_by_size(scale: float) -> Case:
    """A sphere lamp of radiance L and radius R at the height h gives a floor of albedo rho below it
    the irradiance pi L (R/h)², so its foot has the radiance rho L (R/h)² = 1/2."""
    return Case(lit_floor(scale, 0), 0.5)


@family("distance from the origin along each axis, size 5", OFFSETS, *PATHS)
def lit_floor_by_place(offset: float) -> Case:
    """As lit floor by size: rho L (R/h)² = 1/2."""
    return Case(lit_floor(1, offset), 0.5)
