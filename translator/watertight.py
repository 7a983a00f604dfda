"""Whether meshes close off a volume."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relume.translator.scene_values import Mesh


def open_edges(meshes: Sequence[Mesh]) -> int:
    """Number of directed edges without a counterpart from a face on the other side.

    Vertices at the same place are one: texture seams and several materials leave no gap.

    Args:
        meshes: may be closed together alone.
    """
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([m.faces + k for m, k in zip(meshes, offsets, strict=False)])
    vertices = np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32)
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[faces]
    starts = corners.ravel().astype(np.int64)
    ends = np.roll(corners, -1, axis=1).ravel().astype(np.int64)
    proper = starts != ends  # degenerate faces have no other side
    n = len(vertices)
    forward, backward = starts * n + ends, ends * n + starts
    edges, count = np.unique(forward[proper], return_counts=True)
    back, back_count = np.unique(backward[proper], return_counts=True)
    partners = np.zeros(len(edges), int)
    index = np.asarray(np.searchsorted(back, edges))
    index[index == len(back)] = 0
    paired = back[index] == edges
    partners[paired] = back_count[index[paired]]
    return int(np.maximum(count - partners, 0).sum())
