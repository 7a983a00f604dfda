"""Lights of one direction or one point: infinity light, parallel beam, spot."""

from __future__ import annotations

import math

import numpy as np

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import (
    diffuse,
    emission,
    numbers,
    plane,
    sphere,
    text,
    thing,
    uvplane,
)
from relume.workbench.cells.sizes import OFFSETS, RADII

ANGLES = (0, 60, 89, 89.9, 89.99, 89.999)


def floor(offset: float = 0.0) -> str:
    """A floor of albedo 1/2 through a point on the diagonal of space."""
    return plane((offset, offset, offset), (0, 1, 0), *diffuse(0.5))


def downwards(angle: float) -> tuple[float, float, float]:
    """Direction of light that falls at an angle of incidence [degree]."""
    t = math.radians(angle)
    return math.sin(t), -math.cos(t), 0.0


@family("angle of incidence [degree]", ANGLES, "directional")
def infinity_light(angle: float) -> Case:
    """Irradiance pi E cos(theta) across the floor: radiance rho E cos(theta) = 1/2."""
    radiance = 1 / math.cos(math.radians(angle))
    light = thing(f"infinity_light {numbers(*downwards(angle))}", emission(radiance))
    return Case(text(floor(), light, camera=(0, 1, 3), angle=0.5), 0.5)


def beam(scale: float, offset: float, angle: float = 0.0, distance: float = 2.0) -> str:
    """A floor in a beam of 2 x 2 that falls on it from a distance at an angle; lengths scaled."""
    d = downwards(angle)
    center = [offset - scale * distance * x for x in d]
    # Across the beam: Z, and the direction in the plane of incidence.
    v, u = (0, 0, 2 * scale), (2 * scale * -d[1], 2 * scale * d[0], 0)
    corner = [c - (a + b) / 2 for c, a, b in zip(center, u, v, strict=True)]
    light = uvplane(corner, u, v, emission(1 / -d[1]), "parallel_light 1",
                    f"parallel_light_dir {numbers(*d)}")  # fmt: skip
    camera, target = (offset, offset + scale, offset + 3 * scale), (offset,) * 3
    return text(floor(offset), light, camera=camera, target=target, angle=0.5)


@family("half width of the beam [scene unit]", RADII, "parallelbeam")
def beam_by_size(scale: float) -> Case:
    """Irradiance pi E cos(theta) inside the beam: radiance rho E cos(theta) = 1/2."""
    return Case(beam(scale, 0), 0.5)


@family("distance from the origin along each axis, half width 1", OFFSETS, "parallelbeam")
def beam_by_place(offset: float) -> Case:
    """As beam by size: rho E cos(theta) = 1/2."""
    return Case(beam(1, offset), 0.5)


@family("angle of incidence [degree]", ANGLES, "parallelbeam")
def beam_by_incidence(angle: float) -> Case:
    """As beam by size: rho E cos(theta) = 1/2."""
    return Case(beam(1, 0, angle), 0.5)


@family("distance over half width", (1e-3, 1e-2, 0.1, 1, 10, 1e3, 1e4, 1e5, 1e6), "parallelbeam")
def beam_by_distance(distance: float) -> Case:
    """As beam by size, at any distance: rho E = 1/2. The camera is within the beam."""
    scene = beam(1, 0, distance=distance)
    return Case(scene, 0.5)


def spot(
    distance: float,
    half_angle: float = 30.0,
    fall_off: float = 5.0,
    exponent: float = 2.0,
    *,
    radiance: float,
    offset: float = 0.0,
    x: float = 0.0,
) -> str:
    """A spot above the origin, or above `x` on the X axis."""
    return sphere((offset + x, offset + distance, offset), 0.01 * distance, emission(radiance),
                  "color 0 0 0", "reflection diffuse", "spot_light 1", "spot_light_dir 0 -1 0",
                  f"spot_light_angle {numbers(half_angle, fall_off)}",
                  f"spot_light_falloff {numbers(exponent)}", "spot_attenuation 0 0 1")  # fmt: skip


