"""The ibldome emitter: maps, orientation, parallax, sampling, and the envmap made from an image."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from emitters.domemaps import MAPS, cell_solid_angles, resample_to_latlong

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


def dome(image, centre=(0.3, 0.4, 0.5), radius=5.0, **parameters):
    return {
        "type": "sphere",
        "center": list(centre),
        "radius": radius,
        "bsdf": {"type": "conductor", "specular_reflectance": 0.0},
        "light": {
            "type": "ibldome",
            "bitmap": mi.Bitmap(np.asarray(image, dtype=np.float32)),
            **parameters,
        },
    }


def camera(origin, target, fov=90.0, size=8, up=(0.01, 1.0, 0.02)):
    return {
        "type": "perspective",
        "fov": fov,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=list(origin), target=list(target), up=list(up)
        ),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
    }


def random_image(seed=1, shape=(17, 33, 3)):
    return np.random.default_rng(seed).random(shape).astype(np.float32)


def random_directions(count, seed=2):
    n = np.random.default_rng(seed).normal(size=(3, count))
    return n / np.linalg.norm(n, axis=0)


@pytest.mark.parametrize("name", MAPS)
def test_one_bright_texel_in_six_directions(name):
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
def test_every_direction_meets_the_nearest_texel(name):
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


def test_hemisphere_is_dark_below_the_centre():
    """With `hemisphere` only points at or above the height of the centre shine."""
    image = np.ones((4, 8, 3))
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map="panoramic", hemisphere=True)})
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.p = mi.Point3f([0.3, 0.3], [0.4 + 3, 0.4 - 3], [4.5, 4.5])
    np.testing.assert_array_equal(np.array(scene.emitters()[0].eval(si))[0], [1, 0])


def test_parallax():
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


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("integrator", ["path", "volpath"])
def test_furnace(name, integrator, measure, agrees):
    """A convex ball of albedo rho in a dome of constant radiance L reflects rho L everywhere."""
    image = np.full((9, 17, 3), 3.0)
    ball = {"type": "sphere", "radius": 1.0, "bsdf": {"type": "diffuse", "reflectance": 0.6}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": 2},
            "dome": dome(image, map=name),
            "ball": ball,
            "sensor": camera((0.5, 0.5, 3), (0, 0, 0), fov=20),
        }
    )
    agrees(measure(scene, spp=64, runs=16), 0.6 * 3.0)


@pytest.mark.parametrize("hemisphere", [False, True])
@pytest.mark.parametrize("name", MAPS)
def test_sampling_density(name, hemisphere):
    """The density integrates to 1 over directions and is the one the samples come with.

    From a point off the centre. The integral over 200000 uniform directions equals the share of
    samples that met the dome (texels may reach beyond the image's disk or the horizon), within 3
    standard errors of both.
    """
    image = random_image()
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map=name, hemisphere=hemisphere)})
    emitter = scene.emitters()[0]
    it = dr.zeros(mi.SurfaceInteraction3f)
    it.p = mi.Point3f(1.5, 2.0, -1.0)
    w = mi.Vector3f(random_directions(200000).astype(np.float32))
    si = scene.ray_intersect(mi.Ray3f(it.p, w))
    ds = mi.DirectionSample3f(scene, si, it)
    pdf = np.array(emitter.pdf_direction(it, ds)) * 4 * np.pi
    variates = np.random.default_rng(3).random((2, 100000)).astype(np.float32)
    ds, _ = emitter.sample_direction(it, mi.Point2f(variates))
    met = np.array(ds.pdf) > 0
    assert met.mean() > 0.85
    error = np.sqrt(pdf.var() / pdf.size + met.var() / met.size)
    assert abs(pdf.mean() - met.mean()) < 3.0 * error
    found = dr.select(ds.pdf > 0, emitter.pdf_direction(it, ds), 0)
    same = np.isclose(np.array(found), np.array(ds.pdf), rtol=1e-2)
    assert same.mean() > 0.995
    np.testing.assert_allclose(np.linalg.norm(np.array(ds.p).T - [0.3, 0.4, 0.5], axis=1), 5, 1e-5)


@pytest.mark.parametrize("name", MAPS)
def test_sampling_finds_what_scattering_finds(name, measure):
    """Emitter sampling (path), BSDF sampling alone (direct) and particles agree on a ball.

    Random texels with one of a hundred times the rest; within 3 standard errors of each other.
    """
    image = random_image()
    image[5, 9] = 100.0
    ball = {"type": "sphere", "radius": 1.0, "bsdf": {"type": "diffuse", "reflectance": 0.6}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "dome": dome(image, map=name),
            "ball": ball,
            "sensor": camera((0.5, 0.5, 3), (0, 0, 0), fov=20),
        }
    )
    runs = {
        "path": ({"type": "path", "max_depth": 2}, 512),
        "scattering": ({"type": "direct", "bsdf_samples": 1, "emitter_samples": 0}, 2048),
        "particles": ({"type": "ptracer", "max_depth": 2}, 2048),
    }
    measured = {}
    for key, (integrator, spp) in runs.items():
        mean, error = measure(scene, spp=spp, runs=16, integrator=mi.load_dict(integrator))
        measured[key] = mean.mean(), error.max()
    mean, error = measured["path"]
    assert error < 3e-3 * mean
    for other, other_error in measured.values():
        assert other_error < 0.06 * other
        assert abs(other - mean) <= 3.0 * np.hypot(error, other_error), measured


def test_seen_from_outside(measure, agrees):
    """Outside, a plate that faces the dome at distance D has E = pi L R^2 / D^2.

    The dome is a sphere of constant radiance, seen under half the angle arcsin(R / D).
    """
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "dome": dome(np.full((9, 17, 3), 2.0), (0, 0, 0), 1.0, map="panoramic"),
            "plate": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([0, 0, -3]).scale(0.02),
                "bsdf": {"type": "diffuse", "reflectance": 0.5},
            },
            "sensor": camera((0.7, 0.0, -2.5), (0, 0, -3), fov=0.1),
        }
    )
    agrees(measure(scene, spp=4096, runs=16), 0.5 * 2.0 / 9.0)


def test_two_domes_and_a_moved_sphere():
    """Several domes keep their own geometry; a sphere moved after loading takes its image along."""
    image = np.zeros((5, 9, 3))
    image[:3] = 1.0  # upper half bright
    scene = mi.load_dict(
        {
            "type": "scene",
            "a": dome(image, (0, 0, 0), 1.0, map="panoramic"),
            "b": dome(2 * image, (10, 0, 0), 2.0, map="panoramic"),
            "high": camera((0, 0.5, 9), (0, 0.5, 0), fov=0.5),
            "low": camera((10, -0.5, 9), (10, -0.5, 0), fov=0.5),
            "right": camera((10, 0.2, 9), (10, 0.2, 0), fov=0.5),
        }
    )
    path = mi.load_dict({"type": "path", "max_depth": 1})

    def look():
        pictures = (mi.render(scene, sensor=i, spp=1, integrator=path) for i in range(3))
        return [np.array(picture).mean() for picture in pictures]

    np.testing.assert_allclose(look(), [1, 0, 2])
    params = mi.traverse(scene)
    params["b.to_world"] = mi.Transform4f().translate([10, -1.5, 0]).scale(2)
    params.update()
    np.testing.assert_allclose(look(), [1, 2, 2])


def test_black_image_gives_no_light(measure):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "dome": dome(np.zeros((4, 8, 3)), map="angular"),
            "ball": {"type": "sphere", "radius": 1.0},
            "sensor": camera((0.5, 0.5, 3), (0, 0, 0)),
        }
    )
    np.testing.assert_array_equal(measure(scene, spp=4, runs=1 + 1)[0], 0.0)


def test_parameters_follow_traverse():
    """`scale` and `data` can be changed; sampling follows the new data."""
    scene = mi.load_dict({"type": "scene", "dome": dome(np.ones((5, 9, 3)), map="panoramic")})
    params = mi.traverse(scene)
    data = np.zeros((5, 9, 3))
    data[2, 3] = 7.0
    params["dome.emitter.data"] = mi.TensorXf(data)
    params["dome.emitter.scale"] = 3.0
    params.update()
    it = dr.zeros(mi.SurfaceInteraction3f)
    variates = np.random.default_rng(3).random((2, 1000)).astype(np.float32)
    ds, value = scene.emitters()[0].sample_direction(it, mi.Point2f(variates))
    np.testing.assert_allclose(np.array(value.x * ds.pdf), 21.0, rtol=1e-5)


def test_data_has_gradients():
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


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (5, 1), (2, 2)])
def test_tiny_images(size, measure, agrees):
    """Down to a single texel the furnace holds."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "dome": dome(np.full((*size, 3), 3.0), map="transposed"),
            "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.6}},
            "sensor": camera((0.5, 0.5, 3), (0, 0, 0), fov=20),
        }
    )
    agrees(measure(scene, spp=64, runs=16), 0.6 * 3.0)


