"""The falloffspot emitter against its closed form, the stock spot and particle tracing."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

W, F, P = 30.0, 12.0, 2.5


def spot(**parameters):
    return {
        "type": "falloffspot",
        "direction": [0, -1, 0],
        "cutoff_angle": W,
        "falloff_angle": F,
        "falloff_exponent": P,
        "intensity": {"type": "rgb", "value": [3.0, 2.0, 1.0]},
        **parameters,
    }


def ramp(theta, w=W, f=F, p=P):
    """Section 9.5 of the scene language, in float64; angles in degrees."""
    c, cw, ci = (np.cos(np.radians(x)) for x in (theta, w, w - f))
    if c <= cw:
        return 0.0
    return 1.0 if c >= ci else ((c - cw) / (ci - cw)) ** p


def place(theta, dist):
    """Point at the angle `theta` from the axis (0, -1, 0) and the distance `dist`."""
    t = np.radians(theta)
    return np.array([dist * np.sin(t), -dist * np.cos(t), 0.0])


def received(emitter, points):
    it = dr.zeros(mi.SurfaceInteraction3f, len(points))
    it.p = mi.Point3f(np.asarray(points, dtype=np.float32).T)
    ds, value = emitter.sample_direction(it, mi.Point2f(0.5))
    return ds, np.array(value).T


ATTENUATIONS = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0.5, 0.2, 0.1), (0, 0, 0)]


@pytest.mark.parametrize("attenuation", ATTENUATIONS)
def test_irradiance_at_five_angles_and_three_distances(attenuation):
    """E = I r(theta) / (a + b d + c d^2): inside, three times in the ramp, outside the cone."""
    emitter = mi.load_dict(spot(attenuation=list(attenuation)))
    for dist in (0.5, 2.0, 7.0):
        for theta in (5.0, 19.0, 24.0, 28.0, 31.0):
            a, b, c = attenuation
            t = a + b * dist + c * dist**2 if any(attenuation) else 1.0
            _, value = received(emitter, [place(theta, dist)])
            expected = np.array([3.0, 2.0, 1.0]) * ramp(theta) / t
            np.testing.assert_allclose(value[0], expected, rtol=2e-4, atol=1e-9)


@pytest.mark.parametrize("attenuation", ATTENUATIONS)
def test_path_sees_the_same_light(attenuation, measure, spot_meter):
    """A Lambert plate of albedo rho that faces the light reflects L = rho E / pi, without noise."""
    rho = 0.5
    for theta, dist in ((5.0, 0.5), (19.0, 2.0), (24.0, 7.0), (28.0, 2.0)):
        p = place(theta, dist)
        facing = mi.ScalarTransform4f().look_at(
            origin=p.tolist(), target=[0, 0, 0], up=[0, 0, 1]
        ) @ mi.ScalarTransform4f().scale(0.2)
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 2},
                "light": spot(attenuation=list(attenuation), intensity=4.0),
                "plate": {
                    "type": "rectangle",
                    "to_world": facing,
                    "bsdf": {"type": "diffuse", "reflectance": rho},
                },
                "sensor": spot_meter(np.add(0.5 * p, [0, 0, 0.3 * dist]), p),
            }
        )
        a, b, c = attenuation
        t = a + b * dist + c * dist**2 if any(attenuation) else 1.0
        expected = rho / np.pi * 4.0 * ramp(theta) / t
        np.testing.assert_allclose(measure(scene, spp=4, runs=2).mean, expected, rtol=5e-4)


def test_hard_edges():
    """p = 0 lights everything inside w evenly; f = 0 does so for any exponent."""
    for parameters in ({"falloff_exponent": 0.0}, {"falloff_angle": 0.0}):
        emitter = mi.load_dict(spot(attenuation=[0, 0, 0], **parameters))
        _, value = received(emitter, [place(theta, 2.0) for theta in (0, 20, 29.9, 30.1, 90, 180)])
        np.testing.assert_allclose(value[:, 0], [3, 3, 3, 0, 0, 0], rtol=1e-6)


@pytest.mark.parametrize("w", [1e-3, 0.01, 0.03])
def test_narrow_cones(w):
    """The ramp of a cone whose cosine single precision does not tell from 1. Points to 1e-7 of the
    distance are 0.6 % of the narrowest cone, so its ramp is known to 2 %."""
    emitter = mi.load_dict(spot(cutoff_angle=w, falloff_angle=w / 2, falloff_exponent=1.0))
    for share in (0.3, 0.6, 0.9, 1.1):
        _, value = received(emitter, [place(share * w, 1.0)])
        # 1 - cos(t) is t²/2.
        expected = np.clip((1 - share**2) / (1 - 0.25), 0, 1)
        np.testing.assert_allclose(value[0], expected * np.array([3.0, 2.0, 1.0]), atol=0.06)


@pytest.mark.parametrize("f", [1e-4, 1e-3, 1e-2])
def test_narrow_rims(f):
    """A ramp within f degrees of 20: to 1e-4 of its middle at each of a thousand points as float32
    has them. (A cosine in float32 leaves errors of a hundredth at f = 1e-3.)"""
    c = (np.cos(np.radians(20)) + np.cos(np.radians(20 - f))) / 2
    x = np.sqrt(1 - c * c) / c * (1 + np.linspace(-0.3, 0.3, 1000) * np.radians(f))
    points = np.stack([x, -np.ones_like(x), 0 * x], axis=1).astype(np.float32)
    parameters = {"cutoff_angle": 20.0, "falloff_angle": f, "falloff_exponent": 1.0}
    _, value = received(mi.load_dict(spot(attenuation=[0, 0, 0], **parameters)), points)
    cosine = 1 / np.hypot(1, points[:, 0].astype(float))
    w, inner = np.cos(np.radians([20, 20 - np.float32(f).astype(float)]))
    np.testing.assert_allclose(value[:, 0] / 3, (cosine - w) / (inner - w), atol=1e-4)


def test_attenuation_below_a_thousandth_is_none():
    """t < 1e-3 counts as 1: with 0 0 1, within 0.0316 of the light."""
    emitter = mi.load_dict(spot())
    _, value = received(emitter, [place(0.0, 0.0315), place(0.0, 0.0317)])
    np.testing.assert_allclose(value[:, 0], [3.0, 3.0 / 0.0317**2], rtol=1e-4)


def test_is_stock_spot_where_both_apply():
    """0 0 1 inside the inner cone: I / d^2 of the stock spot, with its direction and distance."""
    ours = mi.load_dict(spot(to_world=mi.ScalarTransform4f().translate([1, 2, 3])))
    stock = mi.load_dict(
        {
            "type": "spot",
            "to_world": mi.ScalarTransform4f().look_at(
                origin=[1, 2, 3], target=[1, 0, 3], up=[0, 0, 1]
            ),
            "cutoff_angle": W,
            "beam_width": W - F,
            "intensity": {"type": "rgb", "value": [3.0, 2.0, 1.0]},
        }
    )
    points = [[1, 0, 3], [1.1, -1, 3.2], [0.5, 0, 3.1]]
    (a, x), (b, y) = received(ours, points), received(stock, points)
    np.testing.assert_allclose(x, y, rtol=1e-5)
    np.testing.assert_allclose(np.array(a.d), np.array(b.d), atol=1e-6)
    np.testing.assert_allclose(np.array(a.dist), np.array(b.dist), rtol=1e-6)


def box_scene(integrator, light):
    """A floor and a wall seen by a camera, for path and particle tracing alike."""
    t = mi.ScalarTransform4f()
    return {
        "type": "scene",
        "integrator": integrator,
        "light": light,
        "floor": {
            "type": "rectangle",
            "to_world": t.rotate([1, 0, 0], -90).scale(2),
            "bsdf": {"type": "diffuse", "reflectance": 0.7},
        },
        "wall": {
            "type": "rectangle",
            "to_world": t.translate([0, 2, -1]).scale(2),
            "bsdf": {"type": "diffuse", "reflectance": 0.5},
        },
        "sensor": {
            "type": "perspective",
            "fov": 40,
            "to_world": t.look_at(origin=[0, 3, 6], target=[0, 0.7, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
        },
    }


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("c", [1.0, 2.5])
def test_particles_and_paths_make_the_same_picture(c, measure, chance):
    """ptracer against path, three bounces."""
    light = spot(position=[0, 3, 0.3], attenuation=[0, 0, c])
    scene = mi.load_dict(box_scene({"type": "path", "max_depth": 4}, light))
    particles = mi.load_dict({"type": "ptracer", "max_depth": 4})
    measured = measure(scene, spp=256, runs=32, integrator=particles)
    chance.equal(measured, measure(scene, spp=128, runs=32), precision=4e-3)


def test_particles_need_the_inverse_square_law():
    """A particle's power cannot depend on how far it will fly: other laws emit none."""
    emitter = mi.load_dict(spot(attenuation=[0, 1, 0]))
    _, weight = emitter.sample_ray(mi.Float(0), mi.Float(0.5), mi.Point2f(0.5), mi.Point2f(0.5))
    np.testing.assert_array_equal(np.array(weight), 0.0)


