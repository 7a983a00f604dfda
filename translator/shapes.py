"""Shapes of an `OBJECT` block (spec section 6.1) and the table of their keywords."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Sphere:
    """Full sphere with outward normal; centre and radius (above 0) in scene units."""

    center: tuple[float, float, float]
    radius: float


@dataclass(frozen=True)
class Hemisphere:
    """The half y >= centre.y of a sphere: an open dome seen from both sides."""

    center: tuple[float, float, float]
    radius: float


@dataclass(frozen=True)
class UVPlane:
    """Parallelogram origin + s u + t v, s and t in [0, 1], normal along u x v."""

    origin: tuple[float, float, float]
    u: tuple[float, float, float]
    v: tuple[float, float, float]

    def edges(self, dialect: str) -> tuple[np.ndarray, np.ndarray]:
        """Both edges, (3,) each; as they are written, or as dialect `prender` extends them.

        The program (row uvplane-extent) shows the points p whose distances from the corner along
        the unit vectors of U and V are at most the squared lengths: edges of squared length, if
        they are orthogonal; a parallelogram of the dual basis, if not.
        """
        u, v = np.array(self.u, float), np.array(self.v, float)
        a, b = np.linalg.norm(u), np.linalg.norm(v)
        if dialect != "prender" or not a * b > 0:
            return u, v
        along_u, along_v = u / a, v / b
        cosine = float(along_u @ along_v)
        sine2 = 1 - cosine**2
        if not sine2 > 1e-12:
            return u * a, v * b
        dual_u = (along_u - cosine * along_v) / sine2
        dual_v = (along_v - cosine * along_u) / sine2
        return dual_u * a**2, dual_v * b**2

    def tiles(self, dialect: str) -> tuple[float, float]:
        """How often a picture fits along both edges: once, or in dialect `prender` once to each
        length of U and V (row uvplane-texture)."""
        if dialect != "prender":
            return 1.0, 1.0
        return float(np.linalg.norm(self.u)), float(np.linalg.norm(self.v))


@dataclass(frozen=True)
class Plane:
    """Infinite plane through a point; the normal need not be of length 1."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True)
class Disk:
    """Disk; the normal need not be of length 1."""

    center: tuple[float, float, float]
    radius: float
    normal: tuple[float, float, float]


@dataclass(frozen=True)
class Annulus:
    """Disk of outer radius `radius` with a hole of radius `inner_radius`."""

    center: tuple[float, float, float]
    radius: float
    inner_radius: float
    normal: tuple[float, float, float]


@dataclass(frozen=True)
class MeshFile:
    """Mesh in an OBJ file, named as in the scene file."""

    file: str


@dataclass(frozen=True)
class InfinityLight:
    """Light from infinitely far away travelling along `direction`; no geometry."""

    direction: tuple[float, float, float]


@dataclass(frozen=True)
class ShapeKeyword:
    """One row of the table of shapes.

    Attributes:
        name: the word that opens the shape line, right below `OBJECT`.
        arity: how many numbers follow it (0: a file name).
        build: makes the shape of the numbers (a tuple, or the file name) and of the vectors.
        doc: the sentence that documents the shape.
        numbers: what the numbers are.
        vectors: names of the lines of three numbers that follow the shape line.
        radii: which of the numbers must be above 0, by index.
    """

    name: str
    arity: int
    build: Callable[..., Any]
    doc: str
    numbers: str
    vectors: tuple[str, ...] = ()
    radii: tuple[int, ...] = ()


SHAPES = {
    row.name: row
    for row in (
        ShapeKeyword(
            "sphere", 4, lambda x: Sphere(x[:3], x[3]), "Sphere.", "centre, radius", radii=(3,)
        ),
        ShapeKeyword(
            "hemisphere",
            4,
            lambda x: Hemisphere(x[:3], x[3]),
            "Upper half (+Y) of a sphere, open below.",
            "centre, radius",
            radii=(3,),
        ),
        ShapeKeyword(
            "uvplane",
            3,
            lambda x, u, v: UVPlane(x, u, v),
            "Parallelogram with a corner and two edges.",
            "corner",
            vectors=("U", "V"),
        ),
        ShapeKeyword(
            "plane", 3, lambda x, n: Plane(x, n), "Infinite plane.", "point", vectors=("normal",)
        ),
        ShapeKeyword(
            "disk",
            4,
            lambda x, n: Disk(x[:3], x[3], n),
            "Disk.",
            "centre, radius",
            vectors=("normal",),
            radii=(3,),
        ),
        ShapeKeyword(
            "disk2",
            5,
            lambda x, n: Annulus(x[:3], x[3], x[4], n),
            "Ring between an outer and an inner radius.",
            "centre, outer and inner radius",
            vectors=("normal",),
            radii=(3,),
        ),
        ShapeKeyword("objfile", 0, MeshFile, "Mesh in OBJ format.", "file name"),
        ShapeKeyword(
            "infinity_light",
            3,
            InfinityLight,
            "Parallel light from infinitely far away.",
            "direction in which it travels",
        ),
    )
}
