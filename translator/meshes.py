"""Mesh objects: OBJ files with their materials (spec section 12)."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path
from typing import Any

import numpy as np

from relume.translator.assets import Find
from relume.translator.diagnostics import Problem, SceneError
from relume.translator.enclosures import INSIDE, winding_number
from relume.translator.materials import Reflectances
from relume.translator.mtl import Material, Materials, MtlError, TextureMap, read_mtl
from relume.translator.mtl_names import library_names, spellings
from relume.translator.obj import read_obj
from relume.translator.obj_model import Group, MeshError, ObjFile
from relume.translator.obj_scan import stock_obstacle
from relume.translator.objects import Reflection, SceneObject
from relume.translator.outcomes import make_note
from relume.translator.reflectances import Color, Texture, VertexColor, load_texture, times
from relume.translator.scene_values import Entry, Matrix, Mesh

KINDS = dict(
    enumerate(("diffuse", "specular", "glass", "ward", "phong", "glass", "diffuse", "ward"))
)
"""Kind of surface of each `#REFLECTION` code; 5 to 7 are subsurface scattering below it (8.8)."""

BLACK = (0.0, 0.0, 0.0)

NAMES = 10
"""Most names that a note lists."""

UPRIGHT = 1e-6
"""1 - cosine of the angle between a normal and the face's up to which they are the same: 0.08
degrees, what six decimals of a file leave."""


@dataclasses.dataclass(frozen=True, eq=False)
class Part:
    """One material's share of a mesh object.

    Attributes:
        name: suffix for the scene dictionary.
        entry: the shape's dictionary without BSDF.
        block: the object with the material's attributes in place of its own.
        reflectances: its `Reflectances`.
        opacity: a constant opacity, or None.
        bump: path of the material's bump map, or None.
    """

    name: str
    entry: Entry
    block: SceneObject
    reflectances: Reflectances
    opacity: float | None = None
    bump: Path | None = None


class Meshes:
    """Reads the mesh files of one scene, each once.

    Args:
        find: function from the name of a file to its path or None.
        spectral: whether the scene is rendered by wavelength.
    """

    def __init__(self, find: Find, spectral: bool = False) -> None:
        self.find = find
        self.spectral = spectral
        self.files: dict[Path, ObjFile] = {}

    def read(self, path: Path) -> ObjFile:
        """The `ObjFile` of a path."""
        if path not in self.files:
            self.files[path] = read_obj(path)
        return self.files[path]

    def bounds(self, path: Path, matrix: np.ndarray) -> np.ndarray | None:
        """Corners of a box around a mesh file under a matrix: (2, 3), or None if unreadable."""
        try:
            positions = self.read(path).positions
        except MeshError:
            return None
        world = positions @ matrix[:3, :3].T + matrix[:3, 3]
        return np.stack([world.min(axis=0), world.max(axis=0)])

    def surfaces(self, path: Path, matrix: np.ndarray) -> list[Mesh]:
        """All faces of a mesh file under a matrix, (4, 4); none if it is unreadable."""
        try:
            groups = self.read(path).groups
        except MeshError:
            return []
        linear, offset = matrix[:3, :3].T, matrix[:3, 3]
        return [Mesh(group.vertices @ linear + offset, group.faces) for group in groups]

    def enclose(self, path: Path, matrix: np.ndarray, p: np.ndarray) -> bool:
        """Whether a mesh file under a matrix, (4, 4), winds around the point `p`, (3,)."""
        box = self.bounds(path, matrix)
        if box is None or np.any(p < box[0]) or np.any(p > box[1]):
            return False
        return abs(winding_number(self.surfaces(path, matrix), p)) > INSIDE

    def parts(self, block: SceneObject, path: Path, matrix: np.ndarray) -> list[Part]:
        """The parts of a mesh object.

        Args:
            block: `SceneObject` whose shape is a `MeshFile`.
            path: its OBJ file.
            matrix: its transformation, (4, 4).

        Returns:
            A list of `Part`.

        Raises:
            SceneError: the OBJ file, or an MTL file that it uses, cannot be read.
            ImageError: a picture cannot be read.
        """
        try:
            plain = path not in self.files and stock_serves(block, matrix)
            if plain and not stock_obstacle(path, flat=not block.smooth):
                tint = reflectances(block, None, self.find, self.spectral)
                return [Part("", stock_mesh(block, path, matrix), block, tint)]
            return self._parts(block, path, matrix)
        except (MeshError, MtlError) as error:
            place = error.line or 0, error.column or 0
            raise SceneError(error.path, [Problem(*place, error.message, "asset")]) from None

    def bump(self, material: Material | None, block: SceneObject, find: Find) -> Path | None:
        """Path of the bump map of a material, or None; a missing file is noted."""
        if material is None or material.map_bump is None:
            return None
        path = find(material.map_bump.file)
        if path is None:
            file = material.map_bump.file
            block.lines.becomes("", "material-picture-missing", file=file, key="map_Bump")
        return path

    def _parts(self, block: SceneObject, path: Path, matrix: np.ndarray) -> list[Part]:
        """The parts of a file with materials, vertex colours or other extensions."""
        obj = self.read(path)
        for line, note in obj.notes[:20]:
            block.lines.add("", note.at(f"{Path(path).name}:{line}"))
        library, folders = materials(obj, path, self.find, block)

        def find(name: str) -> Path | None:
            for spelling in spellings(name):
                near = (folder / spelling.replace("\\", "/") for folder in folders)
                here = next((file for file in near if file.is_file()), None)
                if (file := self.find(spelling) or here) is not None:
                    return file
            return None

        result = []
        unknown = [g.material for g in obj.groups if g.material and not library.named(g.material)]
        if unknown:
            names = ", ".join(map(repr, unknown[:NAMES])) + (", …" if len(unknown) > NAMES else "")
            block.lines.add("", make_note("material-undefined", names=names).at(Path(path).name))
        for index, group in enumerate(obj.groups):
            material = library.named(group.material) if group.material else None
            described = block if material is None else with_material(block, material)
            colored = group.colors is not None
            tint = reflectances(described, material, find, self.spectral, colored, block.color)
            smoothed = smooth(block, material)
            if not smoothed and (tilted := face_normals(group)) is not None:
                block.lines.remark("", "flat-vn")
                group, smoothed = tilted, True
            entry = mesh(obj, group, matrix, smoothed, block.normal < 0, tint)
            pictured = block.texture is not None or (material is not None and material.map_kd)
            opacity = None if material is None or pictured else material.opacity
            name = f"_{index}" if len(obj.groups) > 1 else ""
            bump = self.bump(material, block, find)
            result.append(Part(name, entry, described, tint, opacity, bump))
        return result


def stock_serves(block: SceneObject, matrix: np.ndarray) -> bool:
    """Whether Mitsuba's own reader could do for a mesh object.

    A bump map must know the mesh (see `bumps.texel_length`), and under a mirroring matrix the stock
    plugin leaves either faces or vertex normals on the wrong side.
    """
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    if block.reflection.subsurface:  # to see whether it is closed
        return False
    return block.bump_texture is None and not (mirrored and block.smooth)


def stock_mesh(block: SceneObject, path: Path, matrix: np.ndarray) -> Entry:
    """The dictionary of a mesh that Mitsuba's own reader reads as we would, and faster."""
    entry = {
        "type": "obj",
        "filename": str(path),
        "face_normals": not block.smooth,
        "to_world": Matrix.of(matrix),
    }
    turned = (block.normal < 0) != (np.linalg.det(matrix[:3, :3]) < 0)
    return entry | ({"flip_normals": True} if turned else {})


