"""Surfaces that light crosses straight on, before all lamps, under `surfacepath`.

Each picture is that of one point, whose radiance is known. A floor of reflectance rho under a point
lamp of intensity I at height h shows rho I / (pi h^2), under a parallel beam of irradiance E
rho E / pi, and under a disk lamp of radius R and radiance L rho L R^2 / (R^2 + h^2).
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
from relume.integrators.seethrough import Surfaces

RHO, HEIGHT = 0.5, 10.0


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("llvm_ad_rgb")


def transform():
    return mi.ScalarTransform4f()


def rgb(value):
    return {"type": "rgb", "value": float(value)}


def diffuse(reflectance):
    return {"type": "diffuse", "reflectance": rgb(reflectance)}


def mask(opacity, bsdf=None):
    return {"type": "mask", "opacity": opacity, "bsdf": bsdf or diffuse(RHO)}


def square(z, bsdf, **more):
    """A square of side 8 at height z, facing up."""
    to_world = transform().translate([0, 0, z]).scale(4)
    return {"type": "rectangle", "to_world": to_world, "bsdf": bsdf, **more}


def scene(eye=(5, 0, 20), integrator="surfacepath", depth=-1, **things):
    """Scene of a sensor that sees the origin."""
    film = {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": depth},
            "sensor": {
                "type": "perspective",
                "fov": 0.05,
                "to_world": transform().look_at(list(eye), [0, 0, 0], [0, 1, 0]),
                "film": film | {"pixel_format": "rgba"},
            },
            **things,
        }
    )


def shown(scene, spp=256, seed=1):
    """Mean of the picture: (red, alpha)."""
    return np.array(mi.render(scene, spp=spp, seed=seed)).mean(axis=(0, 1))[[0, 3]]


def floor():
    return square(0, diffuse(RHO))


def disk_lamp(radiance, z=HEIGHT, **more):
    """A disk of radius 1 that faces down."""
    to_world = transform().translate([0, 0, z]).rotate([1, 0, 0], 180)
    lamp = {"type": "area", "radiance": rgb(radiance)}
    black = {"bsdf": diffuse(0)}
    return {"type": "disk", "to_world": to_world, "emitter": lamp, **black, **more}


LIT = RHO / HEIGHT**2
"""What the floor shows of a lamp of intensity pi."""

LAMPS = {
    "point": ({"type": "point", "position": [0, 0, HEIGHT], "intensity": math.pi}, LIT),
    "spot": (
        lambda: {
            "type": "spot",
            "intensity": math.pi,
            "to_world": transform().look_at([0, 0, HEIGHT], [0, 0, 0], [0, 1, 0]),
        },
        LIT,
    ),
    "parallel": ({"type": "directional", "direction": [0, 0, -1], "irradiance": math.pi}, RHO),
    "sky": ({"type": "constant", "radiance": 1.0}, RHO),
    "disk": (lambda: disk_lamp(1), RHO / (1 + HEIGHT**2)),
}


def lamp(name):
    entry, radiance = LAMPS[name]
    return entry() if callable(entry) else entry, radiance


CLEAR = {
    "mask": lambda: mask(0.0),
    "texture": lambda: mask({"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(np.zeros((2, 2)))}),
    "null": lambda: {"type": "null"},
    "glass": lambda: {"type": "schlickglass", "int_ior": 1.0, "fresnel": "exact"},
}


@pytest.mark.parametrize("clear", CLEAR)
@pytest.mark.parametrize("name", [name for name in LAMPS if name not in ("sky", "disk")])
def test_lamps_that_rays_never_meet_shine_through(name, clear):
    """Spot, point and parallel light under a surface that is not there: as without it."""
    entry, radiance = lamp(name)
    picture = shown(scene(floor=floor(), lamp=entry, clear=square(5, CLEAR[clear]())))
    assert picture == pytest.approx([radiance, 1], rel=1e-4)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("clear", CLEAR)
@pytest.mark.parametrize("name", ["sky", "disk"])
def test_lamps_that_rays_meet_shine_through(name, clear, chance, level):
    """Both ways to find a lamp see through a surface, and together they count it once."""
    entry, radiance = lamp(name)
    made = scene(floor=floor(), lamp=entry, clear=square(5, CLEAR[clear]()))
    pictures = chance.runs(made, 256).mean(axis=(1, 2))
    # The floor sees the sky beside the square, too; what the square reflects is 0.
    chance.equal(level(pictures[:, 0]), radiance, allowed=1e-4, precision=0.01)


@pytest.mark.parametrize("opacities", [(0.5,), (0.5, 0.2), (0.3, 0.3, 0.3, 0.3)])
def test_masks_multiply(opacities):
    """Point light through a stack of black masks: the product of their transmittances."""
    stack = {f"m{i}": square(1 + i, mask(x, diffuse(0))) for i, x in enumerate(opacities)}
    entry, radiance = lamp("point")
    made = scene(eye=(9, 0, 1), floor=floor(), lamp=entry, **stack)
    left = math.prod(1 - x for x in opacities)
    assert shown(made) == pytest.approx([left * radiance, 1], rel=1e-4)


@pytest.mark.false_alarms(1e-3)
def test_grey_glass_in_the_light_of_a_disk(chance, level):
    """Index-matched glass of tint 0.6: 0.6 of the light, found by either way."""
    tint = {"type": "schlickglass", "int_ior": 1.0, "fresnel": "exact"}
    tint["specular_transmittance"] = 0.6
    wide = disk_lamp(1, z=1.0)
    made = scene(eye=(9, 0, 0.3), floor=floor(), lamp=wide, glass=square(0.5, tint))
    pictures = chance.runs(made, 1024).mean(axis=(1, 2))
    chance.equal(level(pictures[:, 0]), 0.6 * RHO / 2, allowed=1e-4, precision=0.005)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["surfacepath", "randomwalk", "bdpt"])
def test_a_lamp_in_the_middle_of_glass(integrator, chance, level):
    """A ball lamp of radiance L and radius R at the distance D, in the middle of an index-matched
    ball: rho L R²/D² of the floor. A shadow ray that left the ball beside its line would miss one
    point in forty, near the lamp's edge."""
    radius, distance = 0.1, 1.0
    lamp = {"type": "sphere", "center": [0, 0, distance], "radius": radius, "bsdf": diffuse(0)}
    lamp["emitter"] = {"type": "area", "radiance": rgb(1 / radius**2)}
    ball = {"type": "sphere", "center": [0, 0, distance], "radius": 0.3, "bsdf": CLEAR["glass"]()}
    made = scene(eye=(5, 0, 2), integrator=integrator, floor=floor(), lamp=lamp, ball=ball)
    pictures = chance.runs(made, 1024).mean(axis=(1, 2))
    chance.equal(level(pictures[:, 0]), RHO / distance**2, allowed=1e-4, precision=5e-3)


