"""Media from scene text: coefficients, boundaries, where the medium around all objects ends, and
what closed forms say of the pictures."""

import mitsuba as mi
import numpy as np
import pytest

from relume.session import Session
from relume.translator import read_text, translate
from relume.translator.materials_table import MATERIALS
from relume.translator.media import uses_dipole, with_method
from relume.translator.scene_values import Mesh
from relume.translator.watertight import open_edges

BALL = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection reflection\n"
SSS = BALL + "reflection Subsurface_Scattering\nBSSRDF\n0\n"


def scene(text):
    return translate(read_text(text, environ={})).scene


def fog(s, a=(0, 0, 0), g="0"):
    """Text of a medium around all objects; `g` one number or three."""
    triples = [" ".join(f"{x:.9g}" for x in v) for v in (s, a)]
    phase = f"PAHASE\n{g}" if len(g.split()) == 1 else f"PAHASE {g}"
    return (
        f"participatingMedia\n1\nSCATTERING\n0\n{triples[0]}\nABSORBING\n0\n{triples[1]}\n{phase}\n"
    )


def coefficients(entry):
    """sigma_s, sigma_a and g of a medium's dictionary."""
    sigma_t = np.array(entry["sigma_t"]["value"]) * entry["scale"]
    albedo = np.array(entry["albedo"]["value"])
    g = np.broadcast_to(entry["phase"].get("g", 0.0), 3)
    return albedo * sigma_t, (1 - albedo) * sigma_t, g


# ---------------------------------- coefficients ----------------------------------


@pytest.mark.parametrize(
    ("g", "phase"),
    [
        ("0", {"type": "isotropic"}),
        ("0.5", {"type": "hg", "g": 0.5}),
        ("-0.99", {"type": "hg", "g": -0.99}),
        ("1", {"type": "hgrgb", "g": [1.0, 1.0, 1.0]}),
        ("0.5 0.5 0.5", {"type": "hg", "g": 0.5}),
        ("0.5 0 -1", {"type": "hgrgb", "g": [0.5, 0.0, -1.0]}),
    ],
)
def test_phase_functions(g, phase):
    """Mitsuba's own where one g below 1 will do, else the one for each channel."""
    assert scene(fog((1, 1, 1), g=g))["medium"]["phase"] == phase


def test_medium_around():
    """Coefficients in 1/scene unit reach the medium; the camera is in it; what light crosses knows
    it as its outside, opaque surfaces need not."""
    wall = "\nOBJECT\nsphere 5 0 0 1\n"
    found = scene(fog((30, 0.25, 2), (10, 0.25, 0), "0.5") + "\n" + BALL + wall)
    s, a, g = coefficients(found["medium"])
    assert s == pytest.approx([30, 0.25, 2]) and a == pytest.approx([10, 0.25, 0]) and g[0] == 0.5
    reference = {"type": "ref", "id": "medium"}
    assert found["sensor"]["medium"] == reference
    glass, opaque = (found[name] for name in found if name.startswith("object_"))
    assert glass["exterior"] == reference and "interior" not in glass
    assert "exterior" not in opaque