def materials(
    obj: ObjFile, path: Path, find: Find, block: SceneObject
) -> tuple[Materials, list[Path]]:
    """The materials of all MTL files that an OBJ file names, and the folders of these files.

    A missing file is noted.
    """
    library, folders = Materials(), [Path(path).parent]
    read: set[Path] = set()
    missing: dict[str, int] = {}

    @functools.cache
    def beside_or_found(name: str) -> Path | None:
        beside = Path(path).parent / name.replace("\\", "/")
        return beside if beside.is_file() else find(name)

    for line, text in obj.mtllib:
        for name in library_names(text, lambda name: beside_or_found(name) is not None):
            file = beside_or_found(name)
            if file is None:
                missing.setdefault(name, line)
            elif file not in read:
                read.add(file)
                found = read_mtl(file)
                for number, note in found.notes[:20]:
                    block.lines.add("", note.at(f"{Path(file).name}:{number}"))
                library.update(found)
                folders.append(Path(file).parent)
    for name, line in list(missing.items())[:NAMES]:
        note = make_note("material-library-missing", name=name)
        block.lines.add("", note.at(f"{Path(path).name}:{line}"))
    return library, folders


def with_material(block: SceneObject, material: Material) -> SceneObject:
    """An object with what an MTL material sets (section 12.2)."""
    changes: dict[str, Any] = {}
    if material.color is not None and material.map_kd is None:
        changes["color"] = material.color
    if material.specular is not None:
        is_diffuse = block.reflection.kind in (None, "diffuse")
        changes["specular"] = BLACK if is_diffuse else material.specular
    if material.reflection is not None:
        changes |= reflecting(material.reflection, material)
    return dataclasses.replace(block, **changes)


def reflecting(code: int, material: Material) -> dict[str, Any]:
    """What a `#REFLECTION` code and the keys that depend on it set."""
    kind = KINDS[code]
    color, specular = material.color or BLACK, material.specular or BLACK
    changes: dict[str, Any] = {
        "reflection": Reflection(kind, subsurface=code >= 5),
        "emission": material.emission or BLACK,
        "refractive_index": material.ni or 0.0,
        "roughness": material.diffuse_weight,
        "color": specular if kind in ("specular", "glass") else color,
        "specular": specular,
    }
    if kind == "ward":
        changes["ward_brdf"] = (1.0, 1.0, *(x or 1e-3 for x in material.ward or (0.1, 0.1)))
    if kind == "phong":
        changes["phong_brdf"] = (1.0, 1.0, 5.0 if material.ns is None else material.ns)
    return changes


