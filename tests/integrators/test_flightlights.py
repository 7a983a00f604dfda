"""Lamps that are looked for along flights: densities, and closed forms of single scattering."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import relume  # noqa: F401  registers the plugins


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def T():
    return mi.ScalarTransform4f()


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in np.broadcast_to(values, 3)]}


def stretch(α, δ, D, t0=0.0, t1=3.0):
    from relume.integrators.flightlights import Stretch

    return Stretch(*(mi.Float(value) for value in (t0, t1, α, δ, D)))


@pytest.mark.parametrize(
    ("α", "δ", "D", "t0", "sigma"),
    [(0, 1, 1, 0, (0.2, 1, 4)), (0, 1, 1, 1, (0.2, 1, 4)), (0.75, 1, 0.01, 0, (0.2, 1, 4)),
     (0.75, -2, 0.5, 0, (0.2, 1, 4)), (0.5, 9, 1, 0, (0.2, 1, 4)),
     # Channels that meet nothing, or next to nothing, on the way.
     (0, 1, 1, 0, (0, 1, 4)), (0.5, 1, 1, 0, (1, 0, 0)), (0, 1, 1, 0, (1e-7, 1e-7, 1e-7))]
)  # fmt: skip
def test_density_is_that_of_the_samples(α, δ, D, t0, sigma):
    """The mean of 1/p over [a, b] is b - a: 5 standard errors, each of 0.6 % at most; a density
    that is 4 % off makes more."""
    sigma, q = mi.Spectrum(*sigma), mi.Spectrum(0.5, 0.25, 0.25)
    u = np.random.default_rng(1).uniform(size=(2, 1_500_000)).astype(np.float32)
    found = stretch(α, δ, D, t0)
    t, p = (np.array(v, float) for v in found.sample(q, sigma, mi.Float(u[0]), mi.Float(u[1])))
    assert t.min() >= t0 and t.max() <= 3
    for a, b in ((t0, 3), (t0, t0 + 0.5), (2, 3)):
        values = np.where((t >= a) & (t < b), 1 / p, 0)
        error = values.std() / len(t) ** 0.5
        assert values.mean() == pytest.approx(b - a, abs=5 * error + 1e-6)
        assert error < 0.006 * (b - a)


def rendered(chance, kind, fog, lamps, spp=256, depth=2, rr_depth=100, target=(0, 0, 0)):
    """Means of runs of a picture of one pixel, from (0, 0, 4) in a medium of radius 8."""
    film = {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}}
    medium = mi.load_dict({"type": "homogeneous"} | fog)
    camera = {
        "type": "perspective",
        "fov": 0.01,
        "to_world": T().look_at([0, 0, 4], list(target), [0, 1, 0]),
        "film": film | {"pixel_format": "rgb"},
        "medium": medium,
    }
    around = {"type": "sphere", "radius": 8.0, "bsdf": {"type": "null"}, "interior": medium}
    integrator = {"type": kind, "max_depth": depth, "rr_depth": rr_depth}
    scene = {"type": "scene", "integrator": integrator, "sensor": camera, "around": around}
    return chance.runs(mi.load_dict(scene | lamps), spp).mean(axis=(1, 2))


def once(sigma_s, sigma_t, y, intensity):
    """Light of a point at (0, y, 0) scattered once into the ray from (0, 0, 4) along -z, to -8."""
    s = np.linspace(0, 12, 2_000_001)
    r = np.hypot(y, s - 4)
    f = np.exp(-sigma_t * (s + r)) / r**2
    return sigma_s * intensity / (4 * np.pi) * np.sum((f[1:] + f[:-1]) / 2) * (s[1] - s[0])


SIGMA = np.array([0.05, 0.2, 0.6])


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("y", [0.01, 0.5])
def test_a_point_that_shines_in_a_medium(y, chance, level):
    """Single scattering in a medium whose channels differ, from near the point and farther off."""
    fog = {"albedo": rgb(0.8), "sigma_t": rgb(SIGMA)}
    point = {"type": "point", "position": [0.0, y, 0.0], "intensity": rgb(1.0)}
    found = level(rendered(chance, "randomwalk", fog, {"point": point}))
    expected = [once(0.8 * sigma, sigma, y, 1.0) for sigma in SIGMA]
    chance.equal(found, expected, allowed=1e-3, precision=0.012)


@pytest.mark.false_alarms(1e-3)
def test_a_beam_in_a_medium(chance, level):
    """Light of a beam 2 wide that crosses the ray, scattered once."""
    fog = {"albedo": rgb(0.5), "sigma_t": rgb(SIGMA)}
    beam = {"type": "parallelbeam", "origin": [-1.0, 3.0, -1.0], "edge_u": [2.0, 0.0, 0.0],
            "edge_v": [0.0, 0.0, 2.0], "direction": [0.0, -1.0, 0.0]}  # fmt: skip
    found = level(rendered(chance, "randomwalk", fog, {"beam": beam}))
    along = 2 * np.sinh(SIGMA) / SIGMA
    expected = 0.5 * SIGMA / (4 * np.pi) * np.exp(-7 * SIGMA) * along
    chance.equal(found, expected, allowed=1e-3, precision=0.01)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("g", [0.0, 0.8])
def test_lamps_found_both_ways(g, chance, level):
    """A shining ball beside the ray, single scattering: emitter sampling and phase function as
    one, against `volpath`."""
    fog = {"albedo": rgb(0.9), "sigma_t": rgb(0.2), "phase": {"type": "hg", "g": g}}
    lamp = {"type": "sphere", "radius": 1.0, "center": [0.0, 1.5, 0.0]}
    lamp |= {"emitter": {"type": "area", "radiance": rgb(1.0)}, "bsdf": {"type": "diffuse"}}
    a, b = (
        level(rendered(chance, kind, fog, {"lamp": lamp}, spp=n))
        for kind, n in (("volpath", 2048), ("randomwalk", 512))
    )
    chance.equal(a, b, precision=0.04)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("σ", [0.01, 2.0, 1000.0])
def test_white_furnace_in_fog(σ, chance, level):
    """A white ball in fog of albedo 1 under a sky of 1, from walks of no scattering to 1e8."""
    fog = {"albedo": rgb(1.0), "sigma_t": rgb(1.0), "scale": σ}
    white = {"type": "diffuse", "reflectance": rgb(1.0)}
    things = {"sky": {"type": "constant"}, "ball": {"type": "sphere", "bsdf": white}}
    found = level(rendered(chance, "randomwalk", fog, things, 16, -1, 200, (0.7, 0, 0)))
    chance.equal(found, 1.0, precision=0.12)


def test_registered_lamps():
    """Lights from infinity have no place; a beam's ray starts and ends where it is inside."""
    from relume.integrators.flightlights import Lamps

    scene = mi.load_dict(
        {
            "type": "scene",
            "sky": {"type": "constant"},
            "point": {"type": "point", "position": [0, 2, 0]},
            "beam": {"type": "parallelbeam", "origin": [-1, 3, -1], "edge_u": [2, 0, 0],
                     "edge_v": [0, 0, 2], "direction": [0, -1, 0]},
        }
    )  # fmt: skip
    lamps, emitters = Lamps(scene), {e.class_name(): e for e in scene.emitters()}
    o, d = mi.Point3f(0, 0, 4), mi.Vector3f(0, 0, -1)
    found = {
        name: lamps.stretch(mi.EmitterPtr(e), o, d, mi.Float(9), mi.Float(0.1), mi.Bool(True))
        for name, e in emitters.items()
    }
    part = {name: (float(s.t0[0]), float(s.t1[0]), float(s.α[0])) for name, s in found.items()}
    names = {n: k for n in part for k in ("Constant", "Point", "Emitter") if n.startswith(k)}
    by_kind = {k: part[n] for n, k in names.items()}
    assert by_kind["Constant"] == pytest.approx((0, 9, 0))
    assert by_kind["Point"][:2] == pytest.approx((0, 9)) and by_kind["Point"][2] > 0.5
    assert by_kind["Emitter"][:2] == pytest.approx((3, 5), abs=1e-4)
    assert dr.allclose(found[next(n for n in part if n.startswith("Point"))].δ, 4)
