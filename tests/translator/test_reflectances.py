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


DISKS = {
    # n.x is 0: X x n, and n x (X x n)
    "+Z": ((0, 0, 1), "", (0, -1, 0), (1, 0, 0)),
    "-Z": ((0, 0, -1), "", (0, 1, 0), (1, 0, 0)),
    "+Y": ((0, 1, 0), "", (0, 0, 1), (1, 0, 0)),
    "in YZ": ((0, 0.6, 0.8), "", (0, -0.8, 0.6), (1, 0, 0)),
    # else Y x n
    "+X": ((1, 0, 0), "", (0, 0, -1), (0, 1, 0)),
    "oblique": ((0.6, 0, 0.8), "", (0.8, 0, -0.6), (0, 1, 0)),
    "near +Y": ((0.28, 0.96, 0), "", (0, 0, -1), (-0.96, 0.28, 0)),
    # a turn about the normal does not turn the picture; the turned normal decides
    "+Z, turned about itself": ((0, 0, 1), "rotation 0 0 30\n", (0, -1, 0), (1, 0, 0)),
    "+Z, turned to +X": ((0, 0, 1), "rotation 0 90 0\n", (0, 0, -1), (0, 1, 0)),
    "+Z, twice as large": ((0, 0, 1), "scale 2 2 2\n", (0, -1, 0), (1, 0, 0)),
}
"""Normal, transformation, and the directions of u and v in the world."""


@pytest.mark.parametrize("name", DISKS)
def test_disk(load, pixels, name):
    """u and v are coordinates along two tangents, 0 at the centre and 1 at the rim; others wrap."""
    normal, lines, along_u, along_v = DISKS[name]
    size = 4 if "scale" in lines else 2
    text = " ".join(map(str, normal))
    scene = load(f"OBJECT\ndisk 0 0 0 2\nnormal {text}\n{TEXTURE}{lines}")
    r, phi = np.random.default_rng(4).random((2, 2000))
    u, v = np.sqrt(r) * 0.99 * np.stack([np.cos(2 * np.pi * phi), np.sin(2 * np.pi * phi)])
    n = np.cross(along_u, along_v)
    points = size * (np.outer(u, along_u) + np.outer(v, along_v)) + n
    compare(scene, pixels, points, np.tile(-n, (2000, 1)), u, v)


@pytest.mark.parametrize(("shape", "hole"), [("disk 0 0 0 2", 0), ("disk2 0 0 0 2 0.6", 0.6)])
def test_picture_that_a_disk_shines_with(load, pixels, shape, hole):
    """`ibl_texture` lies on a disk as its texture does, and shines on both sides."""
    scene = load(f"OBJECT\n{shape}\nnormal 0 0 1\nibl_texture random.png\nibl_texture_coef 3\n")
    r, phi = np.random.default_rng(8).random((2, 2000))
    r = 2 * np.sqrt(r)
    kept = (r > 1.02 * hole) & (r < 1.98)
    x, y = (r * np.stack([np.cos(2 * np.pi * phi), np.sin(2 * np.pi * phi)]))[:, kept]
    expected, clear = texel(pixels, -y / 2, x / 2)
    for side in (1, -1):
        points = np.stack([x, y, np.full(len(x), side)])
        si = scene.ray_intersect(mi.Ray3f(mi.Point3f(points), mi.Vector3f(0, 0, -side)))
        found = np.array(si.emitter(scene).eval(si)).T
        assert np.allclose(found[clear], 3 * expected[clear], atol=1e-4)


@pytest.mark.parametrize("flag", ["", "ibl_"])
@pytest.mark.parametrize("sides", [(2, 1.5), (0.5, 0.8)])
def test_tiles_of_a_uvplane(load, pixels, sides, flag):
    """Dialect `prender`: the plane has squared edges, and a picture to each length of U and V."""
    a, b = sides
    line = TEXTURE.replace("texture ", flag + "texture ")
    scene = load(f"OBJECT\nuvplane 1 2 3\nU {a} 0 0\nV 0 0 {-b}\n{line}", "prender")
    s, t = np.random.default_rng(9).random((2, 2000))
    points = np.stack([1 + a * a * s, np.full(2000, 4.0), 3 - b * b * t], axis=1)
    down = np.tile([0.0, -1, 0], (2000, 1))
    if not flag:
        compare(scene, pixels, points, down, a * s, b * t)
        return
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(points.T), mi.Vector3f(down.T)))
    expected, clear = texel(pixels, a * s, b * t)
    found = np.array(si.emitter(scene).eval(si)).T
    assert np.allclose(found[clear], expected[clear], atol=1e-5)


