"""Scenes in curved space: what rays meet, how surfaces see them, skies, and the flat limit."""

import re

import mitsuba as mi
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    integrators,  # noqa: F401
)
from tests.integrators.metrics.geodesics import angle_of, deflection, nearest, outside

SURFACE = {"type": "surfacepath", "max_depth": 8}


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


def curved(metric="schwarzschild", **parameters):
    return {"type": "curvedspace", "metric": metric, "nested": SURFACE} | parameters


def lamp(center, radius, value):
    return {"type": "sphere", "center": center, "radius": radius,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": value}},
            "bsdf": {"type": "diffuse", "reflectance": 0.0}}  # fmt: skip


def seen(integrator, shapes, p, d, seed=0):
    """Radiance (n, 3) along rays from p in directions d, both (3, n), and their alpha."""
    scene = mi.load_dict({"type": "scene"} | shapes)
    if isinstance(integrator, dict):
        integrator = mi.load_dict(integrator)
    p, d = np.broadcast_arrays(np.asarray(p, float), np.asarray(d, float))
    ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*p), mi.Vector3f(*d)))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, p.shape[1])
    L, valid, _ = integrator.sample(scene, sampler, ray)
    alpha = np.broadcast_to(np.array(valid), p.shape[1])
    return np.broadcast_to(np.array(L).T, (p.shape[1], 3)), alpha


def coordinates():
    """An environment of which red, green and blue are 1 + x, 1 + y and 1 + z of the direction."""
    h = 256
    v, u = np.meshgrid(np.arange(h) / (h - 1) * np.pi, (np.arange(2 * h) + 0.5) / h * np.pi,
                       indexing="ij")  # fmt: skip
    n = [np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)]
    return {"type": "envmap", "bitmap": mi.Bitmap(1 + np.stack(n, -1).astype(np.float32))}


def fan(angle):
    """Directions from a point on +X, at angles from that to the centre."""
    angle = np.asarray(angle, float)
    return np.array([-np.cos(angle), np.sin(angle), 0 * angle])


# ------------------------------ the flat limit ------------------------------


def test_flat_limit_of_what_is_seen():
    """Without mass rays meet what they meet in flat space."""
    shapes = {f"s{i}": lamp([3 * i - 6, i % 2, -i], 1.4, [i + 1, 1, 5 - i]) for i in range(5)}
    rng = np.random.default_rng(1)
    d = np.array([0, 0, -1])[:, None] + 0.3 * rng.normal(size=(3, 4000))
    d /= np.linalg.norm(d, axis=0)
    p = np.array([[0.0], [0], [20]])
    shapes["sky"] = {"type": "constant", "radiance": 0.25}
    flat, _ = seen(SURFACE, shapes, p, d)
    for tiny in (curved(mass=1e-6), curved("kerr", mass=1e-6, spin=0.9)):
        L, alpha = seen(tiny, shapes, p, d)
        assert (flat != L).any(axis=1).mean() < 5e-4  # edges, and what meets the centre
        assert alpha.all()
    assert len(np.unique(flat[:, 0])) == 6


@pytest.mark.false_alarms(1e-3)
def test_flat_limit_of_bounces(chance, level):
    """Diffuse, mirrors, half a mask: the picture of `surfacepath`, which samples lamps, too."""
    scene = {
        "type": "scene",
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(5),
                  "bsdf": {"type": "diffuse", "reflectance": 0.7}},
        "veil": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 0, 2]),
                 "bsdf": {"type": "mask", "opacity": 0.4, "nested":
                          {"type": "twosided", "nested": {"type": "diffuse"}}}},
        "ball": {"type": "sphere", "center": [2, 0, 1], "bsdf": {"type": "conductor"}},
        "lamp": lamp([-3, 0, 5], 2, [1, 2, 3]),
        "sky": {"type": "constant", "radiance": 0.3},
        "sensor": {"type": "perspective", "fov": 50, "to_world": mi.ScalarTransform4f().look_at(
            [0, -9, 6], [0, 0, 1], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 16, "height": 16}},
    }  # fmt: skip
    pictures = [
        chance.runs(mi.load_dict(scene | {"integrator": integrator}), 64).mean(axis=(1, 2))
        for integrator in (SURFACE, curved(mass=1e-6, center=[0, 0, 30]))
    ]
    chance.equal(level(pictures[1]), level(pictures[0]), precision=0.01)


# ------------------------------ what rays meet ------------------------------


