"""Media: the one around all objects, and those inside objects (spec section 10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from relume.translator.document import Document
from relume.translator.giant_spheres import Ball
from relume.translator.materials import Reflectances
from relume.translator.materials_table import MATERIALS
from relume.translator.objects import SceneObject
from relume.translator.reflectances import entry
from relume.translator.scene_values import Entry, Mesh, rgb
from relume.translator.watertight import open_edges

LEAST_EXTINCTION = 1e-12
"""Mean extinction below which there is no medium [1/scene unit]."""

LEAST_CHANNEL = 1e-6
"""Least extinction of a channel in units of the largest: stock integrators lose the other channels,
or return NaN, where one has none."""

AROUND = "medium"
"""Name of the medium around all objects in the scene's dictionary."""

BOUNDARY = "medium_boundary"
"""Name of the shape that ends it."""

PROFILES = {"manual": "standard", "prender": "directional"}
"""Profile of the dipole in each dialect (row sss-dipole)."""

REFERENCE = {"type": "ref", "id": AROUND}
"""How sensor and shapes name it."""


@dataclass(frozen=True)
class HomogeneousMedium:
    """A homogeneous medium: triples for red, green and blue.

    Attributes:
        sigma_s, sigma_a: scattering and absorption coefficients [1/scene unit].
        g: mean cosines of the Henyey-Greenstein phase function.
    """

    sigma_s: tuple[float, ...]
    sigma_a: tuple[float, ...]
    g: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def sigma_t(self) -> np.ndarray:
        """Extinction coefficients, (3,)."""
        return np.add(self.sigma_s, self.sigma_a)

    @property
    def reduced(self) -> np.ndarray:
        """Reduced extinction coefficients sigma_s (1 - g) + sigma_a, (3,)."""
        return np.multiply(self.sigma_s, np.subtract(1, self.g)) + self.sigma_a

    @property
    def exists(self) -> bool:
        """Whether there is anything between the surfaces."""
        return bool(self.sigma_t.mean() >= LEAST_EXTINCTION)

    @property
    def chromatic(self) -> bool:
        """Whether the extinction differs between the channels."""
        return bool(np.ptp(self.sigma_t) > 1e-6 * self.sigma_t.max())

    def scaled(self, factor: float) -> HomogeneousMedium:
        """The medium with both coefficients multiplied."""
        s, a = (tuple(factor * x for x in sigma) for sigma in (self.sigma_s, self.sigma_a))
        return replace(self, sigma_s=s, sigma_a=a)

    def entry(self) -> Entry:
        """The dictionary of the medium; it must exist."""
        scale = float(self.sigma_t.max())
        extinction = np.maximum(self.sigma_t, LEAST_CHANNEL * scale)
        # Where a channel has none the albedo does not matter.
        albedo = np.divide(self.sigma_s, self.sigma_t, out=np.ones(3), where=self.sigma_t > 0)
        return {
            "type": "homogeneous",
            "albedo": rgb(albedo),
            "sigma_t": rgb(extinction / scale),
            "scale": scale,
            "phase": phase(self.g),
        }


def phase(g: Sequence[float]) -> Entry:
    """The dictionary of a phase function: Mitsuba's own where its single g will do."""
    if len(set(g)) == 1 and abs(g[0]) < 1:
        return {"type": "hg", "g": float(g[0])} if g[0] else {"type": "isotropic"}
    return {"type": "hgrgb", "g": [float(x) for x in g]}


def surrounding_medium(document: Document) -> HomogeneousMedium | None:
    """The medium around all objects, or None; notes go to the document's lines."""
    lines = document.lines
    if not document.participating_media:
        return None
    medium = HomogeneousMedium(document.scattering, document.absorbing, document.phase)
    if not medium.exists:
        lines.becomes("participating_media", "empty-medium")
        return None
    lines.remark("scattering", "medium-units")
    lines.remark("phase", "medium-phase")
    return medium


def boundary(ball: Ball, document: Document) -> Entry:
    """The shape that ends the medium around all objects: light from infinity must get through.

    Args:
        ball: a ball around the scene.
        document: the document, for a note.
    """
    document.lines.remark("participating_media", "medium-ball", radius=ball.radius)
    return {
        "type": "sphere",
        "center": [float(x) for x in ball.center],
        "radius": float(ball.radius),
        "bsdf": {"type": "null"},
        "interior": REFERENCE,
    }


