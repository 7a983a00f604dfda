"""Spheres too large for single precision, replaced by what the scene can see of them.

Half of the real scenes build their rooms from spheres of radius 1e5. In single precision a ray that
leaves such a wall hits it again on 9 to 13 % of the bounces, and pictures come out 7 to 11 % too
dark. The part that the scene can see is therefore made of triangles whose vertices are computed in
double precision: two of them where the sphere is flat within the tolerance, else a mesh of rings
around the point nearest to the camera, finer there than far away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relume.translator.geometry import frame, unit
from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note
from relume.translator.scene_values import Mesh

GIANT_RATIO = 20.0
"""A sphere is giant if its radius exceeds this multiple of 1 + the largest coordinate of its point
nearest to the camera: errors of single precision grow with the radius, Mitsuba's offset against
hitting a surface twice with that coordinate."""

TOLERANCE = 1e-4
"""Largest distance of the triangles from the sphere, in units of the scene's extent."""

FAR_TOLERANCE = 1e-3
"""The same beyond twice the extent, in units of the distance that lies beyond."""

OPEN_DISTANCE = 20.0
"""Rays that go further than this multiple of the extent mean that the scene is open."""

MARGIN = 1.5
"""How much larger than what probe rays see of a closed room a patch is made."""


@dataclass(frozen=True, eq=False)
class Ball:
    """A sphere in world space: centre (3,) and radius."""

    center: np.ndarray
    radius: float


def nearest_point(ball: Ball, camera: np.ndarray) -> np.ndarray:
    """The point of a sphere that is nearest to the camera."""
    offset = camera - ball.center
    direction = unit(offset) if np.any(offset) else np.array([0.0, 1.0, 0.0])
    return ball.center + ball.radius * direction


def is_giant(ball: Ball, camera: np.ndarray) -> bool:
    """Whether single precision would fail on a sphere as the camera at `camera` (3,) sees it."""
    reach = 1 + np.max(np.abs(nearest_point(ball, camera)))
    return bool(ball.radius > GIANT_RATIO * reach)


class Surroundings:
    """What bounds the view: giant spheres and infinite planes, seen from the rest of the scene.

    Args:
        giants: the spheres.
        planes: pairs (point, normal), (3,) each.
        camera: position of the camera, (3,). All that it sees, directly or by way of another
            surface, lies in its own part of space; objects beyond the walls do not matter.
        extent: diameter of the finite part of the scene.
    """

    def __init__(
        self,
        giants: Sequence[Ball],
        planes: Sequence[tuple[np.ndarray, np.ndarray]],
        camera: np.ndarray,
        extent: float,
    ) -> None:
        self.giants = giants
        self.planes = planes
        self.camera = camera
        near = [np.linalg.norm(nearest_point(ball, camera) - camera) for ball in giants]
        self.extent = float(max(extent, min(near, default=1.0)))
        self.reach = self._reach()

    def patch(self, index: int, closed: bool = False) -> tuple[Mesh, Note]:
        """The triangles for one giant sphere.

        Args:
            index: which of the giants.
            closed: whether the whole sphere is needed whatever can be seen.

        Returns:
            (mesh, note): a mesh with outward normals, and what was done, for the report.
        """
        ball = self.giants[index]
        pole = unit(nearest_point(ball, self.camera) - ball.center)
        reach = None if closed else self.reach[index]
        if reach is not None and reach**2 / (2 * ball.radius) <= TOLERANCE * self.extent:
            sagitta = reach**2 / (2 * ball.radius)
            return flat_patch(ball, pole, reach), make_note("giant-sphere-flat", off=sagitta)
        mesh = rings(ball, pole, self.extent, reach)
        count, off = len(mesh.faces), TOLERANCE * self.extent
        if reach is None:
            return mesh, make_note("giant-sphere-whole", count=count, off=off)
        return mesh, make_note("giant-sphere-patch", count=count, off=off)

    def distances(self) -> list[float]:
        """How far from the camera the seen parts of the giants end at most; none if open."""
        return [
            float(np.linalg.norm(nearest_point(ball, self.camera) - self.camera)) + reach
            for ball, reach in zip(self.giants, self.reach, strict=True)
            if reach is not None
        ]

    def _reach(self) -> list[float | None]:
        """For each giant how far from its pole the scene sees it, or None if the scene is open."""
        origins = self.camera[None]
        seen = np.zeros(len(self.giants))
        for _ in range(2):
            hits, which, distance = self._cast(origins)
            if len(which) and (np.any(which < 0) or distance.max() > OPEN_DISTANCE * self.extent):
                return [None] * len(self.giants)
            for k, ball in enumerate(self.giants):
                pole = nearest_point(ball, self.camera)
                on_ball = hits[which == k]
                if len(on_ball):
                    seen[k] = max(seen[k], np.linalg.norm(on_ball - pole, axis=1).max())
            step = max(1, len(hits) // 64)
            origins = hits[::step] + 1e-3 * (self.camera - hits[::step])
        return [MARGIN * float(reach) if reach > 0 else None for reach in seen]

    def _cast(
        self, origins: np.ndarray, count: int = 512
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rays in all directions from all origins: hit points, index of what is hit, distances."""
        directions = fibonacci_sphere(count)
        o = np.repeat(origins, count, axis=0)
        d = np.tile(directions, (len(origins), 1))
        best, which = np.full(len(o), np.inf), np.full(len(o), -1)
        for k, ball in enumerate(self.giants):
            _keep_nearest(best, which, sphere_distance(o, d, ball), k)
        for k, (p, n) in enumerate(self.planes):
            with np.errstate(divide="ignore", invalid="ignore"):
                t = ((p - o) @ n) / (d @ n)
            _keep_nearest(best, which, np.where(t > 0, t, np.inf), len(self.giants) + k)
        finite = np.isfinite(best)
        hits = o + d * np.where(finite, best, 0.0)[:, None]
        return hits, which, best


def _keep_nearest(best: np.ndarray, which: np.ndarray, t: np.ndarray, index: int) -> None:
    nearer = t < best
    best[nearer] = t[nearer]
    which[nearer] = index


def sphere_distance(o: np.ndarray, d: np.ndarray, ball: Ball) -> np.ndarray:
    """Distance along rays o + t d (N, 3) to a sphere, inf where they miss; good for large radii."""
    f = o - ball.center
    b = np.einsum("ij,ij->i", f, d)
    c = (np.linalg.norm(f, axis=1) - ball.radius) * (np.linalg.norm(f, axis=1) + ball.radius)
    root = np.sqrt(np.maximum(b * b - c, 0.0))
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.sort(np.stack([q, np.where(q != 0, c / q, np.inf)]), axis=0)
    epsilon = 1e-12 * ball.radius
    nearest = np.where(t[0] > epsilon, t[0], np.where(t[1] > epsilon, t[1], np.inf))
    return np.where(b * b >= c, nearest, np.inf)


def fibonacci_sphere(count: int) -> np.ndarray:
    """`count` directions spread evenly over the sphere, (count, 3)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    phi = math.pi * (1 + math.sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def flat_patch(ball: Ball, pole: np.ndarray, half_side: float) -> Mesh:
    """A square touching the sphere at its pole."""
    axes = frame(pole)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half_side
    vertices = ball.center + ball.radius * pole + corners @ axes[:, :2].T
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]))


