"""The twosidedarea emitter on every kind of shape, against closed forms and particle tracing."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

L, RHO = 3.0, 0.5


def light(radiance=L):
    return {"type": "twosidedarea", "radiance": radiance}


def bitmap(image):
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.asarray(image, dtype=np.float32)),
        "raw": True,
        "filter_type": "nearest",
    }


def black():
    return {"type": "diffuse", "reflectance": 0.0}


def plate(at, normal, size=0.05):
    """Lambert rectangle around `at` that faces `normal`."""
    to_world = mi.ScalarTransform4f().look_at(
        origin=list(at), target=list(np.add(at, normal)), up=[0.12, 0.2, 0.97]
    )
    return {
        "type": "rectangle",
        "to_world": to_world @ mi.ScalarTransform4f().scale(size),
        "bsdf": {"type": "diffuse", "reflectance": RHO},
    }


def seen_plate(shape, at, normal, spot_meter, integrator="path"):
    """Scene in which the sensor sees the plate; it reflects RHO E / pi."""
    side = np.cross(normal, [0.3, 0.5, 0.81])
    eye = np.add(at, 0.05 * np.asarray(normal) + 0.05 * side)
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": 2},
            "lamp": shape,
            "plate": plate(at, normal),
            "sensor": {**spot_meter(eye, at), "near_clip": 1e-4},
        }
    )


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["path", "volpath"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_disk_lights_both_sides(side, integrator, measure, agrees, spot_meter):
    """E = pi L a^2 / (a^2 + h^2) on the axis of a disk of radius a at the distance h."""
    a, h = 1.5, 1.0
    disk = {
        "type": "disk",
        "to_world": mi.ScalarTransform4f().scale(a),
        "bsdf": black(),
        "light": light(),
    }
    scene = seen_plate(disk, [0, 0, side * h], [0, 0, -side], spot_meter, integrator)
    agrees(measure(scene, spp=2048, runs=16), RHO * L * a**2 / (a**2 + h**2))


@pytest.mark.false_alarms(1e-3)
def test_sphere_from_outside(measure, agrees, spot_meter):
    """E = pi L R^2 / D^2 facing a sphere of radius R whose centre is at the distance D."""
    sphere = {"type": "sphere", "radius": 1.0, "bsdf": black(), "light": light()}
    scene = seen_plate(sphere, [0, 0, 3.0], [0, 0, -1], spot_meter)
    agrees(measure(scene, spp=2048, runs=16), RHO * L / 9.0)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("angle", [1e-5, 1e-3, 0.1])
def test_sphere_of_any_apparent_size(angle, measure, agrees, spot_meter):
    """E = pi L sin²(sigma), also where 1 - cos(sigma) is nothing in single precision."""
    sine = np.sin(angle / 2)
    lamp = {"type": "sphere", "center": [0, 0, 50], "radius": 50 * sine, "bsdf": black(),
            "light": light(sine**-2)}  # fmt: skip
    scene = seen_plate(lamp, [0, 0, 0], [0, 0, 1], spot_meter)
    agrees(measure(scene, spp=512), RHO)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("distance", [0.4, 0.9995, 1.0005, 1.002, 1.5, 30.0])
def test_sampling_density_of_a_sphere(distance, chance, level):
    """From inside and outside and next to its surface the density integrates to 1 over directions,
    and is that of the samples, which are points of the sphere.

    The density is split by the near point and the far one: from outside only the near point is
    sampled by the cone. 400000 directions in the cone about the centre, or in the sphere.
    """
    scene = mi.load_dict({"type": "scene", "lamp": {"type": "sphere", "light": light()}})
    emitter = scene.emitters()[0]
    it = dr.zeros(mi.Interaction3f)
    axis = np.array([0.48, 0.6, 0.64])
    it.p = mi.Point3f(*(distance * axis).tolist())
    rng, count = chance.rng(), chance.samples(400000)
    outside = distance > 1.001
    cos_cone = np.sqrt(1 - 1 / distance**2) if outside else -1.0
    cosine = 1 - rng.random(count) * (1 - cos_cone)
    phi = rng.random(count) * 2 * np.pi
    sine = np.sqrt(1 - cosine**2)
    local = mi.Vector3f(*(np.float32(x) for x in (sine * np.cos(phi), sine * np.sin(phi), cosine)))
    w = mi.Frame3f(mi.Vector3f(*(-axis).tolist())).to_world(local)
    total = np.zeros(cosine.size)
    ray, met = mi.Ray3f(it.p, w), mi.Bool(True)
    for _ in range(1 if outside else 2):
        si = scene.ray_intersect(ray, met)
        met &= si.is_valid()
        ds = mi.DirectionSample3f(scene, si, it)
        total += np.array(dr.select(met, emitter.pdf_direction(it, ds), 0))
        ray = si.spawn_ray(w)
    total *= 2 * np.pi * (1 - cos_cone)
    # Float32 meets a sphere from next to its surface to 1e-3 of the directions.
    chance.equal(level(total), 1.0, allowed=2e-3, precision=1e-2)
    variates = mi.Point2f(rng.random((2, 20000)).astype(np.float32))
    ds, value = emitter.sample_direction(it, variates)
    np.testing.assert_allclose(dr.norm(ds.p), 1, rtol=1e-5)
    # A tangent ray takes the square root of the rounding of a sine.
    np.testing.assert_allclose(np.array(it.p + ds.dist * ds.d), np.array(ds.p), atol=5e-4)
    np.testing.assert_allclose(np.array(value * ds.pdf), L, rtol=1e-4)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("radius", [0.1, 1.0, 100.0])
def test_furnace_on_the_inner_surface(radius, measure, chance):
    """A sphere of albedo 1/2 that emits 1 inside: L = 1 + L / 2 = 2. The stock sphere takes points
    of its inner surface for outer ones and loses 10 to 20 %."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "rr_depth": 20},
            "ball": {"type": "sphere", "radius": radius, "light": light(1.0),
                     "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}}},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=[0, 0, 0.1 * radius], target=[0, 0, -1], up=[0, 1, 0]
                ),
                "near_clip": 1e-6,
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
        }
    )  # fmt: skip
    chance.equal(measure(scene, spp=512), 2.0, allowed=2e-3, precision=2e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("shape", ["sphere", "cube", "cylinder"])
def test_furnace_inside(shape, measure, agrees, spot_meter):
    """E = pi L inside a closed lamp, whatever its shape; the cube is a mesh.

    The cylinder is long: its open ends cover less than 1e-4 of the plate's cosine-weighted sky.
    """
    to_world = mi.ScalarTransform4f().scale(2.0)
    if shape == "cylinder":
        to_world = mi.ScalarTransform4f().translate([0, 0, -500]).scale([1, 1, 1000])
    lamp = {"type": shape, "to_world": to_world, "bsdf": black(), "light": light()}
    scene = seen_plate(lamp, [0.2, 0.3, 0.1], [0, 1, 0], spot_meter)
    agrees(measure(scene, spp=4096, runs=16), RHO * L)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_wide_plane(side, measure, agrees, spot_meter):
    """E = pi L above and below a plane without end (a square 20000 times the distance)."""
    plane = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().scale(1e4),
        "bsdf": black(),
        "light": light(),
    }
    scene = seen_plate(plane, [0, 0, side], [0, 0, -side], spot_meter)
    agrees(measure(scene, spp=4096, runs=16), RHO * L)


