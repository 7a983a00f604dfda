"""The ibldome emitter: closed forms, sampling, particles, parameters and images."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.emitters.dome_sampling import MAPS


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("integrator", ["path", "volpath"])
def test_furnace(name, integrator, measure, agrees, dome, camera):
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


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("hemisphere", [False, True])
@pytest.mark.parametrize("name", MAPS)
def test_sampling_density(name, hemisphere, dome, random_image, random_directions, chance):
    """The density integrates to 1 over directions and is the one the samples come with.

    From a point off the centre. The integral over 200000 uniform directions equals the share of
    samples that met the dome (texels may reach beyond the image's disk or the horizon).
    """
    image = random_image()
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map=name, hemisphere=hemisphere)})
    emitter = scene.emitters()[0]
    it = dr.zeros(mi.SurfaceInteraction3f)
    it.p = mi.Point3f(1.5, 2.0, -1.0)
    w = mi.Vector3f(random_directions(200000, chance.seed()).astype(np.float32))
    si = scene.ray_intersect(mi.Ray3f(it.p, w))
    ds = mi.DirectionSample3f(scene, si, it)
    pdf = np.array(emitter.pdf_direction(it, ds)) * 4 * np.pi
    variates = chance.rng().random((2, 100000)).astype(np.float32)
    ds, _ = emitter.sample_direction(it, mi.Point2f(variates))
    met = np.array(ds.pdf) > 0
    assert met.mean() > 0.85
    error = np.sqrt(pdf.var() / pdf.size + met.var() / met.size)
    chance.scores((pdf.mean() - met.mean()) / error)
    found = dr.select(ds.pdf > 0, emitter.pdf_direction(it, ds), 0)
    same = np.isclose(np.array(found), np.array(ds.pdf), rtol=1e-2)
    assert same.mean() > 0.995
    np.testing.assert_allclose(np.linalg.norm(np.array(ds.p).T - [0.3, 0.4, 0.5], axis=1), 5, 1e-5)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize("name", MAPS)
def test_sampling_finds_what_scattering_finds(name, measure, dome, camera, random_image, chance):
    """Emitter sampling (path), BSDF sampling alone (direct) and particles agree on a ball.

    Random texels with one of a hundred times the rest.
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
    path, scattering, particles = (
        measure(scene, spp=spp, runs=16, integrator=mi.load_dict(integrator))
        for integrator, spp in (
            ({"type": "path", "max_depth": 2}, 512),
            ({"type": "direct", "bsdf_samples": 1, "emitter_samples": 0}, 12288),
            ({"type": "ptracer", "max_depth": 2}, 12288),
        )
    )
    assert np.all(path.variance < (5e-3 * path.mean) ** 2 * chance.reduced)
    for other in (scattering, particles):
        chance.equal(other, path, precision=0.06, of=2)


@pytest.mark.false_alarms(1e-3)
def test_seen_from_outside(measure, agrees, dome, camera):
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


@pytest.mark.false_alarms(1e-3)
def test_power_of_the_particles(dome, chance, level):
    """Their mean weight is the power of both sides, 2 pi L 4 pi R²; to 0.1 % at the map's poles."""
    image = np.full((33, 65, 3), 3.0)
    scene = mi.load_dict({"type": "scene", "dome": dome(image, map="panoramic")})
    u = chance.rng().random((5, 200_000)).astype(np.float32)
    _, weight = scene.emitters()[0].sample_ray(
        mi.Float(0), mi.Float(u[0]), mi.Point2f(u[1:3]), mi.Point2f(u[3:])
    )
    measured = level(np.array(weight)[0].reshape(100, -1).mean(axis=1))
    chance.equal(measured, 2 * np.pi * 3 * 4 * np.pi * 5**2, allowed=1e-3, precision=4e-3)


def test_two_domes_and_a_moved_sphere(dome, camera):
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


def test_black_image_gives_no_light(measure, dome, camera):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "dome": dome(np.zeros((4, 8, 3)), map="angular"),
            "ball": {"type": "sphere", "radius": 1.0},
            "sensor": camera((0.5, 0.5, 3), (0, 0, 0)),
        }
    )
    np.testing.assert_array_equal(measure(scene, spp=4, runs=2).mean, 0.0)


def test_parameters_follow_traverse(dome):
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


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("size", [(1, 1), (1, 5), (5, 1), (2, 2)])
def test_tiny_images(size, measure, agrees, dome, camera):
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
def test_senseless_parameters_are_refused(parameters, message, dome):
    with pytest.raises(Exception, match=message):
        mi.load_dict(dome(np.ones((4, 8, 3)), **parameters))


def test_undefined_texels_are_refused(dome):
    for bad in (np.nan, np.inf, -1.0):
        with pytest.raises(Exception, match="negative or undefined"):
            mi.load_dict(dome(np.full((4, 8, 3), bad)))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["path", "ptracer"])
def test_spectral_variant_gives_the_same_colours(
    integrator, measure, dome, camera, random_image, chance
):
    """A grey ball under coloured texels: the spectral picture is the RGB one to 0.5 %."""
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
    chance.equal(means[1], means[0], allowed=5e-3)
