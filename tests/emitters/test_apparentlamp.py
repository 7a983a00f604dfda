"""The emitter apparentlamp: what sees the shape, and what the parallelogram lights."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

L, RHO = 3.0, 0.5
HEIGHT = 2.0


def square_factor(half):
    """Form factor of a horizontal square above a point (Siegel and Howell, B-4, four quarters)."""
    a = half / HEIGHT
    root = np.sqrt(1 + a * a)
    return 4 / np.pi * a / root * np.arctan(a / root)


def lamp(half_seen=4.0, half_lit=1.0, **parameters):
    """A horizontal square at HEIGHT that shines down, as seen, and the square that gives light."""
    down = mi.ScalarTransform4f().translate([0, 0, HEIGHT]).rotate([1, 0, 0], 180)
    edges = {
        "origin": [-half_lit, -half_lit, HEIGHT],
        "edge_u": [0, 2 * half_lit, 0],
        "edge_v": [2 * half_lit, 0, 0],
    }
    return {
        "type": "rectangle",
        "to_world": down @ mi.ScalarTransform4f().scale(half_seen),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "light": {"type": "apparentlamp", "radiance": L, **edges, **parameters},
    }


def scene(light, sensor, floor=None, integrator="path", **others):
    parts = {"type": "scene", "integrator": {"type": integrator, "max_depth": 6}, "lamp": light,
             "sensor": sensor, **others}  # fmt: skip
    if floor is not None:
        parts["floor"] = {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(50),
                          "bsdf": floor}  # fmt: skip
    return mi.load_dict(parts)


DIFFUSE = {"type": "diffuse", "reflectance": RHO}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["path", "volpath", "surfacepath"])
def test_lit_by_the_parallelogram(integrator, measure, agrees, spot_meter):
    """The floor below has rho L F of the small square, though the large one stands there."""
    meter = spot_meter((3.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    measured = measure(scene(lamp(), meter, DIFFUSE, integrator), spp=256)
    agrees(measured, RHO * L * square_factor(1.0))


def test_dark_behind_the_parallelogram(spot_meter):
    """Nothing above it is lit, as nothing below it is but by L cos cos' A / r²."""
    emitter = scene(lamp(), spot_meter((3.0, 0.0, 1.0), (0.0, 0.0, 0.0))).emitters()[0]
    for z, value in ((HEIGHT + 1, 0.0), (HEIGHT - 1, 4 * L)):
        it = dr.zeros(mi.Interaction3f)
        it.p = mi.Point3f(0, 0, z)
        ds, weight = emitter.sample_direction(it, mi.Point2f(0.5))
        assert np.allclose(np.array(weight), value)
        assert np.allclose(np.array(emitter.eval_direction(it, ds)), value)


@pytest.mark.parametrize("target", [(0.0, 0.0, HEIGHT), (3.9, 3.9, HEIGHT)])
def test_seen_by_the_camera(target, spot_meter):
    """L wherever the shape is seen from its normal's side, black from behind."""
    for eye_z, radiance in ((0.5, L), (5.0, 0.0)):
        meter = spot_meter((target[0] + 0.3, target[1], eye_z), target)
        assert np.allclose(np.array(mi.render(scene(lamp(), meter), spp=4)), radiance)


def test_two_sided(spot_meter):
    meter = spot_meter((0.3, 0.0, 5.0), (0.0, 0.0, HEIGHT))
    assert np.allclose(np.array(mi.render(scene(lamp(two_sided=True), meter), spp=4)), L)


@pytest.mark.parametrize(
    ("floor", "radiance"),
    [
        ({"type": "conductor", "specular_reflectance": RHO}, RHO * L),
        # a glossy surface is lit by the parallelogram alone, out of sight here
        ({"type": "roughconductor", "alpha": 0.02, "specular_reflectance": RHO}, 0.0),
    ],
)
def test_seen_in_mirrors(floor, radiance, spot_meter):
    """A perfect mirror shows the shape; a glossy one does not."""
    light = lamp(half_lit=0.01)
    meter = spot_meter((5.0, 0.0, HEIGHT - 0.5), (5.0 - 0.5 * HEIGHT, 0.0, 0.0))
    found = np.array(mi.render(scene(light, meter, floor), spp=64))
    assert np.allclose(found, radiance, atol=1e-3 * L)


def test_particles_leave_the_parallelogram(spot_meter):
    """`sample_ray` gives them the power pi A L, downwards."""
    emitter = scene(lamp(), spot_meter((3.0, 0.0, 1.0), (0.0, 0.0, 0.0))).emitters()[0]
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(3, 100000)
    ray, weight = emitter.sample_ray(0.0, sampler.next_1d(), sampler.next_2d(), sampler.next_2d())
    assert float(dr.mean(weight[0])[0]) == pytest.approx(np.pi * 4 * L)
    assert np.all(np.array(ray.d.z) < 0)
    assert np.all(np.abs(np.array(ray.o)[:2]) <= 1)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("mirror", [False, True])
def test_backdrop(mirror, measure, agrees, spot_meter):
    """With `surfacepath` a backdrop shows what it emits, and is not lit, where the camera or a
    mirror sees it; other surfaces get what it reflects: here 0.5 of a sky of 2, halved again."""
    sky = {"type": "constant", "radiance": 2.0}
    wall = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().look_at([0, 0, 1], [1, 0, 1], [0, 0, 1])
        @ mi.ScalarTransform4f().scale([200, 200, 1]),
        "bsdf": {"type": "twosided", "bsdf": DIFFUSE},
        "light": {"type": "apparentlamp", "radiance": 0.1, "two_sided": True, "backdrop": True},
    }
    eye = (3.0, 0.0, 1.5)
    if mirror:
        glass = {"type": "sphere", "center": [4.0, 0.0, 1.5], "radius": 0.5,
                 "bsdf": {"type": "conductor"}}  # fmt: skip
        meter = spot_meter(eye, (3.5, 0.0, 1.5))
        seen = measure(scene(wall, meter, None, "surfacepath", sky=sky, ball=glass), spp=16)
    else:
        meter = spot_meter(eye, (0.0, 0.0, 1.5))
        seen = measure(scene(wall, meter, None, "surfacepath", sky=sky), spp=16)
    assert np.allclose(seen.mean, 0.1, rtol=1e-5)
    # A plate that faces the wall: all that it sees is the wall, lit by half of its own sky.
    plate = {"type": "disk", "bsdf": DIFFUSE,
             "to_world": mi.ScalarTransform4f().look_at([1, 0, 1], [0, 0, 1], [0, 0, 1])
             @ mi.ScalarTransform4f().scale(1e-2)}  # fmt: skip
    meter = spot_meter((0.9, 0.0, 1.0), (1.0, 0.0, 1.0))
    lit = measure(scene(wall, meter, None, "surfacepath", sky=sky, plate=plate), spp=512)
    agrees(lit, RHO * RHO * 2.0)


def test_what_lights_has_one_radiance():
    """A texture may only be seen."""
    texture = {"type": "checkerboard"}
    mi.load_dict({"type": "apparentlamp", "radiance": texture})
    with pytest.raises(Exception, match="must not vary"):
        mi.load_dict({"type": "apparentlamp", "radiance": texture, "edge_u": [1, 0, 0],
                      "edge_v": [0, 1, 0]})  # fmt: skip
