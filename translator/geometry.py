"""Small linear algebra in double precision."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from relume.translator.forms.transforms import Transform


def unit(v: ArrayLike) -> np.ndarray:
    """The vector of length 1 along `v`; safe for any finite `v` other than 0."""
    vector = np.asarray(v, float)
    vector = vector / np.max(np.abs(vector))
    return vector / np.linalg.norm(vector)


def frame(z: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) whose third column is the unit vector `z`."""
    helper = np.array([0.0, 1.0, 0.0]) if abs(z[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    x = unit(np.cross(helper, z))
    return np.stack([x, np.cross(z, x), z], axis=1)


def rotation(degrees: Sequence[float]) -> np.ndarray:
    """Rotation about X, then Y, then Z, right handed: matrix (3, 3) for column vectors."""
    a, b, c = (math.radians(x) for x in degrees)
    x = [[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]]
    y = [[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]]
    z = [[math.cos(c), -math.sin(c), 0], [math.sin(c), math.cos(c), 0], [0, 0, 1]]
    return np.array(z) @ np.array(y) @ np.array(x)


def affine(linear: ArrayLike | None = None, offset: ArrayLike = (0, 0, 0)) -> np.ndarray:
    """Matrix (4, 4) of x -> linear x + offset."""
    matrix = np.eye(4)
    if linear is not None:
        matrix[:3, :3] = linear
    matrix[:3, 3] = offset
    return matrix


def compose(transforms: Iterable[Transform]) -> np.ndarray:
    """The matrix of transform lines, applied in file order about the world origin (section 6.3)."""
    matrix = np.eye(4)
    for transform in transforms:
        if transform.kind == "rotation":
            step = affine(rotation(transform.values))
        elif transform.kind == "scale":
            step = affine(np.diag(transform.values))
        else:
            step = affine(offset=transform.values)
        matrix = step @ matrix
    return matrix


def point(matrix: np.ndarray, p: ArrayLike) -> np.ndarray:
    """A point under a (4, 4) matrix."""
    return matrix[:3, :3] @ np.asarray(p, float) + matrix[:3, 3]


def normal(matrix: np.ndarray, n: ArrayLike) -> np.ndarray:
    """A normal under a (4, 4) matrix, of length 1."""
    return unit(np.linalg.inv(matrix[:3, :3]).T @ unit(n))


def similarity_scale(linear: np.ndarray, tolerance: float = 1e-9) -> float | None:
    """The factor of a rotation with one scale, or None where `linear` (3, 3) is anything else."""
    gram = linear.T @ linear
    scale = math.sqrt(abs(np.trace(gram)) / 3)
    return (
        scale
        if np.allclose(gram, scale**2 * np.eye(3), rtol=0, atol=tolerance * scale**2)
        else None
    )
