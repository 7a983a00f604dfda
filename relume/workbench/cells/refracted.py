"""Lamps behind refracting glass, of all sizes, against answers that trace no path of a camera."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import qmc

from relume.workbench.cells.family import Case, family
from relume.workbench.cells.glass import glass
from relume.workbench.cells.scenes import diffuse, emission, sphere, text, uvplane

BOTH_ENDS = ("surfacepath", "bdpt")
SIZES = (1, 0.1, 0.01, 1e-3, 0)
BLACK = diffuse(0)

BALL, LAMP = 3.0, 5.0
"""Heights of a glass ball of radius 1 and of the lamp's centre above the floor."""
INDEX = 1.5
POWER_OF_TWO = 19
"""Of the number of rays of a quadrature."""


def lamp(angle: float, height: float, distance: float) -> str:
    """A lamp of intensity pi, that subtends an angle [rad] at a distance below it; 0 is a spot,
    which shines into the half space below."""
    if angle == 0:
        spot = ("spot_light 1", "spot_light_dir 0 0 -1", "spot_light_angle 90 0")
        return sphere((0, 0, height), 0.01, emission(1), *spot, *BLACK)
    radius = distance * math.sin(angle / 2)
    return sphere((0, 0, height), radius, emission(radius**-2), *BLACK)


def quasi_random(dimensions: int) -> np.ndarray:
    """Points of a Sobol sequence, (2^POWER_OF_TWO, dimensions)."""
    return np.asarray(qmc.Sobol(dimensions, seed=0).random_base2(POWER_OF_TWO))