def test_channels_without_extinction_keep_a_millionth():
    """Stock integrators lose the other channels where one has none: see `media.FLOOR`."""
    s, a, _ = coefficients(scene(fog((0, 1, 2)))["medium"])
    assert s == pytest.approx([2e-6, 1, 2]) and np.all(a == 0)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_measured_material(name):
    """`MATERIAL_SYMBOL` with `MATERIAL_SCALE`: sigma, g and index of the table, both ways."""
    text = SSS.replace("BSSRDF\n0", "BSSRDF\n1")
    bsdf = scene(text + f"MATERIAL_SYMBOL\n{name}\nMATERIAL_SCALE\n0.5\n")["object_1"]["bsdf"]
    for field in ("sigma_s", "sigma_a"):
        value = np.array(bsdf[field]["value"]) * bsdf["scale"]
        assert value == pytest.approx(0.5 * np.array(getattr(MATERIALS[name], field)), abs=1e-12)
    assert bsdf["g"]["value"] == list(MATERIALS[name].g) and bsdf["eta"] == MATERIALS[name].eta
    found = scene(SSS + f"MATERIAL_SYMBOL\n{name}\nMATERIAL_SCALE\n0.5\n")["object_1"]
    material = MATERIALS[name]
    s, a, g = coefficients(found["interior"])
    assert s == pytest.approx(0.5 * np.array(material.sigma_s), abs=1e-12)
    assert a == pytest.approx(0.5 * np.array(material.sigma_a), abs=1e-12)
    assert np.all(g == material.g)
    assert found["bsdf"]["int_ior"] == material.eta and found["bsdf"]["fresnel"] == "exact"


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("PAHASE\n0.3\nMATERIAL_SYMBOL\nCoke\n", ("s", "a", "g", 1.33)),
        ("MATERIAL_SYMBOL\nCoke\nPAHASE\n0.3\n", ("s", "a", (0.3, 0.3, 0.3), 1.33)),
        ("MATERIAL_SYMBOL\nCoke\nSCATTERING\n0\n1 2 3\n", ((1, 2, 3), "a", "g", 1.33)),
        ("MATERIAL_SYMBOL\nCoke\nABSORBING\n0\n1 2 3\n", ("s", (1, 2, 3), "g", 1.33)),
        ("MATERIAL_SYMBOL\nCoke\nrefractive_index 1.7\n", ("s", "a", "g", 1.7)),
        ("refractive_index 1.7\nMATERIAL_SYMBOL\nCoke\n", ("s", "a", "g", 1.33)),
    ],
)
def test_the_last_line_wins(lines, expected):
    """Lines after `MATERIAL_SYMBOL` set their own anew (section 10.2)."""
    table = dict(
        zip(
            "sag",
            (MATERIALS["Coke"].sigma_s, MATERIALS["Coke"].sigma_a, MATERIALS["Coke"].g),
            strict=True,
        )
    )
    found = scene(SSS + lines)["object_1"]
    *wanted, index = (table.get(x, x) if isinstance(x, str) else x for x in expected)
    for value, target in zip(coefficients(found["interior"]), wanted, strict=True):
        assert value == pytest.approx(np.array(target, float), abs=1e-9)
    assert found["bsdf"]["int_ior"] == index


def test_order_zero_takes_away_what_would_be_scattered():
    """`level 0`: nothing scatters, but the extinction is that of scattering and absorption."""
    found = scene(SSS + "SCATTERING\n0\n5 5 5\nABSORBING\n0\n1 2 3\nlevel\n0\n")["object_1"]
    s, a, _ = coefficients(found["interior"])
    assert np.all(s == 0) and a == pytest.approx([6, 7, 8])


def test_without_coefficients_there_is_no_medium():
    """Both 0, or a scale of 0: the boundary alone."""
    for lines in ("", "MATERIAL_SYMBOL\nApple\nMATERIAL_SCALE\n0\n"):
        found = scene(SSS + lines)
        assert "interior" not in found["object_1"] and found["integrator"]["type"] == "surfacepath"


@pytest.mark.parametrize(
    ("lines", "kind"),
    [
        ("", "schlickglass"),
        ("reflection reflection\n", "schlickglass"),
        ("reflection diffuse\n", "schlickglass"),
        ("reflection ward_brdf\nward_brdf 0.5 1 0.1 0.2\n", "roughdielectric"),
        ("reflection phong_brdf\nphong_brdf 0.5 1 30\n", "roughdielectric"),
    ],
)
def test_boundaries(lines, kind):
    """The surface named before; smooth glass where none would let light in."""
    text = f"OBJECT\nsphere 0 0 0 1\n{lines}reflection Subsurface_Scattering\nBSSRDF\n0\n"
    found = scene(text + "MATERIAL_SYMBOL\nApple\n")["object_1"]["bsdf"]
    assert (found["type"], found["int_ior"]) == (kind, 1.3)
    if kind == "roughdielectric":
        assert found["alpha_v"] == pytest.approx(0.2 if "ward" in lines else 0.25)


