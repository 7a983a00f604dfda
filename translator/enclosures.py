"""What the camera is inside of, and the medium that fills it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from relume.translator.scene_values import Mesh

if TYPE_CHECKING:
    from relume.translator.media import HomogeneousMedium

INSIDE = 0.5
"""Winding number from which on a point counts as inside a mesh, be it closed or nearly."""


@dataclass(frozen=True)
class Enclosure:
    """An object that light crosses and that the camera is in.

    Attributes:
        size: its diameter, which orders those that lie in each other [scene unit].
        medium: what fills it, None for nothing.
    """

    size: float
    medium: HomogeneousMedium | None


def winding_number(meshes: Sequence[Mesh], p: np.ndarray) -> float:
    """How often meshes together wind around a point: 1 inside, 0 outside of a closed surface.

    The solid angles of all triangles over 4 pi, by A. van Oosterom and J. Strackee, "The Solid
    Angle of a Plane Triangle", IEEE Transactions on Biomedical Engineering 30(2), 1983, eq. 8.

    Args:
        meshes: whose normals point outwards.
        p: the point, (3,).
    """
    total = 0.0
    for mesh in meshes:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] - p for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
        denominator = la * lb * lc + np.einsum("ij,ij->i", a, b) * lc
        denominator += np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
        total += float(np.arctan2(numerator, denominator).sum())
    return total / (2 * np.pi)


def diameter(meshes: Sequence[Mesh]) -> float:
    """Diagonal of the box around meshes."""
    low = np.min([mesh.vertices.min(axis=0) for mesh in meshes], axis=0)
    high = np.max([mesh.vertices.max(axis=0) for mesh in meshes], axis=0)
    return float(np.linalg.norm(high - low))


def medium_at_camera(
    enclosures: Iterable[Enclosure], around: HomogeneousMedium | None
) -> HomogeneousMedium | None:
    """The medium at the camera: that of the innermost object around it.

    Args:
        enclosures: all objects that it is in.
        around: the medium around all objects, which ends at the surfaces of those that have none;
            without one, they stay in the medium of the object around them.
    """
    medium = around
    for enclosure in sorted(enclosures, key=lambda enclosure: -enclosure.size):
        if enclosure.medium is not None or around is not None:
            medium = enclosure.medium
    return medium
