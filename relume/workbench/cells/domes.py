"""Image-based light: domes of all sizes, and one bright texel among dim ones."""

from __future__ import annotations

import math

import numpy as np

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.lamps import FLOOR
from relume.workbench.cells.scenes import diffuse, plane, sphere, text
from relume.workbench.cells.sizes import RADII

HEIGHT, WIDTH = 33, 65
"""Of the picture: 32 x 64 texels are met (the last row and column are not)."""


def dome(radius: float) -> str:
    """A sphere around the origin that shines with `sky.exr`, a panorama."""
    return sphere((0, 0, 0), radius, "ibl_texture sky.exr", "panoramic_map 1", "normal -1",
                  *diffuse(0))  # fmt: skip


def sky(row: int | None = None, column: int = 40, ratio: float = 1.0) -> dict[str, np.ndarray]:
    """A panorama of radiance 1 with one texel brighter."""
    pixels = np.ones((HEIGHT, WIDTH, 3))
    if row is not None:
        pixels[row, column] = ratio
    return {"sky.exr": pixels}


def texel_irradiance(row: int) -> float:
    """Irradiance on a floor by a texel of radiance 1 in a row from the top.

    It spans the polar angles theta from +Y with 1 - theta / pi in [j, j + 1] / (h - 1), j being
    the row from the bottom, and 1 / (w - 1) of a turn; the integral of cos sin is sin² / 2.
    """
    j = HEIGHT - 1 - row
    below, above = (min(math.pi * (1 - v / (HEIGHT - 1)), math.pi / 2) for v in (j, j + 1))
    return 2 * math.pi / (WIDTH - 1) * (math.sin(below) ** 2 - math.sin(above) ** 2) / 2


@family("radius of the dome [scene unit]", RADII, "ibldome")
def floor_under_a_white_dome(radius: float) -> Case:
    """A floor of albedo 1/2 under a sky of radiance 1 has radiance 1/2."""
    camera = (0, 0.1 * radius, 0.3 * radius)
    return Case(
        text(
            FLOOR,
            dome(radius),
            camera=camera,
            angle=0.5,
        ),
        0.5,
        files=sky(),
    )


ROWS_SEEN = (16, 18, 24, 28, 30)


@family("row of the picture that is seen, of 32 from the bottom", ROWS_SEEN, "ibldome")
def dome_off_its_centre(row: int) -> Case:
    """A dome is looked up by hit point: with its centre the height h below the camera the horizon
    shows the row v = 1 - arccos(h / R) / pi of the panorama, here the middle of one."""
    height = 16005 * math.cos(math.pi * (1 - (row + 0.5) / (HEIGHT - 1)))
    rows = np.arange(HEIGHT, dtype=float)[::-1]
    pixels = np.broadcast_to(rows[:, None, None], (HEIGHT, WIDTH, 3))
    shining = sphere((0, -height, 0), 16005, "ibl_texture sky.exr", "panoramic_map 1", *diffuse(0))
    ball = sphere((0, 0, 9), 1, *diffuse(0))
    scene = text(ball, shining, camera=(0, 0, 0), target=(0, 0, -1), angle=0.1)
    return Case(scene, float(row), files={"sky.exr": pixels})


def bright_texel(row: int, ratio: float) -> Case:
    """A floor under a near dome, one of whose texels is brighter than the others."""
    expected = 0.5 / math.pi * (math.pi + (ratio - 1) * texel_irradiance(row))
    # What lies below the floor makes the scene large enough for the dome to keep its parallax.
    below = sphere((0, -8, 0), 2, *diffuse(0))
    scene = text(FLOOR, below, dome(100), camera=(0, 1, 3), angle=0.1)
    return Case(scene, expected, files=sky(row, ratio=ratio))


@family("radiance of one texel of 2048, the others 1", (1, 1e2, 1e4, 1e6, 1e8), "ibldome")
def bright_texel_high(ratio: float) -> Case:
    """A floor of albedo rho has the radiance rho / pi (pi + (ratio - 1) E), E the irradiance by a
    texel of radiance 1, here 30 degrees from the zenith, in closed form."""
    return bright_texel(6, ratio)


@family("radiance of one texel of 2048, the others 1", (1, 1e2, 1e4, 1e6, 1e8), "ibldome")
def bright_texel_at_the_zenith(ratio: float) -> Case:
    """As bright texel high, in the topmost row, where texels are narrow."""
    return bright_texel(1, ratio)


@family("radiance of one texel of 2048, the others 1", (1, 1e2, 1e4, 1e6, 1e8), "ibldome")
def bright_texel_at_the_horizon(ratio: float) -> Case:
    """As bright texel high, in the row above the horizon."""
    return bright_texel(16, ratio)


@family("radiance of one texel of 2048, the others 1", (1, 1e2, 1e4, 1e6, 1e8), "envmap")
def bright_texel_of_a_far_dome(ratio: float) -> Case:
    """As bright texel high, the dome so far that it is rendered as an environment map."""
    expected = 0.5 / math.pi * (math.pi + (ratio - 1) * texel_irradiance(6))
    scene = text(FLOOR, dome(1e5), camera=(0, 1, 3), angle=0.1)
    return Case(scene, expected, files=sky(6, ratio=ratio))


@family("radius of the dome [scene unit]", RADII, "shadowcatcher")
def shadow_catcher_in_the_open(radius: float) -> Case:
    """A shadow catcher that nothing shades shows the sky behind it: radiance 1."""
    floor = plane((0, 0, 0), (0, 1, 0), *diffuse(0.2), "shadow 1")
    camera = (0, 0.1 * radius, 0.3 * radius)
    return Case(text(floor, dome(radius), camera=camera, angle=20), 1.0, files=sky())
