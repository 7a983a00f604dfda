"""Lamps of all sizes, heights and distances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from relume.workbench.cells.dictionaries import camera, rgb
from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import (
    PATHS,
    diffuse,
    emission,
    plane,
    sphere,
    text,
    thing,
    uvplane,
)

FLOOR = plane((0, 0, 0), (0, 1, 0), *diffuse(0.5))
BLACK = ("color 0 0 0", "reflection diffuse")


def floor_seen(*objects: str, angle: float = 0.5, **keywords: Any) -> str:
    """The floor at the origin, seen from the height 1 and the distance 3 along +Z."""
    return text(FLOOR, *objects, camera=(0, 1, 3), angle=angle, **keywords)


@family("angle that the lamp subtends [rad]", (1e-5, 1e-4, 1e-3, 0.01, 0.1, 1), *PATHS)
def sun(angle: float) -> Case:
    """A sphere lamp of radiance L overhead that subtends 2 sigma gives a floor of albedo rho the
    radiance rho L sin²(sigma) = 1/2, however small it is."""
    radius = 100 * math.sin(angle / 2)
    lamp = sphere((0, 100, 0), radius, emission(math.sin(angle / 2) ** -2), *BLACK)
    return Case(floor_seen(lamp), 0.5)


@family("elevation of the lamp [degree]", (90, 45, 10, 1, 0.1, 0.01), *PATHS)
def low_sun(elevation: float) -> Case:
    """A sphere lamp whose centre stands at the elevation e, all of it above the horizon: the
    floor has the radiance rho L sin²(sigma) sin(e) = 1/2."""
    e = math.radians(elevation)
    sigma = min(0.05, e / 2)
    at = (-100 * math.cos(e), 100 * math.sin(e), 0)
    radiance = 1 / (math.sin(sigma) ** 2 * math.sin(e))
    lamp = sphere(at, 100 * math.sin(sigma), emission(radiance), *BLACK)
    return Case(floor_seen(lamp, angle=0.1), 0.5)


def square_factor(side: float, distance: float) -> float:
    """Form factor from a point to a parallel square above it, its centre over the point (Howell,
    A Catalog of Radiation Heat Transfer Configuration Factors, B-4: four such quarters)."""
    a = side / 2 / distance
    return 4 / math.pi * a / math.sqrt(1 + a * a) * math.atan(a / math.sqrt(1 + a * a))


@family("height over side of the lamp", (1e-4, 1e-3, 1e-2, 0.1, 1, 10, 100, 1e3), *PATHS)
def panel(height: float) -> Case:
    """A square lamp of radiance L parallel to the floor gives it rho L F with the form factor of a
    square; F = 1 as the lamp covers the floor."""
    half = 1 / 2
    lamp = uvplane((-half, height, -half), (1, 0, 0), (0, 0, 1), emission(1), *BLACK)
    expected = 0.5 * square_factor(1, height)
    # Seen from under the lamp.
    near = min(height, 1)
    return Case(text(FLOOR, lamp, camera=(0, near / 4, near / 100), angle=0.1), expected)


@family("ratio of the lamps' powers", (1, 1e2, 1e4, 1e6, 1e8), *PATHS)
def bright_lamp_out_of_sight(ratio: float) -> Case:
    """A lamp overhead gives the floor 1/2; another one, `ratio` times as strong, stands below the
    floor and gives it nothing."""
    lamp = sphere((0, 4, 0), 0.5, emission(64), *BLACK)
    hidden = sphere((0, -4, 0), 0.5, emission(64 * ratio), *BLACK)
    return Case(floor_seen(lamp, hidden), 0.5)


@family("radius [scene unit]", (1e-3, 1e-2, 0.1, 1, 100, 1e4, 1e6), "twosidedarea")
def shining_dome(radius: float) -> Case:
    """A hemisphere that emits 1 fills the sky of the floor's centre: radiance rho = 1/2."""
    dome = thing(f"hemisphere 0 0 0 {radius:.17g}", emission(1), *BLACK)
    seen_from = (0, 0.1 * radius, 0.3 * radius)
    return Case(text(FLOOR, dome, camera=seen_from, angle=0.5), 0.5)


@family("height [scene unit]", (1e-4, 1e-2, 1, 100, 1e4, 1e6), "twosidedarea")
def shining_plane(height: float) -> Case:
    """An infinite plane that emits 1 fills the sky of the floor: radiance rho = 1/2. It is made of
    a square 200 times as wide as it is high, which lacks 1e-4 of that."""
    sky = plane((0, height, 0), (0, -1, 0), emission(1), *BLACK)
    seen_from = (0, 0.1 * height, 0.3 * height)
    return Case(text(FLOOR, sky, camera=seen_from, angle=0.5), 0.5)


@family(
    "radius [scene unit]",
    (1e-3, 1e-2, 0.1, 1, 100, 1e4, 1e6),
    "twosidedarea",
    why="`path`, for which the light is made, starts rays h = 8.9e-5 (1 + R) / R radii off the "
    "surface. Those that the BSDF drew meet another point than from the surface itself, and get "
    "the weight of that: the weights of the two ways no longer sum to 1. With density d / 2 pi of "
    "both ways for points at the distance d of radii, the sum is 1 + e, e = -0.95 % at R = 0.01, "
    "-4.86 % at 0.001 by quadrature, and L = 2 + e is off by -0.47 and -2.43 %, as measured. Scene "
    "files are enlarged before they are rendered: `shining hollow ball` is exact at 1e-4.",
)
def shining_sphere_from_inside(radius: float) -> Case:
    """Inside a stock sphere of albedo 1/2 that emits 1 to both sides: L = 1 + L / 2 = 2."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "rr_depth": 9},
        "sensor": camera((0, 0, 0.1 * radius), (0, 0, 0), 60),
        "ball": {
            "type": "sphere",
            "radius": radius,
            "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(0.5)}},
            "light": {"type": "twosidedarea", "radiance": rgb(1.0)},
        },
    }
    return Case(scene, 2.0)


@family("brightest texel over the others", (1, 1e2, 1e4, 1e6, 1e8), "twosidedarea")
def bright_texel_of_a_panel(ratio: float) -> Case:
    """A wall that shines by a picture: rho / pi times the integral of L cos cos' / d² over it, on a
    fine grid. Of 17 x 17 texels 16 x 16 are met: not the top row and not the last column."""
    texels = np.ones((17, 17))
    texels[5, 3] = ratio
    fine = (np.arange(1024) + 0.5) / 1024
    u, v = np.meshgrid(fine, fine)
    # The wall stands at z = -4, x from -2 to 2, y from 1 to 5.
    p = np.stack([4 * u - 2, 1 + 4 * (1 - v), np.full_like(u, -4.0)], axis=-1)
    d2 = (p**2).sum(axis=-1)
    radiance = texels[1:, :-1].repeat(64, axis=0).repeat(64, axis=1)
    expected = 0.5 / np.pi * (radiance * p[..., 1] * 4 / d2**2).mean() * 16
    wall = uvplane((-2, 1, -4), (4, 0, 0), (0, 4, 0), emission(0), *BLACK,
                   "ibl_texture wall.exr")  # fmt: skip
    files = {"wall.exr": texels[..., None].repeat(3, axis=2)}
    return Case(floor_seen(wall, angle=0.1), expected, files=files)
