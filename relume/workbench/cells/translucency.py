"""Subsurface scattering by diffusion: phase functions, coefficients and sizes to their ends.

All at level -2, multiple scattering alone, whose answers are closed forms: with
k = sqrt(3 (1 - a)), z_r = 1, z_v = 1 + 4A/3 and lengths in units of 1/sigma_t',

    R(r) = a/2 sum_j (exp(-k z_j) - z_j/d_j exp(-k d_j)),  d_j^2 = r^2 + z_j^2,

is the light that leaves within the distance r (Jensen et al. 2001, eq. 4, integrated by
substitution of d for r).
"""

from __future__ import annotations

import math

import numpy as np

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import numbers, plane, sphere, text

ETA = 1.3
WHITE_SKY = "1 1 1"
ENDS = (0, 1e-6, 1e-4, 1e-2, 1, 100, 1e4, 1e6)


def fresnel(cos: np.ndarray | float) -> np.ndarray:
    """Reflectance of the boundary for unpolarised light from outside."""
    cos_t = np.sqrt(1 - (1 - cos * cos) / ETA**2)
    r_s, r_p = (cos - ETA * cos_t) / (cos + ETA * cos_t), (ETA * cos - cos_t) / (ETA * cos + cos_t)
    return (r_s**2 + r_p**2) / 2


def returned(albedo: float, reach: float = math.inf) -> float:
    """R(reach) for the reduced albedo `albedo`; see the top of this file."""
    F_dr = -1.440 / ETA**2 + 0.710 / ETA + 0.668 + 0.0636 * ETA
    k, total = math.sqrt(3 * (1 - albedo)), 0.0
    for z in (1.0, 1 + 4 / 3 * (1 + F_dr) / (1 - F_dr)):
        d = math.hypot(reach, z)
        total += math.exp(-k * z) - (z / d * math.exp(-k * d) if math.isfinite(d) else 0)
    return albedo / 2 * total


def radiance(returned_light: float) -> float:
    """What is seen along the normal under a sky of 1: F + (1 - F) (1 - mean F) R."""
    cos = (np.arange(10_000) + 0.5) / 10_000
    F = float(fresnel(1.0))
    return F + (1 - F) * (1 - float(np.mean(2 * cos * fresnel(cos)))) * returned_light


def translucent(sigma_s: float, sigma_a: float, g: float = 0.0) -> tuple[str, ...]:
    """Attributes of a medium behind smooth glass."""
    scattering, absorbing = (f"{numbers(x)}\n{numbers(x, x, x)}" for x in (sigma_s, sigma_a))
    return (
        "color 1 1 1",
        f"refractive_index {numbers(ETA)}",
        "reflection reflection",
        "reflection Subsurface_Scattering",
        f"SCATTERING\n{scattering}",
        f"ABSORBING\n{absorbing}",
        f"PAHASE {numbers(g, g, g)}",
        "level\n-2",
    )


def slab(*medium: float) -> str:
    """A half space, seen from above."""
    ground = plane((0, 0, 0), (0, 1, 0), *translucent(*medium))
    return text(ground, camera=(0, 5, 1e-3), angle=1, BACKGROUND=WHITE_SKY)


@family("mean cosine g", (-1, -0.99, -0.5, 0, 0.5, 0.9, 0.99, 1), "dipole")
def slab_by_phase_function(g: float) -> Case:
    """A half space with sigma_s = 1 and sigma_a = 0.1 returns R(inf) for the reduced albedo
    a = (1 - g) / (1 - g + 0.1), nothing for g = 1."""
    return Case(slab(1.0, 0.1, g), radiance(returned((1 - g) / (1.1 - g))))


@family("sigma_t [1/scene unit]", (0, 0.1, 1, 100, 1e4, 1e6), "dipole")
def slab_by_density(sigma: float) -> Case:
    """A half space of albedo a = 0.9 returns R(inf), whatever its density; but for its boundary it
    is black without a medium. (Below 0.1 the square that stands for the plane is too small.)"""
    return Case(slab(0.9 * sigma, 0.1 * sigma), radiance(returned(0.9) if sigma else 0))


@family("sigma_a [1/scene unit], sigma_s = 1", ENDS, "dipole")
def slab_by_absorption(sigma_a: float) -> Case:
    """A half space returns R(inf) for a = 1 / (1 + sigma_a)."""
    return Case(slab(1.0, sigma_a), radiance(returned(1 / (1 + sigma_a))))


@family("radius [mean free path]", (1e-3, 1e-2, 0.1, 1, 10, 100, 1e3, 1e4), "dipole")
def ball_by_free_paths(radius: float) -> Case:
    """In the middle of a ball of albedo 0.9, whose points at the chord length d have the area
    2 pi d dd, light returns from within the distance of the diameter: R(2 radius)."""
    ball = sphere((0, 0, 0), 1.0, *translucent(0.9 * radius, 0.1 * radius))
    scene = text(ball, camera=(0, 0, 3), angle=0.5, BACKGROUND=WHITE_SKY)
    # Only the mirror is seen of smaller balls, by a sample in twenty.
    spp = 64 if radius >= 1 else 2048
    return Case(scene, radiance(returned(0.9, 2 * radius)), spp=spp)
