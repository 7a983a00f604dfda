"""The maps of image-based lights: formulas, orientation, parallax and the envmap of an image."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.emitters.dome_sampling import MAPS, cell_solid_angles
from relume.translator import environment_maps

# Near each axis, but on no boundary of a texel.
NEAR_AXES = np.array(
    [
        [1, 0.11, 0.2],
        [-1, 0.13, 0.2],
        [0.2, 1, 0.11],
        [0.2, -1, 0.13],
        [0.2, 0.11, 1],
        [0.2, 0.13, -1],
    ]
)
NEAR_AXES /= np.linalg.norm(NEAR_AXES, axis=1, keepdims=True)


def section_11_5(name, n):
    """The table of section 11.5, written out in float64: n (3, k) -> u, v from the bottom left."""
    x, y, z = n
    phi = np.arctan2(y, x) % (2 * np.pi)
    if name == "transposed":
        return np.arccos(z) / np.pi, phi / (2 * np.pi)
    if name == "panoramic":
        return 0.5 * (1 + np.arctan2(x, -z) / np.pi), 1 - np.arccos(y) / np.pi
    if name == "equirectangular":
        return (np.arctan2(z, x) + np.pi) / (2 * np.pi), 0.5 - np.arcsin(y) / np.pi
    if name == "hemisphere":
        return 0.5 * (1 + z), 0.5 * (1 + x)
    front = {"angular": -z, "angular_mirrored": z}[name]
    rho = np.arccos(front) / (np.pi * np.hypot(x, y))
    return 0.5 + 0.5 * x * rho, 0.5 + 0.5 * y * rho


def lookup(name, n, height, width):
    """Row from the top and column of the nearest texel."""
    u, v = section_11_5(name, np.asarray(n, dtype=np.float64))
    column = np.floor((width - 1) * u).astype(int)
    return height - 1 - np.floor((height - 1) * v).astype(int), column


@pytest.mark.parametrize("name", MAPS)
def test_one_bright_texel_in_six_directions(name, dome, camera):
    """Six cameras on the axes find each of six coloured texels where the formula puts it.

    Every camera looks along an axis from the centre of the dome; the mean direction of the pixels
    of each brightness lies within a texel of the direction that the texel was chosen for. The
    orthographic map shows its image above the centre, also for directions below.
    """
    height, width = 61, 91
    image = np.zeros((height, width, 3), dtype=np.float32)
    for brightness, n in enumerate(NEAR_AXES, start=1):
        image[lookup(name, n, height, width)] = brightness
    upper_only = name == "hemisphere"
    faces = np.repeat(np.eye(3), 2, axis=0) * np.tile([1, -1], 3)[:, None]
    scene = {"type": "scene", "dome": dome(image, (0, 0, 0), map=name, hemisphere=upper_only)}
    for i, axis in enumerate(faces):
        up = (0, 0, 1) if i in (2, 3) else (0, 1, 0)
        scene[f"camera{i}"] = camera((0, 0, 0), axis, size=128, up=up)
    scene = mi.load_dict(scene)
    path = mi.load_dict({"type": "path", "max_depth": 1})
    seen = {}
    for i, axis in enumerate(faces):
        picture = np.array(mi.render(scene, sensor=i, spp=1, integrator=path))[..., 0]
        up = np.array((0, 0, 1) if i in (2, 3) else (0, 1, 0))
        left = np.cross(up, axis)
        c = 1 - (np.arange(128) + 0.5) / 64  # picture plane at distance 1, from top and left
        rays = axis + c[None, :, None] * left + c[:, None, None] * up
        rays /= np.linalg.norm(rays, axis=2, keepdims=True)
        for brightness in np.unique(picture[picture > 0]):
            seen.setdefault(round(float(brightness)), []).append(rays[picture == brightness])
    expected = dict(enumerate(NEAR_AXES.copy(), start=1))
    if upper_only:
        expected[4][1] *= -1
    assert seen.keys() == expected.keys()
    for brightness, n in expected.items():
        where = np.concatenate(seen[brightness])
        assert np.degrees(np.arccos(where @ n)).min() < 1.0
        mean = where.mean(axis=0)
        assert np.degrees(np.arccos(n @ mean / np.linalg.norm(mean))) < 8.0


@pytest.mark.parametrize("name", MAPS)
def test_every_direction_meets_the_nearest_texel(name, dome, random_image, random_directions):
    """Radiance at 20000 points of the dome against float64; only texel edges may differ (0.2 %)."""
    image = random_image()
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map=name, scale=2.0)})
    n = random_directions(20000)
    si = dr.zeros(mi.SurfaceInteraction3f, n.shape[1])
    si.p = mi.Point3f((5.0 * n + [[0.3], [0.4], [0.5]]).astype(np.float32))
    value = np.array(scene.emitters()[0].eval(si)).T
    row, column = lookup(name, n, *image.shape[:2])
    wrong = np.any(np.abs(value - 2.0 * image[row, column]) > 1e-6, axis=1)
    assert wrong.mean() < 2e-3


def test_hemisphere_is_dark_below_the_centre(dome):
    """With `hemisphere` only points at or above the height of the centre shine."""
    image = np.ones((4, 8, 3))
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map="panoramic", hemisphere=True)})
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.p = mi.Point3f([0.3, 0.3], [0.4 + 3, 0.4 - 3], [4.5, 4.5])
    np.testing.assert_array_equal(np.array(scene.emitters()[0].eval(si))[0], [1, 0])


def test_parallax(dome, camera):
    """Off centre, a texel is seen towards its point on the sphere, not along its direction."""
    image = np.zeros((61, 91, 3))
    n = NEAR_AXES[0]
    image[lookup("panoramic", n, 61, 91)] = 1.0
    eye = np.array([2.0, 2.0, -1.0])
    scene = mi.load_dict(
        {
            "type": "scene",
            "dome": dome(image, (0, 0, 0), map="panoramic"),
            "at_the_point": camera(eye, 5.0 * n, fov=0.1),
            "along_the_direction": camera(eye, eye + n, fov=0.1),
        }
    )
    path = mi.load_dict({"type": "path", "max_depth": 1})
    point, direction = (
        np.array(mi.render(scene, sensor=i, spp=1, integrator=path)) for i in (0, 1)
    )
    assert point.min() == 1.0
    assert direction.max() == 0.0


def test_data_has_gradients(dome, random_image):
    """d radiance / d texel is the scale at the texel looked up, and 0 elsewhere."""
    image = random_image(shape=(5, 9, 3))
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map="panoramic", scale=2.0)})
    params = mi.traverse(scene)
    dr.enable_grad(params["dome.emitter.data"])
    params.update()
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = mi.Point3f(*(5.0 * NEAR_AXES[0] + [0.3, 0.4, 0.5]).tolist())
    dr.backward(scene.emitters()[0].eval(si).x)
    expected = np.zeros((5, 9, 3))
    expected[(*lookup("panoramic", NEAR_AXES[0], 5, 9), 0)] = 2.0
    np.testing.assert_allclose(np.array(dr.grad(params["dome.emitter.data"])), expected)


@pytest.mark.parametrize("name", MAPS)
def test_solid_angles(name):
    """The texels' solid angles add up to the sphere (the dome for the orthographic map)."""
    total = cell_solid_angles(MAPS[name], 65, 65, name == "hemisphere").sum()
    expected = 2 * np.pi if name == "hemisphere" else 4 * np.pi
    np.testing.assert_allclose(total, expected, rtol=0.02)


