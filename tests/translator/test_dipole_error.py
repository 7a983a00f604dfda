"""Which objects are simulated because the dipole is far off, and what is told of it."""

import json
from pathlib import Path

import numpy as np
import pytest

from relume.loading import translated as loaded
from relume.options import RenderOptions
from relume.translator import read_text, translate
from relume.translator.dipole_error import (
    ALBEDOS,
    ETAS,
    LIGHT,
    RADII,
    DipoleError,
    ball_radius,
    dipole_error,
    mesh_radius,
    relative_error,
)
from relume.translator.media import HomogeneousMedium
from relume.translator.scene_values import Mesh

MAP = Path(__file__).parents[2] / "docs" / "subsurface" / "map.json"

CUBE = """v 0 0 0
v 1 0 0
v 0 1 0
v 1 1 0
v 0 0 1
v 1 0 1
v 0 1 1
v 1 1 1
f 1 3 4 2
f 5 6 8 7
f 1 2 6 5
f 3 7 8 4
f 1 5 7 3
f 2 4 8 6
"""
CODES = {"simulated-far-off", "simulated-with-another", "dipole-fits", "dipole-off"}


def thing(material="Marble", shape="sphere 0 0 0 1", lines=""):
    """An object whose lines do not tell how it is rendered."""
    return (
        f"OBJECT\n{shape}\ncolor 1 1 1\nreflection reflection\nreflection Subsurface_Scattering\n"
        f"MATERIAL_SYMBOL\n{material}\n{lines}\n"
    )


def told(translation):
    """Codes of the notes on how objects with subsurface scattering are rendered, in file order."""
    notes = (note for line in translation.document.lines.all for note in line.notes)
    return [note.code for note in notes if note.code in CODES]


# ---------------------------------- error and size ----------------------------------


def test_the_table_is_the_map():
    """It has what docs/subsurface/map.json has, in per cent; without scattering nothing is off."""
    rows = json.loads(MAP.read_text())
    cells = {(row["eta"], row["radius"], row["alpha"]): row["standard"] for row in rows}
    for i, eta in enumerate(ETAS):
        for j, radius in enumerate(RADII):
            assert LIGHT[i, j, 0] == 1
            for k, albedo in enumerate(ALBEDOS[1:], 1):
                assert LIGHT[i, j, k] == pytest.approx(cells[eta, radius, albedo], abs=0.0051)


def test_errors_between_the_measured_ones():
    """The table at its nodes, the mean halfway in each coordinate, its ends beyond them."""
    assert relative_error(10, 0.9, 1.3) == pytest.approx(LIGHT[1, 3, 5] - 1)
    halfway = relative_error(10 * 3**0.5, 1 - (0.1 * 0.05) ** 0.5, 1.4)
    assert halfway == pytest.approx(LIGHT[1:, 3:5, 5:7].mean() - 1, abs=1e-9)
    assert relative_error(np.inf, 1.0, 2.0) == pytest.approx(LIGHT[2, -1, -1] - 1)
    assert relative_error(0.3, 0.999, 0.5) == pytest.approx(LIGHT[0, 0, -1] - 1)
    assert relative_error(0.03, 0.999, 1.3) == pytest.approx((LIGHT[1, 0, -1] - 1) / 10)


@pytest.mark.parametrize(
    ("g", "radius", "measured"),
    [
        (0.5, 1, (0.51, 0.48, 0.47, 0.47, 0.47, 0.48)),
        (0.5, 10, (0.97, 0.86, 0.81, 0.79, 0.80, 0.84)),
        (0.5, 30, (1.09, 0.98, 0.92, 0.90, 0.89, 0.90)),
        (0.9, 0.3, (0.17, 0.16, 0.16, 0.16, 0.16, 0.16)),
        (0.9, 1, (0.32, 0.33, 0.34, 0.35, 0.36, 0.37)),
        (0.9, 3, (0.61, 0.57, 0.56, 0.57, 0.59, 0.62)),
        (0.9, 10, (0.90, 0.81, 0.77, 0.75, 0.76, 0.81)),
        (0.9, 30, (1.00, 0.92, 0.87, 0.85, 0.85, 0.87)),
        (0.9, 100, (1.04, 0.95, 0.91, 0.90, 0.90, 0.91)),
    ],
)
def test_scattering_ahead_leaves_less(g, radius, measured):
    """Within 0.07 of the light of balls of index 1.3, by the integrators as for the map."""
    for albedo, light in zip((0.8, 0.9, 0.95, 0.98, 0.99, 0.999), measured, strict=True):
        assert relative_error(radius, albedo, 1.3, g) + 1 == pytest.approx(light, abs=0.07)


