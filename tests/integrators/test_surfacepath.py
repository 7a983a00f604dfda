"""`surfacepath`: the stock path tracer, and where that has no answer, closed forms.

Surfaces that light crosses straight on are the matter of `test_seethrough.py`, dispersion that of
`test_hero_wavelength.py`.
"""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    integrators,  # noqa: F401
)

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono")
WARD = {"type": "ward", "alpha_u": 0.2, "alpha_v": 0.3}
GLASS = {"type": "schlickglass", "int_ior": 1.5}
MASK = {"type": "mask", "opacity": 0.5, "nested": {"type": "diffuse"}}
BOX = {"type": "box"}


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def film(size, pixel_format="rgb"):
    known = "luminance" if mi.is_monochromatic else pixel_format
    return {"type": "hdrfilm", "width": size, "height": size, "rfilter": BOX, "pixel_format": known}


def cornell(bsdf, integrator, size=16, **options):
    """The Cornell box with both blocks of a material, and a wide lamp."""
    d = mi.cornell_box()
    d["light"]["to_world"] = d["light"]["to_world"] @ mi.ScalarTransform4f().scale(4)
    d["integrator"] = {"type": integrator, **options}
    d["sensor"]["film"] = film(size)
    d["small-box"]["bsdf"] = d["large-box"]["bsdf"] = bsdf
    return mi.load_dict(d)


def rendered(scene, spp=16, seed=3, **options):
    return np.array(mi.render(scene, spp=spp, seed=seed, **options))


# ------------------------------ the stock path tracer ------------------------------


@pytest.mark.parametrize("variant", VARIANTS, indirect=True)
@pytest.mark.parametrize("options", [{}, {"max_depth": 2}, {"max_depth": 1}, {"max_depth": 6}])
@pytest.mark.parametrize("bsdf", [GLASS, WARD, {"type": "roughconductor"}], ids=lambda m: m["type"])
def test_is_path_where_roulette_does_not_act(variant, bsdf, options):
    """The same numbers from the same seed, pixel by pixel, to float32's rounding.

    Rounding may turn a path at a glass edge: one pixel in a hundred may differ.
    """
    options = {"max_depth": 8, "rr_depth": 100} | options
    a, b = (rendered(cornell(bsdf, name, **options)) for name in ("path", "surfacepath"))
    assert np.mean(np.abs(a - b) > 1e-4 * (np.abs(a) + 1e-3)) < 0.01
    assert a.mean() == pytest.approx(b.mean(), rel=1e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("rr_depth", [1, 3])
def test_roulette_keeps_the_mean(rr_depth, chance, level):
    """As `path` without roulette, in blocks of the picture, with glass and mirrors in the box."""
    a, b = (
        level(
            chance.runs(cornell(GLASS, name, max_depth=12, rr_depth=rr), spp)
            .reshape(8, 4, 4, 4, 4, 3)
            .mean(axis=(2, 4))
        )
        for name, rr, spp in (("surfacepath", rr_depth, 128), ("path", 100, 64))
    )
    chance.equal(a, b, precision=0.15)


@pytest.mark.parametrize("integrator", ["path", "surfacepath"])
def test_hidden_emitters(integrator):
    """Lamps are passed by rays from the sensor, skies are not seen; both still give light."""
    area = {"type": "area", "radiance": 7.0}
    T = mi.ScalarTransform4f()
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "hide_emitters": True, "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "fov": 40,
                "to_world": T.look_at([0, 0, 9], [0, 0, 0], [0, 1, 0]),
                "film": film(9, "rgba"),
            },
            "sky": {"type": "constant", "radiance": 1.0},
            "floor": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 1.0}},
            "lamp": {
                "type": "disk",
                "to_world": T.translate([0, 0, 4]).rotate([1, 0, 0], 180),
                "emitter": area,
                "bsdf": {"type": "diffuse", "reflectance": 0.0},
            },
        }
    )
    picture = rendered(scene, spp=2048)
    assert picture[0, 0] == pytest.approx([0, 0, 0, 0])  # sky
    share = 1 / 17  # of what the middle of the floor sees
    assert picture[4, 4] == pytest.approx([7 * share + 1 - share] * 3 + [1], rel=0.02)


# ---------------------------------- long paths ----------------------------------