@pytest.mark.false_alarms(1e-3)
def test_half_a_surface_under_a_lamp(chance, level):
    """d rho L R^2/D^2 of a surface of opacity d, though half of its samples pass on; alpha is d."""
    things = {"half": square(0, mask(0.5)), "lamp": disk_lamp(100, z=30)}
    pictures = chance.runs(scene(**things), 256).mean(axis=(1, 2))
    lit = 0.5 * RHO * 100 / 901
    chance.equal(level(pictures[:, 0]), lit, allowed=1e-4, precision=1e-3, of=2)
    chance.equal(level(pictures[:, 3]), 0.5, precision=0.02, of=2)


@pytest.mark.parametrize("opacity", [0.25, 1.0])
@pytest.mark.false_alarms(1e-3)
def test_lamp_with_a_mask_shines_as_far_as_it_is_there(opacity, chance, level):
    """Seen, by emitter sampling and by BSDF sampling: opacity times its light; the rest passes."""
    shining = {"emitter": {"type": "area", "radiance": rgb(2.0)}}
    sky = {"type": "constant", "radiance": rgb(0.1)}
    seen = scene(lamp=square(0, mask(opacity, diffuse(0)), **shining), sky=sky)
    mean = chance.runs(seen, 256).mean(axis=(1, 2))[:, 0]
    expected = opacity * 2 + (1 - opacity) * 0.1
    chance.equal(level(mean), expected, allowed=1e-4, precision=0.05, of=3)
    for z, near in ((HEIGHT, 0), (1.0, 1)):
        masked = disk_lamp(100, z=z, bsdf=mask(opacity, diffuse(0)))
        lit = scene(eye=(9, 0, 0.3) if near else (5, 0, 20), floor=floor(), lamp=masked)
        mean = chance.runs(lit, 512).mean(axis=(1, 2))[:, 0]
        expected = opacity * RHO * 100 / (1 + z**2)
        chance.equal(level(mean), expected, allowed=1e-4, precision=0.01, of=3)


def test_lamp_that_is_not_there_gives_no_light():
    """Opacity 0: black, and transparent."""
    masked = disk_lamp(100, z=1.0, bsdf=mask(0.0, diffuse(0)))
    assert np.array_equal(shown(scene(eye=(9, 0, 0.3), floor=floor(), lamp=masked)), [0, 1])
    assert np.array_equal(shown(scene(eye=(0, 0, -9), lamp=masked)), [0, 0])


