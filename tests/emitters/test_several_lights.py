"""All the emitter plugins in one scene: their light adds up, in every variant that is compiled."""

import mitsuba as mi
import numpy as np
import pytest

from relume.workbench.statistics import Level

BLACK = {"type": "conductor", "specular_reflectance": 0.0}


def lights():
    t = mi.ScalarTransform4f()
    sky = mi.Bitmap(np.random.default_rng(1).random((9, 17, 3)).astype(np.float32))
    return {
        "spot": {"type": "falloffspot", "position": [1, 3, 0], "intensity": 20.0},
        "spot2": {
            "type": "falloffspot",
            "position": [-1, 3, 0],
            "attenuation": [0, 0, 2],
            "intensity": 30.0,
        },
        "beam": {
            "type": "parallelbeam",
            "origin": [-0.5, 4, -0.5],
            "edge_u": [1, 0, 0],
            "edge_v": [0, 0, 1],
            "direction": [0, -1, 0],
            "irradiance": 3.0,
        },
        "lamp": {
            "type": "rectangle",
            "to_world": t.translate([0, 2, -1.5]).scale(0.4),
            "bsdf": BLACK,
            "light": {"type": "twosidedarea", "radiance": 5.0},
        },
        "dome": {
            "type": "sphere",
            "radius": 8.0,
            "bsdf": BLACK,
            "light": {"type": "ibldome", "bitmap": sky, "map": "panoramic"},
        },
    }


def scene(integrator, **some):
    t = mi.ScalarTransform4f()
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator,
            "floor": {
                "type": "rectangle",
                "to_world": t.rotate([1, 0, 0], -90).scale(2),
                "bsdf": {"type": "diffuse", "reflectance": 0.5},
            },
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": t.look_at(origin=[0, 2, 5], target=[0, 0, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
            **some,
        }
    )


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["path", "volpath", "ptracer"])
def test_lights_add_up(integrator, measure, chance):
    """A floor under five lights is as bright as under each of them in turn.

    The lamp hides a thousandth of the dome from the floor.
    """
    depth = {"type": integrator, "max_depth": 2}
    spp = 6144 if integrator == "ptracer" else 256
    everything = measure(scene(depth, **lights()), spp=spp)
    each = [measure(scene(depth, **{name: light}), spp=spp) for name, light in lights().items()]
    total, variance = sum(one.mean for one in each), sum(one.variance for one in each)
    dof = variance**2 / sum(one.variance**2 / one.dof for one in each)
    chance.equal(everything, Level(total, variance, dof), allowed=2e-3, precision=0.04)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("name", ["llvm_ad_mono", "llvm_ad_spectral"])
def test_other_variants(name, measure, chance):
    """Grey light is equally bright in every variant, to 0.5 %."""
    means = []
    for variant in ("llvm_ad_rgb", name):
        mi.set_variant(variant)
        grey = lights()
        grey["dome"]["light"]["bitmap"] = mi.Bitmap(np.full((9, 17, 3), 0.5, dtype=np.float32))
        means.append(measure(scene({"type": "path", "max_depth": 3}, **grey), spp=256))
    chance.equal(means[1], means[0], allowed=5e-3, precision=0.01)


def test_plugins_print_themselves():
    for light in lights().values():
        assert any(name in str(mi.load_dict(light)) for name in ("Spot", "Beam", "Area", "Dome"))


def test_lights_without_a_shape_disturb_nobody(measure):
    """Dr.Jit traces every living emitter, also those that no scene uses: they must stay inert."""
    alone = [
        mi.load_dict({"type": "twosidedarea"}),
        mi.load_dict({"type": "ibldome", "bitmap": mi.Bitmap(np.ones((2, 4, 3), "f4"))}),
        mi.load_dict({"type": "falloffspot", "attenuation": [1, 0, 0]}),
    ]
    two = {name: light for name, light in lights().items() if name in ("spot", "lamp")}
    for integrator in ("path", "ptracer"):
        measured = measure(scene({"type": integrator, "max_depth": 2}, **two), spp=64, runs=2)
        assert np.all(measured.mean > 0.0)
    assert len(alone) == 3


def test_dome_belongs_on_a_sphere(measure):
    """On any other shape it gives no light."""
    image = mi.Bitmap(np.ones((2, 4, 3), dtype=np.float32))
    wrong = {"type": "cube", "light": {"type": "ibldome", "bitmap": image}}
    measured = measure(scene({"type": "path"}, wrong=wrong), spp=4, runs=2)
    np.testing.assert_array_equal(measured.mean, 0.0)
