"""Where flights meet the surface near which they start, in coordinates local to a point of it.

In single precision a point of the world is known to 6e-8 of its coordinates. What matters inside a
dense medium is its distance from the boundary in mean free paths, so walks keep their positions x
relative to an anchor a on the surface, and know the surface around it:

    f(x) = 2 n . x + k |x|^2 = 0,

the plane (k = 0) of a flat face or the sphere of the curvature k, with n the unit normal at a that
points out of the region where f < 0. Nothing in it cancels near the anchor, where |x| is small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.translucentmaterials import nested
from relume.integrators.translucentobjects import registry_number, triangles

FLAT = ("Rectangle", "Disk")
"""Classes of shapes that are one flat face."""

FLAT_FACES, SPHERE = 1, 2
"""Kinds of surfaces that an anchor describes."""

FAR = 1e30
"""Distance of what is not met."""


@dataclass
class Anchor:
    """A point of a surface, and the surface around it.

    Attributes:
        p: ``mi.Point3f``, the point in the world.
        n: ``mi.Vector3f``, unit normal that points out of the region.
        k: ``mi.Float``, curvature, above 0 where the region is convex.
        known: ``mi.Bool``, whether `n` and `k` describe the surface.
        alone: ``mi.Bool``, whether it is a sphere in which nothing is.
        shape: ``mi.ShapePtr``.
        prim: ``mi.UInt32``, index of the face on the shape.
        extent: ``mi.Float``, size of what rays are tested against there: `extent_within`.
        outer: ``mi.Bool``, whether the region is on the side that the shape's normals point to.
        absorbed: ``mi.Float``, share of the light that the surface takes; 1 unless it is a diffuse
            grey sphere that does not shine.
    """

    p: mi.Point3f
    n: mi.Vector3f
    k: mi.Float
    known: mi.Bool
    alone: mi.Bool
    shape: mi.ShapePtr
    prim: mi.UInt32
    extent: mi.Float
    outer: mi.Bool
    absorbed: mi.Float

    @classmethod
    def none(cls, p: mi.Point3f) -> Anchor:
        """That of a walk that starts at a point of no surface."""
        return cls(
            mi.Point3f(p),
            mi.Vector3f(0),
            mi.Float(0),
            mi.Bool(False),
            mi.Bool(False),
            dr.zeros(mi.ShapePtr),
            mi.UInt32(0),
            mi.Float(0),
            mi.Bool(False),
            mi.Float(1),
        )

    def f(self, x: mi.Vector3f) -> mi.Float:
        """2 n . x + k |x|^2, below 0 inside, clamped against rounding."""
        value = dr.fma(self.k, dr.squared_norm(x), 2 * dr.dot(self.n, x))
        return dr.minimum(value, 0)

    def distance(self, x: mi.Vector3f, d: mi.Vector3f) -> mi.Float:
        """How far it is from `x` along `d` to the surface, from inside, or `FAR`.

        The root t > 0 of k t^2 + 2 b t + f = 0 without cancellation.
        """
        f = self.f(x)
        b = dr.fma(self.k, dr.dot(x, d), dr.dot(self.n, d))
        D = dr.fma(b, b, -self.k * f)
        root = dr.safe_sqrt(D)
        ahead = -f / (b + root)
        behind = (root - b) / self.k
        t = dr.select(b > 0, ahead, dr.select(self.k > 0, behind, FAR))
        return dr.select(D >= 0, t, FAR)

    def depth(self, x: mi.Vector3f) -> mi.Float:
        """Distance of `x` from the surface."""
        f = self.f(x)
        return -f / (1 + dr.safe_sqrt(dr.fma(self.k, f, 1)))

    def normal(self, x: mi.Vector3f) -> mi.Vector3f:
        """Unit normal at a point of the surface."""
        return dr.normalize(dr.fma(self.k, x, self.n))


class KnownSurfaces:
    """The shapes of a scene whose surface an `Anchor` describes, as known before it is rendered.

    Flat faces of meshes and rectangles, disks, and spheres; none inside instances.

    Args:
        scene: `mi.Scene`.

    Attributes:
        white: whether some sphere reflects nearly all light.
    """

    def __init__(self, scene: mi.Scene) -> None:
        shapes = [s for s in scene.shapes() if s.bsdf() is not None]
        numbers = [registry_number(shape) for shape in shapes]
        size = max(numbers, default=0) + 1
        kind, alone = np.zeros(size, np.uint32), np.zeros(size, bool)
        ball, extent = np.zeros((size, 4), np.float32), np.zeros(size, np.float32)
        absorbed = np.ones(size, np.float32)
        media = box_of_media(shapes)
        for number, shape in zip(numbers, shapes, strict=True):
            extent[number] = extent_within(shape, media)
            if shape.is_mesh() or shape.class_name() in FLAT:
                kind[number] = FLAT_FACES
            elif shape.class_name() == "Sphere":
                kind[number] = SPHERE
                ball[number] = sphere_of(shape)
                absorbed[number] = absorption(shape)
                others = [other for other in shapes if other is not shape]
                alone[number] = all(apart(ball[number], other) for other in others)
        self._kind, self._alone = mi.UInt32(kind), mi.Bool(alone)
        self._ball = [mi.Float(column) for column in ball.T]
        self.white = bool((absorbed < 1e-3).any())
        self._extent, self._absorbed = mi.Float(extent), mi.Float(absorbed)

    def anchor(self, si: mi.SurfaceInteraction3f, d: mi.Vector3f, active: mi.Bool) -> Anchor:
        """The `Anchor` at points of surfaces for walks that set out along `d`.

        Args:
            si: ``mi.SurfaceInteraction3f``.
            d: direction of travel.
            active: lanes.
        """
        number = dr.reinterpret_array(mi.UInt32, si.shape)
        active = active & (number < dr.width(self._kind)) & (si.instance == None)  # noqa: E711
        kind = dr.gather(mi.UInt32, self._kind, number, active)
        x, y, z, R = (dr.gather(mi.Float, column, number, active) for column in self._ball)
        outer = dr.dot(si.n, d) > 0
        n = dr.select(outer, -mi.Vector3f(si.n), mi.Vector3f(si.n))
        curvature = dr.rcp(dr.mulsign(R, dr.dot(n, si.p - mi.Point3f(x, y, z))))
        k = dr.select(kind == SPHERE, curvature, 0)
        return Anchor(
            p=mi.Point3f(si.p),
            n=n,
            k=k,
            known=kind != 0,
            alone=dr.gather(mi.Bool, self._alone, number, active) & (k > 0),
            shape=mi.ShapePtr(si.shape),
            prim=mi.UInt32(si.prim_index),
            extent=dr.gather(mi.Float, self._extent, number, active),
            outer=outer,
            absorbed=dr.gather(mi.Float, self._absorbed, number, active),
        )


def box_of_media(shapes: Sequence[mi.Shape]) -> np.ndarray:
    """Corners of the box around the shapes with a medium inside, (2, 3); all space without any."""
    boxes = [shape.bbox() for shape in shapes if shape.interior_medium() is not None]
    if not boxes:
        return np.array([[-np.inf] * 3, [np.inf] * 3])
    low = np.min([np.array(box.min, float).ravel() for box in boxes], axis=0)
    high = np.max([np.array(box.max, float).ravel() for box in boxes], axis=0)
    return np.stack([low, high])


def extent_within(shape: mi.Shape, media: np.ndarray) -> float:
    """Diagonal of the box around a shape, or around its largest face of those that reach media.

    A plane that goes on for ever has faces that grow with their distance.

    Args:
        shape: `mi.Shape`.
        media: corners of the box outside which no walk is, (2, 3).
    """
    corners = corners_of(shape)
    if corners is None:
        box = shape.bbox()
        return float(dr.norm(box.max - box.min))
    low, high = corners.min(axis=1), corners.max(axis=1)
    reached = ((low <= media[1]) & (high >= media[0])).all(axis=1)
    return float(np.linalg.norm(high - low, axis=1).max(initial=0, where=reached))


def absorption(shape: mi.Shape) -> float:
    """Share of the light that a grey diffuse surface takes; 1 for any other."""
    kinds = {bsdf.class_name() for bsdf in [shape.bsdf(), *nested(shape, mi.BSDF)]}
    if not kinds <= {"SmoothDiffuse", "TwoSidedBRDF"} or shape.is_emitter():
        return 1.0
    values = {k: v for k, v in mi.traverse(shape.bsdf()).items() if "reflectance" in k}
    if not all(key.endswith("reflectance.value") for key in values):  # a picture
        return 1.0
    found = np.concatenate(
        [np.ravel(np.array(value, float)) for value in values.values()] or [np.zeros(1)]
    )
    return 1 - float(found.min()) if np.ptp(found) < 1e-6 else 1.0


def sphere_of(shape: mi.Shape) -> np.ndarray:
    """Centre and radius of a sphere, (4,)."""
    matrix = np.array(mi.traverse(shape)["to_world"].matrix, float).reshape(4, 4)
    return np.append(matrix[:3, 3], np.linalg.norm(matrix[:3, 0]))


def apart(ball: np.ndarray, shape: mi.Shape) -> bool:
    """Whether no point of a shape is in a ball; False where that is not known.

    Args:
        ball: centre and radius, (4,).
        shape: `mi.Shape`.
    """
    centre, radius = ball[:3].astype(float), float(ball[3])
    box = shape.bbox()
    low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
    if np.linalg.norm(np.clip(centre, low, high) - centre) > radius:
        return True
    if shape.class_name() == "Sphere":
        other = sphere_of(shape)
        return bool(other[3] > np.linalg.norm(other[:3] - centre) + radius)
    faces = corners_of(shape)
    return faces is not None and bool((distances(faces - centre) > radius).all())


def corners_of(shape: mi.Shape) -> np.ndarray | None:
    """The triangles of a mesh, or those that cover a rectangle or disk, (N, 3, 3)."""
    if shape.is_mesh():
        found = triangles(shape)
        assert found is not None
        return found[0][found[1]].astype(float)
    if shape.class_name() not in FLAT:
        return None
    matrix = np.array(mi.traverse(shape)["to_world"].matrix, float).reshape(4, 4)
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    corners = square @ matrix[:3, :2].T + matrix[:3, 3]
    return np.stack([corners[[0, 1, 2]], corners[[0, 2, 3]]])


def distances(faces: np.ndarray) -> np.ndarray:
    """Distances of triangles (N, 3, 3) from the origin, (N,).

    The nearest point is the foot on the plane, if that lies in the triangle, or is on an edge.
    """
    a, b = faces, np.roll(faces, -1, axis=1)
    edge = b - a
    length2 = np.maximum((edge**2).sum(axis=2), 1e-300)
    t = np.clip(-(a * edge).sum(axis=2) / length2, 0, 1)
    nearest = np.linalg.norm(a + t[..., None] * edge, axis=2).min(axis=1)
    n = np.cross(edge[:, 0], -edge[:, 2])
    area = np.maximum(np.linalg.norm(n, axis=1), 1e-300)
    foot = n * ((a[:, 0] * n).sum(axis=1) / area**2)[:, None]
    sides = np.cross(edge, foot[:, None] - a)
    within = ((sides * n[:, None]).sum(axis=2) >= 0).all(axis=1)
    return np.where(within, np.linalg.norm(foot, axis=1), nearest)