@pytest.mark.parametrize("name", MAPS)
def test_envmap_of_the_same_image(name, dome, camera, monkeypatch):
    """The resampled image in a stock envmap looks like a large dome: 1 % in the mean of a view.

    The image varies smoothly, so the nearest texel and the envmap's interpolation differ little.
    """
    height, width = 129, 257
    v, u = np.meshgrid(np.linspace(0, 1, height), np.linspace(0, 1, width), indexing="ij")
    image = np.stack([1 + u, 2 - u + v, 1 + np.sin(6 * u) * v], axis=2)
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 256)
    env = environment_maps.resample(image, name)
    path = mi.load_dict({"type": "path", "max_depth": 1})
    lights = [
        dome(image, (0, 0, 0), 1000.0, map=name),
        {"type": "envmap", "bitmap": mi.Bitmap(env.astype(np.float32))},
    ]
    for n in NEAR_AXES:
        views = [
            np.array(
                mi.render(
                    mi.load_dict(
                        {"type": "scene", "light": light, "camera": camera((0, 0, 0), n, fov=30)}
                    ),
                    spp=16,
                    integrator=path,
                )
            )
            for light in lights
        ]
        np.testing.assert_allclose(views[1].mean((0, 1)), views[0].mean((0, 1)), rtol=0.01)
