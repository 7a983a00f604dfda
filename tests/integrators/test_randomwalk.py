"""`randomwalk`: furnaces, half spaces, and `volpathmis` where single precision lets that be right.

What it does to surfaces is the matter of `test_surfacepath.py`.
"""

import mitsuba as mi
import numpy as np
import pytest

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    integrators,  # noqa: F401
    phasefunctions,  # noqa: F401
)
from relume.integrators.boundaries import distances
from relume.integrators.walkmedia import chosen, mixture
from relume.workbench.cells.volumes import scattered_back


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def T():
    return mi.ScalarTransform4f()


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in np.broadcast_to(values, 3)]}


def medium(albedo, sigma_t, g=None, **more):
    sigma_t = np.broadcast_to(sigma_t, 3).astype(float)
    found = {"type": "homogeneous", "albedo": rgb(albedo), "scale": float(sigma_t.max())} | more
    if g is not None:
        found["phase"] = {"type": "hgrgb", "g": g} if np.ndim(g) else {"type": "hg", "g": g}
    return found | {"sigma_t": rgb(sigma_t / sigma_t.max())}


def camera(origin, fov, size=8):
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    known = "luminance" if mi.is_monochromatic else "rgb"
    return {
        "type": "perspective",
        "fov": fov,
        "to_world": T().look_at(list(origin), [0, 0, 0], [0, 1, 0]),
        "film": film | {"pixel_format": known},
    }


NULL = {"type": "null"}
GLASS = {"type": "schlickglass", "int_ior": 1.3, "fresnel": "exact"}
ROUGH = {"type": "roughdielectric", "alpha": 0.3, "int_ior": 1.3}
SKY = {"type": "constant"}


def scene(integrator="randomwalk", fov=10.0, origin=(0, 0, 9), rr_depth=9, depth=-1, **things):
    kind = {"type": integrator, "rr_depth": rr_depth, "max_depth": depth}
    parts = {"type": "scene", "integrator": kind, "sensor": camera(origin, fov)}
    return mi.load_dict(parts | things)


def body(shape, bsdf, inside, **more):
    return {"type": shape, "bsdf": bsdf, "interior": inside} | more


# ------------------------------ nothing is lost ------------------------------


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"], indirect=True)
@pytest.mark.parametrize("shape", ["sphere", "cube"])
@pytest.mark.parametrize("bsdf", [NULL, GLASS], ids=lambda b: b["type"])
def test_white_furnace(variant, shape, bsdf, chance, level):
    """Under a sky of 1 a body that absorbs nothing is invisible."""
    made = scene(sky=SKY, body=body(shape, bsdf, medium(1.0, [3, 6, 4], g=[0.3, -0.5, 0.0])))
    pictures = chance.runs(made, 64).mean(axis=(1, 2, 3))
    chance.equal(level(pictures), 1.0, allowed=1e-4, precision=0.05)


def test_black_walks_are_black():
    """Deep in a dark ball throughputs fall below what single precision has: no 0/0 of them.

    Seeds of which one in two had a sample that was not a number.
    """
    walks = body("sphere", GLASS | {"int_ior": 1.5}, medium([0.3, 0.5, 0.7], 100.0))
    made = scene(sky=SKY, fov=14.0, rr_depth=6, body=walks)
    for seed in range(4):
        assert np.isfinite(np.array(mi.render(made, spp=8192, seed=seed))).all()


@pytest.mark.false_alarms(1e-3)
def test_sky_and_what_it_is_sampled_by_are_one(chance, level):
    """The furnace to 0.2 %, where light comes by emitter sampling through the medium, too."""
    made = scene(sky=SKY, fov=4.0, body=body("sphere", NULL, medium(1.0, 3)))
    pictures = chance.runs(made, 1024).mean(axis=(1, 2, 3))
    chance.equal(level(pictures), 1.0, allowed=1e-4, precision=0.002)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("scale", [100, 1e4, 1e6])
def test_walks_of_any_length_keep_the_mean(scale, chance, level):
    """About scale^2 scatterings to the middle of a white ball and back."""
    made = scene(sky=SKY, body=body("sphere", GLASS, medium(1.0, scale)))
    pictures = chance.runs(made, 16).mean(axis=(1, 2, 3))
    chance.equal(level(pictures), 1.0, precision=0.02)


