"""Pictures of the surroundings: where their texels are seen, and what a dome becomes.

Six texels of their own colours are put where the tables of sections 11.5 and 11.6 say, transcribed
here, that six directions near the axes are; six cameras must see each where its direction points.
The directions are off the axes, so a mirrored picture does not pass.
"""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.translator import environment_maps

AXES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
OFF = np.array(
    [[0, 0.3, 0.2], [0, 0.25, -0.3], [0.3, 0, 0.2], [-0.3, 0, 0.25], [0.2, 0.3, 0], [-0.3, 0.25, 0]]
)
DIRECTIONS = (AXES + OFF) / np.linalg.norm(AXES + OFF, axis=1, keepdims=True)
COLORS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]]) * 200
SIZE = 90
TOLERANCE = 5.0  # degrees: a texel of the light probe is up to 4 degrees wide
PIXELS = 41


def turn(y, x):
    return math.atan2(y, x) / (2 * math.pi) % 1


def probe(x, y, z):
    rho = math.acos(z) / (math.pi * math.hypot(x, y))
    return 0.5 + 0.5 * x * rho, 0.5 + 0.5 * y * rho


MAPS = {
    "": lambda x, y, z: (math.acos(z) / math.pi, turn(y, x)),
    "panoramic_map": lambda x, y, z: (
        0.5 * (1 + math.atan2(x, -z) / math.pi),
        1 - math.acos(y) / math.pi,
    ),
    "angular_map": lambda x, y, z: probe(x, y, -z),
    "angular_map, prender": probe,
    "equirectangular_map": lambda x, y, z: (
        (math.atan2(z, x) + math.pi) / (2 * math.pi),
        0.5 - math.asin(y) / math.pi,
    ),
    "hemisphere_map": lambda x, y, z: (0.5 * (1 + z), 0.5 * (1 + x)),
}
"""(u, v) of a direction, v from the bottom, for each flag."""


def legacy(u, v):
    """Column, and row from the bottom."""
    return math.floor((SIZE - 1) * u), math.floor((SIZE - 1) * v)


def picture(place):
    """Bytes of a picture with the six texels at (column, row from the bottom) = place(x, y, z)."""
    pixels = np.zeros((SIZE, SIZE, 3), np.uint8)
    for n, color in zip(DIRECTIONS, COLORS, strict=True):
        column, row = place(*n)
        pixels[SIZE - 1 - row, column] = color
    return pixels


@pytest.fixture
def seen(view, load, translated):
    """Directions (6, 3) in which cameras at `eye` see the six colours, NaN where they do not."""

    def run(text, dialect="manual", eye=(0, 0, 0), directions=DIRECTIONS):
        found = []
        scene = load(view(eye, np.add(eye, AXES[0])) + text, dialect)
        for k, n in enumerate(directions):
            axis = np.round(n / np.abs(n).max())
            axis[np.argsort(-np.abs(n))[1:]] = 0
            up = np.array([0, 0, 1.0]) if axis[1] else np.array([0, 1.0, 0])
            camera = view(eye, np.add(eye, axis), width=1.2, size=(PIXELS, PIXELS), up=up)
            sensor = mi.load_dict(translated(camera).dictionary()["sensor"])
            image = np.array(mi.render(scene, sensor=sensor, spp=16))
            color = COLORS[k] / COLORS[k].max()
            # Pure: all in the colour's channels, and alike there.
            match = np.min(image[..., color > 0], axis=-1) - np.max(
                image[..., color == 0], axis=-1, initial=0
            )
            match = np.clip(match, 0, None)
            if match.max() < 0.02:
                found.append([np.nan] * 3)
                continue
            rows, columns = np.mgrid[0:PIXELS, 0:PIXELS]
            x = (np.average(columns, weights=match) + 0.5) / PIXELS - 0.5
            y = 0.5 - (np.average(rows, weights=match) + 0.5) / PIXELS
            right = np.cross(axis, up)
            d = axis + 1.2 * (x * right + y * up)
            found.append(d / np.linalg.norm(d))
        return np.array(found)

    return run


def degrees_apart(a, b):
    return np.degrees(np.arccos(np.clip(np.sum(a * b, axis=-1), -1, 1)))


BALL = "\nOBJECT\nsphere 0 -4 0 1\ncolor 0 0 0\nreflection diffuse\n"
"""Tells how large the scene is: about 5 units, of which 50 times is far."""


