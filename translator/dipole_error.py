"""Where the dipole is far off: its measured error, and which objects are simulated instead.

`BSSRDF` 1, the default, is the dipole of the manual. Its formulas are those of a flat half space in
which light is scattered many times, and objects that are small or dark are neither.
`docs/subsurface.md` has the map: how far its light is from that of `randomwalk` in balls of 0.3 to
300 reduced mean free paths, and the time of both.

So the dialect `manual` takes the default for a wish to have the light of the medium: closed objects
are simulated in which the dipole is off by more than `TOLERATED`, or that are thinner than `THIN`,
where it is no quicker, unless walks have more than `LONGEST` scatterings: mostly they are short
where the dipole is wrong, for they soon leave, or are soon absorbed. An object whose lines ask for
the dipole, by `BSSRDF` 1, `level` -2 or `MATERIAL_R_MAX`, has it, and the dialect `prender` has
that of the program; notes tell the error.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relume.translator.document import Document
from relume.translator.media import HomogeneousMedium, interior_medium, uses_dipole
from relume.translator.objects import SceneObject
from relume.translator.scene_values import Mesh
from relume.translator.watertight import open_edges

FAR_OFF = "simulated-far-off"
"""Code of the reason why an object is simulated in which the dipole is far off."""

THIN = 3.0
"""Mean radius below which objects are simulated [reduced mean free path]."""

TOLERATED = 0.1
"""Largest relative error of the dipole's light in a channel where the dipole is taken."""

LONGEST = 200.0
"""Scatterings of a walk up to which objects are simulated without being asked for it."""

ETAS = (1.0, 1.3, 1.5)
RADII = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
ALBEDOS = (0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999)
"""Refractive indices, radii [reduced mean free path] and reduced albedos of `LIGHT`."""

LIGHT = (
    np.array(
        [
            [
                [100, 101, 102, 102, 101, 102, 102, 102, 102, 103],
                [100, 107, 105, 103, 102, 103, 104, 105, 106, 107],
                [100, 119, 112, 105, 101, 99, 100, 103, 105, 108],
                [100, 133, 125, 117, 113, 110, 109, 108, 109, 113],
                [100, 137, 129, 122, 119, 116, 115, 115, 115, 116],
                [100, 136, 129, 123, 120, 118, 117, 117, 117, 117],
                [100, 131, 125, 120, 118, 116, 116, 116, 116, 117],
            ],
            [
                [100, 96, 92, 88, 85, 83, 82, 81, 80, 80],
                [100, 95, 89, 81, 77, 72, 71, 70, 70, 71],
                [100, 119, 110, 95, 86, 77, 73, 72, 73, 76],
                [100, 138, 135, 122, 112, 99, 91, 87, 87, 90],
                [100, 141, 140, 129, 120, 109, 102, 97, 96, 96],
                [100, 141, 141, 132, 123, 112, 106, 101, 100, 99],
                [100, 140, 140, 131, 123, 112, 106, 102, 100, 100],
            ],
            [
                [100, 94, 90, 85, 81, 78, 76, 74, 74, 74],
                [100, 95, 88, 80, 74, 67, 64, 62, 62, 61],
                [100, 119, 116, 103, 91, 77, 69, 65, 64, 65],
                [100, 132, 138, 132, 121, 104, 91, 82, 80, 81],
                [100, 134, 143, 140, 131, 116, 104, 94, 91, 89],
                [100, 134, 144, 142, 134, 119, 108, 99, 96, 94],
                [100, 133, 143, 142, 134, 120, 109, 100, 97, 95],
            ],
        ]
    )
    / 100
)
"""Light of balls by the dipole (`standard`, level -1) over that of the simulation (3, 7, 10)."""

FORWARD_RADII, FORWARD = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0), (0.2, 0.48, 0.77, 0.85, 0.87, 0.88)
"""By radius, what of `LIGHT` is left where the mean cosine is 0.9: single scattering, which goes
ahead, gives less of it. The mean over albedos of 0.8 to 0.999 (within 0.05), index 1.3."""

COSINES, FALL = (0.0, 0.5, 0.75, 0.9), (0.0, 0.68, 0.86, 1.0)
"""Mean cosines, and how much of the way to `FORWARD` they go."""


@dataclass(frozen=True)
class DipoleError:
    """How far the dipole is off in an object.

    Attributes:
        error: relative error of its light in the channel where it is largest.
        radius: of the object in that channel [reduced mean free path]; infinite if it has no
            inside.
        mean_radius: mean over the channels that scatter.
        scatterings: of a walk, about, in the channel where they are most.
    """

    error: float
    radius: float
    mean_radius: float
    scatterings: float

    @property
    def is_small(self) -> bool:
        """Whether the dipole is right."""
        return abs(self.error) <= TOLERATED

    @property
    def is_avoided(self) -> bool:
        """Whether the simulation is right and quick, and the dipole is not."""
        quick = math.isfinite(self.mean_radius) and self.scatterings <= LONGEST
        return quick and (not self.is_small or self.mean_radius < THIN)

    @property
    def percent(self) -> str:
        """How far it is off, for notes."""
        return f"{abs(100 * self.error):.0f} % too {'dark' if self.error < 0 else 'bright'}"

    @property
    def where(self) -> str:
        """The size of the object, for notes."""
        if math.isinf(self.radius):
            return "a half space"
        return f"a body of {self.radius:.2g} mean free paths"