def test_texture_on_a_lamp_is_looked_up_where_it_is_sampled():
    """A lamp that is there on one half alone lights a floor below the middle by half."""
    picture = np.repeat([[0.0, 1.0]], 2, axis=0)
    texture = {"type": "bitmap", "raw": True, "filter_type": "nearest"}
    texture["bitmap"] = mi.Bitmap(picture)
    shape = square(0, mask(texture, diffuse(0)))
    shape["to_world"] = transform().translate([0, 0, 200]).rotate([1, 0, 0], 180)
    shape["emitter"] = {"type": "area", "radiance": rgb(1e4)}
    made = scene(eye=(5, 0, 20), floor=floor(), lamp=shape, depth=2)
    full = RHO / math.pi * 1e4 * 4 / 200**2
    assert shown(made, spp=4096)[0] == pytest.approx(full / 2, rel=0.01)


@pytest.mark.parametrize("bsdf", [{"type": "null"}, {"type": "schlickglass", "int_ior": 1.0}])
def test_lamp_without_a_mask_shines_fully(bsdf):
    """What else passes light does not hold back that of the lamp itself."""
    shining = {"emitter": {"type": "area", "radiance": rgb(2.0)}}
    masked = square(-1, mask(1.0, diffuse(0)), **shining)
    made = scene(lamp=square(0, bsdf, **shining), masked=masked)
    assert Surfaces(made).masked_lamps
    assert shown(made) == pytest.approx([2 + 2, 1], rel=1e-4)


def test_ray_that_only_looks_through_is_transparent():
    """Alpha is 0 behind masks alone and 1 where they stand before a sky or a surface."""
    veils = {f"veil{i}": square(i, mask(0.0)) for i in range(3)}
    sky = {"type": "constant", "radiance": 1.0}
    assert np.array_equal(shown(scene(**veils)), [0, 0])
    assert shown(scene(**veils, sky=sky)) == pytest.approx([1, 1])
    assert shown(scene(**veils, back=square(-1, diffuse(0.5)))) == pytest.approx([0, 1])


@pytest.mark.parametrize("max_depth", [1, 2, 3])
def test_surfaces_that_light_crosses_do_not_lengthen_paths(max_depth):
    """As without them, whatever the longest path is."""
    lamps = {"lamp": disk_lamp(50, z=3.0), "side": square(4, diffuse(0.5))}
    veils = {f"veil{i}": square(0.1 + i / 2, mask(0.0)) for i in range(5)}
    bare, veiled = (
        shown(scene(depth=max_depth, eye=(4, 0, 1), floor=floor(), **lamps, **more), spp=16384)[0]
        for more in ({}, veils)
    )
    assert veiled == pytest.approx(bare, rel=0.02, abs=1e-6)


def test_shadow_rays_end_far_from_the_origin():
    """Where rays start by as much beside a surface as veils are apart, none goes back and forth."""
    far = 1e5
    to_world = transform().translate([0, 0, far])

    def moved(z, bsdf):
        shape = square(z, bsdf)
        return shape | {"to_world": to_world @ shape["to_world"]}

    made = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "surfacepath"},
            "sensor": {
                "type": "perspective",
                "fov": 5,
                "to_world": to_world @ transform().look_at([5, 0, 40], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 4, "height": 4},
            },
            "floor": moved(0, diffuse(RHO)),
            "lamp": {"type": "point", "position": [0, 0, far + 35], "intensity": 1.0},
            **{f"veil{i}": moved(30 + 2 * i, mask(0.0)) for i in range(9)},
        }
    )
    assert np.array(mi.render(made, spp=16)).mean() == pytest.approx(
        RHO / math.pi / 35**2, rel=0.05
    )


def test_longest_path_ends_behind_what_light_crosses():
    """Paths of one segment show a lamp behind veils."""
    shining = {"emitter": {"type": "area", "radiance": rgb(2.0)}}
    things = {f"veil{i}": square(1 + i, mask(0.0)) for i in range(3)}
    lamp_behind = square(0, diffuse(0), **shining)
    assert shown(scene(depth=1, lamp=lamp_behind, **things)) == pytest.approx([2, 1])


@pytest.mark.false_alarms(1e-3)
def test_shadow_catcher_is_solid_for_emitter_sampling(chance, level):
    """A surface that passes light without telling how much: a small floor under a black one.

    Its light comes by BSDF sampling alone, and with its full weight, as under `path`.
    """
    small = {"to_world": transform().scale(0.1)}
    catcher = square(0.5, {"type": "shadowcatcher", "reflectance": rgb(0)})
    sky = {"type": "constant", "radiance": 1.0}
    made = scene(eye=(9, 0, 0.3), floor=floor() | small, catcher=catcher, sky=sky)
    a, b = (
        level(
            chance.runs(
                made, 256, integrator=mi.load_dict({"type": "shadowcatching", "nested": nested})
            ).mean(axis=(1, 2))[:, 0]
        )
        for nested in ({"type": "surfacepath"}, {"type": "path"})
    )
    assert b.mean > 0.9 * RHO
    chance.equal(a, b, precision=0.01)


