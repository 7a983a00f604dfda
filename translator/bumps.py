"""Bump maps: normals turned by the gradient of a picture's luminance (spec section 11.8)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from relume.translator.images import bump_height, read_image
from relume.translator.objects import Shape
from relume.translator.reflectances import uv_matrix
from relume.translator.scene_values import Entry, Mesh, Picture
from relume.translator.shapes import Hemisphere, Sphere

SLOPE = 25.5
"""Slope of the surface where the picture steps from black to white within one texel: what the
program takes for spheres, 255 times 0.1."""


def bumped(
    bsdf: Entry,
    path: str | Path,
    entry: Entry,
    shape: Shape | None,
    *,
    flip: bool,
    tiles: tuple[float, float] = (1.0, 1.0),
) -> Entry:
    """A BSDF with a bump map.

    Args:
        bsdf: the BSDF's dictionary; a two-sided one is bumped inside.
        path: the picture.
        entry: dictionary of the shape, which tells how far one texel reaches.
        shape: shape of the object.
        flip: whether v = 0 is the bottom row of the picture.
        tiles: how often the picture fits along u and v.

    Raises:
        ImageError: the file is no picture.
    """
    if bsdf["type"] in ("twosided", "mask"):
        inner = bumped(bsdf["bsdf"], path, entry, shape, flip=flip, tiles=tiles)
        return bsdf | {"bsdf": inner}
    height = np.asarray(bump_height(read_image(path)), np.float32)
    rows, columns = height.shape
    # Mitsuba displaces along the normal by scale times the picture; its slope is that over length.
    length = texel_length(entry, shape, rows * tiles[1], columns * tiles[0])
    texture: Entry = {
        "type": "bitmap",
        "picture": Picture((height[::-1] if flip else height)[..., None]),
        "raw": True,
    }
    if tiles != (1.0, 1.0):
        texture["to_uv"] = uv_matrix(tiles, (0.0, 0.0))
    return {
        "type": "bumpmap",
        "scale": SLOPE * length,
        "use_shadowing_function": False,
        "bump_texture": texture,
        "bsdf": bsdf,
    }


def texel_length(entry: Entry, shape: Shape | None, rows: float, columns: float) -> float:
    """Mean length of one texel on the surface [scene unit]; of the picture as often as it fits."""
    if isinstance(shape, Sphere | Hemisphere) and "radius" in entry:
        return math.pi * entry["radius"] / rows
    mesh = entry.get("mesh")
    if isinstance(mesh, Mesh) and mesh.uv is not None:
        share = area(mesh.uv, mesh.faces)
        world = area(mesh.vertices, mesh.faces)
        return math.sqrt(world / share / (rows * columns)) if share > 0 else 0.0
    if "to_world" in entry and entry["type"] == "rectangle":
        matrix = np.array(entry["to_world"].rows)
        u, v = 2 * np.linalg.norm(matrix[:3, 0]), 2 * np.linalg.norm(matrix[:3, 1])
        return math.sqrt(u / columns * v / rows)
    return 0.0


def area(points: np.ndarray, faces: np.ndarray) -> float:
    """Total area of triangles, whose corners have two or three coordinates."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    p, q = b - a, c - a
    # |p x q| by Lagrange's identity, in any dimension.
    squared = (p * p).sum(1) * (q * q).sum(1) - (p * q).sum(1) ** 2
    return float(np.sqrt(np.maximum(squared, 0)).sum() / 2)