def test_the_worst_channel_counts():
    """With similarity: g goes into the radius, and channels without scattering have no error."""
    medium = HomogeneousMedium((10.0, 10.0, 0.0), (0.1, 3.0, 1.0), (0.5, 0.9, 0.0))
    found = dipole_error(medium, 1.3, 2.0)
    errors = [relative_error(10.2, 5 / 5.1, 1.3, 0.5), relative_error(8.0, 0.25, 1.3, 0.9)]
    assert found.error == pytest.approx(max(errors, key=abs))
    assert found.radius == pytest.approx((10.2, 8.0)[int(np.argmax(np.abs(errors)))])
    assert found.mean_radius == pytest.approx((10.2 + 8.0) / 2)
    assert found.scatterings == pytest.approx(4 / 3 * 2 * 10)
    deep = HomogeneousMedium((10.0,) * 3, (0.1, 0.2, 0.4))
    assert dipole_error(deep, 1.3, 1e3).scatterings == pytest.approx(101)
    assert dipole_error(HomogeneousMedium((0.0,) * 3, (1.0,) * 3), 1.3, 2.0) is None
    assert dipole_error(HomogeneousMedium((1.0,) * 3, (0.0,) * 3, (1.0,) * 3), 1.3, 2.0) is None


def test_radii_of_balls():
    """Three times volume over surface, also of ellipsoids, whose surface is integrated here."""
    assert ball_radius(2.0, np.diag([3.0, 3.0, 3.0])) == pytest.approx(6)
    t, p = (np.arange(400) + 0.5) / 400 * np.pi, (np.arange(800) + 0.5) / 800 * 2 * np.pi
    t, p = np.meshgrid(t, p)
    a, b, c = 1.0, 2.0, 5.0
    n = [b * c * np.sin(t) * np.cos(p), a * c * np.sin(t) * np.sin(p), a * b * np.cos(t)]
    area = np.sum(np.sin(t) * np.sqrt(np.square(n).sum(axis=0))) * np.pi / 400 * 2 * np.pi / 800
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    expected = 3 * (4 / 3 * np.pi * a * b * c) / area
    assert ball_radius(1.0, turn @ np.diag([a, b, c])) == pytest.approx(expected, rel=0.011)


