"""Where the dipole is far off: its measured error, and which objects are simulated instead.

`BSSRDF` 1, the default, is the dipole of the manual. Its formulas are those of a flat half space in
which light is scattered many times, and objects that are small or dark are neither. For balls of 0.3
to 300 reduced mean free paths `docs/subsurface.md` has how far its light is from that of
`randomwalk`, and the time of both: the simulation is as quick or quicker in objects thinner than
`THIN`, and beyond it walks are short wherever the dipole is wrong, for there they are soon absorbed.

So the dialect `manual` takes the default for a wish to have the light of the medium: closed objects
are simulated in which the dipole is off by more than `TOLERATED`, or that are thinner than `THIN`.
An object whose lines ask for the dipole, by `BSSRDF` 1, `level` -2 or `MATERIAL_R_MAX`, has it, and
the dialect `prender` has that of the program; notes tell the error.
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

THIN = 10.0
"""Radius below which objects are simulated [reduced mean free path]."""

TOLERATED = 0.1
"""Largest relative error of the dipole's light in a channel where the dipole is taken."""

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
                [100, 136, 129, 122, 119, 116, 115, 115, 115, 116],
                [100, 136, 129, 122, 119, 117, 117, 100, 100, 100],
                [100, 100, 100, 100, 100, 100, 100, 100, 100, 100],
            ],
            [
                [100, 101, 102, 102, 101, 102, 102, 102, 102, 103],
                [100, 107, 105, 103, 102, 103, 104, 105, 106, 107],
                [100, 119, 112, 105, 101, 99, 100, 103, 105, 108],
                [100, 133, 125, 117, 113, 110, 109, 108, 109, 113],
                [100, 136, 129, 122, 119, 116, 115, 115, 115, 116],
                [100, 136, 129, 122, 119, 117, 117, 100, 100, 100],
                [100, 100, 100, 100, 100, 100, 100, 100, 100, 100],
            ],
            [
                [100, 101, 102, 102, 101, 102, 102, 102, 102, 103],
                [100, 107, 105, 103, 102, 103, 104, 105, 106, 107],
                [100, 119, 112, 105, 101, 99, 100, 103, 105, 108],
                [100, 133, 125, 117, 113, 110, 109, 108, 109, 113],
                [100, 136, 129, 122, 119, 116, 115, 115, 115, 116],
                [100, 136, 129, 122, 119, 117, 117, 100, 100, 100],
                [100, 100, 100, 100, 100, 100, 100, 100, 100, 100],
            ],
        ]
    )
    / 100
)
"""Light of balls by the dipole (`standard`, level -1) over that of the simulation (3, 7, 10)."""


@dataclass(frozen=True)
class DipoleError:
    """How far the dipole is off in an object.

    Attributes:
        error: relative error of its light in the channel where it is largest.
        radius: of the object in that channel [reduced mean free path]; infinite if it has no
            inside.
        mean_radius: mean over the channels that scatter.
    """

    error: float
    radius: float
    mean_radius: float

    @property
    def is_small(self) -> bool:
        """Whether the dipole is right."""
        return abs(self.error) <= TOLERATED

    @property
    def is_avoided(self) -> bool:
        """Whether the simulation is right and quick, and the dipole is not."""
        closed = math.isfinite(self.mean_radius)
        return closed and (not self.is_small or self.mean_radius < THIN)

    @property
    def values(self) -> dict[str, str]:
        """What notes say of it: `percent`, how far it is off, and `where`."""
        size = f"a body of {self.radius:.2g} mean free paths"
        return {
            "percent": f"{abs(100 * self.error):.0f} % too {'dark' if self.error < 0 else 'bright'}",
            "where": size if math.isfinite(self.radius) else "a half space",
        }


def relative_error(radius: float, albedo: float, eta: float) -> float:
    """How much brighter than the simulation the dipole is, from `LIGHT`; 0 is right.

    Args:
        radius: of the object [reduced mean free path].
        albedo: reduced albedo.
        eta: index of refraction inside.
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
    return float(found) - 1


def dipole_error(medium: HomogeneousMedium, eta: float, radius: float) -> DipoleError | None:
    """The `DipoleError` of an object; None where nothing scatters, and the dipole is exact.

    Args:
        medium: inside.
        eta: index of refraction inside.
        radius: of the object, see `ball_radius` [scene unit].
    """
    channels = [
        (radius * float(t), relative_error(radius * float(t), float(1 - a / t), eta))
        for t, s, a in zip(medium.reduced, medium.sigma_s, medium.sigma_a, strict=True)
        if t > a and s > 0
    ]
    if not channels:
        return None
    size, error = max(channels, key=lambda channel: abs(channel[1]))
    return DipoleError(error, size, sum(size for size, _ in channels) / len(channels))


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


def report(block: SceneObject, obstacle: str | None, error: DipoleError | None) -> None:
    """Report how an object is rendered that does not ask for the simulation, and why.

    Args:
        block: the object.
        obstacle: code of the reason why it is simulated, or None.
        error: of the dipole there, or None where it is not known.
    """
    if obstacle == FAR_OFF:
        if error is not None and error.is_avoided:
            block.lines.remark("subsurface", FAR_OFF, **error.values)
        else:
            block.lines.becomes("subsurface", "simulated-with-another")
    elif obstacle is not None:
        block.lines.becomes("subsurface", obstacle)
    elif error is not None and error.is_small:
        block.lines.remark("subsurface", "dipole-fits", **error.values)
    elif error is not None:
        block.lines.becomes("subsurface", "dipole-off", **error.values)
