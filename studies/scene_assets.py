"""Makes the pictures and meshes that the example scenes use: `python studies/scene_assets.py`."""

from pathlib import Path

import numpy as np
from PIL import Image

from relume.output import write_image

FOLDER = Path(__file__).parents[1] / "scenes" / "assets"


def tiles():
    """An asymmetric picture: a red corner at the bottom left, an arrow of light tiles, a hole."""
    pixels = np.zeros((64, 64, 4), np.uint8)
    y, x = np.mgrid[0:64, 0:64] // 8
    pixels[..., :3] = np.where(((x + y) % 2)[..., None], (70, 90, 120), (205, 200, 185))
    pixels[56:, :8, :3] = (200, 40, 30)
    pixels[:8, 56:, :3] = (240, 190, 40)
    pixels[..., 3] = 255
    pixels[24:40, 24:40, 3] = 0
    Image.fromarray(pixels).save(FOLDER / "tiles.png")


def waves():
    """A height map of rings."""
    y, x = np.mgrid[0:128, 0:128] / 127.0 - 0.5
    height = 0.5 + 0.5 * np.cos(2 * np.pi * 6 * np.hypot(x, y))
    Image.fromarray(np.round(255 * height).astype(np.uint8)).save(FOLDER / "waves.png")


def sky():
    """A panorama: blue above, sand below, a sun of radiance 900 to the right, a cross at -Z."""
    rows, columns = 64, 128
    v = np.mgrid[0:rows, 0:columns][0]
    elevation = (0.5 - (v + 0.5) / rows) * np.pi
    up = np.clip(np.sin(elevation), 0, 1)[..., None]
    image = (1 - up) * np.array([0.85, 0.9, 1.0]) + up * np.array([0.15, 0.3, 0.75])
    image[elevation < 0] = (0.30, 0.25, 0.18)
    image[12:14, 88:90] = (900.0, 800.0, 600.0)
    image[28:36, 63:65] = (1.0, 0.2, 0.1)
    image[31:33, 60:68] = (1.0, 0.2, 0.1)
    write_image(FOLDER / "sky.hdr", image.astype(np.float32))


def vase():
    """A turned vase: two materials, texture coordinates, no normals; glazed foot by extension."""
    profile = np.array([[0, 0], [3, 0], [3.4, 1], [2.2, 2.2], [3.8, 5], [4.2, 7.5], [2.4, 10],
                        [1.7, 11], [2.3, 12]])
    around = 32
    lines = ["# a turned vase", "mtllib vase.mtl"]
    for r, h in profile:
        for k in range(around + 1):
            phi = 2 * np.pi * k / around
            lines.append(f"v {r * np.cos(phi):.5f} {h:.5f} {-r * np.sin(phi):.5f}")
    for row in range(len(profile)):
        lines += [f"vt {k / around:.5f} {row / (len(profile) - 1):.5f}" for k in range(around + 1)]
    for row in range(len(profile) - 1):
        lines.append("usemtl " + ("foot" if row < 3 else "body"))
        for k in range(around):
            a, b = row * (around + 1) + k + 1, (row + 1) * (around + 1) + k + 1
            lines.append("f " + " ".join(f"{i}/{i}" for i in (a, a + 1, b + 1, b)))
    (FOLDER / "vase.obj").write_text("\n".join(lines) + "\n")
    (FOLDER / "vase.mtl").write_text(
        "newmtl body\nKd 0.8 0.8 0.8\nmap_Kd tiles_opaque.png\n\n"
        "newmtl foot\nKd 0.25 0.12 0.05\nKs 0.5 0.5 0.5\n#REFLECTION 3\n#WARD 0.1 0.3\n"
    )
    opaque = Image.open(FOLDER / "tiles.png").convert("RGB")
    opaque.save(FOLDER / "tiles_opaque.png")


def tetrahedron():
    """A tetrahedron with a colour at each corner."""
    corners = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    colors = np.array([[0.9, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.2, 0.9], [0.9, 0.8, 0.1]])
    vertices = np.concatenate([corners, colors], axis=1)
    lines = [f"v {' '.join(map(str, vertex))}" for vertex in vertices.tolist()]
    lines += ["f 1 2 4", "f 1 3 2", "f 1 4 3", "f 2 3 4"]
    (FOLDER / "tetrahedron.obj").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for make in (tiles, waves, sky, vase, tetrahedron):
        make()