@family("distance [scene unit]", (0.1, 1, 10, 100, 1e3, 1e4, 1e5, 1e6), "falloffspot")
def spot_by_distance(distance: float) -> Case:
    """On the axis the irradiance is pi E / d²: radiance rho E / d² = 1/2."""
    light = spot(distance, radiance=distance**2)
    camera = (0, 0.3 * distance, distance)
    return Case(text(floor(), light, camera=camera, angle=0.5), 0.5)


@family("distance from the origin along each axis", OFFSETS, "falloffspot")
def spot_by_place(offset: float) -> Case:
    """As spot by distance: rho E / d² = 1/2."""
    light = spot(2, radiance=4, offset=offset)
    camera, target = (offset, offset + 1, offset + 3), (offset,) * 3
    return Case(text(floor(offset), light, camera=camera, target=target, angle=0.5), 0.5)


@family("half angle [degree]", (1e-3, 0.01, 0.03, 0.1, 1, 30, 90), "falloffspot")
def spot_by_width(half_angle: float) -> Case:
    """Inside the cone, which has no fall-off: rho E / d² = 1/2. Half the cone is seen."""
    light = spot(1, half_angle, 0, radiance=1)
    angle = min(max(half_angle / 2, 1e-3), 5)
    # From so near that the patch is seen under an angle that a camera can have.
    near = min(0.2, 100 * half_angle)
    return Case(text(floor(), light, camera=(0, near, near / 10), angle=angle), 0.5)


@family("fall-off angle [degree]", (1e-3, 0.01, 0.1, 1, 10, 20), "falloffspot")
def spot_ramp(fall_off: float) -> Case:
    """Where the cosine of the angle from the axis is by the share u of the ramp's width above that
    of w, the ramp is u^p; with p = 2, and cos³ for the distance and the incidence, the radiance is
    rho E cos³(theta) (u² + s²/12) over a picture that is s ramps wide."""
    w, f = math.radians(20), math.radians(fall_off)
    rim = math.cos(w - f) - math.cos(w)
    # The point that is seen is the origin: elsewhere its coordinates have errors of 6e-8, and the
    # narrowest ramp is 2e-5 wide. So the lamp stands at a number that float32 has, where u = 1/2.
    x = float(np.float32(math.sqrt((math.cos(w) + rim / 2) ** -2 - 1)))
    cosine = 1 / math.hypot(1, x)
    u = (cosine - math.cos(w)) / rim
    angle = max(0.02 * fall_off, 1e-3)
    camera = (0, 0.1, 0.1)
    seen = 2 * math.tan(math.radians(angle) / 2) * math.hypot(*camera)
    s = seen * x * cosine**3 / rim
    light = spot(1, 20, fall_off, radiance=1, x=-x)
    scene = text(floor(), light, camera=camera, angle=angle)
    return Case(scene, 0.5 * cosine**3 * (u**2 + s**2 / 12))


@family("exponent", (0, 1e-3, 1, 10, 100), "falloffspot")
def spot_exponent(exponent: float) -> Case:
    """As spot ramp, w = 20 and f = 10 degrees: rho E cos³(theta) / 2^p, where cos(theta) is
    nearer to the inner cone for large p: the ramp there is 2^(-min(p, 10))."""
    w, f = math.radians(20), math.radians(10)
    share = 2 ** (-min(1.0, 10 / max(exponent, 1e-9)))
    cosine = math.cos(w) + share * (math.cos(w - f) - math.cos(w))
    x = math.sqrt(1 - cosine**2) / cosine
    light = spot(1, 20, 10, exponent, radiance=1)
    scene = text(floor(), light, camera=(x, 0.1, 0.1), target=(x, 0, 0), angle=0.01)
    return Case(scene, 0.5 * cosine**3 * share**exponent)