def test_horizon_and_sky():
    """The hole is black and hides what is behind; the sky is seen in the asymptotic direction."""
    b, R = np.array([6.0, 8, 15, 30]), 50.0
    angle = np.append(angle_of(b, R), 0.0)
    L, alpha = seen(curved(), {"sky": coordinates()}, [[R], [0], [0]], fan(angle))
    phi = deflection(b) + np.pi - np.array([outside(x, R) for x in b])
    want = 1 + np.array([np.cos(phi), np.sin(phi), 0 * phi]).T
    assert np.allclose(L[:4], want, atol=2e-3)
    assert (L[4] == 0).all()
    assert alpha.tolist() == [True] * 5
    _, alpha = seen(curved(), {}, [[R], [0], [0]], fan(angle))
    assert alpha.tolist() == [False] * 4 + [True]


def test_ring_of_a_ball_behind_the_hole():
    """A small lamp straight behind is seen in a ring of the angle that the closed form has."""
    R, D, radius = 25.0, 40.0, 0.5
    b = brentq(lambda b: deflection(b) + np.pi - outside(b, R) - outside(b, D) - np.pi, 5.6, 14)
    ring = angle_of(b, R)
    # Half the width of the ring in view, from how far rays beside it pass the ball's centre.
    slope = (deflection(b + 0.01) - deflection(b - 0.01)) / 0.02
    slope -= (outside(b + 0.01, R) + outside(b + 0.01, D)
              - outside(b - 0.01, R) - outside(b - 0.01, D)) / 0.02  # fmt: skip
    cosine = np.sqrt(1 - (b / D) ** 2 * (1 - 2 / D))
    half = radius / (D * abs(slope) * cosine) * (angle_of(b + 0.01, R) - angle_of(b, R)) / 0.01
    angle = ring + half * np.array([-1.1, -0.9, 0, 0.9, 1.1])
    L, _ = seen(
        curved(), {"ball": lamp([-D, 0, 0], radius, [1, 2, 3])}, [[R], [0], [0]], fan(angle)
    )
    assert L[:, 1].tolist() == [0, 2, 2, 2, 0]


def test_hits_lie_on_the_path():
    """Where a ray bends most a lamp on it is met, and one on its tangents is not."""
    b, R = 5.22, 20.0
    closest = (deflection(b) + np.pi) / 2 - outside(b, R)
    for r, hit in ((nearest(b), True), (nearest(b) + 0.45, False), (nearest(b) - 0.4, False)):
        at = [r * np.cos(closest), r * np.sin(closest), 0]
        L, _ = seen(curved(), {"ball": lamp(at, 0.15, [1, 2, 3])},
                    [[R], [0], [0]], fan([angle_of(b, R)]))  # fmt: skip
        assert (L[0, 1] == 2) == hit, r


def test_mirrors_see_the_tangent():
    """A ray that a sphere about the hole reflects turns back as it came, mirrored."""
    b, R, ball = 3.5, 30.0, 4.0
    L, _ = seen(
        curved(),
        {"ball": {"type": "sphere", "radius": ball, "bsdf": {"type": "conductor"}},
         "sky": coordinates()},
        [[R], [0], [0]], fan([angle_of(b, R)]),
    )  # fmt: skip
    inwards = quad(lambda u: b / np.sqrt(1 - (b * u) ** 2 * (1 - 2 * u)), 1 / R, 1 / ball)[0]
    phi = inwards + quad(lambda u: b / np.sqrt(1 - (b * u) ** 2 * (1 - 2 * u)), 0, 1 / ball)[0]
    assert np.allclose(L[0], 1 + np.array([np.cos(phi), np.sin(phi), 0]), atol=4e-3)


def test_veils_do_not_bend_light():
    """A surface that is not there leaves the geodesic as it is; half a veil, half the light."""
    angle = angle_of(np.array([6.0, 7, 9, 20]), 40.0)
    sky = {"sky": coordinates()}
    plane = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 90).scale(90),
    }
    clear, _ = seen(curved(), sky, [[40.0], [0], [0]], fan(angle))

    def veil(opacity):
        black = {"type": "diffuse", "reflectance": 0.0}
        return {"veil": plane | {"bsdf": {"type": "mask", "opacity": opacity, "nested": black}}}

    through, _ = seen(curved(), sky | veil(0.0), [[40.0], [0], [0]], fan(angle))
    assert np.allclose(through, clear, atol=3e-3)
    many = np.repeat(fan(angle[3:]), 4000, axis=1)
    half, _ = seen(curved(), sky | veil(0.5), [[40.0], [0], [0]], many)
    assert set(np.unique(half[:, 0] > 0)) == {False, True}
    # The ray crosses the plane of the hole once: 6 standard deviations of a coin.
    assert abs((half[:, 0] > 0).mean() - 0.5) < 6 * 0.5 / np.sqrt(4000)


def test_geodesics_that_run_out_are_counted():
    L, _ = seen(near := mi.load_dict(curved()), {}, [[30.0], [0], [0]], fan([0.3, 0.6]))
    assert near.unfinished() == 0
    short = mi.load_dict(curved(geodesics_max_length=3))
    L, _ = seen(short, {"sky": {"type": "constant"}}, [[30.0], [0], [0]], fan([0.3, 0.6]))
    assert short.unfinished() == 2 and short.unfinished() == 0
    assert (L == 1).all()  # they leave straight on


