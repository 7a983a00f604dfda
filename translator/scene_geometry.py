"""Where the objects of a document are: measured once, before any of them is made."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relume.translator import geometry
from relume.translator.assets import Find, existing
from relume.translator.camera import view
from relume.translator.document import Document
from relume.translator.giant_spheres import Ball, Surroundings, is_giant, nearest_point
from relume.translator.meshes import Meshes
from relume.translator.objects import SceneObject, Shape
from relume.translator.shapes import Annulus, Disk, Hemisphere, MeshFile, Plane, Sphere, UVPlane

NEAR_CAMERA, FAR_CAMERA = 0.01, 1e4
"""Coordinates of the camera that do not suggest that a scene must be moved [scene unit]."""


@dataclass(frozen=True, eq=False)
class Extent:
    """The box around some objects and the camera: its centre (3,) and its diagonal."""

    center: np.ndarray
    diameter: float


@dataclass(frozen=True, eq=False)
class SceneGeometry:
    """Where the camera and the objects of a document are.

    Attributes:
        camera: position of the camera, (3,).
        matrices: the transformation of each object, (4, 4).
        balls: what each sphere and hemisphere is in world space, by index of the object; None for
            one that becomes an ellipsoid.
        giants: indices of the spheres that are too large for single precision.
        planes: point and normal, (3,) each, of the infinite planes.
        whole: extent of all that is finite.
        inner: the same without what surrounds the camera, such as a sky, which does not tell how
            fine the scene is.
        unlit: the same without image-based lights.
        shown: diameter of what the scene shows; 0 where nothing tells it.
        surroundings: giant spheres and planes as the scene sees them; None without giants.
        boxes: corners of a box around each finite object, (N, 3), by its index.
        shining: indices of the image-based lights.
    """

    camera: np.ndarray
    matrices: tuple[np.ndarray, ...]
    balls: Mapping[int, Ball | None]
    giants: tuple[int, ...]
    planes: tuple[tuple[np.ndarray, np.ndarray], ...]
    whole: Extent
    inner: Extent
    unlit: Extent
    shown: float
    surroundings: Surroundings | None
    boxes: Mapping[int, np.ndarray]
    shining: frozenset[int]

    def farthest(self, center: np.ndarray, dome: int) -> float:
        """How far from a point what the camera can see in a dome lies at most.

        Args:
            center: the point, (3,).
            dome: index of the object whose inside it is: infinite planes and giant spheres reach
                it, and other domes and image-based lights end what light meets them.
        """
        if self.planes or self.giants:
            return math.inf
        seen = [self.camera[None]]
        seen += [box for k, box in self.boxes.items() if k != dome and k not in self.shining]
        return float(np.linalg.norm(np.concatenate(seen) - center, axis=1).max())

    def encloses_camera(self, index: int) -> bool:
        """Whether an object is a sphere or hemisphere whose ball holds the camera."""
        return _encloses(self.balls.get(index), self.camera)

    def medium_ball(self) -> Ball:
        """A ball twice as large as what the scene shows, image-based light aside."""
        center = self.unlit.center
        away = [2 * abs((center - p) @ n) for p, n in self.planes]
        if self.surroundings is not None:
            away += self.surroundings.distances()
        return Ball(center, max([self.unlit.diameter, 1e-3, *away]))


def measure(document: Document, dialect: str, meshes: Meshes, find: Find) -> SceneGeometry:
    """Where the objects of a document are.

    Args:
        document: the document.
        dialect: `manual` or `prender` (rows camera-angle and uvplane-extent).
        meshes: reads the files of mesh objects, where the size of the scene matters.
        find: function from the name of a file to its path.
    """
    camera = view(document, dialect).origin
    objects = document.objects
    matrices = tuple(geometry.compose(block.transforms) for block in objects)
    pairs = list(zip(objects, matrices, strict=True))
    balls = {
        k: world_ball(block.shape, m)
        for k, (block, m) in enumerate(pairs)
        if isinstance(block.shape, Sphere | Hemisphere)
    }
    giants = tuple(k for k, ball in balls.items() if _is_giant(ball, objects[k], camera))
    read_meshes = _size_matters(objects, camera)
    boxes = {}
    for k, (block, m) in enumerate(pairs):
        if k in giants:
            continue
        if isinstance(block.shape, MeshFile):
            box = meshes.bounds(existing(find, block.shape.file), m) if read_meshes else None
        else:
            box = box_corners(block.shape, m, dialect)
        if box is not None:
            boxes[k] = box
    whole = _extent([camera[None], *boxes.values()])
    inner = _extent(
        [camera[None], *(b for k, b in boxes.items() if not _encloses(balls.get(k), camera))]
    )
    unlit = _extent(
        [camera[None], *(b for k, b in boxes.items() if objects[k].ibl_texture is None)]
    )
    planes = tuple(
        (geometry.point(m, block.shape.point), geometry.normal(m, block.shape.normal))
        for block, m in pairs
        if isinstance(block.shape, Plane)
    )
    giant_balls = [ball for k in giants if (ball := balls[k]) is not None]
    # Where there is nothing but surroundings, how near they are tells the size.
    near = [float(abs((camera - p) @ n)) for p, n in planes]
    near += [float(np.linalg.norm(nearest_point(ball, camera) - camera)) for ball in giant_balls]
    return SceneGeometry(
        camera=camera,
        matrices=matrices,
        balls=balls,
        giants=giants,
        planes=planes,
        whole=whole,
        inner=inner,
        unlit=unlit,
        shown=inner.diameter or whole.diameter or min(near, default=0.0),
        surroundings=(
            Surroundings(giant_balls, planes, camera, inner.diameter) if giants else None
        ),
        boxes=boxes,
        shining=frozenset(k for k, block in enumerate(objects) if block.ibl_texture is not None),
    )


def _size_matters(objects: Sequence[SceneObject], camera: np.ndarray) -> bool:
    """Whether the sizes of meshes are needed: reading large files takes a while."""
    ordinary = NEAR_CAMERA <= np.max(np.abs(camera)) <= FAR_CAMERA
    return not ordinary or any(
        isinstance(b.shape, Plane | Sphere | Hemisphere) for b in objects
    )


def _is_giant(ball: Ball | None, block: SceneObject, camera: np.ndarray) -> bool:
    plain = isinstance(block.shape, Sphere) and block.ibl_texture is None and not block.texture
    return ball is not None and plain and is_giant(ball, camera)


def _encloses(ball: Ball | None, point: np.ndarray) -> bool:
    return ball is not None and bool(np.linalg.norm(point - ball.center) < ball.radius)


def _extent(boxes: Sequence[np.ndarray]) -> Extent:
    """The extent of the corners (N, 3) of several boxes."""
    corners = np.concatenate(boxes)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Extent((low + high) / 2, float(np.linalg.norm(high - low)))


def world_ball(shape: Sphere | Hemisphere, matrix: np.ndarray) -> Ball | None:
    """The ball that a sphere becomes under a matrix, or None if it becomes an ellipsoid."""
    scale = geometry.similarity_scale(matrix[:3, :3])
    if scale is None:
        return None
    return Ball(geometry.point(matrix, shape.center), shape.radius * scale)


def box_corners(shape: Shape | None, matrix: np.ndarray, dialect: str) -> np.ndarray | None:
    """Corners of a box around a finite shape, (N, 3), or None for meshes and what has no end."""
    if isinstance(shape, Sphere | Hemisphere | Disk | Annulus):
        size = shape.radius * np.abs(matrix[:3, :3]).sum(axis=1)
        center = geometry.point(matrix, shape.center)
        return np.stack([center - size, center + size])
    if isinstance(shape, UVPlane):
        corner, (u, v) = np.array(shape.origin), shape.edges(dialect)
        corners = [corner, corner + u, corner + v, corner + u + v]
        return np.stack([geometry.point(matrix, c) for c in corners])
    return None