def reflectances(
    block: SceneObject,
    material: Material | None,
    find: Find,
    spectral: bool,
    colored: bool = False,
    object_color: Color | None = None,
) -> Reflectances:
    """The `Reflectances` of a part: a picture, vertex colours or plain ones (sections 11.2, 12).

    Args:
        block: the object, with what its material sets.
        material: the MTL material, or None.
        find: function from the name of a picture to its path.
        spectral: whether the scene is rendered by wavelength.
        colored: whether the mesh has vertex colours.
        object_color: colour of the object itself, a factor of the material's picture.

    Raises:
        ImageError: a picture cannot be read.
    """
    if block.texture is not None:
        if material is not None and material.map_kd is not None:
            block.lines.remark("texture", "texture-over-map")
        picture = load_texture(find(block.texture), flip=False, spectral=spectral)
        return Reflectances(picture, block.specular)
    if material is not None and material.map_kd is not None:
        assert object_color is not None
        file = material.map_kd.file
        path = find(file)
        if path is None:
            block.lines.becomes("", "material-picture-missing", file=file, key="map_Kd")
            return Reflectances(object_color, block.specular)
        if any(block.emission) and material.emission:
            block.lines.becomes("", "emission-not-textured")
        picture = material_texture(material.map_kd, path, material.repeat or 1, spectral)
        return Reflectances(times(picture, object_color), block.specular)
    if colored and (material is None or material.color is None):
        return Reflectances(VertexColor(), block.specular)
    return Reflectances(block.color, block.specular)


def material_texture(map_kd: TextureMap, path: Path, repeat: int, spectral: bool) -> Texture:
    """The picture of a material with its options: u and v become scale times them plus offset.

    Args:
        map_kd: the options.
        path: the picture.
        repeat: how often it repeats along each side of the unit square, after scale and offset.
        spectral: whether the scene is rendered by wavelength.

    Raises:
        ImageError: the picture cannot be read.
    """
    u, v, _ = map_kd.scale
    du, dv, _ = map_kd.offset
    # Meshes have 1 - v: 1 - r (s v + o) = r s (1 - v) + (1 - r s) - r o.
    turned = 1 - repeat * v
    if not map_kd.clamp:
        turned %= 1  # 0 where the picture's repetitions fall on each other
    texture = load_texture(
        path,
        flip=False,
        repeat=repeat,
        uv_scale=(u, v),
        uv_offset=(du, turned / repeat - dv),
        clamp=map_kd.clamp,
        spectral=spectral,
    )
    return texture.adjusted(map_kd.base, map_kd.gain)


def smooth(block: SceneObject, material: Material | None) -> bool:
    """Whether normals are interpolated: `#SMOOTH` before `smooth`."""
    if material is not None and material.smooth is not None:
        return material.smooth != 0
    return block.smooth


def face_normals(group: Group) -> Group | None:
    """A group whose faces are shaded, flat, with the mean of their corners' normals (row flat-vn).

    Returns:
        The group with corners of its own for each face; None where the file has no normals, or all
        of these means are the normals of the faces, up to `UPRIGHT`.
    """
    if group.normals is None:
        return None
    mean = group.normals[group.faces].sum(axis=1)
    a, b, c = (group.vertices[group.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    length, size = (np.linalg.norm(x, axis=1, keepdims=True) for x in (mean, across))
    usable = length > 1e-6
    mean = np.where(usable, mean / np.where(usable, length, 1), across / np.maximum(size, 1e-300))
    if np.all((mean * across).sum(axis=1) >= (1 - UPRIGHT) * size[:, 0]):
        return None
    corners = group.faces.ravel()
    return dataclasses.replace(
        group,
        vertices=group.vertices[corners],
        faces=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        normals=np.repeat(mean, 3, axis=0),
        uv=None if group.uv is None else group.uv[corners],
        colors=None if group.colors is None else group.colors[corners],
        source=group.source[corners],
    )


def mesh(
    obj: ObjFile,
    group: Group,
    matrix: np.ndarray,
    smoothed: bool,
    turned: bool,
    tint: Reflectances,
) -> Entry:
    """The dictionary of one group of faces under a matrix."""
    normals = None
    if smoothed:
        normals = group.normals if group.normals is not None else obj.smooth_normals(group)
        normals = normals @ np.linalg.inv(matrix[:3, :3])
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    vertices = group.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    faces = group.faces[:, ::-1] if mirrored != turned else group.faces
    if turned and normals is not None:
        normals = -normals
    uv = None if group.uv is None else np.stack([group.uv[:, 0], 1 - group.uv[:, 1]], axis=1)
    colors = group.colors if isinstance(tint.color, VertexColor) else None
    return {"type": "mesh", "mesh": Mesh(vertices, faces, normals, uv, colors)}