def half_sky(shape):
    """A sphere of which a 2 x 1 texture leaves half dark, and the pole of the bright half."""
    if shape == "around x":
        return bitmap([[[1.0] * 3, [0.0] * 3]]), [0, 1, 0]
    return bitmap([[[0.0] * 3], [[1.0] * 3]]), [0, 0, 1]


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("shape", ["around x", "around z"])
def test_textured_sphere(shape, measure, agrees, spot_meter):
    """Half a bright sky: the plate's irradiances facing its pole and away from it are pi and 0.

    Which of the two poles is the bright one is up to the sphere's (u, v).
    """
    radiance, pole = half_sky(shape)
    sphere = {"type": "sphere", "radius": 2.0, "bsdf": black(), "light": light(radiance)}
    values = []
    for sign in (1.0, -1.0):
        scene = seen_plate(sphere, [0, 0, 0], np.multiply(sign, pole), spot_meter)
        values.append(measure(scene, spp=4096, runs=16))
    bright, dark = sorted(values, key=lambda value: -value.mean.mean())
    agrees(bright, RHO * 1.0)
    assert dark.mean.max() < 1e-3 * bright.mean.max()


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("shape", ["rectangle", "disk", "sphere"])
def test_sampling_density_of_textured_shapes(shape, chance):
    """The density integrates to 1 over directions and is the one the samples come with.

    From a point near the shape: 400000 uniform directions.
    """
    image = np.random.default_rng(1).random((5, 7, 3))
    image[1, 2] = 50.0
    scene = mi.load_dict({"type": "scene", "lamp": {"type": shape, "light": light(bitmap(image))}})
    emitter = scene.emitters()[0]
    it = dr.zeros(mi.SurfaceInteraction3f)
    it.p = mi.Point3f(0.1, 0.2, 0.8 if shape == "sphere" else 1.0) * 0.5
    w = chance.rng().normal(size=(3, 400000))
    w = mi.Vector3f((w / np.linalg.norm(w, axis=0)).astype(np.float32))
    si = scene.ray_intersect(mi.Ray3f(it.p, w))
    ds = mi.DirectionSample3f(scene, si, it)
    pdf = dr.select(si.is_valid(), emitter.pdf_direction(it, ds, si.is_valid()), 0)
    pdf = np.array(pdf) * 4 * np.pi
    chance.scores((pdf.mean() - 1.0) / (pdf.std() / np.sqrt(pdf.size)))
    variates = chance.rng().random((2, 20000)).astype(np.float32)
    ds, value = emitter.sample_direction(it, mi.Point2f(variates))
    same = np.isclose(np.array(emitter.pdf_direction(it, ds)), np.array(ds.pdf), rtol=1e-3)
    assert same.mean() > 0.999
    radiance = np.array(emitter.eval_direction(it, ds))
    same = np.isclose(np.array(value * ds.pdf), radiance, rtol=1e-4).all(axis=0)
    assert same.mean() > 0.999  # at the edge of a texel either one is right


