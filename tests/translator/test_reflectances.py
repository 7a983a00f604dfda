"""Pictures on surfaces: the very texel that the original program takes, and alpha as opacity.

Expected texels come from a transcription of section 11.1: column floor((w - 1) u) and, from the
bottom, row floor((h - 1) v), where `repeat` multiplies u and v before their fraction is taken.
"""

import mitsuba as mi
import numpy as np
import pytest

W, H = 7, 5
MARGIN = 0.03
"""Points nearer than this share of a texel to its edge are left out: float32 may take either."""


@pytest.fixture
def pixels(write_picture):
    """Random bytes of a picture `random.png`, (H, W, 3), top row first."""
    made = np.random.default_rng(7).integers(1, 255, (H, W, 3))
    write_picture("random.png", made)
    return made


def wrapped(x):
    """Values in [0, 1] are kept, of others the fraction is taken, from 1 if negative."""
    fraction = np.abs(x) % 1
    return np.where((x >= 0) & (x <= 1), x, np.where(x < 0, 1 - fraction, fraction))


def texel(pixels, u, v, repeat=1):
    """Colours (N, 3) at (u, v), and which of them are clear of the edges of texels."""
    h, w = pixels.shape[:2]
    x, y = (w - 1) * wrapped(repeat * u), (h - 1) * wrapped(repeat * v)
    off = [np.abs(x - np.round(x)) + (w == 1), np.abs(y - np.round(y)) + (h == 1)]
    clear = np.minimum(*off) > MARGIN * repeat
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    return pixels[h - 1 - row, column] / 255, clear


def reflectance(scene, origins, directions):
    """Colours (N, 3) of the Lambert surfaces that rays from `origins` along `directions` meet."""
    rays = mi.Ray3f(mi.Point3f(np.transpose(origins)), mi.Vector3f(np.transpose(directions)))
    si = scene.ray_intersect(rays)
    assert np.all(np.array(si.is_valid()))
    value = si.bsdf().eval(mi.BSDFContext(), si, si.wi)
    return (np.array(value) * np.pi / np.abs(np.array(si.wi.z))).T


TEXTURE = "color 0.5 0.5 0.5\nreflection diffuse\ntexture random.png\n"


def compare(scene, pixels, origins, directions, u, v, repeat=1):
    expected, clear = texel(pixels, u, v, repeat)
    assert clear.mean() > 0.5
    found = reflectance(scene, origins, directions)
    assert np.allclose(found[clear], expected[clear], atol=1e-5)


@pytest.mark.parametrize("repeat", [1, 3])
def test_uvplane(load, pixels, repeat):
    """u runs along U from the corner and v along V: the bottom left texel is at the corner."""
    scene = load(f"OBJECT\nuvplane 1 2 3\nU 4 0 0\nV 0 0 -6\n{TEXTURE}repeat {repeat}\n")
    s, t = np.random.default_rng(1).random((2, 2000))
    points = np.stack([1 + 4 * s, np.full(2000, 4.0), 3 - 6 * t], axis=1)
    compare(scene, pixels, points, np.tile([0.0, -1, 0], (2000, 1)), s, t, repeat)


def test_slanted_uvplane(load, pixels):
    """The same where U and V are not perpendicular."""
    scene = load(f"OBJECT\nuvplane 0 0 0\nU 4 0 0\nV 2 3 0\n{TEXTURE}")
    s, t = np.random.default_rng(2).random((2, 2000))
    points = np.stack([4 * s + 2 * t, 3 * t, np.ones(2000)], axis=1)
    compare(scene, pixels, points, np.tile([0.0, 0, -1], (2000, 1)), s, t)


def directions(count=3000):
    n = np.random.default_rng(3).normal(size=(count, 3))
    return n / np.linalg.norm(n, axis=1, keepdims=True)


@pytest.mark.parametrize("repeat", [1, 2])
def test_sphere(load, pixels, repeat):
    """u = atan2(y, x) / 2 pi and v = arccos(z) / pi: +Z is the bottom row; rotation is lost."""
    move = "rotation 0 0 90\ntranslate 2 0 0\n"
    scene = load(f"OBJECT\nsphere 0 0 0 2\n{TEXTURE}repeat {repeat}\n{move}")
    n = directions()
    u = np.mod(np.arctan2(n[:, 1], n[:, 0]) / (2 * np.pi), 1)
    v = np.arccos(n[:, 2]) / np.pi
    compare(scene, pixels, n * 3 + [2, 0, 0], -n, u, v, repeat)


def test_hemisphere(load, pixels):
    """u is doubled, so that the picture covers the half once."""
    scene = load(f"OBJECT\nhemisphere 0 0 0 2\n{TEXTURE}")
    n = directions()
    n[:, 1] = np.abs(n[:, 1])
    n = n[(np.abs(n[:, 2]) < 0.9) & (n[:, 1] > 0.05)]  # the dome has corners at the poles
    u = np.arctan2(n[:, 1], n[:, 0]) / np.pi
    compare(scene, pixels, n * 3, -n, u, np.arccos(n[:, 2]) / np.pi)


def test_disk(load, pixels):
    """u and v are coordinates along two tangents, 0 at the centre and 1 at the rim; others wrap.

    For the normal +Z the tangents are +X and +Y.
    """
    scene = load(f"OBJECT\ndisk 1 1 0 2\nnormal 0 0 1\n{TEXTURE}")
    r, phi = np.random.default_rng(4).random((2, 2000))
    u, v = np.sqrt(r) * 0.99 * np.stack([np.cos(2 * np.pi * phi), np.sin(2 * np.pi * phi)])
    points = np.stack([1 + 2 * u, 1 + 2 * v, np.ones(2000)], axis=1)
    compare(scene, pixels, points, np.tile([0.0, 0, -1], (2000, 1)), u, v)