@pytest.mark.parametrize(
    ("lines", "dipole"),
    [
        ("", True), ("BSSRDF\n0\n", False), ("level\n-2\n", True), ("level\n0\n", False),
        ("BSSRDF\n0\nlevel\n-2\n", True), ("level\n-2\nBSSRDF\n0\n", False),
        ("BSSRDF\n1\nlevel\n3\n", False), ("level\n3\nBSSRDF\n1\n", True),
        ("BSSRDF\n0\nlevel\n-1\n", False), ("BSSRDF\n1\nlevel\n-1\n", True),
    ],
)  # fmt: skip
def test_which_way(lines, dipole):
    """The later of `BSSRDF` and `level` counts; `level -1` leaves it."""
    document = read_text(BALL + "reflection Subsurface_Scattering\n" + lines, environ={})
    assert uses_dipole(document.objects[0]) == dipole
    for forced in (False, True):
        assert uses_dipole(with_method(document, forced).objects[0]) == forced


@pytest.mark.parametrize(("lines", "factor"), [("", 0), ("MATERIAL_R_MAX\n2\n", 2)])
def test_search_radius(lines, factor):
    """The manual's formula where a file sets `MATERIAL_R_MAX`, with the least sigma_t' of the three
    channels, here that of red: 2 (1 - 0.5) + 0.1; no limit elsewhere."""
    text = BALL + "reflection Subsurface_Scattering\nBSSRDF\n1\nSCATTERING\n0\n2 4 6\n"
    bsdf = scene(text + "ABSORBING\n0\n0.1 0.1 0.1\nPAHASE\n0.5\n" + lines)["object_1"]["bsdf"]
    assert bsdf["r_max"] == pytest.approx(factor * 1.25 * np.sqrt(np.log(1e4) / 1.1))
    assert (bsdf["level"], bsdf["g"]["value"]) == (-1, [0.5, 0.5, 0.5])


def test_the_environment_chooses_the_way():
    """`USE_BSSRDF` stands in for `BSSRDF`; a `level` line still counts."""
    text = BALL + "reflection Subsurface_Scattering\n"
    for value, lines, dipole in (
        ("0", "", False),
        ("1", "BSSRDF\n0\n", True),
        ("0", "level\n-2\n", True),
    ):
        document = read_text(text + lines, environ={"USE_BSSRDF": value})
        assert uses_dipole(document.objects[0]) == dipole


# ---------------------------------- geometry ----------------------------------


CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([f for a, b, c, d in QUADS for f in ((a, b, c), (a, c, d))])


def test_open_edges():
    """A cube is closed, also if each face has vertices of its own or it is in two parts; without
    one triangle three edges are open, and the face turned round opens as many."""
    assert open_edges([Mesh(CUBE, FACES)]) == 0
    apart = Mesh(CUBE[FACES].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert open_edges([apart]) == 0
    assert open_edges([Mesh(CUBE, FACES[:5]), Mesh(CUBE, FACES[5:])]) == 0
    assert open_edges([Mesh(CUBE, FACES[1:])]) == 3
    turned = FACES.copy()
    turned[0] = turned[0][::-1]
    assert open_edges([Mesh(CUBE, turned)]) > 0


def test_an_open_mesh_is_noted(tmp_path):
    """At the line of the object, with the number of edges."""
    faces = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES[1:])
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in CUBE)
    (tmp_path / "open.obj").write_text(corners + faces)
    text = "OBJECT\nobjfile open.obj\nreflection reflection\nreflection Subsurface_Scattering\n"
    result = translate(read_text(text, environ={}), asset_path=[tmp_path])
    report = result.document.lines.all[0]
    assert report.outcome == "approximated" and "3 edges" in report.note


def test_a_ball_ends_the_medium():
    """Light from infinitely far would be lost in an endless medium: a ball twice the size of the
    scene bounds it."""
    ball = scene(fog((1, 1, 1)) + "\n" + BALL)["medium_boundary"]
    assert ball["bsdf"] == {"type": "null"} and ball["interior"] == {"type": "ref", "id": "medium"}
    for point in ((50, 52, 220), (0, 0, 0)):
        assert np.linalg.norm(np.array(point) - ball["center"]) < 0.6 * ball["radius"]