def test_parameters_follow_traverse():
    """Every parameter can be changed after loading, and the formula follows."""
    emitter = mi.load_dict(spot())
    params = mi.traverse(emitter)
    params["cutoff_angle"] = 40.0
    params["falloff_angle"] = 20.0
    params["falloff_exponent"] = 1.0
    params["attenuation"] = [0, 2, 0]
    params["direction"] = [0, 0, -5]
    params["position"] = [0, 0, 1]
    params["intensity.value"] = [7.0, 7.0, 7.0]
    params.update()
    theta = np.radians(30.0)
    point = [0, np.sin(theta) * 3, 1 - np.cos(theta) * 3]
    _, value = received(emitter, [point])
    np.testing.assert_allclose(value[0], 7.0 * ramp(30.0, 40.0, 20.0, 1.0) / 6.0, rtol=1e-4)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize(
    ("key", "step"),
    [
        ("intensity.value", (1.0, 1.0, 1.0)),
        ("direction", (0.3, 0.0, 0.1)),
        ("cutoff_angle", 1.0),
        ("falloff_angle", 1.0),
        ("falloff_exponent", 1.0),
        ("attenuation", (1.0, 0.5, 0.2)),
    ],
)
def test_gradients_are_those_of_finite_differences(key, step, chance, level):
    """prb's derivative of the picture along `step` against central differences, in twelve runs.

    The picture is weighted from left to right, or a turn of the light would nearly cancel out.
    """
    light = spot(position=[0.5, 2, 0], attenuation=[0.1, 0.2, 1.0])
    scene = mi.load_dict(box_scene({"type": "prb", "max_depth": 2}, light))
    params = mi.traverse(scene)
    key = f"light.{key}"
    kind = type(params[key])
    start, step = kind(params[key]), kind(step)

    weights = mi.TensorXf(np.arange(8.0)[None, :, None] * np.ones((8, 8, 3)))

    def mean(shift, seed):
        params[key] = start + shift * step
        params.update()
        picture = mi.render(scene, params, spp=chance.samples(4096), seed=seed)
        return dr.mean((picture * weights).array)

    h, gradients, differences = 1e-2, [], []
    for _ in range(12):
        theta = mi.Float(0.0)
        dr.enable_grad(theta)
        dr.backward(mean(theta, chance.seed()))
        gradients.append(dr.grad(theta)[0])
        seed = chance.seed()
        differences.append((mean(h, seed)[0] - mean(-h, seed)[0]) / (2.0 * h))
    chance.equal(level(gradients), level(differences), allowed=2e-3, precision=0.02)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"cutoff_angle": 0.0}, "cutoff_angle"),
        ({"cutoff_angle": 190.0}, "cutoff_angle"),
        ({"falloff_angle": 31.0}, "falloff_angle"),
        ({"falloff_exponent": -1.0}, "falloff_exponent"),
        ({"attenuation": [0, -1, 0]}, "attenuation"),
        ({"direction": [0, 0, 0]}, "direction"),
    ],
)
def test_senseless_parameters_are_refused(parameters, message):
    with pytest.raises(Exception, match=message):
        mi.load_dict(spot(**parameters))


@pytest.mark.false_alarms(1e-3)
def test_spectral_variant_gives_the_same_colours(measure, chance):
    """A grey floor under a coloured spot: the spectral picture is the RGB one to 0.5 %."""
    means = []
    for variant in ("llvm_ad_rgb", "llvm_ad_spectral"):
        mi.set_variant(variant)
        light = spot(position=[0, 3, 0.3], intensity={"type": "rgb", "value": [0.9, 0.6, 0.3]})
        for integrator in ("path", "ptracer"):
            scene = mi.load_dict(box_scene({"type": integrator, "max_depth": 2}, light))
            means.append(measure(scene, spp=512, runs=32))
    for other in means[1:]:
        chance.equal(other, means[0], allowed=5e-3, precision=4e-3, of=3)
