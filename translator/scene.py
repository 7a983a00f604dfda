"""Document to scene: a dictionary of plain values, the plan, and the account of every line."""

import copy
from dataclasses import dataclass

from relume.translator import (
    camera,
    dense_media,
    environment_maps,
    lights,
    line_outcomes,
    materials,
    media,
    plan,
    precision,
    recentering,
    surfaces,
)
from relume.translator.assets import Assets
from relume.translator.bumps import bumped
from relume.translator.diagnostics import Problem, SceneError
from relume.translator.dialects import DIALECTS, note
from relume.translator.document import Document
from relume.translator.file_problems import picture_problem
from relume.translator.images import ImageError
from relume.translator.materials import Reflectances, plain_reflectances
from relume.translator.meshes import Meshes
from relume.translator.reflectances import Texture, at_most_one, load_texture
from relume.translator.scene_values import resolved, rgb, to_mitsuba
from relume.translator.shapes import InfinityLight, MeshFile, Plane, UVPlane

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
    "samplescale": "integrator",
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
    plan: plan.RenderPlan

    def dictionary(self):
        """The dictionary for `mi.load_dict`; a variant must be set.

        Its `sensor` holds the medium around all objects, if there is one, as a Mitsuba object.
        """
        return to_mitsuba(resolved(self.scene, media.AROUND))

    def status(self):
        """`ok`, or `unsupported` if any line is."""
        outcomes = {report.outcome for report in self.document.lines.all}
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
    if dialect == "prender" and "luminance_cutoff" not in document.lines.reports:
        document.luminance_cutoff = document.luminance_cutoff or PROGRAM_CUTOFF
    assets = Assets(document, asset_path)
    problems = assets.problems() + materials.check(document)
    if problems:
        raise SceneError(document.path, problems)
    line_outcomes.account(document, dialect)
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
        dense_media.walks(
            document, document.lines, "participating_media", objects.around, ball.radius
        )
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
        if move := recentering.needed(self.shapes.focus, self.shapes.shown):
            move.place(document, dialect)
            self.shapes = self.measured()
        precision.account(document, self.shapes.matrices)
        self.domes = environment_maps.Domes(document, self.shapes, assets.find, dialect, spectral)
        self.around = media.around(document)
        self.why_simulated = media.why_simulated(document, spectral)
        self.diffuses = False
        self.media = [] if self.around is None else [self.around]

    def measured(self):
        """The `ShapeBuilder` of the document as it stands."""
        origin = camera.view(self.document, self.dialect).origin
        return surfaces.ShapeBuilder(self.document, origin, self.dialect, self.mesh_box)

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
                line = block.lines.line() + 1
                problems += [Problem(line, 1, text, "asset") for text in error.described()]
            except ImageError as error:
                problems.append(picture_problem(block, self.find, error))
        try:
            background = environment_maps.background(self.document, self.find)
        except ImageError as error:
            problems.append(picture_problem(self.document, self.find, error))
        if problems:
            raise SceneError(self.document.path, problems)
        for name, entry in entries.items():
            if entry.get("emitter", {}).get("type") == "twosidedarea":
                entry["emitter"]["name"] = name  # equal lights would be merged into one
        if background is None:
            background = lights.background(self.document)
        if background is not None and self.domes.environments:
            self.document.lines.becomes("background", "ignored", "an image-based light hides it")
            self.document.lines.becomes("background_texture", "ignored", "a dome hides it")
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
        name = f"object_{block.lines.line()}"
        matrix = self.shapes.matrices[index]
        emitters = lights.standalone(block, matrix, self.dialect)
        if emitters:
            if not isinstance(block.shape, InfinityLight):
                block.lines.becomes("", "approximated", "the lamp itself is not shown")
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
            block.lines.remark("shadow", note("shadow", self.dialect))
            return {name: entry | {"bsdf": {"type": "shadowcatcher", "reflectance": color}}}
        return {name: self.surface(entry, block, self.reflectances(block), matrix)}

    def catches_shadows(self, block):
        """Whether an object is a plane that shows shadows alone: under image-based light (11.7)."""
        if not (block.shadow and isinstance(block.shape, Plane | UVPlane)):
            return False
        if all(other.ibl_texture is None for other in self.document.objects):
            block.lines.becomes("shadow", "ignored", "there is no image-based light")
            return False
        return True

    def fill(self, entry, block, reflectances, matrix):
        """The BSDF of an object with subsurface scattering; a simulated one is filled (10.2)."""
        medium, index = media.inside(block)
        color, specular = at_most_one(reflectances.color), at_most_one(reflectances.specular)
        reflectances = Reflectances(color, specular)
        if media.uses_dipole(block):
            block.lines.remark("subsurface", note("sss-dipole", self.dialect))
            if not self.why_simulated:
                self.diffuses = True
                return media.subsurface(block, reflectances, medium, index, self.dialect)
            why = f"simulated instead: {self.why_simulated}"
            block.lines.becomes("subsurface", "approximated", why)
        block.lines.remark("subsurface", note("sss-simulation", self.dialect))
        block.lines.becomes("material_r_max", "ignored", "of use to the dipole alone")
        if medium.exists:
            entry["interior"] = medium.entry()
            self.media.append(medium)
            if (points := self.points(entry, block, matrix)) is not None:
                dense_media.entered(block, medium, points)
                radius = dense_media.least_half(points)
                dense_media.walks(self.document, block.lines, "", medium, radius)
        return materials.boundary(block, reflectances, index)

    def points(self, entry, block, matrix):
        """Points that tell where a finite shape is, (N, 3), or None."""
        mesh = entry.get("mesh")
        return surfaces.bounds(block.shape, matrix, self.dialect) if mesh is None else mesh.vertices

    def part(self, part, matrix):
        """The dictionary of a part of a mesh object."""
        if part.block.ibl_texture is not None:
            pixels = environment_maps.picture(self.find(part.block.ibl_texture), part.block)
            return part.entry | self.domes.shining(pixels, part.block.ibl_texture_coef, flip=False)
        return self.surface(
            part.entry, part.block, part.reflectances, matrix, part.opacity, part.bump
        )

    def reflectances(self, block):
        """The reflectances of a shape: `texture` replaces both colours (section 11.2)."""
        if block.texture is None or isinstance(block.shape, Plane):
            return plain_reflectances(block)
        picture = load_texture(
            self.find(block.texture), repeat=block.repeat, spectral=self.spectral
        )
        block.lines.becomes("color", "ignored", "texture takes its place")
        return Reflectances(picture, picture)

    def surface(self, entry, block, reflectances, matrix, opacity=None, bump=None):
        """A shape's dictionary with its BSDF and emitter."""
        if block.reflection.subsurface:
            bsdf = self.fill(entry, block, reflectances, matrix)
        else:
            bsdf = materials.bsdf(block, reflectances, self.dialect)
        if self.around is not None and block.reflection.lets_pass:
            # Light crosses these surfaces; at all others it stays in the medium that it is in.
            entry["exterior"] = media.REFERENCE
        materials.account(block)
        if bump is None and block.bump_texture is not None:
            bump = self.find(block.bump_texture)
        if bump is not None:
            flip = not isinstance(block.shape, MeshFile)
            bsdf = bumped(bsdf, bump, entry, block.shape, flip=flip)
            block.lines.becomes("bump_texture", "approximated", note("bump", self.dialect))
        if isinstance(reflectances.color, Texture) and reflectances.color.alpha is not None:
            opacity = reflectances.color.opacity()
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
