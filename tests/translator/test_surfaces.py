"""Shapes as Mitsuba gets them: infinite planes, ellipsoids and their coordinates."""

import mitsuba as mi
import numpy as np
import pytest

LEVEL = "SCREEN\n1 1 1\n\nCAMERA_POS\n0 {height} 0\n\nCAMERA_DIR\n0 0 -1\n\n"
FLOOR = "OBJECT\nplane 0 0 0\nnormal 0 1 0\nemission 1 1 1\ncolor 0 0 0\nreflection diffuse\n\n"
CEILING = FLOOR.replace("plane 0 0 0", "plane 0 9 0")
BALL = "OBJECT\nsphere 50 1 -9 1\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"


def rows(scene):
    """Mean of each row of a picture, from the top."""
    return np.array(mi.render(scene, spp=64)).mean(axis=(1, 2))


@pytest.mark.parametrize("height, around", [(3, ""), (1e4, ""), (0.01, BALL), (3, BALL)])
def test_a_floor_begins_at_the_horizon(load, height, around):
    """Of 240 rows the lower half, whatever the height of the camera."""
    seen = rows(load("IMAGE\n4 240\n\n" + LEVEL.format(height=height) + FLOOR + around))
    assert np.all(seen[:119] < 1e-3) or around
    assert seen[119] < 1e-3 and np.allclose(seen[120:122], 1, atol=2e-2)


def test_floor_and_ceiling_leave_no_band(load):
    seen = rows(load("IMAGE\n4 240\n\n" + LEVEL.format(height=3) + FLOOR + CEILING))
    assert np.allclose(seen, 1, atol=2e-2)


def test_a_leaning_plane_reaches_its_horizon(load):
    """One whose normal leans to the side fills half of a square picture."""
    leaning = FLOOR.replace("normal 0 1 0", "normal 1 1.7320508 0")
    scene = load("IMAGE\n64 64\n\n" + LEVEL.format(height=3) + leaning)
    assert np.array(mi.render(scene, spp=256)).mean() == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("height", [0.01, 1, 1e3])
def test_points_on_planes_are_exact_near_by(load, height):
    """Hits around a low camera in a wide scene: off the plane by some 1e-7 of their distance."""
    lamp = "OBJECT\nsphere 0 9e3 0 1\nemission 1 1 1\ncolor 0 0 0\nreflection diffuse\n\n"
    scene = load(LEVEL.format(height=height) + FLOOR + lamp)
    o = np.array(scene.sensors()[0].world_transform().matrix).reshape(4, 4)[:3, 3]
    d = np.random.default_rng(1).normal(size=(3, 20000))
    d /= np.linalg.norm(d, axis=0)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(*o.tolist()), mi.Vector3f(*map(mi.Float, d))))
    below = np.array(si.is_valid()) & (d[1] < -1e-3)
    assert below.sum() == (d[1] < -1e-3).sum()
    y, t = np.array(si.p)[1][below], np.array(si.t)[below]
    exact = o[1] + d[1][below] * t
    assert np.ptp(y) < 1e-3 * height or np.all(np.abs(y - np.median(y)) < 1e-6 * t)
    assert np.all(np.abs(exact - y) < 1e-5 * t)


@pytest.mark.parametrize(
    ("lines", "told"),
    [("", 0), ("scale 3 3 3\n", 0), ("translate 1 2 3\n", 0), ("rotation 0 0 90\n", 1),
     ("rotation 0 40 0\nscale 2 2 2\n", 1), ("scale -1 1 1\n", 1), ("scale 2 2 1\n", 0)],
)  # fmt: skip
def test_a_picture_that_does_not_turn_is_told(translated, write_picture, lines, told):
    """It lies as it does without the rotation; an ellipsoid's turns with it."""
    write_picture("map.png", np.zeros((4, 4, 3)))
    ball = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection diffuse\n"
    for picture in ("texture map.png\n", "bump_texture map.png\n", ""):
        reports = translated(ball + picture + lines).document.lines.all
        found = [report.keyword for report in reports if "picture-not-turned" in report.codes]
        assert found == picture.split()[:1] * told


@pytest.mark.parametrize("scale", ["2 2.0001 2", "2 1 0.5", "-1 2 1"])
@pytest.mark.parametrize("rotation", ["0 0 0", "30 0 70"])
def test_ellipsoids_have_the_coordinates_of_spheres(load, write_picture, scale, rotation):
    """Texels of a sphere scaled unevenly: u = phi / 2 pi around +Z from +X, v = theta / pi.

    Points of the unit sphere are carried to the ellipsoid, and looked up there; points close to the
    borders of texels are left out.
    """
    size = 16
    pixels = np.zeros((size + 1, size + 1, 3))
    pixels[..., 0], pixels[..., 1] = np.meshgrid(np.arange(size + 1), np.arange(size + 1)[::-1])
    write_picture("map.png", pixels * 10)
    scene = load(
        "CAMERA_POS\n0 0 20\n\nTARGET_POS\n0 0 0\n\nOBJECT\nsphere 0 0 0 1\ncolor 1 1 1\n"
        f"texture map.png\nreflection diffuse\nscale {scale}\nrotation {rotation}\n"
    )
    turn = mi.ScalarTransform4f()
    for axis, angle in zip(np.eye(3).tolist(), map(float, rotation.split()), strict=True):
        turn = mi.ScalarTransform4f().rotate(axis, angle) @ turn
    linear = np.array(turn.matrix)[:3, :3] @ np.diag([float(x) for x in scale.split()])
    u, v = np.random.default_rng(2).random((2, 4000))
    phi, theta = 2 * np.pi * u, np.pi * v
    p = linear @ [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    ray = mi.Ray3f(mi.Point3f(*map(mi.Float, 5 * p)), mi.Vector3f(*map(mi.Float, -p)))
    si = scene.ray_intersect(ray)
    seen = np.array(si.bsdf().eval_diffuse_reflectance(si))[:2] * 255 / 10
    column, row = np.floor(size * u), np.floor(size * v)
    apart = np.minimum(np.abs(size * u - np.round(size * u)), np.abs(size * v - np.round(size * v)))
    inside = (apart > 0.05) & np.array(si.is_valid())
    assert inside.sum() > 2000
    np.testing.assert_allclose(seen[0][inside], column[inside], atol=0.1)
    np.testing.assert_allclose(seen[1][inside], row[inside], atol=0.1)
