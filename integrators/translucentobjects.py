"""Which translucent object a point of a surface belongs to.

Light that enters an object leaves the same object. Mitsuba's shapes are not these objects: a mesh
with several materials is several shapes, meshes of one material are merged into one shape when a
scene is loaded, and all instances of a group share its shapes. Here an object is all surfaces whose
materials carry the same name (parameter ``object`` of `subsurface`), or else what is connected, and
in instances what belongs to the same one.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np


@dataclass
class ObjectId:
    """The object of a point.

    Attributes:
        label: ``mi.UInt32``, a number from 1 on; 0 for what is not translucent.
        instance: ``mi.ShapePtr``, the instance it belongs to, or null.
    """

    label: mi.UInt32
    instance: mi.ShapePtr

    @classmethod
    def none(cls) -> ObjectId:
        """That of points outside of all objects."""
        return cls(mi.UInt32(0), dr.zeros(mi.ShapePtr))

    def is_same(self, other: ObjectId) -> mi.Bool:
        """Whether both are one object, lane by lane."""
        return (self.label == other.label) & (self.instance == other.instance)


class TranslucentObjects:
    """The objects that the shapes with a translucent material make up.

    Args:
        shapes: pairs of a shape (``mi.Shape``) and the name of its object, empty for none.
    """

    def __init__(self, shapes: Sequence[tuple[mi.Shape, str]]) -> None:
        labels = labels_of_faces(shapes)
        numbers = [registry_number(shape) for shape, _ in shapes]
        # Of shapes that are one object as a whole, all faces have the label of the first.
        whole = [bool((faces == faces[0]).all()) for faces in labels]
        kept = [faces[:1] if one else faces for faces, one in zip(labels, whole, strict=True)]
        starts = np.cumsum([1] + [len(faces) for faces in kept[:-1]])
        first, stride = np.zeros((2, max(numbers, default=0) + 1), np.uint32)
        first[numbers] = starts[: len(numbers)]
        stride[numbers] = ~np.array(whole, dtype=bool)
        self._first, self._stride = mi.UInt32(first), mi.UInt32(stride)
        self._labels = mi.UInt32(np.concatenate([np.zeros(1, np.uint32), *kept]))

    def at(self, si: mi.SurfaceInteraction3f, active: mi.Bool) -> ObjectId:
        """The `ObjectId` of points of surfaces.

        Args:
            si: ``mi.SurfaceInteraction3f``.
            active: lanes.
        """
        number = dr.reinterpret_array(mi.UInt32, si.shape)
        active = active & (number < dr.width(self._first))
        first = dr.gather(mi.UInt32, self._first, number, active)
        stride = dr.gather(mi.UInt32, self._stride, number, active)
        face = dr.fma(stride, si.prim_index, first)
        return ObjectId(dr.gather(mi.UInt32, self._labels, face, active), si.instance)


def registry_number(shape: mi.Shape) -> int:
    """The number by which ``mi.ShapePtr`` refers to a shape."""
    return int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])


_labels: dict[tuple[Any, ...], list[np.ndarray]] = {}
"""The labels of the shapes looked at last: each pass of a render asks for them anew."""


def labels_of_faces(shapes: Sequence[tuple[mi.Shape, str]]) -> list[np.ndarray]:
    """The labels of all faces of each shape, of one face for shapes that are no meshes.

    Args:
        shapes: as `TranslucentObjects`.

    Returns:
        An array of uint32 for each shape, labels from 1 on.
    """
    geometry = [None if name else triangles(shape) for shape, name in shapes]
    key = tuple(
        name or (registry_number(shape) if mesh is None else tuple(map(_checksum, mesh)))
        for (shape, name), mesh in zip(shapes, geometry, strict=True)
    )
    if key not in _labels:
        _labels.clear()
        _labels[key] = _labels_of_faces([name for _, name in shapes], geometry)
    return _labels[key]


def _checksum(array: np.ndarray) -> int:
    return zlib.crc32(array.tobytes())


def triangles(shape: mi.Shape) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices (N, 3) in float32 and faces (M, 3) of a mesh, None for other shapes."""
    if not shape.is_mesh():
        return None
    vertices = np.array(shape.vertex_positions_buffer(), np.float32).reshape(-1, 3)
    faces = np.array(shape.faces_buffer(), np.uint32).reshape(-1, 3)
    return vertices + np.float32(0), faces  # -0 becomes 0


def _labels_of_faces(
    names: Sequence[str], geometry: Sequence[tuple[np.ndarray, np.ndarray] | None]
) -> list[np.ndarray]:
    meshes = [mesh for mesh in geometry if mesh is not None]
    parts = iter(components(meshes))
    named: dict[str, int] = {}
    next_label = 1 + sum(len(faces) for _, faces in meshes)
    labels = []
    for name, mesh in zip(names, geometry, strict=True):
        if mesh is not None and len(mesh[1]):
            labels.append(next(parts) + np.uint32(1))
            continue
        if mesh is not None:
            next(parts)
        label = named.setdefault(name, next_label) if name else next_label
        next_label += label == next_label
        labels.append(np.array([label], np.uint32))
    return labels


def components(meshes: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[np.ndarray]:
    """Number the connected pieces of meshes.

    Faces are connected if they share a vertex, or have edges in the same place that nothing else
    has: the seams along which materials, or coordinates of textures, cut a surface.

    Args:
        meshes: vertices (N, 3) and faces (M, 3) of each.

    Returns:
        For each mesh the numbers of its faces' pieces, uint32, from 0 on.
    """
    if not meshes:
        return []
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    counts = [len(vertices) for vertices, _ in meshes]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    faces = np.concatenate(
        [part.astype(np.int64) + offset for (_, part), offset in zip(meshes, offsets, strict=False)]
    )
    points = np.concatenate([vertices for vertices, _ in meshes])
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, place = np.unique(points, axis=0, return_inverse=True)
    rims = edges[alone(np.sort(edges, axis=1))]
    where = np.sort(place.ravel()[rims], axis=1)
    order, pairs = shared_by_two(where)
    seams = np.stack([rims[order[pairs], 0], rims[order[pairs + 1], 0]], axis=1)
    joined = np.concatenate([edges, seams])
    total = int(offsets[-1])
    graph = coo_array((np.ones(len(joined), np.int8), joined.T), shape=(total, total))
    _, number = connected_components(graph, directed=False)
    numbers = number.astype(np.uint32)[faces[:, 0]]
    return np.split(numbers, np.cumsum([len(part) for _, part in meshes])[:-1])


def alone(edges: np.ndarray) -> np.ndarray:
    """Which of the edges (N, 2) occur once."""
    _, inverse, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    return count[inverse.ravel()] == 1


def shared_by_two(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An order that sorts edges (N, 2), and the places in it where two that are equal begin."""
    order = np.lexsort(edges.T)
    _, first, count = np.unique(
        edges[order][:, ::-1], axis=0, return_index=True, return_counts=True
    )
    return order, first[count == 2]