def dome(flag, radius, shape="sphere"):
    line = f"{flag.split(',')[0]} 1\n" if flag else ""
    text = f"OBJECT\n{shape} 0 0 0 {radius}\ncolor 0 0 0\nreflection diffuse\n{line}"
    return f"{text}ibl_texture sky.png\nnormal -1\n{BALL}"


@pytest.mark.parametrize("radius", [100, 10000])
@pytest.mark.parametrize("flag", [name for name in MAPS if name != "hemisphere_map"])
def test_spheres(seen, write_picture, monkeypatch, flag, radius):
    """Each map on a near dome, looked up where the ray hits, and on a far one, made a map."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 180)
    write_picture("sky.png", picture(lambda *n: legacy(*MAPS[flag](*n))))
    dialect = "prender" if "prender" in flag else "manual"
    found = seen(dome(flag, radius), dialect)
    assert np.all(degrees_apart(found, DIRECTIONS) < TOLERANCE), found


@pytest.mark.parametrize("radius", [100, 10000])
def test_hemisphere_map(seen, write_picture, monkeypatch, radius):
    """The dome from above: +Y at the centre, +Z right, +X up; nothing below the horizon."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 180)
    above = DIRECTIONS[:, 1] > 0
    shown = picture(lambda *n: legacy(*MAPS["hemisphere_map"](*n)))
    # The direction below the horizon would light up a texel above it.
    shown[(shown == COLORS[3]).all(axis=2)] = 0
    write_picture("sky.png", shown)
    found = seen(dome("hemisphere_map", radius, "hemisphere"))
    assert np.all(degrees_apart(found[above], DIRECTIONS[above]) < TOLERANCE), found
    assert np.all(np.isnan(found[~above]))


@pytest.mark.parametrize("radius", [100, 10000])
def test_hemisphere_is_black_below(load, view, write_picture, monkeypatch, radius):
    """A white hemisphere shines above the horizon alone."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 180)
    write_picture("sky.png", np.full((4, 4, 3), 255))
    for y, expected in ((0.2, 1), (-0.2, 0)):
        text = view((0, 0, 0), (1, y, 1)) + dome("hemisphere_map", radius, "hemisphere")
        assert np.allclose(mi.render(load(text), spp=4), expected, atol=1e-3)


def test_lookup_by_hit_point(seen, write_picture):
    """Near domes keep their parallax: from an eye off the centre a texel is at centre + R n."""
    write_picture("sky.png", picture(lambda *n: legacy(*MAPS["panoramic_map"](*n))))
    eye = np.array([10.0, 20.0, -15.0])
    text = dome("panoramic_map", 100).replace("sphere 0 0 0", "sphere 3 0 0", 1)
    towards = np.array([3.0, 0, 0]) + 100 * DIRECTIONS - eye
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    found = seen(text, eye=eye, directions=towards)
    assert np.all(degrees_apart(found, towards) < TOLERANCE)
    assert degrees_apart(towards, DIRECTIONS).max() > 2 * TOLERANCE


def inverse_background(coefficients):
    """Row and column at which section 11.6 finds a direction."""
    a, b, c, d = coefficients

    def place(x, y, z):
        theta, phi = math.acos(z), math.atan2(y, x) % (2 * math.pi)
        theta = abs(math.fmod(a * theta + b, math.pi))
        phi = math.fmod(c * phi + d, 2 * math.pi)
        phi += 2 * math.pi * (phi < 0)
        return int(SIZE * phi / (2 * math.pi)) % SIZE, int(SIZE * theta / math.pi) % SIZE

    return place


@pytest.mark.parametrize("coefficients", [(1, 0, 1, 0), (-1, 0, 1, 1.5), (1, 0, -1, -0.5)])
def test_background_texture(seen, write_picture, monkeypatch, coefficients):
    """Polar axis +Z at the bottom row, column 0 towards +X, turned by map_coef."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 180)
    write_picture("sky.png", picture(inverse_background(coefficients)))
    line = "map_coef " + " ".join(map(str, coefficients))
    found = seen(f"background_texture sky.png\n{line}\ncoef 2\n{BALL}")
    assert np.all(degrees_apart(found, DIRECTIONS) < TOLERANCE), found


