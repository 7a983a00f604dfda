"""Values of the translated scene that plain Python types cannot hold, and what becomes of them.

The translator builds a dictionary of plain values; only `to_mitsuba` touches Mitsuba, so a scene
can be planned, checked, compared and printed without any variant.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

Entry = dict[str, Any]
"""A plugin with its parameters: what `mi.load_dict` takes, with the values below in places."""


@dataclass(frozen=True)
class Matrix:
    """A 4x4 transformation in double precision: `rows`, a tuple of four tuples."""

    rows: tuple[tuple[float, ...], ...]

    @staticmethod
    def of(array: np.ndarray) -> Matrix:
        """From a numpy array of shape (4, 4)."""
        return Matrix(tuple(tuple(float(x) for x in row) for row in np.asarray(array)))


@dataclass(frozen=True)
class Color:
    """Linear RGB of a reflectance that may lie outside 0 to 1."""

    rgb: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in double precision.

    Attributes:
        vertices: (V, 3) positions in scene units.
        faces: (F, 3) vertex indices; the normal side is counter-clockwise.
        normals: (V, 3) unit vertex normals, or None for flat faces.
        uv: (V, 2) texture coordinates, or None.
        colors: (V, 3) linear RGB, or None.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None
    uv: np.ndarray | None = None
    colors: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Picture:
    """Pixels of a texture, the `picture` of a `bitmap`: (height, width, channels), v = 0 first."""

    pixels: np.ndarray


def rgb(values: Iterable[float]) -> Entry:
    """A radiance or another quantity without an upper end."""
    return {"type": "rgb", "value": [float(x) for x in values]}


def reflectance(values: tuple[float, float, float]) -> Entry:
    """A reflectance; outside 0 to 1 it is kept as written."""
    if all(0 <= x <= 1 for x in values):
        return rgb(values)
    r, g, b = (float(x) for x in values)
    return {"type": "srgb", "color": Color((r, g, b)), "unbounded": True}


def resolved(scene: Entry, name: str) -> Entry:
    """A scene's dictionary with the entry `name`, if any, as a Mitsuba object wherever it is used.

    Meshes take no references, and the objects of a sensor are not told by it. A variant must be
    set.
    """
    import mitsuba as mi

    if name not in scene:
        return scene
    made = mi.load_dict(to_mitsuba(scene[name]))

    def replaced(value: Any) -> Any:
        if value == {"type": "ref", "id": name}:
            return made
        if isinstance(value, dict):
            return {key: replaced(item) for key, item in value.items()}
        return value

    return replaced({key: item for key, item in scene.items() if key != name})


def to_mitsuba(value: Any) -> Any:
    """The dictionary that `mi.load_dict` takes; a variant must be set.

    Args:
        value: dictionary, list or value as the translator builds them.
    """
    import mitsuba as mi

    if isinstance(value, dict):
        if isinstance(value.get("mesh"), Mesh):
            return mitsuba_mesh(value)
        return {
            "bitmap" if isinstance(item, Picture) else key: to_mitsuba(item)
            for key, item in value.items()
        }
    if isinstance(value, Matrix):
        with np.errstate(over="ignore"):  # infinite in single precision: who loads it says so
            return mi.ScalarTransform4f(np.array(value.rows))
    if isinstance(value, Picture):
        return mi.Bitmap(np.asarray(value.pixels, np.float32))
    if isinstance(value, Color):
        return mi.ScalarColor3f(*value.rgb)
    return value


def mitsuba_mesh(entry: Entry) -> Any:
    """The Mitsuba shape of a `{"type": "mesh", "mesh": Mesh, ...}` entry.

    The names of mesh parameters change with Mitsuba 3.10; only this function knows them.
    """
    import mitsuba as mi

    mesh = entry["mesh"]
    properties = mi.Properties()
    for key, item in entry.items():
        if key not in ("type", "mesh"):
            properties[key] = mi.load_dict(to_mitsuba(item)) if isinstance(item, dict) else item
    result = mi.Mesh(
        entry.get("id", "mesh"),
        len(mesh.vertices),
        len(mesh.faces),
        props=properties,
        has_vertex_normals=mesh.normals is not None,
        has_vertex_texcoords=mesh.uv is not None,
    )
    if mesh.colors is not None:
        result.add_attribute("vertex_color", 3, np.ravel(mesh.colors).astype(np.float32))
    parameters = mi.traverse(result)
    parameters["vertex_positions"] = np.ravel(mesh.vertices).astype(np.float32)
    parameters["faces"] = np.ravel(mesh.faces).astype(np.uint32)
    if mesh.normals is not None:
        parameters["vertex_normals"] = np.ravel(mesh.normals).astype(np.float32)
    if mesh.uv is not None:
        parameters["vertex_texcoords"] = np.ravel(mesh.uv).astype(np.float32)
    parameters.update()
    return result
