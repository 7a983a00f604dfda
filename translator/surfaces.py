"""From shapes to Mitsuba shapes (spec section 6): the cheapest exact one for each."""

import math

import numpy as np

from relume.translator import geometry
from relume.translator.dialects import note
from relume.translator.giant_spheres import Ball, Surroundings, is_giant, nearest_point
from relume.translator.scene_values import Matrix, Mesh
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

PLANE_REACH = 100.0
"""Half the side of an infinite plane, in radii of the finite part of the scene."""

NEAR_CAMERA, FAR_CAMERA = 0.01, 1e4
"""Coordinates of the camera that do not suggest that a scene must be moved [scene unit]."""

ROUNDING = 6e-8
"""Error of a hit point over the size of the triangle between whose corners it is interpolated."""

COARSE = 0.01
"""Error of points on an infinite plane over the camera's height from which on a note tells it."""

VISIBLE_EDGE = 0.5
"""Angle below the horizon from which on a note tells of an infinite plane's edge [degree]."""

ANNULUS_SEGMENTS = 1024
"""Segments of a ring: its edge is at most 5e-6 of the radius off the circle."""

DOME_SEGMENTS = 256
"""Segments of a tessellated dome or ellipsoid around its axis; half as many along a meridian."""


class ShapeBuilder:
    """Makes the shapes of one document.

    Args:
        document: the document; notes go to its lines.
        camera: position of the camera, (3,).
        dialect: `manual` or `prender` (row uvplane-extent).
        mesh_box: function from a mesh object and its matrix to corners (N, 3) or None; called only
            where the size of the scene matters.
    """

    def __init__(self, document, camera, dialect, mesh_box):
        self.dialect = dialect
        self.camera = camera
        self.matrices = [geometry.compose(block.transforms) for block in document.objects]
        pairs = list(zip(document.objects, self.matrices, strict=True))
        ordinary = NEAR_CAMERA <= np.max(np.abs(camera)) <= FAR_CAMERA
        if ordinary and not any(isinstance(b.shape, Plane | Sphere) for b, _ in pairs):
            mesh_box = lambda *_: None  # noqa: E731
        self.balls = {
            k: ball(block.shape, m)
            for k, (block, m) in enumerate(pairs)
            if isinstance(block.shape, Sphere | Hemisphere)
        }
        self.giants = [k for k, b in self.balls.items() if self._is_giant(b, document.objects[k])]
        boxes = {
            k: box
            for k, (block, m) in enumerate(pairs)
            if k not in self.giants and (box := self._box(block, m, mesh_box)) is not None
        }
        self.center, self.size = _middle([camera[None], *boxes.values()])
        # What surrounds the camera, such as a sky, does not tell how fine the scene is.
        inner = [box for k, box in boxes.items() if not self.encloses(k, camera)]
        self.focus, self.extent = _middle([camera[None], *inner])
        ends = [b for k, b in boxes.items() if document.objects[k].ibl_texture is None]
        self.middle = _middle([camera[None], *ends])
        self.planes = [
            (geometry.point(m, b.shape.point), geometry.normal(m, b.shape.normal))
            for b, m in pairs
            if isinstance(b.shape, Plane)
        ]
        giants = [self.balls[k] for k in self.giants]
        # Where there is nothing but surroundings, how near they are tells the size.
        near = [abs((camera - p) @ n) for p, n in self.planes]
        near += [np.linalg.norm(nearest_point(ball, camera) - camera) for ball in giants]
        self.shown = self.extent or self.size or min(near, default=0.0)
        self.surroundings = None
        if giants:
            self.surroundings = Surroundings(giants, self.planes, camera, self.extent)

    def _is_giant(self, round_one, block):
        fits = isinstance(block.shape, Sphere) and block.ibl_texture is None and not block.texture
        return round_one is not None and fits and is_giant(round_one, self.camera)

    def _box(self, block, matrix, mesh_box):
        if isinstance(block.shape, MeshFile):
            return mesh_box(block, matrix)
        return bounds(block.shape, matrix, self.dialect)

    def encloses(self, index, point):
        """Whether an object is a sphere or hemisphere whose ball holds a point."""
        round_one = self.balls.get(index)
        return bool(round_one) and np.linalg.norm(point - round_one.center) < round_one.radius

    def fog_ball(self):
        """A `Ball` twice as large as what the scene shows, image-based light aside."""
        center, size = self.middle
        away = [2 * abs((center - p) @ n) for p, n in self.planes]
        if self.surroundings is not None:
            away += self.surroundings.distances()
        return Ball(center, max([size, 1e-3, *away]))

    def shape(self, index, block):
        """The dictionary of an object's shape, without BSDF and emitter.

        Returns:
            A dictionary, or None for what has no geometry.
        """
        shape, matrix = block.shape, self.matrices[index]
        if isinstance(shape, Sphere):
            return self.sphere(index, block, shape, matrix)
        if isinstance(shape, Hemisphere):
            return self.hemisphere(block, shape, matrix)
        if isinstance(shape, UVPlane):
            return self.parallelogram(block, shape, matrix)
        if isinstance(shape, Plane):
            return self.plane(block, shape, matrix)
        if isinstance(shape, Disk):
            return self.disk(block, shape, matrix)
        if isinstance(shape, Annulus):
            return self.annulus(block, shape, matrix)
        assert isinstance(shape, MeshFile | InfinityLight)
        return None

    def sphere(self, index, block, shape, matrix):
        turned = block.normal < 0
        if index in self.giants:
            patch = self.giants.index(index), block.reflection.lets_pass
            mesh, text = self.surroundings.patch(*patch)
            block.lines.remark("", f"giant sphere made of {text}")
            return mesh_entry(mesh, turned)
        round_one = ball(shape, matrix)
        if any(t.kind == "rotation" for t in block.transforms):
            block.lines.remark("", note("sphere-rotation", self.dialect))
        if round_one is None:
            block.lines.becomes("", "approximated", "an ellipsoid, tessellated")
            return mesh_entry(dome(shape, matrix, np.pi), turned)
        entry = {
            "type": "sphere",
            "center": [float(x) for x in round_one.center],
            "radius": float(round_one.radius),
        }
        return entry | flipped(turned)

    def hemisphere(self, block, shape, matrix):
        """The upper half of a sphere, tessellated: a masked sphere would block explicit light."""
        mesh = dome(shape, matrix, np.pi / 2)
        off = 1 - np.cos(np.pi / DOME_SEGMENTS)
        text = f"a dome of {DOME_SEGMENTS} segments, at most {off:.1g} of the radius off the sphere"
        block.lines.becomes("", "approximated", text)
        return mesh_entry(mesh, block.normal < 0)

    def parallelogram(self, block, shape, matrix):
        if any(not np.isclose(np.linalg.norm(e), 1) for e in (shape.u, shape.v)):
            block.lines.remark("", note("uvplane-extent", self.dialect))
        u, v = (matrix[:3, :3] @ edge for edge in shape.edges(self.dialect))
        corner = geometry.point(matrix, shape.origin)
        # U x V turns round under a mirroring matrix, the normal does not.
        turned = (block.normal < 0) != (np.linalg.det(matrix[:3, :3]) < 0)
        if abs(u @ v) > 1e-6 * np.linalg.norm(u) * np.linalg.norm(v):
            uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
            mesh = Mesh(corner + uv @ np.stack([u, v]), np.array([[0, 1, 2], [0, 2, 3]]), uv=uv)
            return mesh_entry(mesh, turned)
        linear = np.stack([u / 2, v / 2, geometry.unit(np.cross(u, v))], axis=1)
        to_world = geometry.affine(linear, corner + u / 2 + v / 2)
        return {"type": "rectangle", "to_world": Matrix.of(to_world)} | flipped(turned)

    def plane(self, block, shape, matrix):
        """A square around the foot of the scene's centre, far larger than the scene."""
        n = geometry.normal(matrix, shape.normal)
        p = geometry.point(matrix, shape.point)
        foot = self.center - ((self.center - p) @ n) * n
        away = float(np.linalg.norm(self.center - foot))
        # As far as what surrounds the camera reaches, but no coarser than what is inside needs.
        inner = (self.extent or self.size) / 2
        side = max(PLANE_REACH * max(inner, away, 1e-3), self.size)
        text = f"infinite plane: a square of side {2 * side:g}"
        height = abs((self.camera - p) @ n)
        edge, off = math.degrees(math.atan(height / side)), ROUNDING * side
        if edge >= VISIBLE_EDGE:
            text += f", whose edge lies {edge:.1g} degrees below the horizon"
        if off > COARSE * height:
            text += f"; single precision: points on it are off by up to {off:.1g}"
        block.lines.remark("", text)
        linear = geometry.frame(n) @ np.diag([side, side, 1.0])
        entry = {"type": "rectangle", "to_world": Matrix.of(geometry.affine(linear, foot))}
        return entry | flipped(block.normal < 0)

    def disk(self, block, shape, matrix):
        linear = matrix[:3, :3]
        axes = geometry.frame(geometry.unit(shape.normal)) * shape.radius
        to_world = matrix @ geometry.affine(axes, shape.center)
        if geometry.similarity_scale(linear) is None or block.texture is not None:
            block.lines.becomes("", "approximated", f"a disk of {ANNULUS_SEGMENTS} segments")
            return mesh_entry(ring(shape.radius, 0.0, shape, matrix), block.normal < 0)
        turned = (block.normal < 0) != (np.linalg.det(linear) < 0)
        return {"type": "disk", "to_world": Matrix.of(to_world)} | flipped(turned)

    def annulus(self, block, shape, matrix):
        block.lines.becomes("", "approximated", f"a ring of {ANNULUS_SEGMENTS} segments")
        return mesh_entry(ring(shape.radius, shape.inner_radius, shape, matrix), block.normal < 0)


