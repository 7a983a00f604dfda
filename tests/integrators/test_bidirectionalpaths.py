"""Paths of `bdpt` for Markov chains: each way by itself, their sum, and chains over them."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import relume.integrators
import relume.sensors  # noqa: F401  registers the plugins
from relume.integrators import misweights
from relume.integrators.pathways import LONGEST_LISTED, Ways
from relume.integrators.uniformsamples import uniform_samples
from tests.integrators.test_bdpt import (
    BOX,
    DOWN,
    HEAVY,
    MASK,
    WARD,
    cornell,
    grey,
    integrator,
    lens,
    open_corner,
    sky,
    wide,
)


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def uniform_mean(chance, level, scene, made, count=2**16, runs=8):
    """Mean of all that uniform samples of primary sample space find."""
    paths = made.path_sampler(scene, scene.sensors()[0])
    if made.only:  # no need to draw others
        paths.ways.set_probabilities((paths.ways.listed == made.only).all(1) * 1.0)
    count = chance.samples(count)
    return level(
        [uniform_samples(paths, count, chance.seed()).f.astype(float).mean() for _ in range(runs)]
    )


def picture_mean(chance, level, scene, made, spp, runs=8):
    return level(chance.runs(scene, spp, runs, integrator=made).mean((1, 2, 3)))


# ------------------------------ the ways ------------------------------


@pytest.mark.parametrize(("shortest", "longest"), [(1, 5), (3, 60), (30, 0xFFFFFFFF)])
def test_ways_count_once(shortest, longest):
    """The mean of 0.9^s 0.95^t over the probability of (s, t) is its sum over all ways."""
    ways = Ways(shortest, longest, True, True)
    n = 2**20
    v, w = np.random.default_rng(1).random((2, n))
    u = (np.arange(n) + 0.5) / n
    s, t, weight = ways.pick(*(mi.Float(x.astype(np.float32)) for x in (u, v, w)))
    s, t, weight = (x.numpy().astype(float) for x in (s, t, weight))
    s, t, weight = (x[weight > 0] for x in (s, t, weight))
    assert (s + t - 1).min() == shortest and (s + t - 1).max() <= longest
    found = np.sum(0.9**s * 0.95**t * weight) / n
    lengths = [(k, range(k + 1 if k > 1 else 1)) for k in range(shortest, min(longest, 1000) + 1)]
    wanted = sum(0.9**i * 0.95 ** (k + 1 - i) for k, some in lengths for i in some)
    assert found == pytest.approx(wanted, rel=0.01)


def test_ways_learn_and_forget_none():
    """Light makes a way likely, and none of those that have shown none becomes impossible."""
    ways = Ways(2, 4, True, False)
    assert set(map(tuple, ways.listed)) == {(s, k + 1 - s) for k in (2, 3, 4) for s in range(k)}
    entry = np.repeat(np.arange(len(ways.listed)), 10)
    ways.learn(entry, np.where(entry == 3, 1.0, 0.0))
    p = 1 / ways.weight.numpy()
    assert p[3] > 0.75 and p.min() > 0.005 and p.sum() == pytest.approx(1, rel=1e-5)


# ------------------------------ uniform samples ------------------------------


@pytest.mark.false_alarms(1e-3)
def test_each_way_alone_finds_the_same_light(chance, level):
    """Paths of three edges by s = 0 to 3 vertices from the lamp, against `surfacepath`."""
    scene = mi.load_dict(open_corner())
    depth = {"min_depth": 3, "max_depth": 3}
    reference = picture_mean(chance, level, scene, integrator("surfacepath", **depth), 2**12)
    precision = (0.04, 0.01, 0.008, 0.03)
    for s in range(4):
        made = integrator(only=(s, 4 - s), **depth)
        found = uniform_mean(chance, level, scene, made, 2**16, runs=16)
        chance.equal(found, reference, precision=precision[s], of=4)


def glowing_room(albedo):
    walls = {
        "type": "cube", "flip_normals": True,
        "bsdf": {"type": "diffuse", "reflectance": grey(albedo)},
        "light": {"type": "area", "radiance": grey(1.0)},
    }  # fmt: skip
    sensor = {"type": "perspective", "fov": 140,
              "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": BOX}}  # fmt: skip
    return mi.load_dict({"type": "scene", "sensor": sensor, "walls": walls})


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "wrong", [None, "of_hit", "of_emitter_sample", "of_sensor_connection", "of_connection"]
)
def test_weights_sum_to_one(wrong, chance, level, monkeypatch):
    """a² of paths of three edges in a closed room that shines, to 0.05 %; and any of the weights
    2 % too large is found: 0.25 % of the light or more, six standard errors."""
    made = integrator(min_depth=3, max_depth=3)
    if wrong:
        right = getattr(misweights, wrong)
        monkeypatch.setattr(misweights, wrong, lambda *given: 1.02 * right(*given))
    # Less of the light comes by the camera's connections than by any other way.
    count = 2**17 if wrong in (None, "of_sensor_connection") else 2**16
    found = uniform_mean(chance, level, glowing_room(0.6), made, count, runs=16)
    if not wrong:
        chance.equal(found, 0.36, precision=0.0005)
        return
    with pytest.raises(AssertionError, match="p = "):
        chance.equal(found, 0.36, precision=0.001)


def spotlit():
    return DOWN | {"type": "falloffspot", "position": [0, 0.9, 0], "cutoff_angle": 40,
                   "intensity": grey(4.0)}  # fmt: skip


def masked(bsdf):
    return {"type": "mask", "opacity": 0.5, "nested": bsdf}


def ball_in_view():
    ball = {"type": "sphere", "center": [0, -0.3, 0], "radius": 0.9,
            "emitter": {"type": "area", "radiance": grey(3.0)}}  # fmt: skip
    return mi.load_dict(open_corner() | {"lamp": ball})


MATT = {"type": "diffuse"}
HIDING = {"hide_emitters": True, "min_depth": 3}
CASES = {
    "masks": ("llvm_ad_rgb", lambda: cornell((masked(MATT), masked(WARD)), wide()), {}),
    "hidden lamp": ("llvm_ad_rgb", ball_in_view, HIDING),
    "sky": ("llvm_ad_rgb", lambda: cornell(({"type": "schlickglass"}, WARD), sky()), {}),
    "spot": ("llvm_ad_mono", lambda: cornell(({"type": "phong"}, MASK), spotlit()), HIDING),
    "prisms": ("llvm_ad_spectral", lambda: cornell((HEAVY, MATT), wide()), {}),
}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    ("variant", "scene", "more"), CASES.values(), ids=CASES, indirect=["variant"]
)
def test_is_bdpt(variant, scene, more, chance, level):
    """The mean of the picture that the cache of light vertices gives, without lamps that are seen,
    to 1 or 2 %."""
    scene, made = scene(), integrator(**{"min_depth": 2} | more)
    found = uniform_mean(chance, level, scene, made, 2**16)
    far = scene.sensors()[0].film().size()[0] == 8  # few of its paths find light
    spp, precision = (2048, 0.02) if far else (64, 0.01)
    chance.equal(found, picture_mean(chance, level, scene, made, spp), precision=precision)


@pytest.mark.false_alarms(1e-3)
def test_paths_of_any_length(chance, level):
    """1 / (1 - a) - 1 in a closed room that shines; its paths have some 80 edges for a = 0.95."""
    made = integrator(min_depth=LONGEST_LISTED + 1, max_depth=-1)
    found = uniform_mean(chance, level, glowing_room(0.95), made, 2**12)
    chance.equal(found, 0.95**LONGEST_LISTED / 0.05, precision=0.05)


# ------------------------------ chains ------------------------------

METHODS = {
    "pssmlt": {"type": "pssmlt", "fallback": False},
    "direct light apart": {"type": "pssmlt", "fallback": False, "direct_samples": 0.25},
    "erpt": {"type": "erpt", "length": 64},
}


def chains(method, **depth):
    paths = {"type": "bdpt", "max_depth": 6, "rr_depth": 100} | depth
    return mi.load_dict(METHODS[method] | {"bootstrap": 0.5, "paths": paths})


def caustic():
    """A lamp without size over a glass ball, whose light no path of the camera finds."""
    light = {"type": "point", "position": [0.0, 4.0, 0.0], "intensity": grey(10.0)}
    return mi.load_dict(lens(light))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("method", METHODS)
def test_chains_find_the_caustic(method, chance, level):
    """Quarters of the picture to 8 %, by chains and by `bdpt`, of a caustic by light tracing."""
    scene = caustic()
    paths = mi.load_dict({"type": "bdpt", "max_depth": 6, "rr_depth": 100})
    found, wanted = (
        level(chance.runs(scene, spp, 16, integrator=by).reshape(16, 2, 8, 2, -1).mean((2, 4)))
        for by, spp in ((chains(method), 256), (paths, 64))
    )
    chance.equal(found, wanted, precision=0.08)


@pytest.mark.false_alarms(1e-3)
def test_chains_connect_to_a_lens(chance, level):
    """Halves of the picture of that caustic to 15 %, a third of which is the caustic."""
    d = lens({"type": "point", "position": [0.0, 4.0, 0.0], "intensity": grey(10.0)})
    d["sensor"] |= {"type": "thinlens", "aperture_radius": 0.2, "focus_distance": 4.0}
    scene = mi.load_dict(d)
    paths = mi.load_dict({"type": "bdpt", "max_depth": 6, "rr_depth": 100})
    found, wanted = (
        level(chance.runs(scene, spp, 12, integrator=by).reshape(12, 2, -1).mean(2))
        for by, spp in ((chains("pssmlt"), 256), (paths, 64))
    )
    chance.equal(found, wanted, precision=0.15)


@pytest.mark.parametrize("method", METHODS)
def test_same_seed_same_picture(method):
    """Bit for bit, on one thread or two, by the same kernels; other seeds give others."""
    scene = caustic()
    walk = chains(method)
    mi.render(scene, integrator=walk, spp=32, seed=4)
    threads = dr.thread_count()
    pictures = []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        try:
            for count, seed in ((1, 5), (2, 5), (2, 6)):
                dr.set_thread_count(count)
                dr.kernel_history_clear()
                pictures.append(np.array(mi.render(scene, integrator=walk, spp=32, seed=seed)))
                kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
                assert all(k["cache_hit"] for k in kernels)
        finally:
            dr.set_thread_count(threads)
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
    again = np.array(mi.render(scene, integrator=chains(method), spp=32, seed=5))
    assert np.array_equal(pictures[0], again)


def test_calm_scenes_are_left_to_bdpt():
    """As it renders them itself, and the report says so."""
    scene = cornell(({"type": "diffuse"}, {"type": "diffuse"}), wide())
    walk = mi.load_dict({"type": "pssmlt", "paths": {"type": "bdpt", "max_depth": 4}})
    found = np.array(mi.render(scene, integrator=walk, spp=64, seed=1))
    assert "independent samples" in walk.report()[0]
    paths = mi.load_dict({"type": "bdpt", "max_depth": 4})
    wanted = np.array(mi.render(scene, integrator=paths, spp=64, seed=2))
    assert found.mean() == pytest.approx(wanted.mean(), rel=0.03)


def test_alpha_and_what_is_not_rendered():
    """Alpha is that of rays of the camera; scenes without lamps are black."""
    d = lens({"type": "point", "position": [0.0, 4.0, 0.0], "intensity": grey(10.0)})
    d["sensor"]["film"]["pixel_format"] = "rgba"
    walk = chains("pssmlt")
    picture = np.array(mi.render(mi.load_dict(d), integrator=walk, spp=32))
    paths = mi.load_dict({"type": "surfacepath", "max_depth": 2})
    wanted = np.array(mi.render(mi.load_dict(d), integrator=paths, spp=64))
    assert picture[..., 3] == pytest.approx(wanted[..., 3], abs=0.4)
    assert picture[..., 3].mean() == pytest.approx(wanted[..., 3].mean(), abs=0.02)
    del d["light"]
    assert not np.array(mi.render(mi.load_dict(d), integrator=walk, spp=4))[..., :3].any()
    with pytest.raises(RuntimeError, match="takes one nested sampling integrator or bdpt"):
        mi.load_dict({"type": "pssmlt", "paths": {"type": "ptracer"}})