def test_raw_switches_srgb_decoding_off(tmp_path):
    """An 8-bit PNG value 128 is 0.502 raw and 0.2159 decoded; `filename` reads it."""
    path = tmp_path / "grey.png"
    mi.Bitmap(np.full((4, 8, 3), 128, dtype=np.uint8)).write(str(path))
    for raw, expected in ((True, 128 / 255), (False, 0.21586)):
        light = {"type": "ibldome", "filename": str(path), "raw": raw}
        scene = mi.load_dict({"type": "scene", "dome": {"type": "sphere", "light": light}})
        value = scene.emitters()[0].eval(dr.zeros(mi.SurfaceInteraction3f))
        np.testing.assert_allclose(np.array(value).ravel(), expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"map": "cube"}, "map must be one of"),
        ({"filename": "x.hdr"}, "either filename or bitmap"),
    ],
)
def test_senseless_parameters_are_refused(parameters, message):
    with pytest.raises(Exception, match=message):
        mi.load_dict(dome(np.ones((4, 8, 3)), **parameters))


def test_undefined_texels_are_refused():
    for bad in (np.nan, np.inf, -1.0):
        with pytest.raises(Exception, match="negative or undefined"):
            mi.load_dict(dome(np.full((4, 8, 3), bad)))


@pytest.mark.parametrize("name", MAPS)
def test_solid_angles(name):
    """The texels' solid angles add up to the sphere (the dome for the orthographic map)."""
    total = cell_solid_angles(MAPS[name], 65, 65, name == "hemisphere").sum()
    expected = 2 * np.pi if name == "hemisphere" else 4 * np.pi
    np.testing.assert_allclose(total, expected, rtol=0.02)


