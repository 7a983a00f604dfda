"""Ward's and Phong's lobes, down to mirrors and up to grazing angles."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.lamps import BLACK
from relume.workbench.cells.scenes import emission, numbers, plane, sphere, text, uvplane
from relume.workbench.cells.sizes import WHITE_SKY

ALPHAS = (0, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1)
EXPONENTS = (0, 1, 10, 1e2, 1e3, 1e4, 1e5, 1e6)
ANGLES = (0, 45, 80, 89, 89.9, 89.99)


def ward(alpha_x: float, alpha_y: float) -> tuple[str, ...]:
    """Attributes of Ward's lobe alone."""
    return ("color 0 0 0", "specular 1 1 1", "reflection ward_brdf",
            f"ward_brdf {numbers(0, 1, alpha_x, alpha_y)}")  # fmt: skip


def phong(exponent: float) -> tuple[str, ...]:
    """Attributes of Phong's lobe alone."""
    return ("color 0 0 0", "specular 1 1 1", "reflection phong_brdf",
            f"phong_brdf {numbers(0, 1, exponent)}")  # fmt: skip


def grid(rows: int = 2048, columns: int = 1024) -> tuple[np.ndarray, np.ndarray]:
    """Midpoints of [0, 1] x [0, 2 pi]: (rows, 1) and (1, columns)."""
    u = (np.arange(rows) + 0.5) / rows
    v = (np.arange(columns) + 0.5) / columns
    return u[:, None], 2 * math.pi * v[None, :]


def ward_albedo(angle: float, alpha_x: float, alpha_y: float) -> float:
    """Directional albedo of Ward's lobe (1992) in the plane of x: quadrature in double precision.

    With the slopes s, t of the half vector, d omega_o = 4 (h.i) (h.n)³ ds dt and f = E / (4 pi
    alpha_x alpha_y sqrt((i.n) (o.n))): the mean of (h.i) (h.n)³ sqrt((o.n) / (i.n)) over the
    Gaussian slopes, of what lies above the surface.
    """
    u, phi = grid()
    r = np.sqrt(-np.log(u))
    s, t = alpha_x * r * np.cos(phi), alpha_y * r * np.sin(phi)
    hz = 1 / np.sqrt(1 + s * s + t * t)
    ix, iz = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    hi = hz * (s * ix + iz)
    oz = 2 * hi * hz - iz
    above = (oz > 0) & (hi > 0)
    return float(np.mean(np.where(above, hi * hz**3 * np.sqrt(np.maximum(oz, 0) / iz), 0)))


def phong_albedo(angle: float, n: float) -> float:
    """Directional albedo of Phong's lobe: (n + 2) / (n + 1) times the mean of cos(theta_o) over the
    density (n + 1) / 2 pi cos^n(a) about the mirror direction, of what lies above the surface."""
    u, phi = grid()
    log = np.log(u) / (n + 1)
    cosine, sine = np.exp(log), np.sqrt(-np.expm1(2 * log))
    t = math.radians(angle)
    oz = cosine * math.cos(t) - sine * np.cos(phi) * math.sin(t)
    return float((n + 2) / (n + 1) * np.mean(np.maximum(oz, 0)))


ACROSS = 0.01
"""Field of view of the cells [degree]."""


def mean_across(albedo: Callable[[float], float], angle: float) -> float:
    """Mean of a function of the angle over the field of view about `angle` [degree]: the lobe of
    Ward goes with 1 / sqrt(i.n), which within it falls to 0.6 of itself at 89.99 degrees."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    return float(np.dot(weights, [albedo(angle + ACROSS / 2 * x) for x in nodes]) / 2)


def under_a_white_sky(attributes: Sequence[str], angle: float) -> str:
    """A wide square under a sky of radiance 1, seen at an angle from its normal, from +Z, which is
    the x of Ward's frame."""
    t = math.radians(angle)
    camera = (0, 3 * math.cos(t), 3 * math.sin(t))
    floor = uvplane((-10, 0, -10), (0, 0, 20), (20, 0, 0), *attributes)
    up = (0, 1, 0) if angle > 45 else (0, 0, -1)
    return text(floor, camera=camera, up=up, angle=ACROSS, BACKGROUND=WHITE_SKY)