def _middle(boxes):
    """Centre and diagonal of the box around the corners of several boxes."""
    corners = np.concatenate(boxes)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low))


def ball(shape, matrix):
    """The `Ball` that a sphere becomes under a matrix, or None if it becomes an ellipsoid."""
    scale = geometry.similarity_scale(matrix[:3, :3])
    if scale is None:
        return None
    return Ball(geometry.point(matrix, shape.center), shape.radius * scale)


def bounds(shape, matrix, dialect):
    """Corners of a box around a finite shape, (N, 3), or None."""
    if isinstance(shape, Sphere | Hemisphere | Disk | Annulus):
        size = shape.radius * np.abs(matrix[:3, :3]).sum(axis=1)
        center = geometry.point(matrix, shape.center)
        return np.stack([center - size, center + size])
    if isinstance(shape, UVPlane):
        corner, (u, v) = np.array(shape.origin), shape.edges(dialect)
        corners = [corner, corner + u, corner + v, corner + u + v]
        return np.stack([geometry.point(matrix, c) for c in corners])
    return None


def flipped(turned):
    """The parameter that turns a stock shape's normal round, where needed."""
    return {"flip_normals": True} if turned else {}


def mesh_entry(mesh, turned):
    """A mesh's dictionary; turning its normals reverses its faces."""
    if turned:
        normals = None if mesh.normals is None else -mesh.normals
        mesh = Mesh(mesh.vertices, mesh.faces[:, ::-1], normals, mesh.uv, mesh.colors)
    return {"type": "mesh", "mesh": mesh}


