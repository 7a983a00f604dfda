"""Infinite planes as triangles: rings of tiles that grow with the distance from the camera.

A hit point is interpolated between the corners of its triangle, in single precision: its error is a
part of the triangle's size. So tiles are small below the camera and grow as fast as the distance,
and the outermost end where no picture tells the plane from its horizon.
"""

from __future__ import annotations

import numpy as np

from relume.translator.scene_values import Mesh

GROWTH = 4.0
"""Size of a ring of tiles over that of the one inside of it."""

REACH = 1e6
"""Half the side of the whole, in units of what tells how high above the plane things are: its edge
is seen 6e-5 degrees below the horizon."""

FARTHEST = 1e12
"""Half the side of the whole at most: products of three such lengths are within single precision
[scene unit]."""

CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)


def tiled_plane(foot: np.ndarray, axes: np.ndarray, least: float, reach: float) -> Mesh:
    """A square in the plane of two axes: one tile around a point, and rings of four around it.

    Args:
        foot: the point, (3,).
        axes: two unit vectors as the columns of (3, 2); the normal is their cross product.
        least: half the side of the tile around the point, above 0.
        reach: half the side of the square, at least `least`.
    """
    rings = max(1, int(np.ceil(np.log(reach / least) / np.log(GROWTH))))
    sizes = np.append(least * GROWTH ** np.arange(rings), reach)
    vertices = foot + (sizes[:, None, None] * CORNERS).reshape(-1, 2) @ axes.T
    faces = [np.array([[0, 1, 2], [0, 2, 3]])]
    k = np.arange(4)
    following = (k + 1) % 4
    for ring in range(len(sizes) - 1):
        a, b = 4 * ring, 4 * (ring + 1)
        faces.append(np.stack([a + k, b + k, b + following], axis=1))
        faces.append(np.stack([a + k, b + following, a + following], axis=1))
    return Mesh(vertices, np.concatenate(faces))