def test_tiles_under_a_scale(load, pixels):
    """A scale scales them, too: their number is that of the lengths as they are written."""
    scene = load(f"OBJECT\nuvplane 0 0 0\nU 2 0 0\nV 0 1 0\n{TEXTURE}scale 3 1 1\n", "prender")
    s, t = np.random.default_rng(10).random((2, 2000))
    points = np.stack([12 * s, t, np.ones(2000)], axis=1)
    compare(scene, pixels, points, np.tile([0.0, 0, -1], (2000, 1)), 2 * s, t)


def test_tiles_of_a_slanted_uvplane(load, pixels):
    """Dialect `prender`: a point belongs to the plane, and finds its texel, by its distances from
    the corner along U and V, whatever the angle between them."""
    scene = load(f"OBJECT\nuvplane 0 0 0\nU 2 0 0\nV 0.9 1.2 0\n{TEXTURE}", "prender")
    p = np.random.default_rng(11).random((4000, 2)) * [6, 6] - [2, 1]
    along_u, along_v = p[:, 0], p @ [0.6, 0.8]
    edge = np.minimum.reduce([along_u, 4 - along_u, along_v, 2.25 - along_v])
    p, u, v = (x[np.abs(edge) > 1e-3] for x in (p, along_u / 2, along_v / 1.5))
    inside = edge[np.abs(edge) > 1e-3] > 0
    points = np.column_stack([p, np.ones(len(p))])
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(points.T), mi.Vector3f(0, 0, -1)))
    assert np.array_equal(np.array(si.is_valid()), inside)
    down = np.tile([0.0, 0, -1], (inside.sum(), 1))
    compare(scene, pixels, points[inside], down, u[inside], v[inside])


def light_probe(n, front):
    """u and v of a light probe whose centre is the direction front * Z."""
    x, y, z = n.T
    rho = np.arccos(np.clip(front * z, -1, 1)) / (np.pi * np.hypot(x, y))
    return (1 + x * rho) / 2, (1 + y * rho) / 2


MAPS = {
    "hemisphere": lambda n: ((1 + n[:, 2]) / 2, (1 + n[:, 0]) / 2),
    "panoramic": lambda n: (
        (1 + np.arctan2(n[:, 0], -n[:, 2]) / np.pi) / 2, 1 - np.arccos(n[:, 1]) / np.pi
    ),
    "equirectangular": lambda n: (
        (np.arctan2(n[:, 2], n[:, 0]) + np.pi) / (2 * np.pi), 0.5 - np.arcsin(n[:, 1]) / np.pi
    ),
    "angular": lambda n: light_probe(n, -1),
    "angular, prender": lambda n: light_probe(n, 1),
}  # fmt: skip
"""The formulas of section 11.5."""


@pytest.mark.parametrize("name", MAPS)
def test_maps_of_a_sphere(load, pixels, name):
    """The flags act on `texture`; neither the place of the sphere nor a rotation matters."""
    flag, _, dialect = name.partition(", ")
    move = "rotation 0 0 90\ntranslate 2 0 0\n"
    text = f"OBJECT\nsphere 0 0 0 2\n{TEXTURE}{flag}_map 1\n{move}"
    scene = load(text, dialect or "manual")
    n = directions()
    compare(scene, pixels, n * 3 + [2, 0, 0], -n, *MAPS[name](n))


@pytest.mark.parametrize("name", MAPS)
def test_maps_of_a_hemisphere(load, pixels, name):
    """u is doubled, as without a flag, but for `hemisphere_map`: it shows the dome from above."""
    flag, _, dialect = name.partition(", ")
    scene = load(f"OBJECT\nhemisphere 0 0 0 2\n{TEXTURE}{flag}_map 1\n", dialect or "manual")
    n = directions()
    n[:, 1] = np.abs(n[:, 1])
    n = n[(n[:, 1] < 0.99) & (n[:, 1] > 0.05)]
    u, v = MAPS[name](n)
    compare(scene, pixels, n * 3, -n, u if flag == "hemisphere" else 2 * u, v)