def transformed(vertices, faces, normals, matrix, uv):
    """A mesh under a matrix; a mirroring one keeps the normals' side."""
    world = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    turned = normals @ np.linalg.inv(matrix[:3, :3])
    return Mesh(world, faces, turned / np.linalg.norm(turned, axis=1, keepdims=True), uv)


def dome(shape, matrix, end):
    """A sphere around +Y from its top to the polar angle `end`, tessellated, with true normals."""
    rows, columns = round(DOME_SEGMENTS * end / (2 * np.pi)), DOME_SEGMENTS
    theta, phi = np.meshgrid(
        np.linspace(0, end, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij"
    )
    normals = np.stack(
        [np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1
    )
    k = np.arange(rows * (columns + 1)).reshape(rows, -1)[:, :-1].ravel()
    below = k + columns + 1
    faces = np.concatenate([np.stack([k, below, below + 1], 1), np.stack([k, below + 1, k + 1], 1)])
    normals = normals.reshape(-1, 3)
    vertices = np.array(shape.center) + shape.radius * normals
    return transformed(vertices, faces, normals, matrix, polar_uv(normals))


def polar_uv(n):
    """Texture coordinates around +Z of the half y >= 0 of a sphere: u is doubled (section 11.3)."""
    phi = np.arctan2(np.maximum(n[:, 1], 0), n[:, 0])
    return np.stack([phi / np.pi, np.arccos(np.clip(n[:, 2], -1, 1)) / np.pi], axis=1)


def ring(outer, inner, shape, matrix):
    """A flat ring (a disk where `inner` is 0), tessellated."""
    axes = geometry.frame(geometry.unit(shape.normal))
    phi = np.arange(ANNULUS_SEGMENTS) * (2 * np.pi / ANNULUS_SEGMENTS)
    circle = np.stack([np.cos(phi), np.sin(phi)], axis=1) @ axes[:, :2].T
    vertices = np.array(shape.center) + np.concatenate([inner * circle, outer * circle])
    k, following = np.arange(ANNULUS_SEGMENTS), np.roll(np.arange(ANNULUS_SEGMENTS), -1)
    a, b = k, k + ANNULUS_SEGMENTS
    c, d = following + ANNULUS_SEGMENTS, following
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    normals = np.tile(axes[:, 2], (len(vertices), 1))
    # Texture coordinates along two tangents, from 0 at the centre to 1 at the rim (section 11.3).
    uv = (vertices - np.array(shape.center)) @ axes[:, :2] / shape.radius
    return transformed(vertices, faces[: len(faces) if inner > 0 else len(k)], normals, matrix, uv)