@pytest.mark.parametrize("stock", [True, False])
def test_mesh(load, pixels, tmp_path, stock):
    """v of an OBJ file grows upwards, with Mitsuba's reader and our own; UV beyond 1 wrap."""
    usemtl = "" if stock else "usemtl paint\n"
    text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt -1 0\nvt 2 0\nvt 2 1\nvt -1 1\n"
    (tmp_path / "quad.obj").write_text(f"{text}{usemtl}f 1/1 2/2 3/3 4/4\n")
    scene = load(f"OBJECT\nobjfile quad.obj\n{TEXTURE}")
    s, t = np.random.default_rng(5).random((2, 2000))
    points = np.stack([2 * s, 2 * t, np.ones(2000)], axis=1)
    u = 3 * s - 1
    clear = np.abs(u - np.round(u)) > MARGIN
    down = np.tile([0.0, 0, -1], (2000, 1))
    compare(scene, pixels, points[clear], down[clear], u[clear], t[clear])


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (4, 1)])
def test_thin_pictures(load, write_picture, shape):
    """A picture of one row or column is as wide as what it covers."""
    pixels = np.arange(10, 10 + 20 * shape[0] * shape[1], 20).reshape(*shape, 1).repeat(3, axis=2)
    write_picture("random.png", pixels)
    scene = load(f"OBJECT\nuvplane 0 0 0\nU 1 0 0\nV 0 1 0\n{TEXTURE}")
    s, t = np.random.default_rng(6).random((2, 200))
    points = np.stack([s, t, np.ones(200)], axis=1)
    compare(scene, pixels, points, np.tile([0.0, 0, -1], (200, 1)), s, t)


def test_texture_takes_the_place_of_both_colors(translated, pixels):
    """Section 11.2: the texel replaces color and specular, scaled by rho_d and rho_s alone."""
    lines = "specular 0.3 0.3 0.3\nreflection ward_brdf\nward_brdf 0.5 0.25 0.1 0.1\n"
    text = f"OBJECT\nsphere 0 0 0 1\ncolor 0.5 0.5 0.5\n{lines}texture random.png\n"
    translation = translated(text)
    (ward,) = (e["bsdf"]["bsdf"] for e in translation.scene.values() if "bsdf" in e)
    means = [ward[f"{k}_reflectance"]["picture"].pixels.mean() for k in ("diffuse", "specular")]
    shown = pixels[1:, :-1].mean() / 255
    assert means == [pytest.approx(shown / 2), pytest.approx(shown / 4)]
    color = next(r for r in translation.document.lines.all if r.keyword == "color")
    assert color.outcome == "ignored"


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("shape", ["uvplane -1 -1 0\nU 2 0 0\nV 0 2 0\n", "sphere 0 0 0 1\n"])
@pytest.mark.parametrize("alpha", [0, 64, 255])
def test_alpha_is_opacity(view, measure, agrees, write_picture, shape, alpha):
    """A black surface of opacity a before a sky of 1 shows 1 - a, and a sphere (1 - a)².

    The program has it the other way round on spheres and planes (row alpha).
    """
    write_picture("veil.png", np.broadcast_to([0, 0, 0, alpha], (4, 4, 4)))
    text = view((0.1, 0.2, 5), (0.1, 0.2, 0)) + f"BACKGROUND\n1 1 1\n\nOBJECT\n{shape}"
    text += "reflection diffuse\ncolor 0.5 0.5 0.5\ntexture veil.png\n"
    expected = (1 - alpha / 255) ** (2 if "sphere" in shape else 1)
    measured = measure(text, spp=4096)
    if expected == 0:
        assert np.all(measured.mean == 0)
    else:
        agrees(measured, expected)


PRISM = "OBJECT\nsphere 90 0 9 1\ncolor 1 1 1\nreflection reflection99\n"


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "surface",
    [
        "reflection diffuse\ncolor 0 0 0\ntexture {texture}\n",
        "reflection diffuse\ncolor 0.8 0.4 0.1\n",
        "reflection specular\ncolor 0.8 0.4 0.1\n",
        "reflection diffuse\ncolor 0 0 0\nemission 0.8 0.4 3\n",
        "reflection diffuse\ncolor 0 0 0\nibl_texture {texture}\nibl_texture_coef 3\n",
    ],
)
def test_same_colors_by_wavelength(view, measure, write_picture, chance, surface):
    """Dispersive glass elsewhere makes the scene spectral; its colours stay, within noise.

    1 % is granted for the reflectance spectra, which come from a table.
    """
    colors = np.array([[204, 102, 26], [204, 102, 26]])
    write_picture("paint.png", np.broadcast_to(colors[:, None], (2, 2, 3)))
    text = view((0, 0, 3), (0, 0, 0)) + "BACKGROUND\n1 1 1\n\nOBJECT\nuvplane -1 -1 0\nU 2 0 0\n"
    text += "V 0 2 0\n" + surface.format(texture="paint.png") + "\n"
    rgb = measure(text, spp=512, runs=8)
    measured = measure(text + PRISM, spp=4096, runs=8)
    assert mi.variant() == "llvm_ad_spectral"
    chance.equal(measured, rgb, allowed=0.01, precision=0.02)
