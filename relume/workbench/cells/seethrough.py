"""Surfaces that are not there in full: masks and glass of index 1, before lamps and on them."""

from __future__ import annotations

import math

from relume.workbench.cells.dictionaries import camera, rgb
from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import (
    diffuse,
    emission,
    numbers,
    sphere,
    text,
    thing,
    uvplane,
)

LIGHTS = ("lamp", "infinity", "parallel", "spot")
OPACITIES = (0, 1e-4, 0.1, 0.5, 0.9, 0.9999, 1)
SEES_THROUGH = ("surfacepath", "volpath")
WALKS = ("volpath", "volpathmis", "randomwalk")
BEHIND = (0, 3, 2)
"""Below the veil, from where the middle of the floor is seen."""


def floor() -> str:
    """A floor of albedo 1/2 across Z."""
    return uvplane((-9, -9, 0), (18, 0, 0), (0, 18, 0), *diffuse(0.5))


def lit(light: str) -> tuple[str, float]:
    """A light above the floor, and the radiance of the floor's middle in it.

    rho L R² / D² of the lamp; rho emission of parallel light, over d² of the spot.
    """
    if light == "lamp":
        return sphere((0, 0, 30), 2, emission(100), *diffuse(0)), 0.5 * 100 * (2 / 30) ** 2
    if light == "infinity":
        return thing("infinity_light 0 0 -1", emission(1), *diffuse(0)), 0.5
    if light == "parallel":
        beam = ("parallel_light 1", "parallel_light_dir 0 0 -1")
        return uvplane((-3, -3, 10), (6, 0, 0), (0, 6, 0), emission(1), *beam, *diffuse(0)), 0.5
    spot = ("spot_light 1", "spot_light_dir 0 0 -1")
    return sphere((0, 0, 10), 0.1, emission(7), *spot, *diffuse(0)), 0.035


def veil(opacity: float, albedo: float, *attributes: str) -> tuple[str, dict[str, str]]:
    """A square of half-width 9 at the height 5, as a mesh with its MTL file."""
    corners = "v -9 -9 5\nv 9 -9 5\nv 9 9 5\nv -9 9 5\n"
    files = {
        "veil.obj": f"mtllib veil.mtl\n{corners}usemtl a\nf 1 2 3 4\n",
        "veil.mtl": f"newmtl a\nd {opacity:.17g}\n",
    }
    return thing("objfile veil.obj", *attributes, *diffuse(albedo)), files


@family("light", LIGHTS, *SEES_THROUGH)
def behind_an_absent_surface(light: str) -> Case:
    """A floor below a surface of opacity 0 is lit as without it: rho L R² / D² by a lamp,
    rho E / pi by parallel light, rho I / d² by a spot."""
    source, expected = lit(light)
    absent, files = veil(0, 0.5)
    return Case(text(floor(), absent, source, camera=BEHIND, angle=0.1), expected, files=files)


@family("light", LIGHTS[1:], *SEES_THROUGH)
def behind_index_matched_glass(light: str) -> Case:
    """As behind an absent surface: a ball of glass of index 1 lets all of the light pass that goes
    through its centre."""
    source, expected = lit(light)
    ball = sphere((0, 0, 5), 2, "color 1 1 1", "reflection reflection", "refractive_index 1")
    return Case(text(floor(), ball, source, camera=BEHIND, angle=0.1), expected)


@family("opacity", OPACITIES, *SEES_THROUGH)
def behind_a_black_veil(opacity: float) -> Case:
    """A black surface of opacity d leaves 1 - d of a lamp's light."""
    source, expected = lit("lamp")
    black, files = veil(opacity, 0)
    scene = text(floor(), black, source, camera=BEHIND, angle=0.1)
    return Case(scene, (1 - opacity) * expected, scale=expected, files=files)