def relative_error(radius: float, albedo: float, eta: float, g: float = 0.0) -> float:
    """How much brighter than the simulation the dipole is, from `LIGHT`; 0 is right.

    Args:
        radius: of the object [reduced mean free path].
        albedo: reduced albedo.
        eta: index of refraction inside.
        g: mean cosine.
    """
    found = LIGHT
    # In these coordinates the light is nearly linear; beyond the table its ends count.
    for x, nodes in (
        (eta, ETAS),
        (math.log(max(radius, 1e-30)), np.log(RADII)),
        (-math.log(max(1 - albedo, 1e-30)), -np.log1p(-np.array(ALBEDOS))),
    ):
        place = float(np.interp(x, nodes, np.arange(len(nodes))))
        low = min(int(place), len(nodes) - 2)
        found = found[low] + (place - low) * (found[low + 1] - found[low])
    lost = 1 - float(np.interp(math.log(max(radius, 1e-30)), np.log(FORWARD_RADII), FORWARD))
    lost *= float(np.interp(g, COSINES, FALL)) * min(albedo / 0.8, 1)
    # What is scattered at all in smaller objects falls with their size.
    return (float(found) * (1 - lost) - 1) * min(radius / RADII[0], 1)


def dipole_error(medium: HomogeneousMedium, eta: float, radius: float) -> DipoleError | None:
    """The `DipoleError` of an object; None where nothing scatters, and the dipole is exact.

    Args:
        medium: inside.
        eta: index of refraction inside.
        radius: of the object, see `ball_radius` [scene unit].
    """
    sizes, errors, scatterings = [], [], []
    for t, s, a, g in zip(medium.reduced, medium.sigma_s, medium.sigma_a, medium.g, strict=True):
        if t <= a or s <= 0:
            continue
        sizes.append(radius * float(t))
        errors.append(relative_error(sizes[-1], float(1 - a / t), eta, g))
        # What crosses a body goes 4/3 of its radius on average, however often it is scattered.
        scatterings.append(min(4 / 3 * radius * s, (s + a) / a if a > 0 else math.inf))
    if not sizes:
        return None
    worst = int(np.argmax(np.abs(errors)))
    return DipoleError(errors[worst], sizes[worst], float(np.mean(sizes)), max(scatterings))


def mesh_radius(meshes: Sequence[Mesh]) -> float:
    """Three times the volume over the surface of meshes that are closed together, else infinite.

    That is the radius of a ball, and 3/2 of the thickness of a sheet: what counts is how far light
    gets before it meets a surface, on average 4/3 of it in any body.
    """
    if not meshes or open_edges(meshes):
        return math.inf
    volume = area = 0.0
    middle = np.mean([mesh.vertices.mean(axis=0) for mesh in meshes], axis=0)
    for mesh in meshes:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] - middle for k in range(3))
        volume += float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
        area += float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2
    return 3 * abs(volume) / area if area > 0 else math.inf


def ball_radius(radius: float, linear: np.ndarray) -> float:
    """Three times the volume over the surface of the ellipsoid that a sphere becomes.

    Its surface is that of K. Thomsen's formula (2004), 1 % off at most.

    Args:
        radius: of the sphere.
        linear: what turns it into the ellipsoid, (3, 3).
    """
    a, b, c = (float(x) for x in np.linalg.svd(linear, compute_uv=False))
    p = 1.6075
    mean = (((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3) ** (1 / p)
    return radius * a * b * c / mean if mean > 0 else 0.0


def asks_for_dipole(block: SceneObject) -> bool:
    """Whether lines of an object, or its environment variable, ask for the dipole."""
    said = block.lines.is_set("bssrdf") or block.lines.is_set("material_r_max")
    return uses_dipole(block) and (said or block.level == -2)


def error_of(block: SceneObject, radius: float) -> DipoleError | None:
    """The error of the dipole in an object that it may render, or None where it has no figure.

    Args:
        block: the object.
        radius: its radius [scene unit].
    """
    # Multiple scattering alone, which `level` -2 asks for, is another light.
    return None if block.level == -2 else dipole_error(*interior_medium(block), radius)


def error_of_materials(blocks: Sequence[SceneObject], meshes: Sequence[Mesh]) -> DipoleError | None:
    """The largest error of the dipole in a mesh whose file has materials that scatter, or None.

    Args:
        blocks: the object with the attributes of each of these materials.
        meshes: what is made of them.
    """
    radius = mesh_radius(meshes)
    errors = [error_of(block, radius) for block in blocks]
    known = [error for error in errors if error is not None]
    return max(known, key=lambda error: abs(error.error), default=None)


def obstacle(document: Document, errors: Mapping[int, DipoleError]) -> str | None:
    """Code of the reason why objects without a word on it are simulated; None if they are not.

    One integrator renders all of them, so a single object that asks for the dipole decides.

    Args:
        document: the document.
        errors: of objects that the dipole may render, by their index.
    """
    if any(block.reflection.subsurface and asks_for_dipole(block) for block in document.objects):
        return None
    return FAR_OFF if any(error.is_avoided for error in errors.values()) else None


def tell_method(block: SceneObject, code: str | None, error: DipoleError | None) -> None:
    """Report how an object is rendered that does not ask for the simulation, and why.

    Args:
        block: the object.
        code: of the reason why it is simulated, or None.
        error: of the dipole there, or None where it is not known.
    """
    lines = block.lines
    # Materials of mesh files scatter without a line of the object that says so.
    place = "subsurface" if lines.is_set("subsurface") else ""
    if code == FAR_OFF:
        if error is not None and error.is_avoided:
            lines.remark(place, "simulated-far-off", percent=error.percent, where=error.where)
            return
        code = "simulated-with-another"
    if code is not None:
        lines.becomes(place, code)
    elif error is not None and error.is_small:
        lines.remark(place, "dipole-fits", percent=error.percent, where=error.where)
    elif error is not None:
        lines.becomes(place, "dipole-off", percent=error.percent, where=error.where)
