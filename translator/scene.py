"""Document to scene: a dictionary of plain values, the plan, and the account of every line."""

import copy
from dataclasses import dataclass

from translator import (
    account,
    camera,
    dense,
    domes,
    lights,
    materials,
    media,
    placement,
    plan,
    precision,
    surfaces,
)
from translator.assets import Assets
from translator.bumps import bumped
from translator.diagnostics import Problem, SceneError
from translator.dialects import DIALECTS, note
from translator.document import Document
from translator.images import ImageError
from translator.materials import Tints, plain_tints
from translator.meshes import Meshes
from translator.neutral import resolved, rgb, to_mitsuba
from translator.shapes import InfinityLight, MeshFile, Plane, UVPlane
from translator.tints import Texture, at_most_one, load_texture

OWN_PLUGINS = {
    "ward": "bsdf",
    "phong": "bsdf",
    "schlickglass": "bsdf",
    "subsurface": "bsdf",
    "shadowcatcher": "bsdf",
    "parallelbeam": "emitter",
    "falloffspot": "emitter",
    "twosidedarea": "emitter",
    "ibldome": "emitter",
    "dipole": "integrator",
    "dispersivepath": "integrator",
    "erpt": "integrator",
    "pssmlt": "integrator",
    "sensorresponse": "integrator",
    "shadowcatching": "integrator",
    "hgrgb": "phase function",
    "screencamera": "sensor",
}
"""Plugins that relume brings to Mitsuba, with the kind of each."""


PROGRAM_CUTOFF = 0.025
"""The program's own default of `luminance_cutoff` (decisions, row luminance-cutoff)."""


@dataclass(frozen=True)
class Translation:
    """A translated document.

    Attributes:
        document: copy of the document; its `source.all` tells what each line became.
        scene: the scene as plain values; `dictionary()` is what Mitsuba takes.
        plan: how it is rendered.
    """

    document: Document
    scene: dict
    plan: plan.Plan

    def dictionary(self):
        """The dictionary for `mi.load_dict`; a variant must be set.

        Its `sensor` holds the medium around all objects, if there is one, as a Mitsuba object.
        """
        return to_mitsuba(resolved(self.scene, media.AROUND))

    def status(self):
        """`ok`, or `unsupported` if any line is."""
        outcomes = {report.outcome for report in self.document.source.all}
        return "unsupported" if "unsupported" in outcomes else "ok"


def translate(document, dialect="manual", asset_path=()):
    """Translate a document.

    Args:
        document: the `Document`; left as it is.
        dialect: `manual` (default) or `prender`, to match an old picture (see `dialects`).
        asset_path: folders in which files that a scene names are looked for.

    Returns:
        The `Translation`.

    Raises:
        ValueError: unknown dialect.
        SceneError: with every file that is missing or broken (kind `asset`) and every object that
            lacks what its surface needs.
    """
    if dialect not in DIALECTS:
        raise ValueError(f"unknown dialect {dialect!r}, expected one of {', '.join(DIALECTS)}")
    # Notes on lines are made in the copy.
    document = copy.deepcopy(document)
    if dialect == "prender" and "luminance_cutoff" not in document.source.reports:
        document.luminance_cutoff = document.luminance_cutoff or PROGRAM_CUTOFF
    assets = Assets(document, asset_path)
    problems = assets.problems() + materials.check(document)
    if problems:
        raise SceneError(document.path, problems)
    account.account(document, dialect)
    camera.account(document, dialect)
    dispersive = dialect == "manual" and any(b.reflection.dispersion for b in document.objects)
    objects = _Objects(document, dialect, assets, dispersive)
    entries = objects.entries()
    profile = media.PROFILES[dialect] if objects.diffuses else None
    integrator, reason = plan.integrator(
        document, dialect, dispersive, plan.plugin_types(entries), objects.media, profile
    )
    scene = {"type": "scene", "integrator": integrator, "sensor": camera.sensor(document, dialect)}
    if objects.around is not None:
        scene = {"type": "scene", media.AROUND: objects.around.entry()} | scene
        scene["sensor"]["medium"] = media.REFERENCE
        ball = objects.shapes.fog_ball()
        entries[media.BOUNDARY] = media.boundary(ball, document)
        dense.walks(document, document.source, "participating_media", objects.around, ball.radius)
    scene |= entries
    made = plan.plan(document, scene, OWN_PLUGINS, dispersive, reason)
    return Translation(document, scene, made)