INSTANCED = {"type": "instance", "group": {"type": "ref", "id": "group"}}


@pytest.mark.parametrize("instanced", [False, True])
def test_scene_pays_for_what_it_has(instanced):
    """Surfaces are found in instances and inside other materials, and only where they are."""
    glass = {"type": "schlickglass", "dispersion": "cauchy6", "coefficients": "2.25 0 0.01"}
    blend = {"type": "blendbsdf", "weight": 0.5, "a": glass, "b": diffuse(0.5)}

    def found(bsdf):
        shape = square(0, bsdf)
        group = {"group": {"type": "shapegroup", "shape": shape}, "instance": INSTANCED}
        surfaces = Surfaces(scene(**(group if instanced else {"shape": shape})))
        return surfaces.see_through, surfaces.disperse

    assert found(diffuse(0.5)) == (False, False)
    assert found({"type": "dielectric"}) == (False, False)
    assert found(mask(0.5)) == (True, False)
    assert found(glass) == (False, False)  # of one index where there are no wavelengths
    mi.set_variant("llvm_ad_spectral")
    assert found(diffuse(0.5)) == (False, False)
    assert found(glass) == found(blend) == (False, True)
    assert found(mask(0.5, glass)) == (True, True)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("variant_name", ["llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono"])
def test_agrees_with_volpath(variant_name, chance, level):
    """A box with masks, null surfaces and thin glass, in every variant."""
    mi.set_variant(variant_name)
    box = mi.cornell_box()
    box["light"]["to_world"] = box["light"]["to_world"] @ transform().scale(3)
    film = {"type": "hdrfilm", "width": 12, "height": 12, "rfilter": {"type": "box"}}
    box["sensor"]["film"] = film | {"pixel_format": "luminance"}
    box["small-box"]["bsdf"] = {"type": "mask", "opacity": 0.4, "b": {"type": "diffuse"}}
    box["large-box"]["bsdf"] = {"type": "thindielectric"}
    box["veil"] = {"type": "sphere", "radius": 0.6, "bsdf": {"type": "null"}}
    made = mi.load_dict(box)
    a, b = (
        level(
            chance.runs(made, 128, integrator=mi.load_dict({"type": name, "max_depth": 6}))
            .reshape(8, 4, 3, 4, 3)
            .mean(axis=(2, 4))
        )
        for name in ("surfacepath", "volpath")
    )
    chance.equal(a, b, precision=0.1)


# ------------------------------ lamps seen from within ------------------------------


@pytest.mark.parametrize("opacity", [0.25, 0.5, 0.9])
def test_a_white_ball_with_holes_that_shines(opacity):
    """d + S: white walls add the sky's S, inside and out; their inner side does not shine.

    Points of a sphere are as often before it as within, to single precision: none of its lamp's
    samples may light its inner side.
    """
    lamp = {"type": "area", "radiance": rgb(1)}
    ball = {"type": "sphere", "radius": 3, "bsdf": mask(opacity, twosided(1)), "emitter": lamp}
    made = scene((5, 0, 20), ball=ball, sky={"type": "constant", "radiance": rgb(0.1)})
    assert shown(made, 2048)[0] == pytest.approx(opacity + 0.1, rel=5e-3)


@pytest.mark.parametrize("integrator", ["surfacepath", "dipole"])
@pytest.mark.parametrize(
    ("emitter", "bsdf", "expected"),
    [("area", "opaque", 0), ("twosidedarea", "opaque", 2), ("twosidedarea", "half there", 2 / 3)],
)
def test_inside_a_ball_that_shines(integrator, emitter, bsdf, expected):
    """Lamps of one side leave it dark; those of two give d + d rho u = u, d its opacity."""
    walls = {"opaque": twosided(0.5), "half there": mask(0.5, twosided(0.5))}[bsdf]
    lamp = {"type": emitter, "radiance": rgb(1)}
    ball = {"type": "sphere", "radius": 3, "bsdf": walls, "emitter": lamp}
    far = {"type": "sphere", "center": [0, 500, 0], "bsdf": {"type": "subsurface"}}
    made = scene((1, 2, 0.5), integrator, ball=ball, far=far)
    assert shown(made, 1024)[0] == pytest.approx(expected, rel=0.01)


def twosided(reflectance):
    return {"type": "twosided", "bsdf": diffuse(reflectance)}