def interior_medium(block: SceneObject) -> tuple[HomogeneousMedium, float]:
    """The medium inside an object and its index of refraction; notes go to the object's lines.

    `MATERIAL_SYMBOL` sets all of them; lines after it set their own anew (section 10.2).
    """
    medium = HomogeneousMedium(block.scattering, block.absorbing, block.phase or (0.0,) * 3)
    index = block.refractive_index
    if block.material_symbol is not None:
        measured = MATERIALS[block.material_symbol]
        own: dict[str, tuple[str, Any]] = {
            "sigma_s": ("scattering", measured.sigma_s),
            "sigma_a": ("absorbing", measured.sigma_a),
            "g": ("phase", measured.g),
        }
        for name, (field, value) in own.items():
            if not is_set_after(block, field, "material_symbol"):
                medium = replace(medium, **{name: value})
                block.lines.becomes(field, "replaced-by-material")
        if not is_set_after(block, "refractive_index", "material_symbol"):
            index = measured.eta
            block.lines.becomes("refractive_index", "index-from-material")
        if block.material_symbol.startswith("Chicken"):
            block.lines.remark("material_symbol", "chicken")
    elif index == 0:
        block.lines.remark("refractive_index", "index-zero")
        index = 1.5
    block.lines.remark("scattering", "sss-gate")
    if block.level == 0:
        r, g, b = (float(x) for x in medium.sigma_t)
        medium = replace(medium, sigma_s=(0.0,) * 3, sigma_a=(r, g, b))
        block.lines.remark("level", "level-0")
    elif block.level > 0:
        block.lines.becomes("level", "all-orders")
    return medium.scaled(block.material_scale), index


def report_open_meshes(block: SceneObject, meshes: Sequence[Mesh]) -> None:
    """Report it where the meshes that bound the medium inside an object leave it open."""
    count = open_edges(meshes) if meshes else 0
    if count:
        block.lines.becomes("", "mesh-not-closed", count=count)


def is_set_after(block: SceneObject, field: str, other: str) -> bool:
    """Whether a line that sets `field` comes after the one that sets `other`."""
    if not block.lines.of(field):
        return False
    return block.lines.line(field) > block.lines.line(other)


def dipole(
    block: SceneObject,
    reflectances: Reflectances,
    medium: HomogeneousMedium,
    index: float,
    dialect: str,
) -> Entry:
    """The dictionary of the material that the integrator `dipole` knows.

    Args:
        block: the object.
        reflectances: its colours, at most 1.
        medium: the medium inside.
        index: index of refraction inside.
        dialect: `manual` or `prender`.
    """
    scale = max(*medium.sigma_s, *medium.sigma_a, 1e-30)
    reach = search_radius(block, medium, dialect)
    if block.reflection.kind not in ("glass", None):
        block.lines.becomes("reflection", "dipole-boundary")
    return {
        "type": "subsurface",
        "sigma_s": rgb(np.divide(medium.sigma_s, scale)),
        "sigma_a": rgb(np.divide(medium.sigma_a, scale)),
        "scale": float(scale),
        "g": rgb(medium.g),
        "eta": index,
        "r_max": reach,
        "level": -2 if block.level == -2 else -1,
        "specular_reflectance": entry(reflectances.color),
        "specular_transmittance": entry(reflectances.color),
    }


def search_radius(block: SceneObject, medium: HomogeneousMedium, dialect: str) -> float:
    """Radius within which light may enter, 0 for no limit [scene unit].

    The manual's 1.25 sqrt(log(1e-4) / -sigma_t) R_max, with the least reduced extinction of the
    channels, loses a tenth to a half of the light that its own table says is reflected. So it
    limits what a file sets `MATERIAL_R_MAX` for, and all objects in the dialect `prender` (row
    sss-radius).
    """
    block.lines.remark("subsurface", "sss-radius", dialect=dialect)
    reduced = medium.reduced
    asked = block.lines.is_set("material_r_max") or dialect == "prender"
    if not asked or reduced.min() <= 0:
        return 0.0
    radius = 1.25 * float(np.sqrt(np.log(1e4) / reduced.min())) * block.material_r_max
    block.lines.remark("material_r_max", "search-radius", radius=radius)
    return radius


def obstacle_to_dipole(document: Document, spectral: bool) -> str | None:
    """Code of the reason why objects that ask for the dipole are simulated; None if they are not.

    Args:
        document: the document.
        spectral: whether the scene is rendered by wavelength.
    """
    if document.participating_media:
        return "simulated-in-medium"
    if spectral:
        return "simulated-by-wavelength"
    scattering = (b for b in document.objects if b.reflection.subsurface)
    if any(not uses_dipole(block) for block in scattering):
        return "simulated-with-another"
    return None


def uses_dipole(block: SceneObject) -> bool:
    """Whether an object is rendered by the dipole: the last of `BSSRDF` and `level` counts.

    `level -2` asks for the dipole, a level from 0 on for the simulation (section 10.2).
    """
    if block.level == -1 or is_set_after(block, "bssrdf", "level"):
        return block.bssrdf
    return block.level == -2


def with_method(document: Document, dipole: bool) -> Document:
    """A document all of whose scattering objects are rendered one way.

    Args:
        document: the document; left as it is.
        dipole: True for the dipole, False for the simulation.
    """

    def forced(block: SceneObject) -> SceneObject:
        stays = block.level == -1 or (block.level == -2) == dipole
        # As an environment variable would, which no line tells of.
        said = {"bssrdf": block.lines.reports.get("bssrdf", [])}
        lines = replace(block.lines, reports=block.lines.reports | said)
        return replace(block, bssrdf=dipole, level=block.level if stays else -1, lines=lines)

    return replace(document, objects=[forced(block) for block in document.objects])