class _Objects:
    """Makes the shapes and emitters of a document, named by the line of their block."""

    def __init__(self, document, dialect, assets, spectral):
        self.document = document
        self.dialect = dialect
        self.find = assets.find
        self.spectral = spectral
        self.meshes = Meshes(assets.find, spectral)
        self.shapes = self.measured()
        if move := placement.needed(self.shapes.focus, self.shapes.shown):
            move.place(document, dialect)
            self.shapes = self.measured()
        precision.account(document, self.shapes.matrices)
        self.domes = domes.Domes(document, self.shapes, assets.find, dialect, spectral)
        self.around = media.around(document)
        self.why_simulated = media.why_simulated(document, spectral)
        self.diffuses = False
        self.media = [] if self.around is None else [self.around]

    def measured(self):
        """The `Shapes` of the document as it stands."""
        origin = camera.view(self.document, self.dialect).origin
        return surfaces.Shapes(self.document, origin, self.dialect, self.mesh_box)

    def mesh_box(self, block, matrix):
        """Corners of a box around a mesh object, or None."""
        return self.meshes.bounds(self.find(block.shape.file), matrix)

    def entries(self):
        """The dictionary of all objects and the background.

        Raises:
            SceneError: with every file that cannot be read.
        """
        entries, problems = {}, []
        for index, block in enumerate(self.document.objects):
            try:
                entries |= self.object(index, block)
            except SceneError as error:
                line = block.source.line() + 1
                problems += [Problem(line, 1, text, "asset") for text in error.described()]
            except ImageError as error:
                problems.append(Problem(block.source.line("texture"), 1, str(error), "asset"))
        try:
            background = domes.background(self.document, self.find)
        except ImageError as error:
            line = self.document.source.line("background_texture")
            problems.append(Problem(line, 1, str(error), "asset"))
        if problems:
            raise SceneError(self.document.path, problems)
        for name, entry in entries.items():
            if entry.get("emitter", {}).get("type") == "twosidedarea":
                entry["emitter"]["name"] = name  # equal lights would be merged into one
        if background is None:
            background = lights.background(self.document)
        if background is not None and self.domes.environments:
            self.document.source.becomes("background", "ignored", "an image-based light hides it")
            self.document.source.becomes("background_texture", "ignored", "a dome hides it")
        elif background is not None:
            entries["background"] = background
        elif entries and not self.lights_to_look_for(entries):
            # Mitsuba refuses scenes whose lights all have the weight 0, as ambient light has.
            entries["background"] = {"type": "constant", "radiance": rgb((0, 0, 0))}
        return entries

    def lights_to_look_for(self, entries):
        """Whether there is a light besides the ambient one, or no ambient one either."""
        # Entries without a BSDF are lights themselves.
        shown = [e for e in entries.values() if "emitter" in e or "bsdf" not in e]
        lights = [entry.get("emitter", entry) for entry in shown]
        return not lights or any(light.get("sampling_weight") != 0 for light in lights)

    def object(self, index, block):
        """The entries of one object."""
        name = f"object_{block.source.line()}"
        matrix = self.shapes.matrices[index]
        emitters = lights.standalone(block, matrix, self.dialect)
        if emitters:
            if not isinstance(block.shape, InfinityLight):
                block.source.becomes("", "approximated", "the lamp itself is not shown")
            return {f"{name}_light": emitter for emitter in emitters}
        if block.ibl_texture is not None and not isinstance(block.shape, MeshFile):
            return {name: self.domes.light(index, block)}
        if isinstance(block.shape, MeshFile):
            parts = self.meshes.parts(block, self.find(block.shape.file), matrix)
            media.check_closed(block, [part for part in parts if part.block.reflection.subsurface])
            return {name + part.name: self.part(part, matrix) for part in parts}
        entry = self.shapes.shape(index, block)
        if self.catches_shadows(block):
            color = materials.entry(block.color)
            block.source.remark("shadow", note("shadow", self.dialect))
            return {name: entry | {"bsdf": {"type": "shadowcatcher", "reflectance": color}}}
        return {name: self.surface(entry, block, self.tints(block), matrix)}

    def catches_shadows(self, block):
        """Whether an object is a plane that shows shadows alone: under image-based light (11.7)."""
        if not (block.shadow and isinstance(block.shape, Plane | UVPlane)):
            return False
        if all(other.ibl_texture is None for other in self.document.objects):
            block.source.becomes("shadow", "ignored", "there is no image-based light")
            return False
        return True

    def fill(self, entry, block, tints, matrix):
        """The BSDF of an object with subsurface scattering; a simulated one is filled (10.2)."""
        medium, index = media.inside(block)
        tints = Tints(at_most_one(tints.color), at_most_one(tints.specular))
        if media.uses_dipole(block):
            block.source.remark("subsurface", note("sss-dipole", self.dialect))
            if not self.why_simulated:
                self.diffuses = True
                return media.subsurface(block, tints, medium, index, self.dialect)
            why = f"simulated instead: {self.why_simulated}"
            block.source.becomes("subsurface", "approximated", why)
        block.source.remark("subsurface", note("sss-simulation", self.dialect))
        block.source.becomes("material_r_max", "ignored", "of use to the dipole alone")
        if medium.exists:
            entry["interior"] = medium.entry()
            self.media.append(medium)
            if (points := self.points(entry, block, matrix)) is not None:
                dense.entered(block, medium, points)
                radius = dense.least_half(points)
                dense.walks(self.document, block.source, "", medium, radius)
        return materials.boundary(block, tints, index)

    def points(self, entry, block, matrix):
        """Points that tell where a finite shape is, (N, 3), or None."""
        mesh = entry.get("mesh")
        return surfaces.bounds(block.shape, matrix, self.dialect) if mesh is None else mesh.vertices

    def part(self, part, matrix):
        """The dictionary of a part of a mesh object."""
        if part.block.ibl_texture is not None:
            pixels = domes.picture(self.find(part.block.ibl_texture), part.block)
            return part.entry | self.domes.shining(pixels, part.block.ibl_texture_coef, flip=False)
        return self.surface(part.entry, part.block, part.tints, matrix, part.opacity, part.bump)

    def tints(self, block):
        """The tints of a shape: `texture` replaces both colours (section 11.2)."""
        if block.texture is None or isinstance(block.shape, Plane):
            return plain_tints(block)
        picture = load_texture(
            self.find(block.texture), repeat=block.repeat, spectral=self.spectral
        )
        block.source.becomes("color", "ignored", "texture takes its place")
        return Tints(picture, picture)

    def surface(self, entry, block, tints, matrix, opacity=None, bump=None):
        """A shape's dictionary with its BSDF and emitter."""
        if block.reflection.subsurface:
            bsdf = self.fill(entry, block, tints, matrix)
        else:
            bsdf = materials.bsdf(block, tints, self.dialect)
        if self.around is not None and block.reflection.lets_pass:
            # Light crosses these surfaces; at all others it stays in the medium that it is in.
            entry["exterior"] = media.REFERENCE
        materials.account(block)
        if bump is None and block.bump_texture is not None:
            bump = self.find(block.bump_texture)
        if bump is not None:
            flip = not isinstance(block.shape, MeshFile)
            bsdf = bumped(bsdf, bump, entry, block.shape, flip=flip)
            block.source.becomes("bump_texture", "approximated", note("bump", self.dialect))
        if isinstance(tints.color, Texture) and tints.color.alpha is not None:
            opacity = tints.color.opacity()
        if opacity is not None and opacity != 1:
            bsdf = {"type": "mask", "opacity": opacity, "bsdf": bsdf}
        entry["bsdf"] = bsdf
        if any(block.emission):
            shapes = self.shapes
            return lights.area(
                block, entry, matrix, shapes.camera, shapes.size, self.document.ambient
            )
        if any(self.document.ambient):
            # Too many and too dim to be looked for: they are found by chance alone.
            ambient = {"type": "twosidedarea", "radiance": rgb(self.document.ambient)}
            entry["emitter"] = ambient | {"sampling_weight": 0.0}
        return entry