def test_radii_of_meshes():
    """A cube has that of the ball in it, wherever it is; a sheet 3/2 of its thickness; open ones
    have none."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    faces = np.array([[q[0], q[k], q[k + 1]] for q in quads for k in (1, 2)])
    for move in (0, 1e4):
        assert mesh_radius([Mesh(corners + move, faces)]) == pytest.approx(0.5)
        assert mesh_radius([Mesh(corners + move, faces[:, ::-1])]) == pytest.approx(0.5)
    assert mesh_radius([Mesh(corners, faces[:5]), Mesh(corners, faces[5:])]) == pytest.approx(0.5)
    sheet = Mesh(corners * [1000, 1000, 1], faces)
    assert mesh_radius([sheet]) == pytest.approx(1.5, rel=0.01)
    assert mesh_radius([Mesh(corners, faces[:11])]) == np.inf and mesh_radius([]) == np.inf


# ---------------------------------- the plan ----------------------------------


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("error", "radius", "mean_radius", "scatterings", "small", "avoided"),
    [
        (0.0995, 9, 9, 1, True, False),
        (0.1005, 9, 9, 1, False, True),
        (0.0, 9, 2.99, 1, True, True),
        (0.0, 2, 3.01, 1, True, False),
        (0.5, 9, 9, 199, False, True),
        (0.5, 9, 9, 201, False, False),
        (0.0, 1, 1, 201, True, False),
        (0.5, np.inf, np.inf, 1, False, False),
    ],
)
def test_the_rule(error, radius, mean_radius, scatterings, small, avoided, sign):
    """10 % in the worst channel, 3 mean free paths in the mean of them, 200 scatterings; no walks
    where there is no inside."""
    found = DipoleError(sign * error, radius, mean_radius, scatterings)
    assert (found.is_small, found.is_avoided) == (small, avoided)


SIMULATED, FITS, OFF = ("randomwalk", "simulated-far-off"), ("dipole", "dipole-fits"), (
    "dipole", "dipole-off",
)  # fmt: skip
SCENES = {
    "thin": (thing(), SIMULATED),
    "thick": (thing(shape="sphere 0 0 0 40"), FITS),
    "thick by MATERIAL_SCALE": (thing(lines="MATERIAL_SCALE\n40\n"), FITS),
    "thick by scale": (thing(lines="scale 40 40 40\n"), FITS),
    "thick but flattened": (thing(lines="scale 40 1 40\n"), SIMULATED),
    "thick and dark": (thing("Skin1", "sphere 0 0 0 40"), SIMULATED),
    "thick by lines after the symbol": (
        thing("Skin1", lines="SCATTERING\n0\n60 60 60\nABSORBING\n0\n0.1 0.1 0.1\n"), FITS,
    ),
    "dark by lines after the symbol": (
        thing(shape="sphere 0 0 0 40", lines="ABSORBING\n0\n0 0 2\n"), SIMULATED,
    ),
    "thin, asked for": (thing(lines="BSSRDF\n1\n"), OFF),
    "thin, with a search radius": (thing(lines="MATERIAL_R_MAX\n2\n"), OFF),
    "walks too long": (
        thing("Skin1", "sphere 0 0 0 3", "SCATTERING\n0\n90 90 90\nABSORBING\n0\n0.2 0.2 0.2\n"
              "PAHASE\n0.9\n"), OFF,
    ),
    "thick, asked for": (thing(shape="sphere 0 0 0 40", lines="BSSRDF\n1\n"), FITS),
    "level -1 says nothing": (thing(lines="level\n-1\n"), SIMULATED),
    "mesh": (thing(shape="objfile cube.obj"), SIMULATED),
    "scaled mesh": (thing(shape="objfile cube.obj", lines="scale 80 80 80\n"), FITS),
    "flattened mesh": (thing(shape="objfile cube.obj", lines="scale 80 80 1\n"), SIMULATED),
    "open mesh": (thing("Skin1", shape="objfile open.obj"), OFF),
    "dark plane": (thing("Skin1", shape="plane 0 0 0\nnormal 0 1 0"), OFF),
    "bright plane": (thing(shape="plane 0 0 0\nnormal 0 1 0"), FITS),
}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cube.obj").write_text(CUBE)
    (tmp_path / "open.obj").write_text(CUBE.rpartition("f ")[0])
    return tmp_path


@pytest.mark.parametrize("name", SCENES)
def test_which_way(folder, name):
    """An object whose lines do not tell is simulated where the dipole is off or no quicker."""
    text, (integrator, code) = SCENES[name]
    found = translate(read_text(text, environ={}), asset_path=[folder])
    assert (found.plan.integrator, told(found)) == (integrator, [code])


@pytest.mark.parametrize(
    ("text", "integrator", "codes"),
    [
        (thing() + thing(shape="sphere 99 0 0 40"), "randomwalk",
         ["simulated-far-off", "simulated-with-another"]),
        (thing(shape="sphere 99 0 0 40") + thing("Skin1"), "randomwalk",
         ["simulated-with-another", "simulated-far-off"]),
        (thing() + thing(shape="sphere 99 0 0 40", lines="BSSRDF\n1\n"), "dipole",
         ["dipole-off", "dipole-fits"]),
        (thing() + thing(shape="sphere 9 0 0 1", lines="level\n-2\n"), "dipole", ["dipole-off"]),
        (thing() + thing(shape="sphere 9 0 0 1", lines="BSSRDF\n0\n"), "randomwalk",
         ["simulated-with-another"]),
    ],
)  # fmt: skip
def test_several_objects(text, integrator, codes):
    """One integrator renders all: a line that asks decides, then the object that needs it."""
    found = translate(read_text(text, environ={}))
    assert (found.plan.integrator, told(found)) == (integrator, codes)


@pytest.mark.parametrize(
    ("lines", "another", "integrator", "codes"),
    [
        ("", "", "dipole", ["dipole-off"]),
        ("scale 80 80 80\n", "", "dipole", ["dipole-fits"]),
        ("level\n-2\n", "", "dipole", []),
        ("BSSRDF\n0\n", "", "randomwalk", []),
        ("", thing(), "randomwalk", ["simulated-far-off"] * 2),
        ("scale 80 80 80\n", thing(), "randomwalk",
         ["simulated-with-another", "simulated-far-off"]),
    ],
)  # fmt: skip
def test_materials_of_mesh_files(folder, lines, another, integrator, codes):
    """The notes on a material that scatters by its code stand at the object's line; it is left to
    the dipole unless another object needs the simulation."""
    obj = (folder / "cube.obj").read_text()
    (folder / "cube.obj").write_text("mtllib wax.mtl\nusemtl wax\n" + obj)
    (folder / "wax.mtl").write_text("newmtl wax\nKd 1 1 1\nKs 1 1 1\nNi 1.3\n#REFLECTION 6\n")
    text = f"OBJECT\nobjfile cube.obj\nMATERIAL_SYMBOL\nMarble\n{lines}\n"
    found = translate(read_text(text + another, environ={}), asset_path=[folder])
    assert (found.plan.integrator, told(found)) == (integrator, codes)
    old = translate(read_text(text + another, environ={}), "prender", [folder])
    assert told(old) == []


def test_who_asks_for_the_dipole_has_it():
    """`level` -2, an environment variable, and the dialect of the program's pictures."""
    found = translate(read_text(thing(lines="level\n-2\n"), environ={}))
    assert (found.plan.integrator, told(found)) == ("dipole", [])
    for value, kind in (("1", "dipole"), ("0", "randomwalk")):
        found = translate(read_text(thing(), environ={"USE_BSSRDF": value}))
        assert found.plan.integrator == kind
    found = translate(read_text("luminance_cutoff\n0\n" + thing(), environ={}), "prender")
    assert (found.plan.integrator, told(found)) == ("dipole", [])
    assert found.scene["integrator"]["profile"] == "directional"


@pytest.mark.parametrize("name", ["thin", "thick", "thin, asked for", "scaled mesh"])
@pytest.mark.parametrize("integrator", ["dipole", "randomwalk"])
def test_the_integrator_that_is_asked_for_goes_over_all(folder, name, integrator):
    """The scene is translated for it, whatever the file or the plan would have."""
    document = read_text(SCENES[name][0], environ={})
    before = [(block.bssrdf, block.lines.is_set("bssrdf")) for block in document.objects]
    found = loaded(document, RenderOptions(integrator=integrator, asset_path=[folder]))
    assert found.plan.integrator == integrator
    assert before == [(block.bssrdf, block.lines.is_set("bssrdf")) for block in document.objects]


def test_notes_have_figures():
    """How far off, with its sign, and the size in mean free paths of that channel."""
    medium = "SCATTERING\n0\n9 9 9\nABSORBING\n0\n1 1 1\nrefractive_index 1.3\n"
    found = translate(read_text(thing(lines=medium + "MATERIAL_SCALE\n0.3\n"), environ={}))
    percent = round(100 * (1 - LIGHT[1, 2, 5]))
    text = f"the dipole would be {percent} % too dark in a body of 3 mean free paths"
    assert any(text in line.note for line in found.document.lines.all)