def test_bright_texel_is_found(measure):
    """One texel in 64 x 64 carries the light: sampling by the texture beats sampling by area.

    Variance of one sample a pixel against the same rectangle as a mesh, which is sampled by area:
    at least 100 times lower.
    """
    image = np.zeros((64, 64, 3))
    image[20, 40] = 1e5
    floor = {**plate([0, 0, 2], [0, 0, -1], 1.0), "bsdf": {"type": "diffuse"}}
    variances = []
    for as_mesh in (False, True):
        lamp = {"type": "rectangle", "bsdf": black(), "light": light(bitmap(image))}
        if as_mesh:
            rectangle = mi.load_dict({"type": "rectangle"})
            mesh = mi.Mesh("lamp", 4, 2, has_vertex_texcoords=True, props=props_of(lamp))
            params = mi.traverse(mesh)
            u, v = mi.Float([0, 1, 1, 0]), mi.Float([0, 0, 1, 1])
            si = rectangle.eval_parameterization(mi.Point2f(u, v))
            params["vertex_positions"] = dr.ravel(si.p)
            params["vertex_texcoords"] = dr.ravel(mi.Point2f(u, v))
            params["faces"] = mi.UInt32([0, 1, 2, 0, 2, 3])
            params.update()
            lamp = mesh
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 2},
                "lamp": lamp,
                "floor": floor,
                "sensor": {
                    "type": "perspective",
                    "fov": 1.0,
                    "to_world": mi.ScalarTransform4f().look_at(
                        origin=[3, 0, 1], target=[0, 0, 2], up=[0, 0, 1]
                    ),
                    "film": {"type": "hdrfilm", "width": 32, "height": 32,
                             "rfilter": {"type": "box"}},
                },
            }
        )  # fmt: skip
        picture = np.array(mi.render(scene, spp=64))[..., 0]
        variances.append(picture.var() / picture.mean() ** 2)
    assert variances[0] < 0.01 * variances[1], variances


