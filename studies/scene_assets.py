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


def smooth(shape, cells, seed):
    """Noise from 0 to 1 that goes on at both edges of a picture, with cells of some size."""
    rng = np.random.default_rng(seed)
    grid = rng.random((cells[0] + 1, cells[1]))
    grid = np.concatenate([grid, grid[:, :1]], axis=1)
    y = np.linspace(0, cells[0], shape[0], endpoint=False)
    x = np.linspace(0, cells[1], shape[1], endpoint=False)
    (i, s), (j, t) = ((a.astype(int), 3 * (a % 1) ** 2 - 2 * (a % 1) ** 3) for a in (y, x))
    s, t = s[:, None], t[None]
    top = (1 - t) * grid[i][:, j] + t * grid[i][:, j + 1]
    below = (1 - t) * grid[i + 1][:, j] + t * grid[i + 1][:, j + 1]
    return (1 - s) * top + s * below


def stars():
    """A night sky, +Z at the bottom row: a band of light with dark lanes, and stars."""
    rows, columns = 512, 1024
    y, x = np.mgrid[0:rows, 0:columns]
    theta, phi = (y + 0.5) / rows * np.pi, (x + 0.5) / columns * 2 * np.pi
    n = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    pole = np.array([0.35, 0.5, 0.79])
    height = n @ (pole / np.linalg.norm(pole))
    clouds = sum(smooth((rows, columns), (6 * 2**k, 12 * 2**k), k) / 2**k for k in range(4)) / 1.875
    band = np.exp(-((height / 0.16) ** 2)) * np.clip(1.6 * clouds - 0.35, 0, 1)
    lane = np.exp(-(((height - 0.02) / 0.035) ** 2)) * np.clip(2 * clouds - 0.5, 0, 1)
    pixels = band[..., None] * [0.36, 0.3, 0.27] * (1 - 0.85 * lane[..., None])
    rng = np.random.default_rng(7)
    for _ in range(3600):
        z, turn = rng.uniform(-1, 1), rng.uniform(0, 2 * np.pi)
        row = min(int(np.arccos(z) / np.pi * rows), rows - 1)
        column = int(turn / (2 * np.pi) * columns)
        tint = np.array([[1, 0.8, 0.62], [1, 0.95, 0.88], [0.75, 0.85, 1]])[rng.integers(3)]
        bright = min(0.06 / rng.random() ** 0.75, 1.0) * tint
        pixels[row, column] = np.maximum(pixels[row, column], bright)
    # The steps of dark bytes are seen: they are broken up where there is a band.
    dither = np.where(pixels.max(axis=2, keepdims=True) > 0.004, rng.random((rows, columns, 1)), 0)
    stored = np.clip(255 * pixels + dither + [1, 1, 3], 0, 255).astype(np.uint8)[::-1]
    Image.fromarray(stored).save(FOLDER / "stars.png", optimize=True)


def ring():
    """Matter in orbit: streaks wound around the middle, which is the inner edge of the disk."""
    size = 384
    y, x = (np.mgrid[0:size, 0:size] - (size - 1) / 2) / (size / 2)
    radius, turn = np.hypot(x, y), np.arctan2(-y, x) / (2 * np.pi) % 1
    wound = (turn + 1.1 * np.log(radius + 0.25)) % 1
    polar = sum(smooth((1024, 1024), (24 * 2**k, 5 * 2**k), 20 + k) / 1.6**k for k in range(4))
    polar /= sum(1 / 1.6**k for k in range(4))
    rows = np.clip((radius * 700).astype(int), 0, 1023)
    streaks = polar[rows, (wound * 1023).astype(int)]
    bands = 0.75 + 0.25 * smooth((1024, 4), (40, 1), 3)[rows, 0]
    value = np.clip(2.6 * (streaks - 0.5) + 0.55, 0.03, 1) * bands
    value *= np.clip(1.15 - radius, 0, 1)
    fades = np.clip(radius / 0.05, 0, 1) * np.clip((1 - radius) / 0.4, 0, 1)
    alpha = np.clip(fades * (0.1 + 2 * value), 0, 1)
    warm = np.array([1.0, 0.72, 0.42]) * value[..., None] ** np.array([0.8, 1.0, 1.3])
    pixels = np.concatenate([np.clip(warm, 0, 1), alpha[..., None]], axis=2)
    stored = np.round(255 * pixels).astype(np.uint8)
    Image.fromarray(stored).save(FOLDER / "ring.png", optimize=True)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for make in (tiles, waves, sky, vase, tetrahedron, stars, ring):
        make()
