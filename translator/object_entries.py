"""From the objects of a document to the shapes and emitters of its scene (sections 6 to 12)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from relume.translator import (
    curved_space,
    dense_media,
    environment_maps,
    geometry,
    lights,
    materials,
    media,
)
from relume.translator.accretion_disks import accretion_disk
from relume.translator.assets import Find, existing
from relume.translator.bumps import bumped
from relume.translator.diagnostics import Problem, SceneError
from relume.translator.dipole_error import DipoleError, error_of_materials, tell_method
from relume.translator.document import Document
from relume.translator.enclosures import INSIDE, Enclosure, diameter, winding_number
from relume.translator.file_problems import picture_problem
from relume.translator.giant_spheres import Ball
from relume.translator.images import ImageError
from relume.translator.materials import Reflectances
from relume.translator.media import HomogeneousMedium
from relume.translator.meshes import Meshes, Part
from relume.translator.objects import SceneObject
from relume.translator.outcome_rows import Note
from relume.translator.reflectances import Texture, at_most_one
from relume.translator.scene_geometry import SceneGeometry, box_corners
from relume.translator.scene_values import Entry, rgb
from relume.translator.shapes import (
    Annulus,
    Disk,
    Hemisphere,
    InfinityLight,
    MeshFile,
    Plane,
    Sphere,
    UVPlane,
)
from relume.translator.surface_pictures import cut_out_disk, object_reflectances, picture_tiles
from relume.translator.surfaces import ShapeBuilder


@dataclass(frozen=True, eq=False)
class PlacedScene:
    """A document where it is rendered, with all that its objects are made from.

    Attributes:
        document: the document; notes go to its lines.
        dialect: `manual` or `prender`.
        spectral: whether it is rendered by wavelength.
        find: function from the name of a file to its path.
        meshes: reads the files of mesh objects.
        geometry: where the objects are.
        medium: the medium around all objects, or None.
        domes_by_direction: domes that become environment maps, see `environment_maps`.
        obstacle_to_dipole: code of the reason why objects that ask for the dipole are simulated.
        dipole_errors: how far the dipole is off in the objects that it may render, by index.
    """

    document: Document
    dialect: str
    spectral: bool
    find: Find
    meshes: Meshes
    geometry: SceneGeometry
    medium: HomogeneousMedium | None
    domes_by_direction: Mapping[int, Note | None]
    obstacle_to_dipole: str | None
    dipole_errors: Mapping[int, DipoleError]

    @property
    def dome(self) -> Ball | None:
        """The innermost dome around the camera that stays a shape, or None."""
        around = [
            ball
            for index, block in enumerate(self.document.objects)
            if block.ibl_texture is not None
            and index not in self.domes_by_direction
            and self.geometry.encloses_camera(index)
            and (ball := self.geometry.balls[index]) is not None
        ]
        return min(around, key=lambda ball: ball.radius, default=None)

    @property
    def shapes(self) -> ShapeBuilder:
        """Makes the shapes of the objects."""
        return ShapeBuilder(self.geometry, self.dialect)


@dataclass(frozen=True, eq=False)
class Contents:
    """What objects become.

    Attributes:
        entries: dictionaries of shapes and emitters, by their keys in the scene's dictionary.
        media: the media inside them.
        dipole: whether the dipole renders any of them.
        enclosures: those that the camera is in.
    """

    entries: dict[str, Entry] = field(default_factory=dict)
    media: tuple[HomogeneousMedium, ...] = ()
    dipole: bool = False
    enclosures: tuple[Enclosure, ...] = ()

    @staticmethod
    def of_all(parts: Iterable[Contents]) -> Contents:
        """The contents of several objects together, in their order."""
        parts = list(parts)
        return Contents(
            {name: entry for part in parts for name, entry in part.entries.items()},
            tuple(medium for part in parts for medium in part.media),
            any(part.dipole for part in parts),
            tuple(enclosure for part in parts for enclosure in part.enclosures),
        )


def translate_objects(scene: PlacedScene) -> tuple[Contents, list[Problem]]:
    """What all objects become, and their problems, such as a file that cannot be read."""
    parts, problems = [], []
    for index, block in enumerate(scene.document.objects):
        matrix = scene.geometry.matrices[index]
        if (problem := lights.beam_problem(block, matrix, scene.dialect)) is not None:
            problems.append(problem)
            continue
        try:
            parts.append(translate_object(scene, index, block))
        except SceneError as error:
            line = block.lines.line() + 1
            problems += [Problem(line, 1, text, "asset") for text in error.described()]
        except ImageError as error:
            problems.append(picture_problem(block, scene.find, error))
    return Contents.of_all(parts), problems


def translate_object(scene: PlacedScene, index: int, block: SceneObject) -> Contents:
    """What one object becomes: a lamp, an image-based light, the parts of a mesh, or a surface.

    Args:
        scene: the scene.
        index: which of its objects it is.
        block: the object.

    Raises:
        SceneError: a mesh or one of its materials cannot be read.
        ImageError: a picture cannot be read.
    """
    name = f"object_{block.lines.line()}"
    matrix = scene.geometry.matrices[index]
    if (lamp := lights.lamp(block, matrix, scene.dialect, scene.dome)) is not None:
        contents = {f"{name}_light": lamp}
        if isinstance(block.shape, UVPlane) and scene.dialect == "prender":
            block.lines.remark("", "parallel-lamp", dialect=scene.dialect)
            contents[name] = lights.beam_shown(
                block, scene.shapes.shape(index, block), scene.document
            )
        elif not isinstance(block.shape, InfinityLight):
            block.lines.becomes("", "lamp-not-shown")
        return Contents(contents)
    if isinstance(block.shape, MeshFile):
        return mesh_object(scene, name, index, block)
    if curved_space.is_accretion_disk(scene.document, block):
        disk = accretion_disk(scene, name, index, block)
        return Contents({} if disk is None else {name: disk})
    if isinstance(block.shape, Disk | Annulus) and block.disk_map and block.disk_picture:
        return Contents({name: cut_out_disk(scene, name, index, block)})
    if block.ibl_texture is not None:
        return Contents({name: image_based_light(scene, name, index, block)})
    shape = scene.shapes.shape(index, block)
    if catches_shadows(scene.document, block):
        color = materials.entry(block.color)
        block.lines.remark("shadow", "shadow")
        return Contents({name: shape | {"bsdf": {"type": "shadowcatcher", "reflectance": color}}})
    reflectances = object_reflectances(scene, index, block)
    return surface(scene, name, index, Part("", shape, block, reflectances))


def mesh_object(scene: PlacedScene, name: str, index: int, block: SceneObject) -> Contents:
    """The parts of a mesh object; arguments as `translate_object`."""
    assert isinstance(block.shape, MeshFile)
    path = existing(scene.find, block.shape.file)
    parts = scene.meshes.parts(block, path, scene.geometry.matrices[index])
    scattering = [part for part in parts if part.block.reflection.subsurface]
    bounds = [part.entry["mesh"] for part in scattering]
    media.report_open_meshes(block, bounds)
    # Materials of the file are known too late for the plan, which leaves them to the dipole.
    late = scene.dialect == "manual" and not block.reflection.subsurface
    if late and scattering and media.uses_dipole(block):
        error = error_of_materials([part.block for part in scattering], bounds)
        if error is not None:
            scene = replace(scene, dipole_errors={**scene.dipole_errors, index: error})
    found = Contents.of_all(mesh_part(scene, name + part.name, index, part) for part in parts)
    meshes = [p.entry["mesh"] for p in parts if p.block.reflection.lets_pass and "mesh" in p.entry]
    if not meshes or winding_number(meshes, scene.geometry.camera) < INSIDE:
        return found
    # A mesh has one inside, whichever of its parts tells what fills it.
    inside = Enclosure(diameter(meshes), next(iter(found.media), None))
    return replace(found, enclosures=(inside,))


def mesh_part(scene: PlacedScene, name: str, index: int, part: Part) -> Contents:
    """One part of a mesh object."""
    block = part.block
    if block.ibl_texture is None:
        return surface(scene, name, index, part)
    pixels = environment_maps.picture(existing(scene.find, block.ibl_texture), block)
    shining = environment_maps.shining_surface(
        name, pixels, block.ibl_texture_coef, flip=False, spectral=scene.spectral
    )
    return Contents({name: part.entry | shining})


def image_based_light(scene: PlacedScene, name: str, index: int, block: SceneObject) -> Entry:
    """An object with `ibl_texture`: a dome, an environment map, or a surface that shines."""
    assert block.ibl_texture is not None
    pixels = environment_maps.picture(existing(scene.find, block.ibl_texture), block)
    if not isinstance(block.shape, Sphere | Hemisphere):
        return scene.shapes.shape(index, block) | environment_maps.shining_surface(
            name,
            pixels,
            block.ibl_texture_coef,
            flip=True,
            spectral=scene.spectral,
            tiles=picture_tiles(scene, "ibl_texture", block),
        )
    ball = scene.geometry.balls[index]
    if ball is None or index in scene.domes_by_direction:
        note = scene.domes_by_direction[index]
        return environment_maps.environment_of_dome(block, pixels, scene.dialect, note)
    return environment_maps.dome(block, ball, pixels, scene.dialect)


def catches_shadows(document: Document, block: SceneObject) -> bool:
    """Whether an object is a plane that shows shadows alone: under image-based light (11.7)."""
    if not (block.shadow and isinstance(block.shape, Plane | UVPlane)):
        return False
    if all(other.ibl_texture is None for other in document.objects):
        block.lines.becomes("shadow", "no-image-based-light")
        return False
    return True


@dataclass(frozen=True, eq=False)
class Interior:
    """What light finds at a surface: its BSDF, and how what is below it is rendered.

    Attributes:
        bsdf: the BSDF's dictionary.
        medium: the medium inside that is simulated, or None.
        dipole: whether the dipole renders what is inside.
    """

    bsdf: Entry
    medium: HomogeneousMedium | None = None
    dipole: bool = False


def interior(scene: PlacedScene, index: int, part: Part) -> Interior:
    """The surface of an object with subsurface scattering, and its inside (section 10.2).

    Args:
        scene: the scene.
        index: which of its objects it is.
        part: the object, or a part of it.
    """
    block = part.block
    medium, eta = media.interior_medium(block)
    reflectances = Reflectances(
        at_most_one(part.reflectances.color), at_most_one(part.reflectances.specular)
    )
    if media.uses_dipole(block):
        block.lines.remark("subsurface", "sss-dipole", dialect=scene.dialect)
        tell_method(block, scene.obstacle_to_dipole, scene.dipole_errors.get(index))
        if scene.obstacle_to_dipole is None:
            bsdf = media.dipole(block, reflectances, medium, eta, scene.dialect)
            bsdf["object"] = f"object_{block.lines.line()}"
            return Interior(bsdf, dipole=True)
    block.lines.remark("subsurface", "sss-simulation")
    block.lines.becomes("material_r_max", "dipole-alone")
    bsdf = materials.boundary(block, reflectances, eta)
    if not medium.exists:
        return Interior(bsdf)
    if (points := extent_points(scene, index, part)) is not None:
        dense_media.report_rounding(block, medium, points)
    return Interior(bsdf, medium)


def extent_points(scene: PlacedScene, index: int, part: Part) -> np.ndarray | None:
    """Points that tell where a finite shape is, (N, 3), or None."""
    if (mesh := part.entry.get("mesh")) is not None:
        return mesh.vertices
    return box_corners(part.block.shape, scene.geometry.matrices[index], scene.dialect)


def surface(scene: PlacedScene, name: str, index: int, part: Part) -> Contents:
    """A shape with its BSDF, its emitter, and the media on both sides.

    Args:
        scene: the scene.
        name: key of the shape in the scene's dictionary.
        index: which of the scene's objects it is.
        part: the object, or a part of it.
    """
    block, shape = part.block, dict(part.entry)
    if block.reflection.subsurface:
        inside = interior(scene, index, part)
    else:
        inside = Interior(materials.bsdf(block, part.reflectances, scene.dialect))
    if inside.medium is not None:
        shape["interior"] = inside.medium.entry()
    if scene.medium is not None and block.reflection.lets_pass:
        # Light crosses these surfaces; at all others it stays in the medium that it is in.
        shape["exterior"] = media.REFERENCE
    materials.report_surface(block)
    shape["bsdf"] = covered(scene, part, shape, inside.bsdf)
    if block.is_backdrop:
        shape = seen_unlit(scene, part, shape)
    elif any(block.emission):
        shape = lights.shining(
            name, block, shape, scene.geometry, scene.document, index, scene.dialect
        )
    elif any(scene.document.ambient):
        shape["emitter"] = lights.ambient(name, scene.document)
    found: Sequence[HomogeneousMedium] = () if inside.medium is None else (inside.medium,)
    around = camera_enclosures(scene, index, block, inside.medium)
    return Contents({name: shape}, tuple(found), inside.dipole, around)


def camera_enclosures(
    scene: PlacedScene, index: int, block: SceneObject, medium: HomogeneousMedium | None
) -> tuple[Enclosure, ...]:
    """The object that is no mesh, with the medium in it, if light crosses it and the camera is in.

    The half space behind a plane counts as larger than all else.
    """
    shape, matrix = block.shape, scene.geometry.matrices[index]
    if not block.reflection.lets_pass:
        return ()
    if isinstance(shape, Plane):
        n = geometry.normal(matrix, shape.normal) * (-1 if block.normal < 0 else 1)
        behind = (scene.geometry.camera - geometry.point(matrix, shape.point)) @ n < 0
        return (Enclosure(np.inf, medium),) if behind else ()
    if not isinstance(shape, Sphere) or block.normal < 0:
        return ()
    if lights.encloses(shape, matrix, scene.geometry.camera):
        size = 2 * shape.radius * abs(np.linalg.det(matrix[:3, :3])) ** (1 / 3)
        return (Enclosure(float(size), medium),)
    return ()


def seen_unlit(scene: PlacedScene, part: Part, shape: Entry) -> Entry:
    """A shape that the camera sees in its unlit colour; for other surfaces it is an ordinary one.

    Only `surfacepath` tells the two apart. Where a medium needs another integrator, the shape is
    black to other surfaces.
    """
    block, color = part.block, part.reflectances.color
    bsdf = shape["bsdf"]
    block.lines.remark("background", "background-object")
    if not lit_backdrops(scene.document):
        block.lines.becomes("background", "backdrop-black")
        black = environment_maps.BLACK
        bsdf = bsdf | {"bsdf": black} if bsdf["type"] == "mask" else black
    if isinstance(color, Texture):
        radiance = environment_maps.radiance(color)
    else:
        assert isinstance(color, tuple)  # only meshes have vertex colours
        radiance = rgb(color)
    return shape | {"bsdf": bsdf, "emitter": lights.backdrop(radiance)}


def lit_backdrops(document: Document) -> bool:
    """Whether the integrator can light objects with `background` where they are not seen."""
    translucent = any(block.reflection.subsurface for block in document.objects)
    return not (document.participating_media or translucent)


def covered(scene: PlacedScene, part: Part, shape: Entry, bsdf: Entry) -> Entry:
    """A BSDF with the bumps and the opacity of a surface."""
    block = part.block
    bump: Path | None = part.bump
    if bump is None and block.bump_texture is not None:
        bump = scene.find(block.bump_texture)
    if bump is not None:
        flip = not isinstance(block.shape, MeshFile)
        tiles = picture_tiles(scene, "bump_texture", block)
        bsdf = bumped(bsdf, bump, shape, block.shape, flip=flip, tiles=tiles)
        if flip:
            block.lines.becomes("bump_texture", "bump-shapes")
        else:
            block.lines.becomes("bump_texture", "bump")
    color = part.reflectances.color
    opacity: float | Entry | None = part.opacity
    if isinstance(color, Texture) and color.alpha is not None:
        opacity = color.opacity()
    if opacity is None or opacity == 1:
        return bsdf
    return {"type": "mask", "opacity": opacity, "bsdf": bsdf}