def lamp_rays(points: np.ndarray, radius: float, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions from points (N, 3) to the lamp of intensity pi, uniform in the cone that it fills,
    and their radiance times the cone's solid angle."""
    axis = np.array([0, 0, LAMP]) - points
    d = np.linalg.norm(axis, axis=1)
    axis = axis / d[:, None]
    cosine = np.sqrt(1 - (radius / d) ** 2)
    versine = u[:, 0] * (radius / d) ** 2 / (1 + cosine)
    sine, phi = np.sqrt(versine * (2 - versine)), 2 * np.pi * u[:, 1]
    first = np.cross(axis, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(axis, first)
    across = np.cos(phi)[:, None] * first + np.sin(phi)[:, None] * second
    # radiance 1 / radius², solid angle 2 pi (1 - cosine)
    return (1 - versine)[:, None] * axis + sine[:, None] * across, 2 * np.pi / (d**2 * (1 + cosine))


def on_the_square(p: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Which rays that go down from p along d meet the floor where |x| and |y| are below 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        hit = p - d * (p[:, 2:] / d[:, 2:])
    return (d[:, 2] < 0) & (np.abs(hit[:, :2]) < 1).all(axis=1)


def flux_through_the_ball(radius: float) -> float:
    """Flux onto the square by way of the ball: all rays of the lamp that meet it, followed through
    all reflections inside, at each of which Schlick's F is the same."""
    u = quasi_random(4)
    z, phi = 2 * u[:, 0] - 1, 2 * np.pi * u[:, 1]
    rho = np.sqrt(1 - z * z)
    n = np.stack([rho * np.cos(phi), rho * np.sin(phi), z], axis=1)
    centre = np.array([0, 0, BALL])
    to_lamp, weight = lamp_rays(centre + n, radius, u[:, 2:])
    cosine = (to_lamp * n).sum(axis=1)
    weight = 4 * np.pi * weight * np.maximum(cosine, 0)
    base = ((1 - INDEX) / (1 + INDEX)) ** 2
    F = base + (1 - base) * (1 - np.maximum(cosine, 0)) ** 5
    reflected = 2 * cosine[:, None] * n - to_lamp
    total = weight * F * on_the_square(centre + n, reflected)
    # Inside, each chord turns the point and the direction by the same angle.
    cos_t = np.sqrt(1 - (1 - cosine**2) / INDEX**2)
    inside = -to_lamp / INDEX + (cosine / INDEX - cos_t)[:, None] * n
    share = weight * (1 - F) ** 2
    for _ in range(20):
        n = n + 2 * cos_t[:, None] * inside
        out = INDEX * inside - (INDEX * cos_t - cosine)[:, None] * n
        total += share * on_the_square(centre + n, out)
        inside = inside - 2 * cos_t[:, None] * n
        share = share * F
    return float(total.mean())


def flux_beside_the_ball(radius: float) -> float:
    """Flux onto the square along rays that miss the ball."""
    u = quasi_random(4)
    p = np.stack([2 * u[:, 0] - 1, 2 * u[:, 1] - 1, 0 * u[:, 0]], axis=1)
    d, weight = lamp_rays(p, radius, u[:, 2:])
    to_centre = np.array([0, 0, BALL]) - p
    missed = np.linalg.norm(np.cross(to_centre, d), axis=1) > 1
    return 4 * float((weight * d[:, 2] * missed).mean())


CHANCE = (
    "A ray from the surface meets the lamp with the probability p = E / (pi L), which goes with "
    "the square of its size: the deviation of N samples is 1 / sqrt(p N), and a lamp without size "
    "is never met."
)


@family(
    "angle that the lamp subtends [rad], 0 for a spot",
    SIZES,
    *BOTH_ENDS,
    why=f"{CHANCE} At 0.01 rad p is about 1.7e-5: some 1100 of the 6.7e7 samples of a cell find "
    "the lamp, and 11 at 0.001. Of `bdpt` one light path in fifteen meets the ball, whatever the "
    "size.",
)
def caustic_by_lamp_size(angle: float) -> Case:
    """A lamp of intensity pi above a glass ball throws a caustic on a floor of albedo rho = 1/100,
    whose light is lost: the mean over a square is rho / pi times its share of the light over its
    area, by quadrature over all rays from lamp to ball in double precision."""
    radius = (LAMP - BALL) * math.sin(angle / 2)
    flux = flux_through_the_ball(radius) + flux_beside_the_ball(radius)
    floor = uvplane((-2, -2, 0), (4, 0, 0), (0, 4, 0), *diffuse(0.01))
    ball = sphere((0, 0, BALL), 1, *glass(1, INDEX))
    scene = text(floor, ball, lamp(angle, LAMP, LAMP - BALL), camera=(0, 0, 1), angle=90)
    return Case(scene, 0.01 / math.pi * flux / 4, spp=1024)


def let_out(ratio: float) -> float:
    """Share 1 - F of the light of a Lambertian sphere in the middle of a ball of glass that leaves
    it; what is reflected meets the sphere again. `ratio` is the sine of the angle outside over that
    at the sphere."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    s2, w = (nodes + 1) / 2, weights / 2  # by the square of the sine at the sphere
    return float(np.dot(w, 1 - (1 - np.sqrt(1 - ratio**2 * s2)) ** 5))


def bulb(index: float, radius: float) -> Case:
    """A lamp in the middle of a glass ball of radius 0.3 in the middle of a round room.

    Its wall gets E = pi L r² T / (1 - rho + rho (n r)² T) for the room's radius 1: what leaves the
    lamp, 4 pi² r² L T, less what of the wall's radiance rho E / pi gets back to it, 4 pi (n r)² T
    of it, is absorbed by the wall, 4 pi (1 - rho) E. All is alike on all sides."""
    rho, L = 0.5, radius**-2
    base = ((1 - index) / (1 + index)) ** 2
    T = (1 - base) * let_out(index * radius / 0.3)
    E = math.pi * L * radius**2 * T / (1 - rho + rho * (index * radius) ** 2 * T)
    source = sphere((0, 0, 0), radius, emission(L), *BLACK)
    ball = sphere((0, 0, 0), 0.3, *glass(1, index))
    room = sphere((0, 0, 0), 1, *diffuse(rho))
    scene = text(source, ball, room, camera=(0, 0, 0.5), target=(0, 0, 1), angle=60)
    return Case(scene, rho * E / math.pi, spp=512)


@family("index of the bulb", (1, 1.0001, 1.1, 1.33, 1.5), *BOTH_ENDS)
def lamp_in_a_bulb(index: float) -> Case:
    """A black lamp of radius r and radiance L = 1/r² in the middle of a ball of glass in the middle
    of a room of radius 1 and albedo rho: E = pi L r² T / (1 - rho + rho (n r)² T), the share
    T = <1 - F> over the lamp's directions, shows as rho E / pi."""
    return bulb(index, 0.1)


@family(
    "radius of the lamp over that of the bulb",
    (0.3, 0.1, 0.03, 0.01),
    *BOTH_ENDS,
    why=f"{CHANCE} Here p = (n r)² T, 2e-3 to 2e-5 from 0.1 to 0.01; each finding counts once, the "
    "reflections of the room with it.",
)
def small_lamp_in_a_bulb(ratio: float) -> Case:
    """As lamp in a bulb, of index 1.5."""
    return bulb(1.5, 0.3 * ratio)


WATER, DEPTH, HEIGHT = 4 / 3, 1.0, 2.0
EYE, AIM, FIELD = np.array([3.0, 0.0, 2.0]), np.array([-0.5, 0.0, 0.0]), 12.0
"""Of the camera: place, point of the water, and angle [degree]. Neither the lamp nor its mirror
image is in its field."""


def into_water(sine: np.ndarray) -> np.ndarray:
    """Tangent of the angle in water, of the sine of that in air."""
    under = sine / WATER
    return np.asarray(under / np.sqrt(1 - under**2))


def passed(cosine: np.ndarray) -> np.ndarray:
    """1 - F by Schlick, at the surface of the water."""
    base = ((1 - WATER) / (1 + WATER)) ** 2
    return 1 - (base + (1 - base) * (1 - cosine) ** 5)


def seen_grounds(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of the ground (N, 2) that places on the film, (N, 2) in [0, 1), see, and the share of
    their radiance that gets there."""
    forward = (AIM - EYE) / np.linalg.norm(AIM - EYE)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    x, y = ((2 * u - 1) * math.tan(math.radians(FIELD / 2))).T
    d = forward + x[:, None] * right + y[:, None] * np.cross(right, forward)
    d /= np.linalg.norm(d, axis=1)[:, None]
    sine = np.hypot(d[:, 0], d[:, 1])
    way = EYE[2] * sine / -d[:, 2] + DEPTH * into_water(sine)
    ground = EYE[:2] + way[:, None] * d[:, :2] / sine[:, None]
    return ground, passed(-d[:, 2]) / WATER**2


def pool_radiance(angle: float) -> float:
    """Mean radiance of ground of albedo 1 below water, over the film.

    A point at the height h above the water sends the light of the directions d Omega to the area
    d A = r dr dphi of the ground, with r = h tan(t) + DEPTH tan(t') and sin(t) = WATER sin(t').
    """
    u = quasi_random(4)[: 2**16]
    ground, share = seen_grounds(u[:, :2])
    z, phi = 2 * u[:, 2] - 1, 2 * np.pi * u[:, 3]
    rho = np.sqrt(1 - z * z)
    n = np.stack([rho * np.cos(phi), rho * np.sin(phi), z], axis=1)
    at = np.array([0, 0, HEIGHT]) + HEIGHT * math.sin(angle / 2) * n
    across = ground - at[:, :2]
    r, h = np.linalg.norm(across, axis=1), at[:, 2]
    low, high = np.zeros_like(r), np.ones_like(r)  # of sin(t)
    for _ in range(36):
        s = (low + high) / 2
        beyond = h * s / np.sqrt(1 - s * s) + DEPTH * into_water(s) > r
        low, high = np.where(beyond, low, s), np.where(beyond, s, high)
    cos, cos_w = np.sqrt(1 - s * s), np.sqrt(1 - (s / WATER) ** 2)
    dr = h / cos**2 + DEPTH / cos_w**2 * cos / (WATER * cos_w)
    out = np.concatenate([across / r[:, None] * s[:, None], -cos[:, None]], axis=1)
    # Intensity pi: 4 pi radius² times the radiance 1 / radius² and the cosine; a spot has no size.
    intensity = 4 * np.pi * np.maximum((n * out).sum(axis=1), 0) if angle else np.pi
    return float(np.mean(intensity * passed(cos) * s / (r * dr) * share)) / math.pi


@family(
    "angle that the lamp subtends [rad], 0 for a spot",
    SIZES,
    *BOTH_ENDS,
    "bdpt-merging",
    why=f"The ground is between two refractions, which have one direction each: no vertex of the "
    f"path can be connected with the camera, the lamp or another, and of all ways of `bdpt` only "
    f"to meet the lamp is left, as for `surfacepath`. {CHANCE} `bdpt-merging` finds it.",
)
def pool(angle: float) -> Case:
    """Ground of albedo rho = 1e-4 in water below a lamp of intensity pi, seen from above:
    rho E / pi (1 - F) / n², with E by the refracted rays from all points of the lamp less F, by
    quadrature over lamp and film in double precision."""
    albedo = 1e-4
    water = uvplane((-50, -50, 0), (100, 0, 0), (0, 100, 0), *glass(1, WATER))
    ground = uvplane((-50, -50, -DEPTH), (100, 0, 0), (0, 100, 0), *diffuse(albedo))
    scene = text(water, ground, lamp(angle, HEIGHT, HEIGHT), camera=EYE.tolist(),
                 target=AIM.tolist(), up=(0, 0, 1), angle=FIELD)  # fmt: skip
    return Case(scene, albedo * pool_radiance(angle), spp=1024)
