"""Camera rays against the formulas of the scene language, sections 5.1 to 5.5, in double precision.

Film coordinates: p from the left, q from the bottom, both in [0, 1]. Mitsuba computes rays in
single precision, so directions may be off by a few times 1e-7; 2e-6 is allowed.
"""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume import sensors  # noqa: F401  registers the screen camera
from relume.translator import camera, read_text, translate
from relume.translator.scene_values import to_mitsuba

TOLERANCE = 2e-6


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


def unit(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def film(side=9):
    """Film coordinates of a grid, corners included: arrays p and q."""
    grid = np.linspace(0, 1, side)
    return (x.ravel() for x in np.meshgrid(grid, grid))


def rays(text, dialect="manual", lens=(0.5, 0.5), p=None, q=None):
    """The sensor's plugin id, and origins and unit directions at film coordinates."""
    document = read_text(text, environ={})
    entry = camera.sensor(document, dialect)
    sensor = mi.load_dict(to_mitsuba(entry))
    p, q = film() if p is None else (p, q)
    position = mi.Point2f(mi.Float(p), mi.Float(1 - np.asarray(q)))
    aperture = mi.Point2f(*(mi.Float(np.broadcast_to(x, np.shape(p)).copy()) for x in lens))
    ray, weight = sensor.sample_ray(0.0, 0.5, position, aperture)
    assert dr.allclose(weight, 1)
    return entry["type"], np.array(ray.o).T, np.array(ray.d).T


def expected(origin, direction, up, width, height, distance):
    """c + D d + r W (p - 1/2) + u H (q - 1/2), section 5.1, with the effective width W."""
    d = unit(direction)
    r = unit(np.cross(d, up))
    u = unit(np.cross(r, d))
    p, q = film()
    across = width * (p - 0.5)[:, None] * r + height * (q - 0.5)[:, None] * u
    return np.broadcast_to(origin, across.shape), unit(distance * d + across)


def assert_rays(found, wanted):
    # Stock cameras start at the near plane, 1e-6 away; the screen camera has one origin for all.
    found = np.broadcast_to(found[0], wanted[0].shape), found[1]
    np.testing.assert_allclose(found[0], wanted[0], atol=2e-6 * (1 + np.abs(wanted[0]).max()))
    np.testing.assert_allclose(found[1], wanted[1], atol=TOLERANCE)


POSE = "CAMERA_POS\n1 2 3\nCAMERA_DIR\n2 -1 -3\nCAMERA_UPVEC\n0.1 2 0.3\n"


def test_defaults():
    """An empty file: SCREEN 30 30 40 at 320 x 240, so the screen proper is 40 wide."""
    kind, *found = rays("")
    assert kind == "perspective"
    wanted = expected((50, 52, 220), (0, -0.04, -1), (0, 1, 0), 40, 30, 40)
    assert_rays(found, wanted)


@pytest.mark.parametrize("image", [(100, 100), (320, 240), (64, 256)])
def test_pose(image):
    """Any direction and any up vector; the screen's width is multiplied by the aspect."""
    kind, *found = rays(POSE + f"IMAGE\n{image[0]} {image[1]}\nSCREEN\n20 20 10\n")
    assert kind == "perspective"
    width = 20 * image[0] / image[1]
    assert_rays(found, expected((1, 2, 3), (2, -1, -3), (0.1, 2, 0.3), width, 20, 10))


def test_pixels_that_are_not_square():
    """A screen whose width is not its height (one real file: 20 x 26.67)."""
    kind, *found = rays(POSE + "IMAGE\n320 240\nSCREEN\n20 26.67 40\n")
    assert kind == "screencamera"
    assert_rays(found, expected((1, 2, 3), (2, -1, -3), (0.1, 2, 0.3), 20 * 4 / 3, 26.67, 40))


@pytest.mark.parametrize(("dialect", "axis"), [("manual", "x"), ("prender", "y")])
@pytest.mark.parametrize("image", [(320, 240), (50, 100)])
def test_camera_angle(dialect, axis, image):
    """Decisions, row camera-angle: horizontal in the manual, vertical in the program."""
    text = POSE + f"IMAGE\n{image[0]} {image[1]}\nCAMERA_ANGLE\n70\nSCREEN\n10 20 30\n"
    _, *found = rays(text, dialect)
    size, aspect = 2 * math.tan(math.radians(35)), image[0] / image[1]
    width, height = (size, size / aspect) if axis == "x" else (size * aspect, size)
    assert_rays(found, expected((1, 2, 3), (2, -1, -3), (0.1, 2, 0.3), width, height, 1))


def test_target():
    """TARGET_POS replaces the direction, wherever it stands."""
    for text in ("TARGET_POS\n5 0 -4\n" + POSE, POSE + "TARGET_POS\n5 0 -4\n"):
        _, *found = rays(text)
        assert_rays(found, expected((1, 2, 3), (4, -2, -7), (0.1, 2, 0.3), 40, 30, 40))


def about(axis, degrees):
    """Right-handed rotation matrix by Rodrigues' formula."""
    k = np.cross(np.eye(3), np.eye(3)["xyz".index(axis)])
    a = math.radians(degrees)
    return np.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * k @ k


def test_rotations_are_right_handed():
    """A quarter turn about X takes Y to Z: what the reference of the next tests rests on."""
    np.testing.assert_allclose(about("x", 90) @ [0, 1, 0], [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(about("y", 90) @ [0, 0, 1], [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(about("z", 90) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_camera_matrix():
    """Rotations turn the direction, all lines in order move the position, up stays (5.3)."""
    text = POSE + "CAMERA_MATRIX\nrotation 10 20 30\ntranslate 1 0 -2\nrotation 0 -40 0\n\n"
    _, *found = rays(text)
    first = about("z", 30) @ about("y", 20) @ about("x", 10)
    second = about("y", -40)
    origin = second @ (first @ [1, 2, 3] + [1, 0, -2])
    direction = second @ first @ [2, -1, -3]
    assert_rays(found, expected(origin, direction, (0.1, 2, 0.3), 40, 30, 40))


def test_camera_matrix_with_target():
    """The matrix is applied after TARGET_POS; `scale` has no effect."""
    text = POSE + "TARGET_POS\n5 0 -4\nCAMERA_MATRIX\nscale 2 2 2\nrotation 0 90 0\n\n"
    _, *found = rays(text)
    turn = about("y", 90)
    wanted = expected(turn @ [1, 2, 3], turn @ [4, -2, -7], (0.1, 2, 0.3), 40, 30, 40)
    assert_rays(found, wanted)


@pytest.mark.parametrize(
    ("direction", "kind"),
    [((0, 0, -1), "thinlens"), ((0, 0, 2), "thinlens"), ((2, -1, -3), "screencamera")],
)
def test_lens(direction, kind):
    """Rays start on a disk of the lens's radius in the world's XY plane and meet where the ray of
    the pinhole reaches c + w |f / w_z| (5.5)."""
    words = " ".join(map(str, direction))
    text = f"CAMERA_POS\n1 2 3\nCAMERA_DIR\n{words}\nLENS\n2 50\n"
    random = np.random.default_rng(1)
    p, q = film()
    found_kind, o, d = rays(text, lens=random.random((2, len(p))), p=p, q=q)
    assert found_kind == kind
    center = np.array([1.0, 2.0, 3.0])
    _, pinhole = expected(center, direction, (0, 1, 0), 40, 30, 40)
    focus = center + pinhole * np.abs(50 / pinhole[:, 2:])
    lens = o - center
    # Stock cameras advance their rays by the near clip distance.
    np.testing.assert_allclose(lens[:, 2], 0, atol=1e-5)
    assert np.linalg.norm(lens, axis=1).max() <= 2 + 1e-5
    assert np.linalg.norm(lens, axis=1).max() > 1.5
    away = np.linalg.norm(np.cross(focus - o, d), axis=1)
    np.testing.assert_allclose(away, 0, atol=2e-6 * np.linalg.norm(focus - o, axis=1).max())


def test_a_lens_that_focuses_far_away():
    """Its rays are parallel to that of the pinhole, without numbers beyond single precision."""
    text = "CAMERA_POS\n0 0 9\nCAMERA_DIR\n0 0 -1\nLENS\n2 {}\n"
    points = np.array([0.1, 0.9]), np.array([0.3, 0.5])
    for focus in ("1e16", "-1e20", "1e30"):
        kind, _, d = rays(text.format(focus), lens=(0.2, 0.9), p=points[0], q=points[1])
        assert kind == "thinlens"
        _, _, pinhole = rays("CAMERA_POS\n0 0 9\nCAMERA_DIR\n0 0 -1\n", p=points[0], q=points[1])
        np.testing.assert_allclose(d, pinhole, atol=TOLERANCE)


def test_points_of_the_lens_are_uniform():
    """On a uniform disk r² has the mean R²/2 and the standard deviation R²/√12."""
    count = 4096
    grid = (np.arange(64) + 0.5) / 64
    lens = np.stack(np.meshgrid(grid, grid)).reshape(2, -1)
    middle = np.full(count, 0.5)
    for direction in ("0 0 -1", "2 -1 -3"):
        text = f"CAMERA_POS\n1 2 3\nCAMERA_DIR\n{direction}\nLENS\n2 50\n"
        _, o, _ = rays(text, lens=lens, p=middle, q=middle)
        squares = np.sum((o - [1, 2, 3]) ** 2, axis=1)
        assert squares.mean() == pytest.approx(2, rel=1e-3)  # a stratified grid, no noise
        assert squares.std() == pytest.approx(4 / math.sqrt(12), rel=1e-2)


@pytest.mark.parametrize("radius", ["0", "-1"])
def test_no_lens(radius):
    """A radius of 0 or less is a pinhole."""
    kind, *found = rays(POSE + f"LENS\n{radius} 50\n")
    assert kind == "perspective"
    assert_rays(found, expected((1, 2, 3), (2, -1, -3), (0.1, 2, 0.3), 40, 30, 40))


def test_clip_planes_are_out_of_reach():
    """The program has none: a ray starts within 1e-5 of the camera and has no end."""
    document = read_text("CAMERA_POS\n0 0 0\n", environ={})
    sensor = mi.load_dict(to_mitsuba(camera.sensor(document)))
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(0.1, 0.9), mi.Point2f(0.5))
    assert dr.all(dr.norm(ray.o) < 1e-5) and dr.all(ray.maxt > 1e11)


@pytest.mark.parametrize(("flag", "name", "radius"), [(0, "box", None), (1, "tent", 0.5)])
def test_film(flag, name, radius):
    """Size, filter and pixel format."""
    document = read_text(f"IMAGE\n64 48\ntentfilter\n{flag}\n", environ={})
    entry = camera.film(document)
    assert (entry["width"], entry["height"]) == (64, 48)
    assert entry["rfilter"]["type"] == name and entry["rfilter"].get("radius") == radius
    loaded = mi.load_dict(to_mitsuba(entry))
    assert list(loaded.size()) == [64, 48]


@pytest.mark.parametrize(
    ("lines", "direction", "code"),
    [
        ("TARGET_POS\n1 2 3\n", (0, 0, -1), "target-at-camera"),
        ("TARGET_POS\n1 2 3\nCAMERA_MATRIX\nrotation 0 90 0\n\n", (-1, 0, 0), "target-at-camera"),
        ("TARGET_POS\n1 2 3\nCAMERA_DIR\n1 0 0\n", (1, 0, 0), "target-at-camera"),
        ("TARGET_POS\n1 2 3\nCAMERA_DIR\n0 0 0\n", (0, 0, -1), "target-at-camera"),
        ("CAMERA_DIR\n0 0 0\n", (0, 0, -1), "direction-missing"),
        ("CAMERA_DIR\n0 0 0\nTARGET_POS\n1 2 9\n", (0, 0, 1), None),
        ("CAMERA_DIR\n1 0 0\nCAMERA_UPVEC\n0 0 0\n", (1, 0, 0), "up-missing"),
    ],
)
def test_directions_that_are_told_by_default(lines, direction, code):
    """A target at the camera, and vectors of length 0, have one plausible reading each."""
    document = read_text("CAMERA_POS\n1 2 3\n" + lines, environ={})
    found = translate(document)
    seen = camera.view(found.document)
    assert seen.direction == pytest.approx(direction, abs=1e-15)
    assert seen.up == pytest.approx((0, 1, 0))
    codes = {code: r.outcome for r in found.document.lines.all for code in r.codes}
    assert code is None or codes[code] == "approximated"
    assert len({"target-at-camera", "direction-missing", "up-missing"} & set(codes)) == bool(code)