@family("opacity", OPACITIES[1:], *SEES_THROUGH)
def veil_before_a_lamp(opacity: float) -> Case:
    """Seen from the lamp's side, before nothing, a surface of opacity d and albedo rho shows
    d rho L R² / D²."""
    source, _ = lit("lamp")
    grey, files = veil(opacity, 0.5)
    expected = opacity * 0.5 * 100 * (2 / 25) ** 2
    scene = text(grey, source, camera=(0, 6, 20), target=(0, 0, 5), angle=0.1)
    return Case(scene, expected, files=files)


@family("opacity", OPACITIES, "surfacepath")
def veil_that_shines(opacity: float) -> Case:
    """A surface of opacity d and radiance 1 before a sky of 1/10 shows d + (1 - d) / 10."""
    shining, files = veil(opacity, 0, emission(1))
    scene = text(shining, camera=(0, 0, 20), target=(0, 0, 5), angle=1, BACKGROUND="0.1 0.1 0.1")
    return Case(scene, opacity + (1 - opacity) / 10, files=files)


@family("opacity", OPACITIES[1:], "surfacepath")
def floor_below_a_shining_veil(opacity: float) -> Case:
    """A floor below the middle of a black square of half-width a and radiance 1 at unit distance
    has the radiance rho d F, F = 4 / pi x atan(x), x = a / sqrt(1 + a²), here a = 9 / 5."""
    shining, files = veil(opacity, 0, emission(1))
    a = 9 / 5
    x = a / math.hypot(1, a)
    expected = 0.5 * opacity * 4 / math.pi * x * math.atan(x)
    scene = text(floor(), shining, camera=BEHIND, angle=0.1)
    return Case(scene, expected, files=files)


@family("opacity", OPACITIES, "surfacepath")
def ball_that_shines(opacity: float) -> Case:
    """A white ball of opacity d whose outer side has the radiance 1, under a sky of 1/10, shows
    d + 1/10: its inner side is lit by the sky alone."""
    white = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(1.0)}}
    ball = {
        "type": "sphere",
        "bsdf": {"type": "mask", "opacity": opacity, "bsdf": white},
        "emitter": {"type": "area", "radiance": rgb(1.0)},
    }
    scene = {
        "type": "scene",
        "integrator": {"type": "surfacepath"},
        "sensor": camera((0, 0, 5), (0, 0, 0), 10),
        "sky": {"type": "constant", "radiance": rgb(0.1)},
    }
    return Case(scene | {"ball": ball}, opacity + 0.1)


@family("absorption [1/scene unit]", (0, 1e-3, 0.1, 0.3, 1, 3), *WALKS)
def camera_inside_a_filled_ball(absorption: float) -> Case:
    """From the middle of a ball of radius 2 and index 1.5 under a sky of 1 one sees
    eta² (1 - F) e^(-2a) / (1 - F e^(-4a)), F = 0.04: what enters, and is reflected to and fro."""
    medium = (
        "reflection Subsurface_Scattering",
        "BSSRDF\n0",
        "level\n0",
        "SCATTERING\n0\n0 0 0",
        f"ABSORBING\n0\n{numbers(absorption, absorption, absorption)}",
    )
    glass = ("color 1 1 1", "reflection reflection", "refractive_index 1.5")
    ball = sphere((0, 0, 20), 2, *glass, *medium)
    through = math.exp(-2 * absorption)
    expected = 1.5**2 * 0.96 * through / (1 - 0.04 * through**2)
    scene = text(ball, camera=(0, 0, 20), target=(0, 0, 0), angle=1, BACKGROUND="1 1 1")
    return Case(scene, expected)


@family("limit over radiance", (2, 4, 16, 1e3), "surfacepath")
def cutoff_with_wavelengths(ratio: float) -> Case:
    """Dispersive glass under a sky of 1 has radiance 1: a limit of samples above that cuts off
    nothing, though dispersed paths carry one wavelength of four."""
    ball = thing("sphere 0 0 0 1", "color 1 1 1", "reflection reflection99")
    cutoff = numbers(ratio)  # of one sample a pixel, as the file has it
    scene = text(ball, camera=(0, 0, 5), angle=10, BACKGROUND="1 1 1", luminance_cutoff=cutoff)
    return Case(scene, 1.0)
