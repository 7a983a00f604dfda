"""`bdpt`: its ways of finding a path agree, with `surfacepath`, and with closed forms."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    emitters,  # noqa: F401
    integrators,  # noqa: F401
    sensors,  # noqa: F401
)
from relume.integrators.lightstarts import Emission
from relume.integrators.seethrough import Surfaces
from relume.integrators.sensorconnections import Pinhole

BOX = {"type": "box"}


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def film(size=8, **options):
    known = "luminance" if mi.is_monochromatic else "rgb"
    return {"type": "hdrfilm", "width": size, "height": size, "rfilter": BOX,
            "pixel_format": known} | options  # fmt: skip


def grey(value):
    return {"type": "rgb", "value": value}


def panel(position, towards, scale=1.0, **parts):
    to_world = mi.ScalarTransform4f().look_at(position, towards, [0.1, 0.2, 0.97])
    return {"type": "rectangle", "to_world": to_world.scale(scale)} | parts


def open_corner():
    """A floor and a wall that a wide lamp lights, all well apart: distances are no smaller than
    what they are between, so that every way has little noise."""
    white = {"type": "diffuse", "reflectance": grey(0.8)}
    black = {"type": "diffuse", "reflectance": grey(0.0)}
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov": 40, "film": film(),
            "to_world": mi.ScalarTransform4f().look_at([0.5, 1.5, 4], [0, -0.5, -1], [0, 1, 0]),
        },
        "floor": panel([0, -1.5, 0], [0, 5, 0], 1.2, bsdf=white),
        "wall": panel([0, 0.7, -2.2], [0, 0.5, 5], 1.2, bsdf=white),
        "lamp": panel([-2.6, 0.4, 0], [5, -0.6, -1], 1.0, bsdf=black,
                      emitter={"type": "area", "radiance": grey(5.0)}),
    }  # fmt: skip


def integrator(kind="bdpt", only=None, **options):
    made = mi.load_dict({"type": kind, "rr_depth": 100, "max_depth": 5} | options)
    if only is not None:
        made.only = only
    return made


def means(chance, level, scene, made, spp=1024, runs=6):
    """Means of the quarters of the picture."""
    pictures = chance.runs(scene, spp, runs, integrator=made)[..., :3]
    n = pictures.shape[1] // 2
    return level(pictures.reshape(runs, 2, n, 2, n, -1).mean(axis=(2, 4, 5)))


# ------------------------------ one way and another ------------------------------


@pytest.mark.false_alarms(1e-3)
def test_each_way_alone_finds_the_same_light(chance, level):
    """Paths of three edges, found by s = 0 to 3 vertices from the lamp, against `surfacepath`."""
    scene = mi.load_dict(open_corner())
    depth = {"min_depth": 3, "max_depth": 3}

    def mean(made):
        return level(chance.runs(scene, 2048, 6, integrator=made).mean((1, 2, 3)))

    reference = mean(integrator("surfacepath", **depth))
    for s in range(4):
        found = mean(integrator(only=(s, 4 - s), **depth))
        chance.equal(found, reference, precision=0.06, of=5)
    chance.equal(mean(integrator(**depth)), reference, precision=0.02, of=5)


DOWN = {"direction": [0, -1, 0]}
BRIGHT = {"type": "area", "radiance": grey(9.0)}
ABOVE = {
    "rectangle": {"emitter": BRIGHT},
    "falloffspot": DOWN | {"position": [0, 1, 0], "cutoff_angle": 25, "intensity": grey(9.0)},
    "spot": {"cutoff_angle": 25, "intensity": grey(9.0)},
    "parallelbeam": DOWN | {"origin": [-0.7, 1, -0.7], "edge_u": [1.4, 0, 0],
                            "edge_v": [0, 0, 1.4]},
    "domesun": DOWN | {"radius": 2.5},
    "directional": DOWN,
}  # fmt: skip


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("kind", ABOVE)
def test_light_tracing_alone_is_exact(kind, chance, level):
    """The mean of a picture of all the floor below a lamp, by light tracing alone and
    by emitter sampling; a spot whose light is looked for on all sides had 12 times the
    noise of this."""
    d = open_corner()
    del d["wall"]
    d["sensor"] |= {
        "fov": 30, "to_world": mi.ScalarTransform4f().look_at([0, 4, 0], [0, -1.5, 0], [0, 0, 1])
    }  # fmt: skip
    lamp = {"type": kind} | ABOVE[kind]
    if kind in ("spot", "rectangle"):
        height = 1 if kind == "spot" else -0.7
        down = mi.ScalarTransform4f().look_at([0, height, 0], [0, -2, 0], [0, 0, 1])
        lamp["to_world"] = down.scale(0.5) if kind == "rectangle" else down
    scene = mi.load_dict(d | {"lamp": lamp})
    depth = {"min_depth": 2, "max_depth": 2}
    spp = 4096 if kind == "rectangle" else 1024  # a quarter of the light subpaths, and all around
    a, b = (
        level(chance.runs(scene, spp, 8, integrator=integrator(only=w, **depth)).mean((1, 2, 3)))
        for w in ((2, 1), (1, 2))
    )
    chance.equal(a, b, precision=0.003)


@pytest.mark.false_alarms(1e-3)
def test_connections_alone_are_exact(chance, level):
    """Light of a spot by way of the floor on the ceiling, which is all that the camera sees: by
    connections alone, and by emitter sampling on the floor."""
    d = open_corner()
    d["wall"] = panel([0, 1.5, 0], [0, -5, 0], 1.2, bsdf={"type": "diffuse"})
    d["sensor"]["to_world"] = mi.ScalarTransform4f().look_at([0, -1.4, 0], [0, 1, 0], [0, 0, 1])
    lamp = {"type": "falloffspot"} | ABOVE["falloffspot"]
    scene = mi.load_dict(d | {"lamp": lamp | {"position": [0, 1.4, 0], "cutoff_angle": 20}})
    depth = {"min_depth": 3, "max_depth": 3}
    a, b = (
        level(chance.runs(scene, spp, 8, integrator=integrator(only=w, **depth)).mean((1, 2, 3)))
        for w, spp in (((2, 2), 2048), ((1, 3), 4096))
    )
    chance.equal(a, b, precision=0.004)


@pytest.mark.false_alarms(1e-3)
def test_closed_room_that_shines(chance, level):
    """1 + a + ... = 1 / (1 - a), with lamps everywhere and most ways at work."""
    walls = {
        "type": "cube", "flip_normals": True,
        "bsdf": {"type": "diffuse", "reflectance": grey(0.6)},
        "light": {"type": "area", "radiance": grey(1.0)},
    }  # fmt: skip
    sensor = {"type": "perspective", "fov": 60, "film": film()}
    scene = mi.load_dict({"type": "scene", "sensor": sensor, "walls": walls})
    made = integrator(max_depth=-1, rr_depth=3)
    found = level(chance.runs(scene, 1024, 6, integrator=made).mean((1, 2, 3)))
    chance.equal(found, 2.5, precision=0.003)


# ------------------------------ materials and lamps ------------------------------


def cornell(blocks, light):
    """The Cornell box with two materials for its blocks."""
    d = mi.cornell_box()
    d["sensor"]["film"] = film(16)
    d["small-box"]["bsdf"], d["large-box"]["bsdf"] = blocks
    d["light"] = light
    return mi.load_dict(d)


def wide():
    to_world = mi.ScalarTransform4f().translate([0, 0.99, 0]).rotate([1, 0, 0], 90).scale(0.5)
    return {"type": "rectangle", "to_world": to_world,
            "emitter": {"type": "area", "radiance": grey(8.0)}}  # fmt: skip


WARD = {"type": "ward", "alpha_u": 0.2, "alpha_v": 0.3}
MASK = {"type": "mask", "opacity": 0.5, "nested": {"type": "roughdielectric", "alpha": 0.3}}
HEAVY = {"type": "schlickglass", "dispersion": "cauchy6", "coefficients": "2.8 0 0.05"}


def sky():
    pixels = np.random.default_rng(1).random((16, 32, 3)).astype(np.float32) ** 4 * 5
    return {"type": "sphere", "radius": 6,
            "bsdf": {"type": "conductor", "specular_reflectance": grey(0.0)},
            "emitter": {"type": "ibldome", "bitmap": mi.Bitmap(pixels),
                        "map": "panoramic"}}  # fmt: skip


def spot():
    return {"type": "falloffspot", "position": [0, 0.9, 0], "direction": [0.1, -1, 0.2],
            "cutoff_angle": 40, "falloff_angle": 20, "attenuation": [0.1, 0.5, 0.3],
            "intensity": grey(4.0)}  # fmt: skip


CASES = {
    "masks": ("llvm_ad_rgb", (WARD, MASK), wide),
    "ibl": ("llvm_ad_rgb", ({"type": "schlickglass"}, WARD), sky),
    "spot": ("llvm_ad_mono", ({"type": "phong"}, {"type": "diffuse"}), spot),
    "prisms": ("llvm_ad_spectral", (HEAVY, {"type": "diffuse"}), wide),
}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    ("variant", "blocks", "light"), CASES.values(), ids=CASES, indirect=["variant"]
)
def test_is_surfacepath(variant, blocks, light, chance, level):
    """In quarters of the picture, each to 5 %."""
    scene = cornell(blocks, light())
    a, b = (
        means(chance, level, scene, integrator(kind), spp)
        for kind, spp in (("bdpt", 64), ("surfacepath", 256))
    )
    chance.equal(a, b, precision=0.05)


def textured(kind):
    pixels = np.random.default_rng(3).random((4, 4, 3)).astype(np.float32)
    radiance = {"type": "bitmap", "bitmap": mi.Bitmap(pixels), "raw": True}
    return {"type": kind, "radiance": radiance}


LAMPS = {
    "area": lambda: {"type": "rectangle", "emitter": {"type": "area", "radiance": grey(1.0)}},
    "sphere": lambda: {"type": "sphere", "emitter": {"type": "area", "radiance": grey(1.0)}},
    "two sides": lambda: {"type": "disk", "emitter": {"type": "twosidedarea"}},
    "picture": lambda: {"type": "rectangle", "emitter": textured("area")},
    "picture on both sides": lambda: {"type": "sphere", "emitter": textured("twosidedarea")},
    "dome": sky,
    "sky": lambda: {"type": "constant", "radiance": grey(1.0)},
}


@pytest.mark.parametrize("lamp", LAMPS)
def test_emission_is_as_dense_as_hits_have_it(lamp):
    """The density with which a light subpath begins, where it begins and where a path of the
    camera would hit it; there are two lamps between which it chooses."""
    ball = {"type": "sphere", "center": [2.0, 1.0, 3.0], "radius": 1.5}
    point = {"type": "point", "position": [2.0, 4.0, 3.0]}
    scene = mi.load_dict({"type": "scene", "ball": ball, "point": point, "lamp": LAMPS[lamp]()})
    emission = Emission(scene)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, 20000)
    start = emission.start(
        Surfaces(scene), scene, sampler, dr.zeros(mi.Ray3f).wavelengths, mi.Bool(True)
    )
    y = scene.ray_intersect(start.ray)
    back = scene.ray_intersect(y.spawn_ray(-start.ray.d))
    ds = mi.DirectionSample3f(scene, back, y)
    used = y.is_valid() & (start.dVC > 0) & (ds.emitter == start.emitter)
    used &= (dr.abs(dr.dot(ds.n, ds.d)) > 0.1) | ~back.is_valid()
    E = emission.emitted(ds, scene.pdf_emitter_direction(y, ds, used), used)
    hits = np.array(used)
    ratio = (np.array(E) * np.array(start.dVC))[hits]
    assert hits.sum() > 100
    # A hit next to the edge of a texel may be on its other side; at poles u says little.
    assert np.mean(np.abs(ratio - 1) > 0.01) < 0.04
    assert np.median(ratio) == pytest.approx(1, abs=1e-3)


# ------------------------------ light through glass ------------------------------


def lens(light):
    """A glass ball over a floor, the camera beside it."""
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov": 40, "film": film(16),
            "to_world": mi.ScalarTransform4f().look_at([0, 0.2, 5], [0, -1.3, 0], [0, 1, 0]),
        },
        "floor": panel([0, -1.5, 0], [0, 5, 0], 2, bsdf={"type": "diffuse"}),
        "ball": {"type": "sphere", "center": [0, 0.3, 0], "radius": 0.8,
                 "bsdf": {"type": "schlickglass"}},
        "light": light,
    }  # fmt: skip


@pytest.mark.false_alarms(1e-3)
def test_caustic_of_a_lamp_without_size(chance, level):
    """As that of a small lamp of the same power, found by `surfacepath`, which misses the former;
    and as light tracing alone has it."""
    intensity, radius = 10.0, 0.4
    radiance = intensity / (np.pi * radius**2)
    position = [0.0, 4.0, 0.0]
    small = {"type": "sphere", "center": position, "radius": radius,
             "emitter": {"type": "area", "radiance": grey(radiance)}}  # fmt: skip
    point = {"type": "point", "position": position, "intensity": grey(intensity)}
    depth = {"min_depth": 4, "max_depth": 4}

    def light(lamp, made, spp=256):
        return level(chance.runs(mi.load_dict(lens(lamp)), spp, 6, integrator=made).mean((1, 2, 3)))

    caustic = light(point, integrator(**depth))
    reference = light(small, integrator("surfacepath", **depth), 1024)
    missing = light(point, integrator("surfacepath", **depth), 16)
    assert missing.mean < 0.5 * caustic.mean
    chance.equal(caustic, reference, allowed=0.04, precision=0.06, of=2)
    alone = light(point, integrator(only=(4, 1), **depth))
    assert alone.mean == pytest.approx(caustic.mean - missing.mean, rel=0.05)


# ------------------------------ cameras and films ------------------------------


SENSORS = {
    "lens": {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 3.5},
    "screen with a lens": {"type": "screencamera", "width": 0.8, "height": 0.7,
                           "aperture_radius": 0.3, "focus_distance": 3.5},
    "screen, with a tent": {"type": "screencamera", "width": 0.8, "height": 0.7,
                            "film": {"rfilter": {"type": "tent"}}},
    "cropped, with negative weights": {
        "film": {"rfilter": {"type": "mitchell"}, "width": 24, "height": 20, "crop_width": 16,
                 "crop_height": 16, "crop_offset_x": 5, "crop_offset_y": 3},
    },
}  # fmt: skip


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("camera", SENSORS)
def test_light_arrives_where_the_camera_sees_it(camera, chance, level):
    """Light tracing alone, of what a spot lights, against emitter sampling alone, in blocks."""
    sensor = {"type": "perspective", "fov": 40} | SENSORS[camera]
    sensor["film"] = film(16) | sensor.get("film", {})
    if sensor["type"] == "screencamera":
        del sensor["fov"]
    d = open_corner()
    sensor["to_world"] = d["sensor"]["to_world"]
    spot = {"type": "falloffspot", "position": [0, 3, 3], "direction": [0, -1.6, -2],
            "cutoff_angle": 40, "intensity": grey(9.0)}  # fmt: skip
    scene = mi.load_dict(d | {"sensor": sensor, "lamp": spot})
    depth = {"min_depth": 2, "max_depth": 2}
    a, b = (means(chance, level, scene, integrator(only=w, **depth), 512) for w in ((1, 2), (2, 1)))
    chance.equal(a, b, precision=0.1)


LENSES = [camera for name, camera in SENSORS.items() if "lens" in name]


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("camera", LENSES, ids=["lens", "screen"])
def test_light_tracing_to_a_lens_is_exact(camera, chance, level):
    """The light of a spot on all of the floor below it, by light tracing alone and by emitter
    sampling: 2 % more in the density of the rays of a lens is found."""
    d = open_corner()
    del d["wall"]
    above = mi.ScalarTransform4f().look_at([0, 4, 0.1], [0, -1.5, 0], [0, 0, 1])
    if camera["type"] == "screencamera":  # its lens lies in the plane of X and Y
        above = mi.ScalarTransform4f().look_at([0, 3, 4], [0, -1.5, 0], [0, 1, 0])
    d["sensor"] = {"fov": 40} | camera | {"to_world": above, "film": film()}
    if camera["type"] == "screencamera":
        del d["sensor"]["fov"]
    lamp = {"type": "falloffspot"} | ABOVE["falloffspot"]
    scene = mi.load_dict(d | {"lamp": lamp})
    depth = {"min_depth": 2, "max_depth": 2}
    a, b = (
        level(chance.runs(scene, 1024, 8, integrator=integrator(only=w, **depth)).mean((1, 2, 3)))
        for w in ((2, 1), (1, 2))
    )
    chance.equal(a, b, precision=0.006)


@pytest.mark.false_alarms(1e-3)
def test_all_ways_before_a_lens_are_surfacepath(chance, level):
    """Light of one bounce and two from a wide lamp, in quarters of the picture."""
    d = open_corner()
    d["sensor"] |= SENSORS["lens"]
    scene, depth = mi.load_dict(d), {"min_depth": 2, "max_depth": 3}
    a, b = (
        means(chance, level, scene, integrator(kind, **depth), 512)
        for kind in ("bdpt", "surfacepath")
    )
    chance.equal(a, b, precision=0.03)


@pytest.mark.parametrize("camera", LENSES, ids=["lens", "screen"])
def test_a_lens_is_told_by_its_rays(camera):
    """Where a ray comes from and ends on the film, and its density per solid angle, by the rays
    beside it: to 2e-4, a hundredth of what errors of 2 % would be."""
    to_world = mi.ScalarTransform4f().look_at([9.5, 1.5, 4], [9, -0.5, -1], [0.1, 1, 0])
    fov = {"fov": 40, "near_clip": 0.2} if camera["type"] == "thinlens" else {}
    sensor = mi.load_dict(fov | camera | {"to_world": to_world})
    found = Pinhole.of(sensor, (640, 480)).prepared()
    aperture, p, q, h = mi.Point2f(0.1, 0.8), 0.2, 0.7, 0.01

    def ray(p, q):
        return sensor.sample_ray(0, 0.5, mi.Point2f(p, q), aperture)[0]

    seen = found.connect(ray(p, q)(2.3), aperture)
    assert np.array(seen.position).ravel() == pytest.approx([p, q], abs=1e-5)
    assert np.array(seen.end).ravel() == pytest.approx(np.array(ray(p, q).o).ravel(), abs=1e-5)
    assert np.array(seen.d).ravel() == pytest.approx(-np.array(ray(p, q).d).ravel(), abs=1e-5)
    start = found.start(ray(p, q))
    other = np.array(found.start(ray(0.9, q))).ravel()
    assert np.array(start).ravel() == pytest.approx(other, abs=1e-5)
    distance2 = float(dr.squared_norm(ray(p, q)(2.3) - start)[0])
    assert seen.squared_distance[0] == pytest.approx(distance2, rel=1e-5)
    right, left, down, up = (
        np.array(ray(p + x, q + y).d, float).ravel() for x, y in ((h, 0), (-h, 0), (0, h), (0, -h))
    )
    area = np.linalg.norm(np.cross(right - left, down - up)) / (2 * h) ** 2
    assert seen.pdf[0] * area == pytest.approx(1, abs=2e-4)
    assert found.pdf(ray(p, q).d, start)[0] == pytest.approx(seen.pdf[0], rel=1e-5)


def test_a_lens_that_looks_along_its_own_plane_is_none():
    """Rays ahead of a `screencamera` may go up and down the world's Z axis: its focus is on two
    planes."""
    sideways = mi.ScalarTransform4f().look_at([0, 0, 0], [0, -1, 0], [0, 0, 1])
    lens = mi.load_dict(SENSORS["screen with a lens"] | {"to_world": sideways})
    assert Pinhole.of(lens, (8, 8)) is None


def test_a_pinhole_is_told_by_its_rays():
    camera = mi.load_dict({"type": "perspective", "fov": 40, "near_clip": 0.5, "far_clip": 20.0})
    found = Pinhole.of(camera, (8, 8))
    p = mi.Point3f(0.1, -0.2, 3)
    seen = found.prepared().connect(p)
    ray, _ = camera.sample_ray(0, 0.5, seen.position, 0.5)
    assert np.array(dr.cross(ray.d, dr.normalize(p))).ravel() == pytest.approx(0, abs=1e-5)
    assert np.array(seen.end).ravel() == pytest.approx(np.array(ray.o).ravel(), abs=1e-5)
    assert np.array(seen.active)[0]
    for z in (0.4, 21, -3):
        assert not np.array(found.prepared().connect(mi.Point3f(0, 0, z)).active)[0]


def test_same_numbers_same_picture():
    """Bit for bit, by the same kernels; other seeds give other pictures."""
    scene = cornell((WARD, WARD), wide())
    made = integrator()
    first = np.array(mi.render(scene, integrator=made, spp=16, seed=3))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        again = np.array(mi.render(scene, integrator=integrator(), spp=16, seed=3))
        other = np.array(mi.render(scene, integrator=made, spp=16, seed=4))
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert all(kernel["cache_hit"] for kernel in kernels)


def test_alpha_and_hidden_lamps():
    """As `surfacepath`: alpha of what is met, and lamps that rays of the camera pass."""
    d = open_corner()
    d["sensor"]["film"] = film(16, pixel_format="rgba")
    scene = mi.load_dict(d)
    a, b = (
        np.array(mi.render(scene, spp=256, seed=1, integrator=integrator(k, hide_emitters=True)))
        for k in ("bdpt", "surfacepath")
    )
    assert a.shape == (16, 16, 4)
    assert a[..., 3] == pytest.approx(b[..., 3], abs=0.15)
    assert a[..., :3].mean() == pytest.approx(b[..., :3].mean(), rel=0.02)


def test_reports_what_it_cannot_do():
    with pytest.raises(RuntimeError, match="min_depth is 0"):
        integrator(min_depth=0)
    with pytest.raises(ValueError, match="differentiate by surfacepath"):
        integrator().render_forward(None, None)


def test_darkness_is_black():
    """A scene without lamps; no NaN, no error."""
    d = open_corner()
    del d["lamp"]
    picture = np.array(mi.render(mi.load_dict(d), integrator=integrator(), spp=4))
    assert np.array_equal(picture, np.zeros(picture.shape))