@pytest.fixture
def outcome(translated, write_picture, monkeypatch):
    """Plugin that a dome becomes, and the report of its line."""

    def run(text, dialect="manual"):
        monkeypatch.setattr(environment_maps, "MAP_ROWS", 16)
        write_picture("sky.png", np.full((8, 16, 3), 100))
        result = translated("CAMERA_POS\n0 0 0\n\n" + text, dialect)
        kinds = [e.get("emitter", e)["type"] for e in result.scene.values() if isinstance(e, dict)]
        kinds = [k for k in kinds if k in ("ibldome", "envmap")]
        report = next(r for r in result.document.lines.all if r.keyword == "ibl_texture")
        return kinds, report

    return run


def test_far_domes_become_maps(outcome):
    """Where looking up by direction is off by less than 0.1 degree, which is told.

    From a point at the distance e of the centre of the dome of radius R it is off by asin(e / R):
    the far corner of the ball's box, (1, 5, 1), has e = 5.2.
    """
    for radius in (100, 2900):
        kinds, report = outcome(dome("panoramic_map", radius))
        assert kinds == ["ibldome"]
        assert "ibl-lookup" in report.note
    kinds, report = outcome(dome("panoramic_map", 3000))
    assert (kinds, report.outcome) == (["envmap"], "translated")
    assert "at most 0.099 degrees off" in report.note


@pytest.mark.parametrize("center", ["0 -800 0", "300 0 -741"])
def test_domes_off_their_centre_stay(outcome, center):
    """What counts is the distance from the dome's centre, not the size of the scene."""
    text = dome("panoramic_map", 16005)
    assert outcome(text)[0] == ["envmap"]
    assert outcome(text.replace("sphere 0 0 0 16005", f"sphere {center} 16005"))[0] == ["ibldome"]


def test_domes_over_infinite_planes_stay(outcome):
    """The plane reaches the dome: what it reflects there is far off."""
    floor = "OBJECT\nplane 0 -3 0\nnormal 0 1 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    assert outcome(floor + dome("panoramic_map", 16005))[0] == ["ibldome"]


def test_meshes_count_where_a_hemisphere_is_the_dome(outcome, tmp_path):
    """A far corner of a mesh is as far from the dome's centre as that of a ball."""
    (tmp_path / "far.obj").write_text("v 0 0 0\nv 40 0 0\nv 0 0 40\nf 1 2 3\n")
    mesh = "OBJECT\nobjfile far.obj\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    text = dome("panoramic_map", 16005).replace("sphere 0 0 0 16005", "hemisphere 0 0 0 16005")
    text = text.replace(BALL, "\n")
    assert outcome(text)[0] == ["envmap"]
    assert outcome(mesh + text)[0] == ["ibldome"]


def test_rows_of_environment_maps_lie_from_pole_to_pole():
    """Where the picture's rows meet, the map changes, to a sixth of its own row: 0.03 degrees.

    A panorama of 101 rows has its rows' borders at 1.8 k degrees, by floor(100 v).
    """
    mi.set_variant("llvm_ad_rgb")
    rows = np.arange(101, dtype=np.float32)
    pixels = np.repeat(np.repeat(rows[:, None, None], 8, 1), 3, 2)
    found = environment_maps.resample(pixels, "panoramic")
    light = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(found)})
    borders = np.radians(1.8 * np.concatenate([np.arange(1, 9), np.arange(92, 100)]))
    off = np.linspace(-0.5, 0.5, 501)
    theta = np.float32(borders[:, None] + np.radians(off)).ravel()
    si = dr.zeros(mi.SurfaceInteraction3f, len(theta))
    si.wi = -mi.Vector3f(mi.Float(np.sin(theta)), mi.Float(np.cos(theta)), 0)
    seen = np.array(light.eval(si))[0].reshape(len(borders), -1)
    low, high = seen[:, :1], seen[:, -1:]
    where = off[np.argmax(seen >= (low + high) / 2, axis=1)]
    top, bottom = where[:8].mean(), where[8:].mean()
    assert abs(top) < 0.03 and abs(bottom) < 0.03, (top, bottom)


def test_domes_elsewhere_stay(outcome):
    """A ball that shines and does not hold the camera is no surrounding, however far."""
    text = dome("panoramic_map", 100).replace("sphere 0 0 0 100", "sphere 30000 0 0 20000")
    assert outcome(text)[0] == ["ibldome"]


