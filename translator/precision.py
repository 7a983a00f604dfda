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
