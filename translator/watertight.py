"""Whether meshes close off a volume."""

import numpy as np


def open_edges(meshes):
    """Number of directed edges without a counterpart from a face on the other side.

    Vertices at the same place are one: texture seams and several materials leave no gap.

    Args:
        meshes: list of `scene_values.Mesh`, which may be closed together alone.
    """
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([m.faces + k for m, k in zip(meshes, offsets, strict=False)])
    vertices = np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32)
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[faces]
    starts = corners.ravel().astype(np.int64)
    ends = np.roll(corners, -1, axis=1).ravel().astype(np.int64)
    whole = starts != ends  # degenerate faces have none to the other side
    n = len(vertices)
    forward, backward = starts * n + ends, ends * n + starts
    edges, count = np.unique(forward[whole], return_counts=True)
    back, back_count = np.unique(backward[whole], return_counts=True)
    met = np.zeros(len(edges), int)
    index = np.searchsorted(back, edges)
    index[index == len(back)] = 0
    same = back[index] == edges
    met[same] = back_count[index[same]]
    return int(np.maximum(count - met, 0).sum())
