"""Objects that single precision cannot tell apart, with a note of where its limit lies.

Mitsuba starts a ray off its surface by RAY_OFFSET (1 + m), m being the largest coordinate there: it
misses what is nearer, such as the far side of a sheet of glass.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relume.translator import geometry
from relume.translator.document import Document
from relume.translator.objects import SceneObject
from relume.translator.shapes import Plane, Sphere, UVPlane

RAY_OFFSET = 8.94e-5
"""`mi.math.RayEpsilon` of single precision."""

SMALL = 1e-2
"""Sine of half the angle of a lamp below which fewer than one ray in ten thousand meets it."""


def report_thin_glass(document: Document, matrices: Sequence[np.ndarray]) -> None:
    """Report glass that is thinner than rays can tell.

    Args:
        document: the document, where it is rendered.
        matrices: transformation of each object, (4, 4).
    """
    glass = [
        (block, matrix)
        for block, matrix in zip(document.objects, matrices, strict=True)
        if block.reflection.kind == "glass"
    ]
    faces = [(block, *face(block, matrix)) for block, matrix in glass if is_flat(block)]
    for k, (block, p, n) in enumerate(faces):
        for _, q, m in faces[:k]:
            if abs(n @ m) > 1 - 1e-6:
                report_if_thin(block, abs((p - q) @ n), p)
    for block, matrix in glass:
        scale = geometry.similarity_scale(matrix[:3, :3])
        if isinstance(block.shape, Sphere) and scale is not None:
            center = geometry.point(matrix, block.shape.center)
            report_if_thin(block, 2 * scale * block.shape.radius, center)


def report_small_lamps(document: Document, matrices: Sequence[np.ndarray]) -> None:
    """Report lamps that refracting glass sees so small that hardly a ray meets them through it.

    Args:
        document: the document, where it is rendered.
        matrices: transformation of each object, (4, 4).
    """
    placed = list(zip(document.objects, matrices, strict=True))
    glass = [(block, matrix) for block, matrix in placed if refracts(block)]
    for block, matrix in placed:
        if isinstance(block.shape, Sphere) and any(block.emission) and not block.spot_light:
            scale = geometry.similarity_scale(matrix[:3, :3])
            center = geometry.point(matrix, block.shape.center)
            far = [distance(*other, center) for other in glass]
            if scale is None or not far or min(far) <= 0:
                continue
            sine = scale * block.shape.radius / min(far)
            if 0 < sine < SMALL:
                count = sine**-2
                block.lines.remark("", "small-lamp-behind-glass", angle=2 * sine, count=count)


def refracts(block: SceneObject) -> bool:
    """Whether an object is of glass that turns light."""
    turns = block.refractive_index != 1 or block.reflection.dispersion
    return block.reflection.kind == "glass" and bool(turns)


def distance(block: SceneObject, matrix: np.ndarray, point: np.ndarray) -> float:
    """How far a sphere's surface, or the plane of a flat object, is from a point (3,); infinite for
    other shapes, and 0 or less inside a sphere."""
    if is_flat(block):
        p, n = face(block, matrix)
        return abs(float((point - p) @ n))
    scale = geometry.similarity_scale(matrix[:3, :3])
    if not isinstance(block.shape, Sphere) or scale is None:
        return np.inf
    center = geometry.point(matrix, block.shape.center)
    return float(np.linalg.norm(point - center)) - scale * block.shape.radius


def is_flat(block: SceneObject) -> bool:
    """Whether an object is a plane or a part of one."""
    return isinstance(block.shape, Plane | UVPlane)


def face(block: SceneObject, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point of a flat object in world space and its normal."""
    shape = block.shape
    if isinstance(shape, Plane):
        return geometry.point(matrix, shape.point), geometry.normal(matrix, shape.normal)
    assert isinstance(shape, UVPlane)
    middle = np.array(shape.origin) + np.array(shape.u) / 2 + np.array(shape.v) / 2
    n = geometry.normal(matrix, np.cross(shape.u, shape.v))
    return geometry.point(matrix, middle), n


def ray_offset(points: np.ndarray) -> float:
    """How far off a surface rays start at the outermost of points (N, 3) [scene unit]."""
    return RAY_OFFSET * (1 + float(np.max(np.abs(points))))


def report_if_thin(block: SceneObject, thickness: float, p: np.ndarray) -> None:
    """Report that glass of a thickness at the point `p` (3,) is too thin, if it is."""
    least = ray_offset(p)
    if thickness < least:
        block.lines.remark("", "thin-glass", thickness=thickness, least=least)