# ------------------------------ wormholes ------------------------------


def test_two_worlds():
    """What is near the far mouth is seen through the near one, wherever that world is."""
    other = {
        "type": "scene",
        "ball": lamp([1000, 0, -7], 2, [3, 0, 0]),
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0, 0, 1]}},
    }
    scene = {
        "ball": lamp([0, 0, -7], 2, [0, 5, 0]),
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [1, 1, 1]}},
    }
    hole = curved("wormhole", mouth_in=[0, 0, 2], mouth_out=[1000, 0, 0], other=other)
    d = np.array([[0, 0.5, 0.0], [0, 0, 0.0], [-1, -1, 1]])
    d /= np.linalg.norm(d, axis=0)
    p = np.array([[0.0], [0], [-3]])
    # From below, up through the mouth: out of the other one downwards, towards the red ball.
    L, _ = seen(hole, scene, p, -d)
    assert L.tolist() == [[3, 0, 0], [1, 1, 1], [0, 5, 0]]


def test_through_to_the_sky_and_back_again():
    """Skies of both sides, and a sensor on side 2."""
    skies = {
        "sky": {"type": "constant", "radiance": 1.0},
        "sky2": {"type": "constant", "radiance": 2.0},
        "other": {"type": "scene"},
    }
    p, d = [[5.0], [0], [0]], fan([0.0, 0.2, 0.3])
    L, _ = seen(curved("wormhole", **skies), {}, p, d)
    assert L[:, 0].tolist() == [2, 2, 1]
    L, _ = seen(curved("wormhole", start_side=2, **skies), {}, p, d)
    assert L[:, 0].tolist() == [1, 1, 2]


def test_both_mouths_in_one_room():
    scene = {"ball": lamp([-20, 0, -10], 3, [7, 0, 0])}
    hole = curved("wormhole", mouth_in=[0, 0, 0], mouth_out=[-20, 0, 0])
    L, _ = seen(hole, scene, [[0.0], [0], [-5]], [[0.0], [0], [1]])
    assert L[0].tolist() == [7, 0, 0]


# ------------------------------ how it is put together ------------------------------


def test_in_a_picture():
    """`mi.render`, with worlds that hang on the integrator alone, in other integrators."""
    scene = {
        "type": "scene",
        "integrator": {"type": "shadowcatching", "nested": curved(
            "wormhole", other={"type": "scene", "ball": lamp([0, 0, 6], 3, [4, 4, 4])})},
        "sensor": {"type": "perspective", "fov": 20,
                   "to_world": mi.ScalarTransform4f().look_at([0, 0, -5], [0, 0, 0], [0, 1, 0]),
                   "film": {"type": "hdrfilm", "width": 9, "height": 9,
                            "rfilter": {"type": "box"}}},
    }  # fmt: skip
    picture = np.array(mi.render(mi.load_dict(scene), spp=4))
    # Beyond the mouth one looks back the way one came.
    scene["integrator"]["nested"]["other"]["ball"] = lamp([0, 0, -6], 3, [4, 4, 4])
    back = np.array(mi.render(mi.load_dict(scene), spp=4))
    assert picture[4, 4, 0] == 0 and back[4, 4, 0] == 4


@pytest.mark.parametrize(
    ("parameter", "message"),
    [({"nested": {"type": "path"}}, "nested surfacepath"),
     ({"geodesics_max_length": 0}, "geodesics_max_length is 0"),
     ({"metric": "wormhole", "start_side": 3}, "start_side is 3")],
)  # fmt: skip
def test_bad_parameters(parameter, message):
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict(curved() | parameter)


@pytest.mark.parametrize(
    ("metric", "given"),
    [("kerr", {"center": [1, 2, 3], "mass": 2, "spin": 0.5, "observer": "static"}),
     ("wormhole", {"mouth_in": [1, 2, 3], "mouth_out": [9, 8, 7], "rho": 2, "a": 3, "W": 0.25})],
)  # fmt: skip
def test_to_string_shows_the_values_of_the_metric(metric, given):
    """Those that the scene gives, which the metric may keep in another form; and no others."""
    text = str(mi.load_dict(curved(metric, **given)))
    shown = text.partition("hide_emitters")[2].partition("geodesics_max_length")[0]
    found = dict(re.findall(r"(\w+)=\[*([^\]=]*)\]*, ", shown))
    assert set(found) == set(given)
    for name, value in given.items():
        if isinstance(value, str):
            assert found[name] == value
        else:
            assert np.allclose([float(x) for x in found[name].split(",")], value)