def room(bsdf, **options):
    """A closed box that emits 1, seen from inside."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "surfacepath", **options},
            "sensor": {"type": "perspective", "fov": 60, "film": film(8)},
            "walls": {
                "type": "cube",
                "flip_normals": True,
                "bsdf": bsdf,
                "light": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
            },
        }
    )


WALLS = {
    "matt": lambda a: {"type": "diffuse", "reflectance": {"type": "rgb", "value": a}},
    "mirror": lambda a: {"type": "conductor", "specular_reflectance": {"type": "rgb", "value": a}},
}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(("albedo", "spp"), [(0.8, 64), (0.99, 64), (0.999, 16), (0.9999, 4)])
@pytest.mark.parametrize("walls", WALLS)
def test_closed_rooms(walls, albedo, spp, chance, level):
    """L = 1 + a L = 1 / (1 - a), with no more noise than the lengths of paths have."""
    pictures = chance.runs(room(WALLS[walls](albedo), rr_depth=1), spp).mean(axis=(1, 2, 3))
    precision = 2 / np.sqrt(8 * 64 * spp)
    chance.equal(level(pictures), 1 / (1 - albedo), allowed=1e-4, precision=precision)


@pytest.mark.parametrize("max_depth", [1, 2, 7])
def test_longest_path_in_a_room(max_depth):
    """1 + a + ... + a^(n - 1), exactly between mirrors while roulette does not act."""
    made = room(WALLS["mirror"](0.8), max_depth=max_depth, rr_depth=100)
    expected = (1 - 0.8**max_depth) / (1 - 0.8)
    assert rendered(made) == pytest.approx(expected, rel=1e-5)


def tunnel(length):
    """Two perfect mirrors, 2 apart, between which a ray crosses `length` times before the sky."""
    T = mi.ScalarTransform4f()

    def side(x):
        return {
            "type": "rectangle",
            "to_world": T.translate([x, 0, 0]).rotate([0, 1, 0], 90).scale(length),
            "bsdf": {"type": "twosided", "bsdf": {"type": "conductor"}},
        }

    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "surfacepath"},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
            "sensor": {
                "type": "perspective",
                "fov": 1e-3,
                "to_world": T.look_at([0, 0, 0], [1, 0, 0.5], [0, 1, 0]),
                "film": film(8),
            },
            "left": side(-1),
            "right": side(1),
        }
    )


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(("length", "spp"), [(50, 1024), (200, 512), (1000, 256)])
def test_light_that_loses_nothing_on_its_way(length, spp, chance, level):
    """Perfect mirrors pass on all of the light, whatever roulette makes of single paths."""
    pictures = chance.runs(tunnel(length), spp).mean(axis=(1, 2, 3))
    chance.equal(level(pictures), 1, allowed=1e-4, precision=0.05)


def test_perfect_mirrors_are_left():
    """Between them a path would never end; without light there it finds none."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "surfacepath"},
            "sensor": {"type": "perspective", "film": film(8)},
            "walls": {"type": "cube", "flip_normals": True, "bsdf": {"type": "conductor"}},
            "lamp": {"type": "point", "position": [0, 0, 0], "intensity": 1.0},
        }
    )
    assert np.array_equal(rendered(scene, spp=64), np.zeros((8, 8, 3)))


# ------------------------------------ nesting ------------------------------------


@pytest.mark.parametrize("bsdf", [GLASS, MASK])
def test_parts_of_the_light_add_up(bsdf):
    """Emitters, direct light and the rest, from the same numbers, are the whole picture."""
    lengths = ({}, {"max_depth": 1}, {"min_depth": 2, "max_depth": 2}, {"min_depth": 3})
    whole, *parts = (rendered(cornell(bsdf, "surfacepath", **options)) for options in lengths)
    assert all(part.max() > 0.1 for part in parts)
    if bsdf is GLASS:  # rays through masks end at other numbers where paths are shorter
        assert sum(parts) == pytest.approx(whole, rel=1e-4, abs=1e-5)
    assert sum(part.mean() for part in parts) == pytest.approx(whole.mean(), rel=0.02)


def test_range_of_depths_keeps_the_rest():
    """The part of an integrator has its other parameters, and stays within its range."""
    options = {"min_depth": 2, "max_depth": 9, "rr_depth": 7, "hide_emitters": True}
    whole = mi.load_dict({"type": "surfacepath", **options})
    assert str(whole.with_depth_range(1, 100)) == str(whole)
    part = whole.with_depth_range(3, 5)
    assert str(part) == str(whole).replace("min_depth=2, max_depth=9", "min_depth=3, max_depth=5")
    unlimited = mi.load_dict({"type": "surfacepath"})
    assert str(unlimited.with_depth_range(1, unlimited.max_depth)) == str(unlimited)