NO_MIRROR = "alpha_x and alpha_y above 0"
"""What the refusal of an alpha of 0 says: the scene language has alpha > 0 (section 4)."""


def ward_case(scene: str, expected: float, alpha: float) -> Case:
    """A scene with Ward's lobe, which the language forbids for `alpha` = 0."""
    return Case(scene, expected, forbidden="" if alpha else NO_MIRROR)


@family("alpha, seen straight on", ALPHAS, "ward")
def ward_under_a_white_sky(alpha: float) -> Case:
    """The directional albedo, by quadrature in double precision. The language forbids 0."""
    scene = under_a_white_sky(ward(alpha, alpha), 0)
    return ward_case(scene, ward_albedo(0, alpha, alpha), alpha)


@family("alpha, seen at 80 degrees", ALPHAS, "ward")
def ward_under_a_white_sky_aslant(alpha: float) -> Case:
    """As ward under a white sky."""
    scene = under_a_white_sky(ward(alpha, alpha), 80)
    return ward_case(scene, ward_albedo(80, alpha, alpha), alpha)


@family("angle from the normal [degree], alpha 0.1", ANGLES, "ward")
def ward_by_angle(angle: float) -> Case:
    """As ward under a white sky, over the field of view of 0.01 degrees."""
    expected = mean_across(lambda t: ward_albedo(t, 0.1, 0.1), angle)
    return Case(under_a_white_sky(ward(0.1, 0.1), angle), expected)


@family("alpha_x, with alpha_y 0.5, seen at 45 degrees", ALPHAS, "ward")
def ward_brushed(alpha: float) -> Case:
    """As ward under a white sky."""
    scene = under_a_white_sky(ward(alpha, 0.5), 45)
    return ward_case(scene, ward_albedo(45, alpha, 0.5), alpha)


@family("exponent, seen straight on", EXPONENTS, "phong")
def phong_under_a_white_sky(exponent: float) -> Case:
    """The directional albedo, by quadrature in double precision; 1 at normal incidence."""
    return Case(under_a_white_sky(phong(exponent), 0), phong_albedo(0, exponent))


@family("exponent, seen at 80 degrees", EXPONENTS, "phong")
def phong_under_a_white_sky_aslant(exponent: float) -> Case:
    """As phong under a white sky."""
    return Case(under_a_white_sky(phong(exponent), 80), phong_albedo(80, exponent))


@family("angle from the normal [degree], exponent 100", ANGLES, "phong")
def phong_by_angle(angle: float) -> Case:
    """As phong under a white sky, over the field of view of 0.01 degrees."""
    expected = mean_across(lambda t: phong_albedo(t, 100), angle)
    return Case(under_a_white_sky(phong(100), angle), expected)


def lamp_in_the_mirror(attributes: Sequence[str], angle: float) -> str:
    """A plane that reflects the middle of a lamp of radiance 1, 23 degrees wide, to the camera."""
    t = math.radians(angle)
    camera = (0, 3 * math.cos(t), 3 * math.sin(t))
    lamp = sphere((0, 10 * math.cos(t), -10 * math.sin(t)), 2, emission(1), *BLACK)
    floor = plane((0, 0, 0), (0, 1, 0), *attributes)
    return text(floor, lamp, camera=camera, angle=0.01)


NARROW_ALPHAS, NARROW_EXPONENTS = (0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2), (1e3, 1e4, 1e5, 1e6, 1e8)


@family("alpha", NARROW_ALPHAS, "ward")
def lamp_reflected_by_ward(alpha: float) -> Case:
    """All of the narrow lobe meets a lamp of radiance 1: the albedo at 45 degrees."""
    scene = lamp_in_the_mirror(ward(alpha, alpha), 45)
    return ward_case(scene, ward_albedo(45, alpha, alpha), alpha)


@family("exponent", NARROW_EXPONENTS, "phong")
def lamp_reflected_by_phong(exponent: float) -> Case:
    """All of the narrow lobe meets a lamp of radiance 1: the albedo at 45 degrees."""
    return Case(lamp_in_the_mirror(phong(exponent), 45), phong_albedo(45, exponent))