@pytest.mark.false_alarms(1e-3)
def test_what_is_not_scattered_is_beers_law(chance, level):
    """Of a sky of 1 through two units of media that scatter, in each channel; flights 2 % too long
    make 2 to 6 % of that."""
    sigma_t = np.array([0.5, 1.5, 1.0])
    made = scene(fov=0.2, depth=1, sky=SKY, body=body("sphere", NULL, medium(0.5, sigma_t)))
    pictures = chance.runs(made, 1024).mean(axis=(1, 2))
    chance.equal(level(pictures), np.exp(-2 * sigma_t), allowed=1e-3, precision=0.006)


@pytest.mark.parametrize("u", [0.0, 1 - 2.0**-24])
def test_flights_at_the_ends_of_the_variates(u):
    """A channel that meets nothing goes all the way, also by a variate of 0, of which it made
    0/0: of the mixture of three flights as many come through as T over the mean T."""
    sigma_t = np.array([0.0, 0.2, 0.6] if u == 0 else [0.6, 0.2, 0.0])
    made = scene(depth=1, sky=SKY, body=body("sphere", NULL, medium(0.5, sigma_t)))

    class Constant(mi.Sampler):
        def next_1d(self, active=True):
            return mi.Float(u)

        def next_2d(self, active=True):
            return mi.Point2f(u)

    ray = mi.Ray3f([0, 0, 9], [0, 0, -1])
    L, _, _ = made.integrator().sample(made, Constant(mi.Properties()), ray)
    T = np.exp(-2 * sigma_t)
    np.testing.assert_allclose(np.array(L).ravel(), T / T.mean(), rtol=1e-5)


@pytest.mark.parametrize("empty", range(3))
def test_no_channel_of_probability_0_is_chosen(empty):
    """By no number in [0, 1), however the sums of probabilities are rounded."""
    weights = np.random.default_rng(1).random((3, 10_000)).astype(np.float32)
    weights[empty] = 0
    for u in (0.0, 0.5, 1 - 2.0**-24):
        found = chosen(mixture(mi.Spectrum(weights)), mi.Spectrum(0, 1, 2), mi.Float(u))
        assert not (np.array(found) == empty).any()


# ------------------------------ dense media ------------------------------


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("free_path", [1e-4, 1e-5])
@pytest.mark.parametrize("things", ["sphere", "cube", "neighbours"])
def test_half_space(free_path, things, chance, level):
    """The middle of a dense body shows 1 - sqrt(1 - a) H(1), with rays cast in it and without."""
    shape = "sphere" if things == "neighbours" else things
    parts = {"body": body(shape, NULL, medium(0.9, 1 / free_path))}
    if things == "neighbours":
        parts["other"] = {"type": "sphere", "center": [0, 1.9, 0], "radius": 0.95}
    pictures = chance.runs(scene(fov=0.2, sky=SKY, **parts), 512).mean(axis=(1, 2, 3))
    chance.equal(level(pictures), scattered_back(0.9), allowed=1e-3, precision=0.01)


# ------------------------------ as volpathmis ------------------------------


def lamp():
    turned = T().translate([0, 0, 3]).rotate([1, 0, 0], 180)
    return {
        "type": "rectangle",
        "to_world": turned,
        "emitter": {"type": "area", "radiance": rgb(5)},
    }


DIM = {"type": "constant", "radiance": rgb(0.3)}
GREY = medium([0.9, 0.8, 0.6], [2, 4, 3])
G = medium([0.9, 0.8, 0.6], [2, 4, 3], g=[0.5, 0.2, -0.4])


