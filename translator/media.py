"""Media: the one around all objects, and those inside objects (spec section 10)."""

from dataclasses import dataclass, replace

import numpy as np

from relume.translator.dialects import note
from relume.translator.materials_table import MATERIALS
from relume.translator.reflectances import entry
from relume.translator.scene_values import rgb
from relume.translator.watertight import open_edges

NONE = 1e-12
"""Mean extinction below which there is no medium [1/scene unit]."""

FLOOR = 1e-6
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

    sigma_s: tuple
    sigma_a: tuple
    g: tuple = (0.0, 0.0, 0.0)

    @property
    def sigma_t(self):
        """Extinction coefficients, (3,)."""
        return np.add(self.sigma_s, self.sigma_a)

    @property
    def reduced(self):
        """Reduced extinction coefficients sigma_s (1 - g) + sigma_a, (3,)."""
        return np.multiply(self.sigma_s, np.subtract(1, self.g)) + self.sigma_a

    @property
    def exists(self):
        """Whether there is anything between the surfaces."""
        return self.sigma_t.mean() >= NONE

    @property
    def chromatic(self):
        """Whether the extinction differs between the channels."""
        return bool(np.ptp(self.sigma_t) > 1e-6 * self.sigma_t.max())

    def scaled(self, factor):
        """The medium with both coefficients multiplied."""
        s, a = (tuple(factor * x for x in sigma) for sigma in (self.sigma_s, self.sigma_a))
        return replace(self, sigma_s=s, sigma_a=a)

    def entry(self):
        """The dictionary of the medium; it must exist."""
        scale = float(self.sigma_t.max())
        extinction = np.maximum(self.sigma_t, FLOOR * scale)
        # Where a channel has none the albedo does not matter.
        albedo = np.divide(self.sigma_s, self.sigma_t, out=np.ones(3), where=self.sigma_t > 0)
        return {
            "type": "homogeneous",
            "albedo": rgb(albedo),
            "sigma_t": rgb(extinction / scale),
            "scale": scale,
            "phase": phase(self.g),
        }


def phase(g):
    """The dictionary of a phase function: Mitsuba's own where its single g will do."""
    if len(set(g)) == 1 and abs(g[0]) < 1:
        return {"type": "hg", "g": float(g[0])} if g[0] else {"type": "isotropic"}
    return {"type": "hgrgb", "g": [float(x) for x in g]}


def around(document):
    """The `HomogeneousMedium` around all objects, or None; notes go to the document's lines."""
    source = document.lines
    if not document.participating_media:
        return None
    medium = HomogeneousMedium(document.scattering, document.absorbing, document.phase)
    if not medium.exists:
        source.becomes("participating_media", "ignored", "no SCATTERING or ABSORBING above 0")
        return None
    source.remark("scattering", note("medium-units", "manual"))
    source.remark("phase", note("medium-phase", "manual"))
    return medium


def boundary(ball, document):
    """The shape that ends the medium around all objects: light from infinity must get through.

    Args:
        ball: `giant_spheres.Ball` around the scene.
        document: the document, for a note.
    """
    text = f"fills a ball of radius {ball.radius:.4g} around the scene"
    document.lines.remark("participating_media", text)
    return {
        "type": "sphere",
        "center": [float(x) for x in ball.center],
        "radius": float(ball.radius),
        "bsdf": {"type": "null"},
        "interior": REFERENCE,
    }