def test_the_first_flag_counts(load, pixels):
    """hemisphere before panoramic before angular before equirectangular."""
    order = ["equirectangular", "angular", "panoramic", "hemisphere"]
    n = directions()
    for count in range(1, 5):
        lines = "".join(f"{flag}_map 1\n" for flag in order[:count])
        scene = load(f"OBJECT\nsphere 0 0 0 2\n{TEXTURE}{lines}")
        compare(scene, pixels, n * 3, -n, *MAPS[order[count - 1]](n))


def test_repeat_of_a_map(load, pixels):
    """`repeat` multiplies u and v of a map; `hemisphere_map` finds its texel without them."""
    n = directions()
    for flag, repeat in (("panoramic", 2), ("hemisphere", 1)):
        scene = load(f"OBJECT\nsphere 0 0 0 2\n{TEXTURE}{flag}_map 1\nrepeat 2\n")
        compare(scene, pixels, n * 3, -n, *MAPS[flag](n), repeat)


def test_a_map_of_an_ellipsoid(load, pixels):
    """The picture is stretched with the sphere."""
    scene = load(f"OBJECT\nsphere 0 0 0 2\n{TEXTURE}panoramic_map 1\nscale 1 3 1\n")
    n = directions()
    n = n[np.abs(n[:, 1]) < 0.9]
    compare(scene, pixels, n * [2.5, 7.5, 2.5], -n * [1, 3, 1], *MAPS["panoramic"](n))


@pytest.mark.parametrize(("mtl", "repeat"), [(None, 1), ("", 1), ("#REPEAT 3\n", 3)])
def test_repeat_on_meshes(load, pixels, tmp_path, mtl, repeat):
    """An object's `repeat` has no effect on a mesh; `#REPEAT` of a material has."""
    text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    head = "" if mtl is None else "mtllib m.mtl\nusemtl paint\n"
    (tmp_path / "m.mtl").write_text(f"newmtl paint\nmap_Kd random.png\n{mtl}")
    (tmp_path / "quad.obj").write_text(f"{head}{text}f 1/1 2/2 3/3 4/4\n")
    lines = TEXTURE if mtl is None else "color 1 1 1\nreflection diffuse\n"
    scene = load(f"OBJECT\nobjfile quad.obj\n{lines}repeat 2\n")
    s, t = np.random.default_rng(12).random((2, 2000))
    points = np.stack([2 * s, 2 * t, np.ones(2000)], axis=1)
    down = np.tile([0.0, 0, -1], (2000, 1))
    compare(scene, pixels, points, down, s, t, repeat)


@pytest.mark.parametrize("shape", ["disk 0 0 0 2", "disk2 0 0 0 2 0.5"])
def test_disk_map(load, pixels, write_picture, shape):
    """A disk with `disk_map` is what its picture covers: a square of side R around the centre,
    columns along v and rows along u; it shines with the emission and reflects nothing.

    The first column and the lowest row are twice as wide: the texel is rounded towards 0.
    """
    alpha = np.where(np.arange(W) < W - 2, 255, 0) * np.ones((H, 1))
    write_picture("random.png", np.dstack([pixels, alpha]))
    scene = load(f"OBJECT\n{shape}\nnormal 0 0 1\n{TEXTURE}disk_map 1\nemission 1 2 3\n")
    x, y = np.random.default_rng(13).random((2, 4000)) * 3 - 1.5
    # u = -y / 2 and v = x / 2, by the normal +Z
    column, row = W * (0.5 + x / 2), H * (0.5 - y / 2)
    shown = (column > -1) & (column < W - 2) & (row > -1) & (row < H)
    clear = np.minimum.reduce([np.abs(column + 1), np.abs(column - W + 2), np.abs(row + 1),
                               np.abs(row - H)]) > 0.02  # fmt: skip
    hits = np.hypot(x, y) > (0.51 if "disk2" in shape else 0)
    kept = clear & hits & (np.hypot(x, y) < 1.9)
    points = np.stack([x, y, np.ones(4000)])[:, kept]
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(points), mi.Vector3f(0, 0, -1)))
    assert np.all(np.array(si.is_valid()))
    radiance = np.array(si.emitter(scene).eval(si)).T
    assert np.allclose(radiance, np.outer(shown[kept], [1, 2, 3]))
    opacity = 1 - np.array(si.bsdf().eval_null_transmission(si))[0]
    assert np.array_equal(opacity, shown[kept])
    assert np.all(np.array(si.bsdf().eval(mi.BSDFContext(), si, si.wi)) == 0)


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