def things(name):
    floor = {"type": "rectangle", "to_world": T().translate([0, 0, -1.05]).scale(5)}
    bead = {"type": "sphere", "radius": 0.4}
    sun = {"type": "directional", "direction": [0, 1, -1], "irradiance": rgb(2)}
    found = {
        "sun": {"sun": sun, "b": body("sphere", NULL, GREY)},
        "lamp": {"sky": DIM, "lamp": lamp(), "b": body("sphere", NULL, G)},
        "glass": {"sky": DIM, "lamp": lamp(), "b": body("sphere", GLASS, G)},
        "rough": {"sky": DIM, "lamp": lamp(), "b": body("sphere", ROUGH, GREY)},
        "bead": {"sky": DIM, "b": body("cube", GLASS, GREY), "bead": bead},
        "bulb": {
            "sky": DIM,
            "b": body("cube", GLASS, GREY),
            "bead": bead | {"emitter": {"type": "area", "radiance": rgb(3)}},
        },
        "mask": {
            "sky": DIM,
            "lamp": lamp(),
            "b": body("sphere", {"type": "mask", "opacity": 0.5, "nested": GLASS}, GREY),
        },
        "absorber": {"sky": DIM, "b": body("sphere", GLASS, medium(0.0, [1, 2, 0.5]))},
    }
    return found[name] | {"floor": floor}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    ("name", "depth"),
    [("sun", -1), ("sun", 3), ("lamp", -1), ("lamp", 4), ("glass", -1), ("glass", 6),
     ("rough", -1), ("bead", -1), ("bulb", -1), ("mask", -1), ("absorber", -1)],
)  # fmt: skip
def test_agrees_with_volpathmis(name, depth, chance, level):
    """The same picture in blocks of pixels, of paths of the same lengths."""
    a, b = (
        level(
            chance.runs(
                scene(kind, 40.0, (0, -4, 1.5), rr_depth=100, depth=depth, **things(name)), 64
            )
            .reshape(8, 2, 4, 2, 4, 3)
            .mean(axis=(2, 4))
        )
        for kind in ("volpathmis", "randomwalk")
    )
    chance.equal(a, b, precision=0.25)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("outer", [NULL, GLASS], ids=["matched", "glass"])
def test_in_fog_and_from_inside(outer, chance, level):
    """A body in fog, and the camera in the fog, too."""
    fog = mi.load_dict(medium(0.9, [0.1, 0.2, 0.15]))
    ball = body("sphere", outer, GREY, exterior=fog)
    around = body("sphere", NULL, fog, radius=8.0)
    a, b = (
        level(
            chance.runs(
                mi.load_dict(
                    {
                        "type": "scene",
                        "integrator": {"type": kind, "rr_depth": 100},
                        "sensor": camera((0, 0, 4), 40.0) | {"medium": fog},
                        "sky": DIM,
                        "around": around,
                        "ball": ball,
                    }
                ),
                64,
            ).mean(axis=(1, 2))
        )
        for kind in ("volpathmis", "randomwalk")
    )
    chance.equal(a, b, precision=0.1)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("chains", ["pssmlt", "erpt"])
def test_in_chains_of_paths(chains, chance, level):
    """Metropolis integrators trace it inside a loop, where nothing can be evaluated."""
    parts = {"sky": DIM, "b": body("sphere", GLASS, medium([0.9, 0.8, 0.6], 5))}
    plain, chained = (
        level(
            chance.runs(
                mi.load_dict(
                    {"type": "scene", "sensor": camera((0, 0, 4), 40.0), "integrator": kind}
                    | parts
                ),
                32,
            ).mean(axis=(1, 2))
        )
        for kind in (
            {"type": "randomwalk"},
            {"type": chains, "paths": {"type": "randomwalk"}},
        )
    )
    chance.equal(plain, chained, precision=0.3)


# ------------------------------ what it refuses, and geometry ------------------------------


@pytest.mark.parametrize(
    ("inside", "word"),
    [({"type": "homogeneous", "phase": {"type": "rayleigh"}}, "phase functions"),
     ({"type": "heterogeneous", "albedo": 0.5}, "homogeneous media")],
)  # fmt: skip
def test_media_that_it_does_not_know(inside, word):
    made = scene(sky=SKY, body=body("sphere", NULL, inside))
    with pytest.raises(Exception) as error:
        mi.render(made, spp=1)
    cause = error.value
    while cause.__cause__ is not None:
        cause = cause.__cause__
    assert word in str(cause)


def test_distances_of_triangles():
    """The foot on the plane where that is in the triangle, else on an edge or a corner."""
    a = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    seen_from = np.array([[0.2, 0.2, 3], [2, 0, 0], [0.5, -2, 0], [1, 1, 0], [-3, -4, 0]])
    expected = [3, 1, 2, np.sqrt(0.5), 5]
    assert distances(a[None] - seen_from[:, None]) == pytest.approx(expected)