def rings(ball: Ball, pole: np.ndarray, extent: float, reach: float | None) -> Mesh:
    """The sphere, or its cap of arc `reach` around the pole, as rings of triangles.

    A square facet of side c is furthest off the sphere in the middle of its diagonal, by the
    sagitta (c sqrt 2)² / 8 R, so its tolerance allows c = sqrt(4 R tolerance).
    """
    end = math.pi * ball.radius if reach is None else min(reach, math.pi * ball.radius)
    arcs = [0.0]
    segments = 8
    while arcs[-1] < end:
        tolerance = TOLERANCE * extent + FAR_TOLERANCE * max(0.0, arcs[-1] - 2 * extent)
        width = min(math.sqrt(4 * ball.radius * tolerance), ball.radius / 4)
        arcs.append(min(arcs[-1] + width, end))
        around = 2 * math.pi * ball.radius * math.sin(arcs[-1] / ball.radius)
        segments = max(segments, math.ceil(around / width))
    theta = np.array(arcs[1:]) / ball.radius
    phi = np.arange(segments) * (2 * math.pi / segments)
    axes = frame(pole)
    # The pole lies near the scene: offsets from it keep their digits where the radius would not.
    flat = np.sin(theta)[:, None, None] * np.stack([np.cos(phi), np.sin(phi)], axis=1)
    drop = 2 * np.sin(theta / 2) ** 2
    offsets = flat @ axes[:, :2].T - drop[:, None, None] * pole
    top = ball.center + ball.radius * pole
    vertices = np.concatenate([top[None], (top + ball.radius * offsets).reshape(-1, 3)])
    return Mesh(vertices, ring_faces(len(theta), segments))


def ring_faces(rows: int, segments: int) -> np.ndarray:
    """Faces of a fan around vertex 0 and of the bands between `rows` rings of vertices."""
    k = np.arange(segments)
    following = (k + 1) % segments
    fan = np.stack([np.zeros_like(k), 1 + k, 1 + following], axis=1)
    faces = [fan]
    for row in range(rows - 1):
        a, b = 1 + row * segments, 1 + (row + 1) * segments
        faces.append(np.stack([a + k, b + k, b + following], axis=1))
        faces.append(np.stack([a + k, b + following, a + following], axis=1))
    return np.concatenate(faces)