def test_the_ball_holds_a_closed_room():
    """Walls far beyond the objects, of giant spheres and of planes: no corner sticks out."""
    camera = "CAMERA_POS\n1 2 3\n"
    giants = "".join(
        f"OBJECT\nsphere {x} {y} {z} 1e5\nnormal -1\n\n"
        for x, y, z in (1e5 - 80 * np.eye(3)) * np.eye(3) + 0
    ) + "".join(
        f"OBJECT\nsphere {x} {y} {z} 1e5\nnormal -1\n\n"
        for x, y, z in -(1e5 - 80 * np.eye(3)) * np.eye(3) + 0
    )
    planes = "".join(
        f"OBJECT\nplane {p[0]} {p[1]} {p[2]}\nnormal {-p[0]} {-p[1]} {-p[2]}\n\n"
        for p in [*(80 * np.eye(3)), *(-80 * np.eye(3))]
    )
    for walls in (giants, planes):
        ball = scene(camera + fog((1, 1, 1)) + "\n" + walls + BALL)["medium_boundary"]
        corner = 80 * np.sqrt(3)
        assert ball["radius"] > corner + np.linalg.norm(ball["center"])


# ---------------------------------- pictures ----------------------------------


WALL = "OBJECT\nuvplane -50 -50 -10\nU 100 0 0\nV 0 100 0\nemission 2 2 2\nreflection diffuse\n\n"


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("index", ["absorbing", "scattering straight on", "chromatic"])
def test_beer_lambert(view, measure, agrees, index):
    """A lamp behind 8 units of medium: L exp(-sigma_a 8). Scattering with g = 1 changes nothing."""
    a = {"absorbing": (0.1, 0.1, 0.1), "chromatic": (0, 0.05, 0.2)}.get(index, (0.02, 0.02, 0.02))
    s = (0.3, 0.1, 0.2) if index.startswith("scattering") else (0, 0, 0)
    text = view((0, 0, -2), (0, 0, -10)) + fog(s, a, "1") + "\n" + WALL
    agrees(measure(text, spp=1024), 2 * np.exp(-8 * np.array(a)))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("g", ["0.9", "-1", "0.5 0.4 0.3"])
def test_furnace(view, measure, chance, g):
    """Under light 1 from all sides a medium with albedo 1 shows 1, in every channel."""
    around = "BACKGROUND\n1 1 1\nDEPTH\n200\n" + fog((0.3, 0.2, 0.4), g=g) + "\n"
    found = measure(view((0, 0, 3), (0, 0, 0)) + around + BALL, spp=256)
    chance.equal(found, 1.0, allowed=2e-4, precision=1e-2)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("lines", ["SCATTERING\n0\n2 1 4\n", "MATERIAL_SYMBOL\nSpectralon\n"])
@pytest.mark.parametrize("boundary", ["", "refractive_index 1\n"])
def test_furnace_of_an_object(view, measure, chance, lines, boundary):
    """A white ball that absorbs nothing is invisible under light 1 from all sides."""
    text = view((0, 0, 9), (0.3, 0.2, 0)) + "BACKGROUND\n1 1 1\nDEPTH\n5000\n\n" + SSS
    chance.equal(measure(text + lines + boundary, spp=192), 1.0, allowed=2e-4, precision=1e-2)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("g", [0.0, 0.6, -0.5])
def test_single_scattering_of_a_beam(view, load, chance, level, g):
    """A beam of irradiance E falls from a lamp at y = 3 across the line of sight, which crosses it
    from z = -w to w at y = 0. Light scattered once:

        L = int sigma_s p(90 degrees) E exp(-sigma_t (3 + 4 - z)) dz

    with the camera at z = 4 and p that of Henyey-Greenstein at cos theta = 0."""
    sigma_s, sigma_a, w = 0.06, 0.03, 1.0
    beam = (
        "OBJECT\nuvplane -1 3 -1\nU 2 0 0\nV 0 0 2\nemission 5 5 5\nparallel_light 1\n"
        "parallel_light_dir 0 -1 0\nreflection diffuse\n"
    )
    text = view((0, 0, 4), (0, 0, 0)) + fog((sigma_s,) * 3, (sigma_a,) * 3, f"{g}") + "\n" + beam
    scene = load(text)
    once = mi.load_dict({"type": "volpath", "max_depth": 2})
    found = level(chance.runs(scene, 2048, integrator=once).mean(axis=(1, 2)))
    phase = (1 - g * g) / (4 * np.pi * (1 + g * g) ** 1.5)
    sigma_t = sigma_s + sigma_a
    along = (np.exp(sigma_t * w) - np.exp(-sigma_t * w)) / sigma_t
    expected = sigma_s * phase * np.pi * 5 * np.exp(-7 * sigma_t) * along
    chance.equal(found, expected, allowed=1e-3, precision=1e-2)


