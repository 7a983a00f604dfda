"""Stand-ins for meshes and pictures that scene files name and that are not at hand."""

import math
from pathlib import Path

import numpy as np
from PIL import Image


class Faces:
    """Vertices and faces of a mesh in the making."""

    def __init__(self):
        self.vertices, self.uv, self.faces = [], [], []

    def add(self, vertices, faces, uv=None):
        """Add vertices (N, 3) with faces of indices from 0, and texture coordinates (N, 2)."""
        start = len(self.vertices)
        self.vertices += [tuple(v) for v in vertices]
        self.uv += [tuple(t) for t in (uv if uv is not None else np.zeros((len(vertices), 2)))]
        self.faces += [[start + k for k in face] for face in faces]

    def box(self, low, high):
        """A box between two corners."""
        (a, b, c), (d, e, f) = low, high
        corners = [(x, y, z) for z in (c, f) for y in (b, e) for x in (a, d)]
        quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        self.add(corners, quads)

    def column(self, x, z, radius, low, high, sides=20):
        """A round column between two heights."""
        turn = np.arange(sides) * 2 * math.pi / sides
        ring = [(x + radius * math.cos(a), z + radius * math.sin(a)) for a in turn]
        vertices = [(p, y, q) for y in (low, high) for p, q in ring]
        quads = [(k, k + sides, (k + 1) % sides + sides, (k + 1) % sides) for k in range(sides)]
        self.add(vertices, quads)

    def write(self, path):
        """Write an OBJ file."""
        lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in self.vertices]
        lines += [f"vt {u:.6g} {v:.6g}" for u, v in self.uv]
        lines += ["f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in self.faces]
        path.write_text("\n".join(lines) + "\n")


def hall(x, y, z, columns=7):
    """A hall along X with two rows of columns, galleries behind them and a roof open between."""
    mesh = Faces()
    (x0, x1), (y0, y1), (z0, z1) = x, y, z
    high, deep = y1 - y0, z1 - z0
    wall = 0.03 * deep
    mesh.box((x0, y0 - wall, z0), (x1, y0, z1))
    for low, up in ((z0 - wall, z0), (z1, z1 + wall)):
        mesh.box((x0, y0 - wall, low), (x1, y1, up))
    for low, up in ((x0 - wall, x0), (x1, x1 + wall)):
        mesh.box((low, y0 - wall, z0), (up, y1, z1))
    for side, inner in ((z0, z0 + 0.28 * deep), (z1, z1 - 0.28 * deep)):
        low, up = sorted((side, inner))
        for level in (0.48, 1.0):
            mesh.box((x0, y0 + (level - 0.04) * high, low), (x1, y0 + level * high, up))
        for position in np.linspace(x0, x1, columns + 2)[1:-1]:
            mesh.column(position, inner, 0.03 * deep, y0, y1)
    return mesh


def prism():
    """A prism with an equilateral base of circumradius 1.2 around the Z axis."""
    mesh = Faces()
    turn = np.radians([90, 210, 330])
    ring = np.stack([1.2 * np.cos(turn), 1.2 * np.sin(turn)], axis=1)
    vertices = [(*p, z) for z in (-2.5, 2.5) for p in ring]
    mesh.add(vertices, [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)])
    return mesh


def cap(rows=24, columns=48):
    """The half z >= 0 of a unit sphere with texture coordinates seen from above."""
    mesh = Faces()
    polar, turn = np.meshgrid(
        np.linspace(0, math.pi / 2, rows + 1), np.linspace(0, 2 * math.pi, columns + 1)
    )
    n = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], -1)
    index = np.arange(n[..., 0].size).reshape(n.shape[:2])
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], -1)
    n = n.reshape(-1, 3)
    mesh.add(n, quads.reshape(-1, 4).tolist(), 0.5 + 0.5 * n[:, :2])
    return mesh


def monument():
    """A block on a plinth, two units high."""
    mesh = Faces()
    mesh.box((-1.6, -0.7, -0.8), (1.6, -0.4, 0.8))
    mesh.box((-1.3, -0.4, -0.6), (1.3, 0.1, 0.6))
    mesh.box((-0.6, 0.1, -0.5), (0.7, 0.6, 0.5))
    return mesh


def lamp(x):
    """A small lamp hanging in the museum hall."""
    mesh = Faces()
    mesh.box((x - 0.5, 2, -16.5), (x + 0.5, 3, -15.5))
    return mesh


MESHES = {
    "sponza2.obj": ("a hall with columns", lambda: hall((-18, 18), (0, 14), (-8, 8))),
    "san-miguel.obj": ("a hall with columns", lambda: hall((2, 36), (0, 12), (-8, 18))),
    "museumhallrd2.obj": ("a hall with columns", lambda: hall((-25, 45), (-12, 20), (-34, -2))),
    "test3.obj": ("a hall with columns", lambda: hall((-25, 45), (-12, 20), (-34, -2))),
    "test3light1.obj": ("a box", lambda: lamp(0)),
    "test3light2.obj": ("a box", lambda: lamp(12)),
    "ivkwwche5p1c-001/untitled.obj": (
        "a hall with columns",
        lambda: hall((-160, 160), (-10, 220), (-250, 300)),
    ),
    "california/untitled.obj": ("a block", monument),
    "p03.obj": ("a prism", prism),
    "cap.obj": ("a dome", cap),
}
"""What stands in for a mesh whose name ends so."""


def checker(alpha):
    """Squares under a gradient; with `alpha` transparent outside a disk."""
    y, x = np.mgrid[0:128, 0:256] / 128
    squares = (np.floor(8 * x) + np.floor(8 * y)) % 2
    pixels = np.stack([0.9 - 0.4 * squares, 0.3 + 0.5 * y, 0.2 + 0.6 * squares], -1)
    if alpha:
        disk = np.hypot(x - 1, 2 * (y - 0.5)) < 0.9
        pixels = np.concatenate([pixels, disk[..., None]], -1)
    return Image.fromarray((255 * pixels).astype(np.uint8))


def sky():
    """A panorama: dark ground, bright horizon, blue zenith, a wide sun."""
    y, x = np.mgrid[0:128, 0:256] / 128
    up = np.clip(1 - 2 * y, 0, 1)[..., None]
    pixels = (1 - up) * [0.9, 0.85, 0.8] + up * [0.25, 0.45, 0.9]
    pixels[y[..., 0] > 0.5 if y.ndim > 2 else y > 0.5] = [0.3, 0.28, 0.25]
    pixels[np.hypot(x - 0.6, y - 0.25) < 0.06] = 1.0
    return Image.fromarray((255 * pixels).astype(np.uint8))


def make(name, folder):
    """Make a stand-in for a missing file.

    Args:
        name: the file as the scene names it.
        folder: folder to make it in, below the folders of its name.

    Returns:
        What stands in for what, or None if nothing does.
    """
    relative = name.replace("\\", "/")
    path = Path(folder, *(part for part in relative.split("/") if part not in ("", "..")))
    path.parent.mkdir(parents=True, exist_ok=True)
    for end, (what, mesh) in MESHES.items():
        if relative.casefold().endswith(end):
            mesh().write(path)
            return f"{what} for {relative}"
    suffix = path.suffix.lower()
    if suffix == ".obj":
        return None
    if suffix == ".hdr":
        sky().save(path, format="PNG")
        return f"a plain sky for {relative}"
    checker(alpha=suffix == ".png").save(path, format="PNG")
    return f"a checker for {relative}"