def props_of(lamp):
    """`mi.Properties` with the lamp's BSDF and light, for a mesh made in memory."""
    props = mi.Properties()
    props["bsdf"] = mi.load_dict(lamp["bsdf"])
    props["light"] = mi.load_dict(lamp["light"])
    return props


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("radiance", ["constant", "texture"])
@pytest.mark.parametrize("shape", ["rectangle", "disk", "sphere"])
def test_power_of_the_particles(shape, radiance, chance, level):
    """Their mean weight is the power 2 pi ∫ L dA of both sides; L is 3 on half of the area, or all.

    A texture that differs along u parts a rectangle in halves, and a sphere along its azimuth.
    """
    texture = bitmap([[[L] * 3, [0.0] * 3]])
    if shape == "disk":  # u is the radius: the inner half of it is a quarter of the area
        texture = bitmap([[[0.0] * 3, [4 / 6 * L] * 3]])
    lamp = {"type": shape, "light": light(texture if radiance == "texture" else L)}
    scene = mi.load_dict({"type": "scene", "lamp": lamp})
    u = chance.rng().random((5, 200_000)).astype(np.float32)
    _, weight = scene.emitters()[0].sample_ray(
        mi.Float(0), mi.Float(u[0]), mi.Point2f(u[1:3]), mi.Point2f(u[3:])
    )
    area = {"rectangle": 4, "disk": np.pi, "sphere": 4 * np.pi}[shape]
    power = 2 * np.pi * L * area * (0.5 if radiance == "texture" else 1)
    # The weights are one number where all points are as likely.
    weights = np.broadcast_to(np.array(weight)[0], u[0].shape)
    measured = level(weights.reshape(100, -1).mean(axis=1))
    chance.equal(measured, power, allowed=1e-4, precision=4e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("radiance", ["constant", "texture"])
def test_particles_and_paths_make_the_same_picture(radiance, measure, chance):
    """ptracer against path, two bounces and the lamp itself, seen from its back as well."""
    image = np.random.default_rng(1).random((5, 7, 3))
    t = mi.ScalarTransform4f()
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "lamp": {
                "type": "rectangle",
                "to_world": t.translate([0, 0.8, 0]).rotate([1, 0, 0], 60).scale(0.7),
                "bsdf": black(),
                "light": light(bitmap(image) if radiance == "texture" else 0.5),
            },
            "floor": {
                "type": "rectangle",
                "to_world": t.translate([0, -0.5, 0]).rotate([1, 0, 0], -90).scale(2),
                "bsdf": {"type": "diffuse", "reflectance": 0.7},
            },
            "ceiling": {
                "type": "rectangle",
                "to_world": t.translate([0, 2, 0]).rotate([1, 0, 0], 90).scale(2),
                "bsdf": {"type": "diffuse", "reflectance": 0.5},
            },
            "sensor": {
                "type": "perspective",
                "fov": 50,
                "to_world": t.look_at(origin=[0, 0.7, 6], target=[0, 0.7, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
        }
    )
    particles = mi.load_dict({"type": "ptracer", "max_depth": 3})
    measured = measure(scene, spp=1024, runs=16, integrator=particles)
    chance.equal(measured, measure(scene, spp=2048, runs=16), precision=7e-3)


def test_shines_where_a_stock_area_light_is_black(spot_meter):
    """Looking at the back of a rectangle."""
    values = []
    for plugin in ("twosidedarea", "area"):
        lamp = {"type": "rectangle", "bsdf": black(), "light": {"type": plugin, "radiance": L}}
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path"},
                "lamp": lamp,
                "sensor": spot_meter([0.1, 0.2, -2], [0, 0, 0], up=(0, 1, 0)),
            }
        )
        values.append(np.array(mi.render(scene, spp=4)).mean())
    np.testing.assert_allclose(values, [L, 0])


def test_parameters_follow_traverse(spot_meter):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path"},
            "lamp": {"type": "rectangle", "light": light({"type": "rgb", "value": 1.0})},
            "sensor": spot_meter([0.1, 0.2, -2], [0, 0, 0], up=(0, 1, 0)),
        }
    )
    params = mi.traverse(scene)
    params["lamp.emitter.radiance.value"] = 7.0
    params.update()
    np.testing.assert_allclose(np.array(mi.render(scene, spp=4)).mean(), 7.0, rtol=1e-5)


def test_to_world_is_refused():
    with pytest.raises(Exception, match="the shape has the transform"):
        mi.load_dict({"type": "twosidedarea", "to_world": mi.ScalarTransform4f()})


@pytest.mark.false_alarms(1e-3)
def test_spectral_variant_gives_the_same_colours(measure, spot_meter, chance):
    """A grey plate under a coloured disk: the spectral picture is the RGB one to 0.5 %."""
    means = []
    for variant in ("llvm_ad_rgb", "llvm_ad_spectral"):
        mi.set_variant(variant)
        colour = {"type": "rgb", "value": [0.9, 0.6, 0.3]}
        disk = {"type": "disk", "bsdf": black(), "light": light(colour)}
        scene = seen_plate(disk, [0, 0, -1], [0, 0, 1], spot_meter)
        means.append(measure(scene, spp=4096))
    chance.equal(means[1], means[0], allowed=5e-3, precision=5e-3)