@pytest.mark.false_alarms(1e-3)
def test_a_spot_lamp_in_fog(view, measure, agrees):
    """Light falls 5 units down from the lamp and comes 2 back to the camera through absorption a:
    L = rho emission / 5^2 exp(-7 a), as light falls in along the normal."""
    a = np.array((0.02, 0.05, 0.1))
    floor = "OBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    lamp = "OBJECT\nsphere 0 5 0 0.2\nemission 50 50 50\ncolor 0 0 0\nspot_light 1\n"
    text = view((0, 2, 1e-3), (0, 0, 0)) + fog((0, 0, 0), a) + "\n" + floor + lamp
    agrees(measure(text, spp=2048), np.exp(-7 * a))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("z", [5, -5])
def test_a_lamp_with_two_sides_in_fog(view, measure, agrees, z):
    """From either side: L exp(-5 a)."""
    a = np.array((0.02, 0.05, 0.1))
    lamp = "OBJECT\nplane 0 0 0\nnormal 0 0 1\nemission 2 2 2\ncolor 0 0 0\n"
    text = view((0, 0, z), (0, 0, 0)) + fog((0, 0, 0), a) + "\n" + lamp
    assert "twosidedarea" in translate(read_text(text, environ={})).plan.plugins
    agrees(measure(text, spp=1024), 2 * np.exp(-5 * a))


@pytest.mark.false_alarms(1e-3)
def test_a_dome_in_fog(view, measure, agrees, write_picture):
    """Its light crosses the ball of fog around the camera, here from its end at distance t:
    L exp(-t a)."""
    a = np.array((0.02, 0.05, 0.1))
    write_picture("sky.png", np.full((8, 16, 3), 255))
    dome = "OBJECT\nsphere 0 0 0 100\ncolor 0 0 0\nibl_texture sky.png\nnormal -1\n\n"
    text = view((0, 0, 4), (0, 3, 4), up=(0, 0, 1)) + fog((0, 0, 0), a) + "\n" + dome + BALL
    ball = scene(text.replace(dome, ""))["medium_boundary"]
    origin = np.array((0, 0, 4)) - ball["center"]
    t = -origin[1] + np.sqrt(origin[1] ** 2 - origin @ origin + ball["radius"] ** 2)
    agrees(measure(text, spp=1024), np.exp(-t * a))


@pytest.mark.false_alarms(1e-3)
def test_a_session_knows_the_medium(view, load, chance, level):
    """Around the camera: its pictures are those of Mitsuba's own rendering."""
    text = view((0, 0, -2), (0, 0, -10)) + fog((0.02,) * 3, (0.1,) * 3) + "\n" + WALL
    scene = load(text)
    own = level(chance.runs(scene, 512).mean(axis=(1, 2)))
    sessions = [Session(scene, 512, chance.seed()) for _ in range(8)]
    for session in sessions:
        list(session.run())
    found = level([session.image().mean(axis=(0, 1)) for session in sessions])
    chance.equal(found, own, allowed=1e-5, precision=1e-2)


# ---------------------------------- the camera inside ----------------------------------

FILLED = (
    "color 1 1 1\nreflection reflection\nrefractive_index 1.5\n"
    "reflection Subsurface_Scattering\nBSSRDF\n0\nlevel\n0\nSCATTERING\n0\n0 0 0\n"
    "ABSORBING\n{a}\n{a} {a} {a}\n\n"
)
SKY = "BACKGROUND\n1 1 1\n\n"
CUBE_FILE = (
    "".join(f"v {x} {y} {z}\n" for z in (-2, 2) for y in (-2, 2) for x in (-2, 2))
    + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
)