@pytest.mark.parametrize("name", MAPS)
def test_envmap_of_the_same_image(name):
    """The resampled image in a stock envmap looks like a large dome: 1 % in the mean of a view.

    The image varies smoothly, so the nearest texel and the envmap's interpolation differ little.
    """
    height, width = 129, 257
    v, u = np.meshgrid(np.linspace(0, 1, height), np.linspace(0, 1, width), indexing="ij")
    image = np.stack([1 + u, 2 - u + v, 1 + np.sin(6 * u) * v], axis=2)
    env = resample_to_latlong(image, name, 256, samples=2)
    path = mi.load_dict({"type": "path", "max_depth": 1})
    lights = [
        dome(image, (0, 0, 0), 1000.0, map=name),
        {"type": "envmap", "bitmap": mi.Bitmap(env)},
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


@pytest.mark.parametrize("integrator", ["path", "ptracer"])
def test_spectral_variant_gives_the_same_colours(integrator, measure):
    """A grey ball under coloured texels: the spectral picture is the RGB one to 1 % + 3 errors."""
    image = random_image() * [1.0, 0.6, 0.4]
    means = []
    for variant in ("llvm_ad_rgb", "llvm_ad_spectral"):
        mi.set_variant(variant)
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": integrator, "max_depth": 2},
                "dome": dome(image, map="angular"),
                "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.6}},
                "sensor": camera((0.5, 0.5, 3), (0, 0, 0), fov=20),
            }
        )
        means.append(measure(scene, spp=2048, runs=8))
    (rgb, rgb_error), (spectral, spectral_error) = means
    allowed = 3.0 * np.hypot(rgb_error, spectral_error) + 0.01 * rgb
    assert np.all(np.abs(spectral - rgb) < allowed), means
