"""Media: densities, phase functions and sizes to their ends, around objects and inside them.

Around objects the integrators are Mitsuba's own; what is measured with them is how media are
translated, the phase functions, and where single precision and roulette end. Inside objects it is
`randomwalk`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import emission, numbers, sphere, text, thing, uvplane

WALKS = ("volpath", "volpathmis")
SKY = "1 1 1"
CHALK = ("color 1 1 1", "reflection diffuse")
LAMP = 2.0


def coefficients(sigma_s: float, sigma_a: float = 0.0, g: float = 0.0) -> dict[str, Any]:
    """Lines of a medium."""
    s, a = (numbers(sigma, sigma, sigma) for sigma in (sigma_s, sigma_a))
    return {"SCATTERING": f"0\n{s}", "ABSORBING": f"0\n{a}", "PAHASE": numbers(g)}


LONG = 100.0
"""Scattering coefficient from which on walks in a furnace are so long that samples are few."""


def furnace(sigma: float, g: float = 0.0) -> Case:
    """A white ball in fog that absorbs nothing under a sky of 1: it shows 1 everywhere."""
    fog = {"participatingMedia": "1"} | coefficients(sigma, 0.0, g)
    ball = sphere((0, 0, 0), 1.0, *CHALK)
    scene = text(ball, camera=(0, 0, 3), angle=30, depth=200, BACKGROUND=SKY, **fog)
    return Case(scene, 1.0, spp=16 if sigma >= LONG else 64)


@family("sigma_s [1/scene unit]", (1e-6, 1e-3, 0.1, 1, 100, 1e4, 1e6), *WALKS, "randomwalk")
def fog_by_density(sigma: float) -> Case:
    """A white ball in fog of albedo 1 some units deep, under a sky of 1, is invisible: light is
    neither lost nor gained."""
    return furnace(sigma)


@family("mean cosine g", (-1, -0.99, 0, 0.99, 1), *WALKS, "randomwalk")
def fog_by_phase_function(g: float) -> Case:
    """As fog by density, for sigma_s = 0.5."""
    return furnace(0.5, g)


@family("optical depth", (0.01, 0.1, 1, 3, 10, 20), *WALKS, "randomwalk")
def lamp_behind_fog(depth: float) -> Case:
    """A lamp behind 8 units of fog that absorbs has the radiance L exp(-depth) (Beer and Lambert).
    Errors are in units of L."""
    fog = {"participatingMedia": "1"} | coefficients(0.0, depth / 8)
    lamp = uvplane((-50, -50, -8), (100, 0, 0), (0, 100, 0), emission(LAMP), "color 0 0 0")
    scene = text(lamp, camera=(0, 0, 0), target=(0, 0, -8), angle=0.5, **fog)
    return Case(scene, LAMP * float(np.exp(-depth)), scale=LAMP)


def filled(index: float, sigma_s: float, sigma_a: float) -> str:
    """A ball of radius 1 filled with a medium whose scattering is simulated."""
    return sphere((0, 0, 0), 1.0, *inside(index, sigma_s, sigma_a))


def inside(index: float, sigma_s: float, sigma_a: float) -> tuple[str, ...]:
    """Attributes of an object filled with a medium whose scattering is simulated."""
    lines = (f"{name}\n{value}" for name, value in coefficients(sigma_s, sigma_a).items())
    return (
        "color 1 1 1",
        f"refractive_index {numbers(index)}",
        "reflection reflection",
        "reflection Subsurface_Scattering",
        *lines,
        "BSSRDF\n0",
    )


@family("MATERIAL_SCALE", (1e-4, 1e-2, 1, 10, 100, 1e4), "randomwalk")
def white_ball_by_scale(scale: float) -> Case:
    """A ball of radius 1 whose inside scatters (sigma_s = scale, refractive index 1.3) and absorbs
    nothing is invisible under a sky of 1."""
    scene = text(filled(1.3, scale, 0.0), camera=(0, 0, 9), depth=100, BACKGROUND=SKY)
    return Case(scene, 1.0)


def scattered_back(albedo: float) -> float:
    """Radiance along the normal of a half space under a sky of 1: 1 - sqrt(1 - albedo) H(1).

    H is Chandrasekhar's function for isotropic scattering (Radiative Transfer, 1950, eq. V.31), as
    the fixed point of 1/H(m) = sqrt(1 - albedo) + albedo/2 int_0^1 m' H(m') / (m + m') dm'.
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    m, w = (nodes + 1) / 2, weights / 2
    absorbed = float(np.sqrt(1 - albedo))
    H: np.ndarray = np.ones_like(m)

    def improved(cos: np.ndarray | float) -> np.ndarray:
        kernel = m / (np.reshape(cos, (-1, 1)) + m)
        return 1 / (absorbed + albedo / 2 * kernel @ (w * H))

    for _ in range(200):
        H = improved(m)
    return float(1 - absorbed * improved(1.0)[0])


CURVED = 1.33
"""By how much more light a ball of albedo 0.9 returns than a half space, in units of the mean free
path over the radius: walks in double precision give 1.34 +- 0.05 and 1.32 +- 0.02 for radii of 100
and 30 mean free paths."""


@family("mean free path [radius]", (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6), "randomwalk")
def dense_ball(free_path: float) -> Case:
    """In the middle of a dense ball of albedo 0.9 and refractive index 1 light returns as from a
    half space: 1 - sqrt(0.1) H(1) with Chandrasekhar's H function, and 1.33 times the mean free
    path over the radius more, since the ball is not flat."""
    ball = filled(1.0, 0.9 / free_path, 0.1 / free_path)
    scene = text(ball, camera=(0, 0, 9), angle=0.2, BACKGROUND=SKY)
    return Case(scene, scattered_back(0.9) * (1 + CURVED * free_path))


CUBE = "\n".join(
    [f"v {x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4", ""]
)


@family("mean free path [half side]", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6), "randomwalk")
def dense_cube(free_path: float) -> Case:
    """In the middle of a face of a dense cube, which is a mesh, of albedo 0.9 and refractive index
    1 light returns as from a half space: 1 - sqrt(0.1) H(1)."""
    cube = thing("objfile cube.obj", *inside(1.0, 0.9 / free_path, 0.1 / free_path))
    scene = text(cube, camera=(0, 0, 9), angle=0.2, BACKGROUND=SKY)
    return Case(scene, scattered_back(0.9), files={"cube.obj": CUBE})
