"""From shapes to Mitsuba shapes (spec section 6): the cheapest exact one for each."""

from __future__ import annotations

import numpy as np

from relume.translator import geometry
from relume.translator.objects import SceneObject
from relume.translator.scene_geometry import SceneGeometry, world_ball
from relume.translator.scene_values import Entry, Matrix, Mesh
from relume.translator.shapes import (
    Annulus,
    Disk,
    Hemisphere,
    Plane,
    Sphere,
    UVPlane,
)
from relume.translator.tiling import FARTHEST, REACH, tiled_plane

SMALLEST_TILE = 1e-5
"""Least size of the tile of an infinite plane below the camera, in units of the largest height."""

LEVEL = 1e-6
"""X of a normal up to which the program takes it for 0."""

ANNULUS_SEGMENTS = 1024
"""Segments of a ring: its edge is at most 5e-6 of the radius off the circle."""

DOME_SEGMENTS = 256
"""Segments of a tessellated dome or ellipsoid around its axis; half as many along a meridian."""


class ShapeBuilder:
    """Makes the shapes of one document.

    Args:
        scene: where its objects are.
        dialect: `manual` or `prender` (row uvplane-extent).
    """

    def __init__(self, scene: SceneGeometry, dialect: str) -> None:
        self.scene = scene
        self.dialect = dialect

    def shape(self, index: int, block: SceneObject) -> Entry:
        """The dictionary of an object's shape, without BSDF and emitter.

        Args:
            index: which of the document's objects it is.
            block: the object, with a shape of its own: meshes are made by `meshes`.
        """
        shape, matrix = block.shape, self.scene.matrices[index]
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
        assert isinstance(shape, Annulus), shape
        return self.annulus(block, shape, matrix)

    def sphere(
        self, index: int, block: SceneObject, shape: Sphere, matrix: np.ndarray
    ) -> Entry:
        """A sphere, or what the scene can see of a giant one."""
        turned = block.normal < 0
        if self.scene.surroundings is not None and index in self.scene.giants:
            giant = self.scene.giants.index(index)
            mesh, note = self.scene.surroundings.patch(giant, block.reflection.lets_pass)
            block.lines.add("", note)
            return mesh_entry(mesh, turned)
        ball = world_ball(shape, matrix)
        if any(t.kind == "rotation" for t in block.transforms):
            block.lines.remark("", "sphere-rotation")
        if ball is None:
            block.lines.becomes("", "ellipsoid")
            return mesh_entry(ellipsoid(shape, matrix), turned)
        if not np.allclose(matrix[:3, :3] * (shape.radius / ball.radius), np.eye(3)):
            for field in ("texture", "bump_texture"):
                block.lines.becomes(field, "picture-not-turned")
        entry = {
            "type": "sphere",
            "center": [float(x) for x in ball.center],
            "radius": float(ball.radius),
        }
        return entry | flipped(turned)

    def hemisphere(self, block: SceneObject, shape: Hemisphere, matrix: np.ndarray) -> Entry:
        """The upper half of a sphere, tessellated: a masked sphere would block explicit light."""
        mesh = dome(shape, matrix)
        off = 1 - np.cos(np.pi / DOME_SEGMENTS)
        block.lines.becomes("", "hemisphere", segments=DOME_SEGMENTS, off=off)
        return mesh_entry(mesh, block.normal < 0)

    def parallelogram(self, block: SceneObject, shape: UVPlane, matrix: np.ndarray) -> Entry:
        """A rectangle, or two triangles where the edges are not orthogonal."""
        if any(not np.isclose(np.linalg.norm(e), 1) for e in (shape.u, shape.v)):
            block.lines.remark("", "uvplane-extent", dialect=self.dialect)
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

    def plane(self, block: SceneObject, shape: Plane, matrix: np.ndarray) -> Entry:
        """Tiles around the foot of the camera, to the horizon."""
        n = geometry.normal(matrix, shape.normal)
        p = geometry.point(matrix, shape.point)
        camera, center = self.scene.camera, self.scene.whole.center
        height, away = abs((camera - p) @ n), abs((center - p) @ n)
        foot = camera - ((camera - p) @ n) * n
        size = self.scene.inner.diameter or self.scene.whole.diameter
        highest = max(height, away, size, 1e-3)
        least = max(height, SMALLEST_TILE * highest)
        across = float(np.linalg.norm(center - camera))
        reach = max(REACH * highest, across + self.scene.whole.diameter)
        reach = max(min(reach, FARTHEST), 2 * highest)
        block.lines.remark("", "infinite-plane", side=2 * reach)
        mesh = tiled_plane(foot, geometry.frame(n)[:, :2], least, reach)
        return mesh_entry(mesh, block.normal < 0)

    def disk(self, block: SceneObject, shape: Disk, matrix: np.ndarray) -> Entry:
        """A disk, tessellated where a matrix or a picture asks for more than the stock one has."""
        self.report_disk(block)
        linear = matrix[:3, :3]
        axes = geometry.frame(geometry.unit(shape.normal)) * shape.radius
        to_world = matrix @ geometry.affine(axes, shape.center)
        if geometry.similarity_scale(linear) is None or block.has_picture:
            block.lines.becomes("", "tessellated-disk", segments=ANNULUS_SEGMENTS)
            return mesh_entry(ring(shape.radius, 0.0, shape, matrix), block.normal < 0)
        turned = (block.normal < 0) != (np.linalg.det(linear) < 0)
        return {"type": "disk", "to_world": Matrix.of(to_world)} | flipped(turned)

    def annulus(self, block: SceneObject, shape: Annulus, matrix: np.ndarray) -> Entry:
        """A flat ring, tessellated."""
        self.report_disk(block)
        block.lines.becomes("", "tessellated-ring", segments=ANNULUS_SEGMENTS)
        return mesh_entry(ring(shape.radius, shape.inner_radius, shape, matrix), block.normal < 0)


    def report_disk(self, block: SceneObject) -> None:
        """Report how pictures lie on a disk."""
        if not block.disk_map:
            for field in ("texture", "bump_texture", "ibl_texture"):
                block.lines.remark(field, "disk-frame")