def inside(block):
    """The medium inside an object and its index of refraction; notes go to the object's lines.

    `MATERIAL_SYMBOL` sets all of them; lines after it set their own anew (section 10.2).
    """
    medium = HomogeneousMedium(block.scattering, block.absorbing, block.phase or (0.0,) * 3)
    index = block.refractive_index
    if block.material_symbol is not None:
        measured = MATERIALS[block.material_symbol]
        own = {
            "sigma_s": ("scattering", measured.sigma_s),
            "sigma_a": ("absorbing", measured.sigma_a),
            "g": ("phase", measured.g),
        }
        for name, (field, value) in own.items():
            if not later(block, field, "material_symbol"):
                medium = replace(medium, **{name: value})
                block.lines.becomes(field, "ignored", "MATERIAL_SYMBOL below sets it anew")
        if not later(block, "refractive_index", "material_symbol"):
            index = measured.eta
            block.lines.becomes("refractive_index", "ignored", "MATERIAL_SYMBOL sets the index")
        if block.material_symbol.startswith("Chicken"):
            block.lines.remark("material_symbol", note("chicken", "manual"))
    elif index == 0:
        block.lines.remark("refractive_index", "0 read as 1.5")
        index = 1.5
    if block.lines.reports.get("scattering"):
        block.lines.remark("scattering", note("sss-gate", "manual"))
    if block.level == 0:
        medium = replace(medium, sigma_s=(0.0,) * 3)
        block.lines.remark("level", "absorption alone")
    elif block.level > 0:
        block.lines.becomes("level", "approximated", "scattering of every order is followed")
    return medium.scaled(block.material_scale), index


def check_closed(block, parts):
    """Note it where the meshes of an object with a medium inside leave it open.

    Args:
        block: `SceneObject`.
        parts: `meshes.Part`s that bound the medium.
    """
    meshes = [part.entry["mesh"] for part in parts]
    count = open_edges(meshes) if meshes else 0
    if count:
        text = f"the mesh is not closed: {count} edges have no second face, light leaks there"
        block.lines.becomes("", "approximated", text)


def later(block, field, other):
    """Whether a line that sets `field` comes after the one that sets `other`."""
    if not block.lines.reports.get(field):
        return False
    return block.lines.line(field) > block.lines.line(other)


def subsurface(block, reflectances, medium, index, dialect):
    """The dictionary of the material that the integrator `dipole` knows.

    Args:
        block: `SceneObject`.
        reflectances: its `Reflectances`, at most 1.
        medium: the `HomogeneousMedium` inside.
        index: index of refraction inside.
        dialect: `manual` or `prender`.
    """
    scale = max(*medium.sigma_s, *medium.sigma_a, 1e-30)
    reach = search_radius(block, medium, dialect)
    if block.reflection.kind not in ("glass", None):
        block.lines.becomes("reflection", "approximated", "sss-base: a smooth boundary")
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


def search_radius(block, medium, dialect):
    """Radius within which light may enter, 0 for no limit [scene unit].

    The manual's 1.25 sqrt(log(1e-4) / -sigma_t) R_max, with the least reduced extinction of the
    channels, loses a tenth to a half of the light that its own table says is reflected. So it
    limits what a file sets `MATERIAL_R_MAX` for, and all objects in the dialect `prender`.
    """
    reduced = medium.reduced
    asked = "material_r_max" in block.lines.reports or dialect == "prender"
    if not asked or reduced.min() <= 0:
        return 0.0
    radius = 1.25 * float(np.sqrt(np.log(1e4) / reduced.min())) * block.material_r_max
    block.lines.remark("material_r_max", f"light enters within {radius:.4g} of where it leaves")
    return radius


def why_simulated(document, dispersive):
    """Why the objects that ask for the dipole are simulated all the same; empty if they are not."""
    if document.participating_media:
        return "there is a medium around all objects"
    if dispersive:
        return "wavelengths matter in the scene"
    scattering = (b for b in document.objects if b.reflection.subsurface)
    if any(not uses_dipole(block) for block in scattering):
        return "another object of the scene asks for the simulation"
    return ""


def uses_dipole(block):
    """Whether an object is rendered by the dipole: the last of `BSSRDF` and `level` counts.

    `level -2` asks for the dipole, a level from 0 on for the simulation (section 10.2).
    """
    if block.level == -1 or later(block, "bssrdf", "level"):
        return block.bssrdf
    return block.level == -2


def with_method(document, dipole):
    """A document all of whose scattering objects are rendered one way.

    Args:
        document: the document; left as it is.
        dipole: True for the dipole, False for the simulation.
    """

    def forced(block):
        stays = block.level == -1 or (block.level == -2) == dipole
        return replace(block, bssrdf=dipole, level=block.level if stays else -1)

    return replace(document, objects=[forced(block) for block in document.objects])