def from_inside(a, way=2.0, eta=1.5):
    """Radiance towards a wall at the distance `way` of a clear cavity with the absorption a.

    The sky of 1 enters with the factor eta² (1 - F); the rest of what is seen has crossed the
    cavity of width 2 way after a reflection, and so on.
    """
    F = ((eta - 1) / (eta + 1)) ** 2
    return eta**2 * (1 - F) * np.exp(-a * way) / (1 - F * np.exp(-2 * a * way))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "shape", ["sphere 0 0 20 2", "objfile cube.obj", "objfile parts.obj", "sphere 0 0 2 0.2"]
)
def test_the_camera_inside_an_object_is_in_its_medium(measure, view, agrees, tmp_path, shape):
    """A filled ball, a mesh, one of two materials and a scaled ball, seen from their centres."""
    (tmp_path / "cube.obj").write_text(CUBE_FILE)
    half = CUBE_FILE.replace("f 1 3", "usemtl a\nf 1 3").replace("f 3 7", "usemtl b\nf 3 7")
    (tmp_path / "parts.obj").write_text(half)
    place = {"objfile": "translate 0 0 20\n\n", "sphere 0 0 2 0.2": "scale 10 10 10\n\n"}
    moved = next((line for key, line in place.items() if shape.startswith(key)), "\n")
    block = f"OBJECT\n{shape}\n" + FILLED.format(a=0.3).rstrip() + "\n" + moved
    text = view((0, 0, 20), (0, 0, 0)) + SKY + block
    agrees(measure(text, spp=1024), from_inside(0.3))


@pytest.mark.parametrize(
    ("camera", "absorption"),
    [((0, 0, 0), 3.0), ((0, 0, 1.5), 2.0), ((0, 0, 3), None), ((0, 0, -9), None)],
)
def test_the_innermost_object_counts(camera, absorption):
    """A filled ball in a larger one; clear glass in the larger one keeps what is around it."""
    x, y, z = camera
    text = f"CAMERA_POS\n{x} {y} {z}\n\nCAMERA_DIR\n0 0 -1\n\n" + "".join(
        f"OBJECT\nsphere 0 0 0 {r}\n" + FILLED.format(a=a) for r, a in ((2, 2.0), (1, 3.0))
    )
    text += "OBJECT\nsphere 0 0 0 1.8\nreflection reflection\n\n"
    found = scene(text)["sensor"].get("medium")
    if absorption is None:
        assert found is None
    else:
        assert coefficients(found)[1] == pytest.approx([absorption] * 3)


def test_fog_ends_at_clear_glass_around_the_camera():
    """Around a camera in a hollow ball there is no fog; beside it there is."""
    for place, inside in (("0 0 0 1", False), ("9 0 0 1", True)):
        text = f"\nOBJECT\nsphere {place}\nreflection reflection\n\n"
        found = scene(fog((1, 1, 1)) + "\nCAMERA_POS\n0 0 0\n\nCAMERA_DIR\n0 0 -1\n" + text)
        assert ("medium" in found["sensor"]) == inside


@pytest.mark.parametrize("shape", ["sphere 0 0 0 2", "objfile cube.obj"])
def test_the_dipole_is_simulated_around_the_camera(translated, tmp_path, shape):
    (tmp_path / "cube.obj").write_text(CUBE_FILE)
    for z, kind in ((0, "randomwalk"), (9, "dipole")):
        text = f"CAMERA_POS\n0 0 {z}\n\nCAMERA_DIR\n0 0 -1\n\nOBJECT\n{shape}\n"
        result = translated(
            text + "reflection Subsurface_Scattering\nBSSRDF\n1\nMATERIAL_SYMBOL\nMarble\n"
        )
        assert result.plan.integrator == kind
        noted = any("the camera is inside" in r.note for r in result.document.lines.all)
        assert noted == (z == 0)