def flipped(turned: bool | np.bool_) -> Entry:
    """The parameter that turns a stock shape's normal round, where needed."""
    return {"flip_normals": True} if turned else {}


def mesh_entry(mesh: Mesh, turned: bool | np.bool_) -> Entry:
    """A mesh's dictionary; turning its normals reverses its faces."""
    if turned:
        normals = None if mesh.normals is None else -mesh.normals
        mesh = Mesh(mesh.vertices, mesh.faces[:, ::-1], normals, mesh.uv, mesh.colors)
    return {"type": "mesh", "mesh": mesh}


def transformed(
    vertices: np.ndarray,
    faces: np.ndarray,
    normals: np.ndarray,
    matrix: np.ndarray,
    uv: np.ndarray,
) -> Mesh:
    """A mesh under a matrix; a mirroring one keeps the normals' side."""
    world = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    turned = normals @ np.linalg.inv(matrix[:3, :3])
    return Mesh(world, faces, turned / np.linalg.norm(turned, axis=1, keepdims=True), uv)


def dome(shape: Hemisphere, matrix: np.ndarray) -> Mesh:
    """The upper half of a sphere, tessellated around +Y, with true normals."""
    normals, faces, _ = graticule(np.pi / 2)
    normals = normals[:, [1, 2, 0]]  # Z becomes Y
    vertices = np.array(shape.center) + shape.radius * normals
    return transformed(vertices, faces, normals, matrix, polar_uv(normals))


def ellipsoid(shape: Sphere, matrix: np.ndarray) -> Mesh:
    """A sphere, tessellated around +Z as its coordinates run, with true normals."""
    normals, faces, uv = graticule(np.pi)
    vertices = np.array(shape.center) + shape.radius * normals
    return transformed(vertices, faces, normals, matrix, uv)


def graticule(end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A unit sphere around +Z from its top to the polar angle `end`, tessellated.

    Returns:
        (vertices (V, 3), faces (F, 3), coordinates (V, 2)): u runs around from +X towards +Y, v
        down from +Z, both in [0, 1] on the whole sphere.
    """
    rows, columns = round(DOME_SEGMENTS * end / (2 * np.pi)), DOME_SEGMENTS
    theta, phi = np.meshgrid(
        np.linspace(0, end, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij"
    )
    vertices = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1
    )
    # All of a pole's vertices lie in one place; each has the u of the middle of its triangle.
    middle = np.where(np.sin(theta) < 1e-9, np.sign(np.cos(theta)), 0) * 0.5 / columns
    u = phi / (2 * np.pi) + middle
    uv = np.stack([u, theta / np.pi], -1).reshape(-1, 2)
    k = np.arange(rows * (columns + 1)).reshape(rows, -1)[:, :-1].ravel()
    below = k + columns + 1
    faces = np.concatenate([np.stack([k, below, below + 1], 1), np.stack([k, below + 1, k + 1], 1)])
    return vertices.reshape(-1, 3), faces, uv


def polar_uv(n: np.ndarray) -> np.ndarray:
    """Texture coordinates around +Z of the half y >= 0 of a sphere: u is doubled (section 11.3)."""
    phi = np.arctan2(np.maximum(n[:, 1], 0), n[:, 0])
    return np.stack([phi / np.pi, np.arccos(np.clip(n[:, 2], -1, 1)) / np.pi], axis=1)


def ring(outer: float, inner: float, shape: Disk | Annulus, matrix: np.ndarray) -> Mesh:
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
    uv = disk_uv(vertices, shape, matrix)
    return transformed(vertices, faces[: len(faces) if inner > 0 else len(k)], normals, matrix, uv)


def disk_uv(points: np.ndarray, shape: Disk | Annulus, matrix: np.ndarray) -> np.ndarray:
    """Texture coordinates of points of a disk, (N, 2), from 0 at its centre to 1 at the rim.

    They are measured along the tangents of the normal as the matrix turns it (row disk-frame): a
    turn about the normal does not turn a picture. Under an uneven scale a picture is scaled, too.
    """
    linear, offsets = matrix[:3, :3], points - np.array(shape.center)
    scale = geometry.similarity_scale(linear)
    if scale is None:
        return offsets @ tangents(geometry.unit(shape.normal)).T / shape.radius
    axes = tangents(geometry.normal(matrix, shape.normal))
    return offsets @ linear.T @ axes.T / (scale * shape.radius)


def tangents(n: np.ndarray) -> np.ndarray:
    """The tangents along which the program measures u and v on a disk of normal `n`, (2, 3)."""
    x = np.cross([0.0, 1.0, 0.0] if abs(n[0]) > LEVEL else [1.0, 0.0, 0.0], n)
    if not np.any(x):
        x = np.array([0.0, 1.0, 0.0])
    x = geometry.unit(x)
    return np.stack([x, np.cross(n, x)])