@pytest.mark.parametrize("outer", ["aov", "moment", "samplescale", "shadowcatching"])
def test_nests(outer):
    """Inside others: the same samples in the first channels."""
    plain = {"type": "surfacepath", "max_depth": 4}
    options = {"aovs": "depth:depth"} if outer == "aov" else {}
    scene = cornell(WARD, "path")
    pictures = [
        rendered(scene, integrator=mi.load_dict(entry))[..., :3]
        for entry in (plain, {"type": outer, "nested": plain, **options})
    ]
    assert np.allclose(*pictures, rtol=1e-5)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("direct_samples", [0.0, 0.5])
@pytest.mark.parametrize("outer", ["pssmlt", "erpt"])
def test_chains_take_its_paths(outer, direct_samples, chance, level):
    """Metropolis pictures have its mean, with direct light in the chains or apart."""
    plain = {"type": "surfacepath", "max_depth": 5}
    scene = cornell(WARD, "path")
    chains = {"type": outer, "nested": plain, "direct_samples": direct_samples}
    chains |= {"fallback": False} if outer == "pssmlt" else {"length": 32}
    a, b = (
        level(chance.runs(scene, 64, integrator=mi.load_dict(entry)).mean(axis=(1, 2, 3)))
        for entry in (chains, plain)
    )
    chance.equal(a, b, precision=0.03)


# ---------------------------------- derivatives ----------------------------------

PARAMETERS = ("red.reflectance.value", "light.emitter.radiance.value", "bsdf.alpha_u.value")


def derivative(scene, suffix, seed=5):
    """Derivative of the mean of a picture by the parameter that ends so, forward and backward."""
    name = next(key for key in mi.traverse(scene).properties if key.endswith(suffix))
    results = []
    for forward in (True, False):
        parameters = mi.traverse(scene)
        x = mi.Float(0)
        dr.enable_grad(x)
        value = dr.detach(parameters[name])
        parameters[name] = value + x
        parameters.update()
        picture = mi.render(scene, parameters, spp=64, seed=1, seed_grad=seed)
        if forward:
            dr.forward(x)
            results.append(np.array(dr.grad(picture)).mean())
        else:
            dr.backward(dr.mean(picture, axis=None))
            results.append(dr.grad(x)[0])
        parameters[name] = value
        parameters.update()
    return results


@pytest.mark.parametrize("parameter", PARAMETERS)
def test_derivatives_are_those_of_prb(parameter):
    """The same numbers from the same seed, forward and backward."""
    a, b = (
        derivative(cornell(WARD, name, size=4, max_depth=3, rr_depth=4), parameter)
        for name in ("prb", "surfacepath")
    )
    assert b == pytest.approx(a, rel=1e-3)
    assert abs(a[0]) > 1e-5


def test_derivative_by_a_lamp_behind_a_mask():
    """The picture is linear in the lamp: its derivative is a difference from the same numbers."""
    scene = cornell(MASK, "surfacepath", size=4, max_depth=3)
    name = "light.emitter.radiance.value"
    found = derivative(scene, name, seed=5)
    means = []
    for extra in (0.0, 1.0):
        parameters = mi.traverse(scene)
        parameters[name] = parameters[name] + extra
        parameters.update()
        means.append(rendered(scene, spp=64, seed=5).mean())
    assert found == pytest.approx([means[1] - means[0]] * 2, rel=1e-3)


# ------------------------------------ running ------------------------------------


def kernels(scene, seed):
    """The kernels of a render: (compiled anew, all)."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(mi.render(scene, spp=4, seed=seed))
        history = [entry for entry in dr.kernel_history() if entry["type"] == dr.KernelType.JIT]
    return sum(not entry["cache_hit"] for entry in history), len(history)


@pytest.mark.parametrize("bsdf", [WARD, MASK])
def test_a_pass_is_as_many_kernels_as_one_of_path_and_none_is_new(bsdf):
    """The second pass takes all of its kernels from the cache."""
    made, stock = (cornell(bsdf, name, max_depth=4) for name in ("surfacepath", "path"))
    first, second, usual = kernels(made, 1), kernels(made, 2), kernels(stock, 1)
    assert second == (0, usual[1])
    assert first[1] == second[1]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"max_depth": -2}, "max_depth is -2, but must be -1 or more"),
        ({"min_depth": 0}, "min_depth is 0, but must be 1 or more"),
        ({"rr_depth": 0}, "rr_depth is 0, but must be above 0"),
    ],
)
def test_errors(wrong, message):
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "surfacepath", **wrong})
