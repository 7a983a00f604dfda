"""Shadow catchers in pictures: what shines through them and what they show.

With V the share of open directions, weighted by their cosine, and L_b the radiance behind, a
catcher below black things shows V L_b; things of radiance L_o with the form factor F add
rho F L_o.
"""

import math

import mitsuba as mi
import numpy as np
import pytest

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    emitters,  # noqa: F401
    integrators,  # noqa: F401
)

RHO = np.array([0.5, 0.4, 0.3])
SKY = np.array([1.0, 2.0, 3.0])


def rgb(value):
    return {"type": "rgb", "value": list(np.broadcast_to(value, 3))}


def sky_picture():
    return mi.Bitmap(np.broadcast_to(SKY, (8, 16, 3)).astype(np.float32))


BLACK = {"type": "conductor", "specular_reflectance": 0.0}
SKIES = {
    "constant": lambda: {"type": "constant", "radiance": rgb(SKY)},
    "envmap": lambda: {"type": "envmap", "bitmap": sky_picture()},
    "ibldome": lambda: {
        "type": "sphere",
        "radius": 50.0,
        "bsdf": BLACK,
        "light": {"type": "ibldome", "bitmap": sky_picture(), "map": "panoramic"},
    },
}
INTEGRATORS = ("path", "volpath")


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def transform():
    return mi.ScalarTransform4f()


def floor(reflectance=RHO):
    """A catcher in the plane z = 0."""
    return {
        "type": "rectangle",
        "to_world": transform().scale(20),
        "bsdf": {"type": "shadowcatcher", "reflectance": rgb(reflectance)},
    }


def disk(**more):
    """A disk of radius 1 at height 2 facing down: F = 1 / (1 + 4) = 0.2 from below its centre."""
    to_world = transform().translate([0, 0, 2]).rotate([1, 0, 0], 180)
    return {"type": "disk", "to_world": to_world, "bsdf": BLACK} | more


def seen(sky, integrator="path", eye=(2.5, 0, 1), **things):
    """Scene of a sensor at `eye` that sees the origin."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {
                "type": "shadowcatching",
                "nested": {"type": integrator, "max_depth": -1, "rr_depth": 100},
            },
            "sky": SKIES[sky](),
            "sensor": {
                "type": "perspective",
                "fov": 0.05,
                "to_world": transform().look_at(list(eye), [0, 0, 0], [0, 1, 0]),
                "film": {
                    "type": "hdrfilm",
                    "width": 4,
                    "height": 4,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                },
            },
            **things,
        }
    )


@pytest.fixture
def shows(chance, level):
    """Judge whether a scene shows a radiance, (3,), with a standard error below 0.3 %."""

    def judge(scene, expected, spp=4096, of=1):
        measured = level(chance.runs(scene, spp).mean(axis=(1, 2)))
        chance.equal(measured, expected, allowed=1e-4, precision=3e-3, of=of)

    return judge


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("sky", SKIES)
def test_invisible_without_occluders(sky, integrator):
    """V = 1: every sample goes straight on, so the surface shows the sky behind without noise."""
    picture = np.array(mi.render(seen(sky, integrator, floor=floor()), spp=64))
    assert np.allclose(picture, SKY, rtol=1e-5)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("sky", SKIES)
def test_below_a_black_disk(sky, integrator, shows):
    """V = 1 - F = 0.8."""
    shows(seen(sky, integrator, floor=floor(), disk=disk()), 0.8 * SKY)


def wall_factor(x, height):
    """Form factor of a wall of infinite width and a height, seen from x before its foot, on a
    surface perpendicular to it: (1 - cos theta) / 2 with tan theta = height / x."""
    return (1 - x / math.hypot(x, height)) / 2


@pytest.mark.false_alarms(1e-3)
def test_before_a_half_blocking_wall(shows):
    """A wall of height 1000 and width 2000 one unit away hides half of the sky: V = 1 - F."""
    wall = {
        "type": "rectangle",
        "to_world": transform().translate([-1, 0, 500]).rotate([0, 1, 0], 90).scale([500, 1000, 1]),
        "bsdf": BLACK,
    }
    expected = (1 - wall_factor(1, 1000)) * SKY
    shows(seen("constant", floor=floor(), wall=wall), expected, spp=8192)


@pytest.mark.false_alarms(1e-3)
def test_shining_occluder_lights_the_shadow(shows):
    """A disk of radiance 5 hides its share and lights it: V sky + rho F 5."""
    lamp = disk(emitter={"type": "area", "radiance": rgb(5)})
    expected = 0.8 * SKY + RHO * 0.2 * 5
    for sky in SKIES:
        shows(seen(sky, floor=floor(), disk=lamp), expected, of=len(SKIES))


@pytest.mark.parametrize("light", ["directional", "point"])
def test_lamps_do_not_light_what_is_open(light):
    """Lamps without surface stand before the sky: no light of theirs is reflected."""
    lamps = {
        "directional": {"type": "directional", "direction": [0, 0, -1], "irradiance": 9.0},
        "point": {"type": "point", "position": [0, 0, 2], "intensity": 9.0},
    }
    picture = np.array(mi.render(seen("constant", floor=floor(), lamp=lamps[light]), spp=64))
    assert np.allclose(picture, SKY, rtol=1e-5)


@pytest.mark.false_alarms(1e-3)
def test_reflecting_disk_under_a_catcher_keeps_energy(shows):
    """Furnace: with a sky of L everywhere and surfaces that lose nothing, all is L.

    A white disk that sees nothing but catchers of reflectance 1 and the sky shines L, and so the
    catcher shows V L + F L = L.
    """
    white = disk(bsdf={"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(1)}})
    shows(seen("constant", floor=floor(1), disk=white), SKY, spp=2048)


def test_scenes_without_catcher_are_as_without_the_integrator():
    """The same samples, bit for bit."""
    things = {
        "type": "scene",
        "sky": SKIES["constant"](),
        "ball": {"type": "sphere", "bsdf": {"type": "diffuse"}},
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
    }
    path = {"type": "path", "max_depth": 4}
    pictures = [
        np.array(mi.render(mi.load_dict(things | {"integrator": integrator}), spp=4))
        for integrator in (path, {"type": "shadowcatching", "nested": path})
    ]
    assert np.array_equal(*pictures)


def test_scene_is_known_only_while_rendering():
    """A catcher does not keep its scene alive: outside a render it knows none."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "shadowcatching", "nested": {"type": "path"}},
            "floor": floor(),
            "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 4}},
        }
    )
    mi.render(scene, spp=1)
    assert scene.shapes()[0].bsdf().scene is None


def test_needs_one_nested_integrator():
    """Without a sampling integrator inside the plugin refuses to load."""
    with pytest.raises(RuntimeError, match="one nested sampling integrator"):
        mi.load_dict({"type": "shadowcatching"})