@pytest.mark.false_alarms(1e-3)
def test_infinity_light_passes(measure, view, agrees, outcome):
    """The sun shines through the dome: rho emission cos + rho dome radiance on the floor."""
    sun = "OBJECT\ninfinity_light 0 -1 0\nemission 2 2 2\ncolor 0 0 0\nreflection diffuse\n\n"
    text = sun + dome("panoramic_map", 100)
    kinds, report = outcome(text)
    assert (kinds, report.outcome) == (["ibldome"], "translated")
    floor = "OBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    text = view((1, 3, 0), (0, 0, 0)) + text.replace(BALL, "\n") + floor
    agrees(measure(text, spp=1024), 0.5 * 2 + 0.5 * 100 / 255)


@pytest.mark.false_alarms(1e-3)
def test_dome_furnace(measure, view, agrees, write_picture, monkeypatch):
    """In a dome of radiance 3 x 100 / 255 a convex ball shows rho times that, near or far."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 16)
    write_picture("sky.png", np.full((8, 16, 3), 100))
    for radius in (100, 100000):
        text = view((0, 0, 0), (0, -4, 0), up=(0, 0, 1)) + dome("angular_map", radius)
        text = text.replace("normal -1\n", "ibl_texture_coef 3\n").replace(
            "color 0 0 0\nreflection diffuse\n", "color 0.5 0.5 0.5\nreflection diffuse\n"
        )
        agrees(measure(text), 0.5 * 3 * 100 / 255, of=2)


@pytest.mark.parametrize("shape", ["uvplane", "mesh"])
def test_shining_pictures(load, view, write_picture, tmp_path, shape):
    """On planes and meshes the picture shines by its own coordinates, to both sides.

    The last column and the top row are never met (section 11.1): 3 x 3 bytes show 2 x 2.
    """
    pixels = np.arange(20, 20 + 27 * 8, 8).reshape(3, 3, 3)
    write_picture("sky.png", pixels)
    mesh = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (tmp_path / "quad.obj").write_text(f"{mesh}f 1/1 2/2 3/3 4/4\n")
    lines = "uvplane -1 -1 0\nU 2 0 0\nV 0 2 0\n" if shape == "uvplane" else "objfile quad.obj\n"
    text = f"OBJECT\n{lines}color 0 0 0\nreflection diffuse\nibl_texture sky.png\n"
    text += "ibl_texture_coef 2\n"
    for u, v in ((0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)):
        column, row = math.floor(2 * u), math.floor(2 * v)
        expected = 2 * pixels[2 - row, column] / 255
        for side in (1, -1):
            at = (2 * u - 1, 2 * v - 1, 0)
            image = mi.render(load(view((at[0], at[1], 3 * side), at) + text), spp=2)
            assert np.allclose(image, expected, rtol=1e-5), (u, v, side)


CATCHER = "OBJECT\nuvplane -20 0 -20\nU 0 0 40\nV 40 0 0\ncolor 0.5 0.4 0.3\nshadow 1\n\n"


def test_shadow_is_for_image_based_light_alone(translated, write_picture):
    """Without it the line is ignored, and no scene pays for the integrator of catchers."""
    write_picture("sky.png", np.full((4, 4, 3), 255))
    plan = translated(CATCHER + dome("panoramic_map", 100)).plan
    assert {"shadowcatcher", "shadowcatching"} <= set(plan.plugins)
    translation = translated(CATCHER + "BACKGROUND\n1 1 1\n")
    assert translation.plan.plugins == ("surfacepath",)
    report = next(r for r in translation.document.lines.all if r.keyword == "shadow")
    assert report.outcome == "ignored"


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("radius", [100, 10000])
def test_shadow_of_a_disk(measure, view, agrees, write_picture, monkeypatch, radius):
    """Below the middle of a black disk of radius 1 at height 2 the share 1 / (1 + 4) is hidden.

    The catcher lets the rest of the sky behind it through; what its own dark side would show of the
    disk is black.
    """
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 16)
    write_picture("sky.png", np.full((4, 4, 3), 255))
    disk = "OBJECT\ndisk 0 2 0 1\nnormal 0 -1 0\ncolor 0 0 0\nreflection diffuse\n\n"
    text = view((3, 1, 0), (0, 0, 0)) + CATCHER + disk + dome("panoramic_map", radius)
    agrees(measure(text.replace(BALL, "\n"), spp=2048), 0.8)
