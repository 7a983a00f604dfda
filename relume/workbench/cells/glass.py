"""Smooth glass: indices far from and near to 1, total reflection, thin and tiny pieces."""

from __future__ import annotations

import math

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import numbers, sphere, text, thing, uvplane
from relume.workbench.cells.sizes import RADII, WHITE_SKY

INDICES = (1e-3, 0.1, 0.5, 0.9, 0.9999, 1, 1.0001, 1.001, 1.1, 1.5, 2.4, 10, 1e3)


def glass(tint: float, index: float) -> tuple[str, ...]:
    """Attributes of glass."""
    return (f"color {numbers(tint, tint, tint)}", "reflection reflection",
            f"refractive_index {numbers(index)}")  # fmt: skip


def schlick(index: float, angle: float) -> float:
    """Schlick's Fresnel term of an angle outside [degree]; 1 where nothing enters."""
    sine = math.sin(math.radians(angle))
    if sine >= index:
        return 1.0
    base = ((1 - index) / (1 + index)) ** 2
    return base + (1 - base) * (1 - math.cos(math.radians(angle))) ** 5


def slab(index: float, angle: float, thickness: float = 1.0, tint: float = 0.5) -> Case:
    """A slab of glass under a sky of radiance 1, seen at an angle from the normal."""
    half = 1e3
    top = uvplane((-half, 0, -half), (0, 0, 2 * half), (2 * half, 0, 0), *glass(tint, index))
    bottom = uvplane((-half, -thickness, -half), (2 * half, 0, 0), (0, 0, 2 * half),
                     *glass(tint, index))  # fmt: skip
    t = math.radians(angle)
    camera = (3 * math.sin(t), 3 * math.cos(t), 0)
    scene = text(top, bottom, camera=camera, up=(0, 0, 1), angle=0.01, BACKGROUND=WHITE_SKY)
    F = schlick(index, angle)
    c = tint
    through = (c * (1 - F)) ** 2 / (1 - (c * F) ** 2)
    return Case(scene, c * F + through + through * c * F)


@family("index, seen straight on", INDICES, "schlickglass")
def slab_by_index(index: float) -> Case:
    """Light that is reflected or refracted at a face is tinted by c = 1/2; F by Schlick is the same
    from both sides: R + T = c F + (1 + c F) c² (1 - F)² / (1 - c² F²)."""
    return slab(index, 0)


@family("index, seen at 60 degrees", INDICES, "schlickglass")
def slab_by_index_aslant(index: float) -> Case:
    """As slab by index, with F = 1 where the sine exceeds the index: all is reflected."""
    return slab(index, 60)


@family("angle from the normal [degree]", (0, 45, 80, 89, 89.9, 89.99), "schlickglass")
def slab_by_angle(angle: float) -> Case:
    """As slab by index, of index 1.5."""
    return slab(1.5, angle)


@family(
    "thickness over distance from the camera",
    (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1),
    "schlickglass",
    why="Mitsuba starts a ray 8.9e-5 (1 + m) off its surface, m the largest coordinate: below the "
    "far side of a thinner slab, so that light is refracted once. c F + c (1 - F) / n² = 0.2339 is "
    "seen instead of 0.2554, -8.4 %, as measured. It is the start of rays that forbids it, which "
    "keeps them from the errors that float32 has in points of any shape: a slab of 3e-6 at "
    "coordinates of 1 is 50 of float32's steps thick.",
)
def slab_by_thickness(thickness: float) -> Case:
    """As slab by index, of index 1.5: at any thickness."""
    return slab(1.5, 45, thickness=3 * thickness)


@family(
    "angle inside over the critical angle",
    (0.5, 0.9, 0.99, 0.999, 1.001, 1.01, 1.5),
    "schlickglass",
)
def total_reflection(ratio: float) -> Case:
    """From inside glass of index n = 1.5 at the angle t, under a sky of radiance 1 outside and
    before a black wall inside: tint (1 - F) n² as long as n sin(t) < 1, F at the outer angle; 0
    beyond, in units of 1."""
    n = 1.5
    t = ratio * math.asin(1 / n)
    sine = n * math.sin(t)
    expected = 0.0
    if sine < 1:
        expected = 0.5 * (1 - schlick(n, math.degrees(math.asin(sine)))) * n**2
    face = uvplane((-1e3, 0, -1e3), (0, 0, 2e3), (2e3, 0, 0), *glass(0.5, n))
    wall = uvplane((-1e3, -5, -1e3), (0, 0, 2e3), (2e3, 0, 0), "color 0 0 0", "reflection diffuse")
    camera = (-3 * math.sin(t), -3 * math.cos(t), 0)
    scene = text(face, wall, camera=camera, up=(0, 0, 1), angle=0.001, BACKGROUND=WHITE_SKY)
    return Case(scene, expected, scale=1.0)


@family("radius [scene unit]", RADII, "schlickglass")
def glass_ball(radius: float) -> Case:
    """Clear glass in surroundings of radiance 1 has radiance 1: nothing is absorbed."""
    ball = sphere((0, 0, 0), radius, *glass(1, 1.5))
    return Case(text(ball, camera=(0, 0, 5 * radius), angle=10, BACKGROUND=WHITE_SKY), 1.0)


@family("index", INDICES, "schlickglass")
def glass_ball_by_index(index: float) -> Case:
    """As glass ball: radiance 1."""
    ball = sphere((0, 0, 0), 1, *glass(1, index))
    return Case(text(ball, camera=(0, 0, 5), angle=10, BACKGROUND=WHITE_SKY), 1.0)


@family("radius [scene unit]", (1e-4, 1e-2, 1, 100, 1e4, 1e6), "surfacepath")
def dispersive_ball(radius: float) -> Case:
    """As glass ball, at every wavelength: radiance 1."""
    ball = thing(f"sphere 0 0 0 {radius:.17g}", "color 1 1 1", "reflection reflection99")
    return Case(text(ball, camera=(0, 0, 5 * radius), angle=10, BACKGROUND=WHITE_SKY), 1.0)
