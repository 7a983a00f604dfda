"""Objects that single precision cannot tell apart, with a note of where its limit lies.

Mitsuba starts a ray off its surface by RAY_OFFSET (1 + m), m being the largest coordinate there: it
misses what is nearer, such as the far side of a sheet of glass.
"""

import numpy as np

from relume.translator import geometry
from relume.translator.shapes import Plane, Sphere, UVPlane

RAY_OFFSET = 8.94e-5
"""`mi.math.RayEpsilon` of single precision."""


def account(document, matrices):
    """Notes on glass thinner than rays can tell.

    Args:
        document: the document, where it is rendered.
        matrices: transformation of each object, (4, 4).
    """
    glass = [
        (block, matrix)
        for block, matrix in zip(document.objects, matrices, strict=True)
        if block.reflection.kind == "glass"
    ]
    faces = [face(block, matrix) for block, matrix in glass if is_flat(block)]
    for k, (block, p, n) in enumerate(faces):
        for _, q, m in faces[:k]:
            if abs(n @ m) > 1 - 1e-6:
                told(block, abs((p - q) @ n), p)
    for block, matrix in glass:
        scale = geometry.similarity_scale(matrix[:3, :3])
        if isinstance(block.shape, Sphere) and scale is not None:
            center = geometry.point(matrix, block.shape.center)
            told(block, 2 * scale * block.shape.radius, center)


def is_flat(block):
    """Whether an object is a plane or a part of one."""
    return isinstance(block.shape, Plane | UVPlane)


def face(block, matrix):
    """An object, a point of it in world space and its normal."""
    shape = block.shape
    if isinstance(shape, Plane):
        return block, geometry.point(matrix, shape.point), geometry.normal(matrix, shape.normal)
    middle = np.array(shape.origin) + np.array(shape.u) / 2 + np.array(shape.v) / 2
    n = geometry.normal(matrix, np.cross(shape.u, shape.v))
    return block, geometry.point(matrix, middle), n


def offset(points):
    """How far off a surface rays start at the outermost of points (N, 3) [scene unit]."""
    return RAY_OFFSET * (1 + float(np.max(np.abs(points))))


def told(block, thickness, p):
    """Note that glass of a thickness at the point `p` is too thin, if it is."""
    least = offset(p)
    if thickness < least:
        text = f"single precision: glass {thickness:.2g} thick, rays miss what is nearer than"
        block.lines.remark("", f"{text} {least:.2g}")
