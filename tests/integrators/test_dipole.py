"""`dipole` against closed forms, against `path`, and at the ends of every parameter's range."""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume import (
    bsdfs,  # noqa: F401  registers the plugins
    emitters,  # noqa: F401
    integrators,  # noqa: F401
)
from relume.bsdfs.subsurface import SubsurfaceMedium
from relume.integrators.diffusion import PROFILES, radius_of_tail, tail

ALPHA = np.array([0.3, 0.8, 0.99])
SKY = {"type": "constant"}


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def transform():
    return mi.ScalarTransform4f()


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in np.broadcast_to(values, 3)]}


def translucent(alpha=ALPHA, **more):
    """A material of sigma_t = 1 without mirror: F is noise for what is measured here."""
    alpha = np.asarray(alpha)
    coefficients = {"sigma_s": rgb(alpha), "sigma_a": rgb(1 - alpha)}
    kind = {"type": "subsurface", "eta": 1.3, "level": -2, "specular_reflectance": 0.0}
    return kind | coefficients | more


def view(origin=(0, 0, 100), fov=0.01, size=4, up=(0, 1, 0)):
    return {
        "type": "perspective",
        "fov": fov,
        "to_world": transform().look_at(list(origin), [0, 0, 0], list(up)),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
    }


def scene(integrator="dipole", profile="standard", sensor=None, **things):
    kind = {"type": integrator, "rr_depth": 100}
    if integrator == "dipole":
        kind["profile"] = profile
    parts = {"type": "scene", "integrator": kind, "sensor": sensor or view()}
    return mi.load_dict(parts | things)


def slab(bsdf):
    return {"type": "rectangle", "to_world": transform().scale(5000), "bsdf": bsdf}


@pytest.fixture
def radiance(chance, level):
    """Function from a scene to the `Level` of its mean radiance, (3,)."""

    def measure(scene, spp=4096, runs=8, **options):
        return level(chance.runs(scene, spp, runs, **options).mean(axis=(1, 2)))

    return measure


def fresnel(cos, eta):
    """Fresnel's reflectance of unpolarised light from outside, float64."""
    cos_t = np.sqrt(1 - (1 - cos * cos) / eta**2)
    r_s, r_p = (cos - eta * cos_t) / (cos + eta * cos_t), (eta * cos - cos_t) / (eta * cos + cos_t)
    return (r_s**2 + r_p**2) / 2


def hemispherical(eta):
    """Mean of Fresnel's reflectance from outside over a hemisphere, weighted by the cosine."""
    z = (np.arange(100_000) + 0.5) / 100_000
    return np.mean(2 * z * fresnel(z, eta))


def boundary(eta):
    """A = (1 + F_dr) / (1 - F_dr) with the polynomial of Jensen et al. 2001."""
    F_dr = -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta
    return (1 + F_dr) / (1 - F_dr)


def reflectance(alpha, eta, reach=np.inf):
    """2 pi int_0^reach R(r) r dr of the dipole with sigma_t' = 1, closed form.

    A source at depth z has alpha/2 (e^(-k z) - z/d e^(-k d)), d^2 = reach^2 + z^2, by
    substitution of d for r; the first term alone is R_d of Jensen et al. 2001, eq. 15.
    """
    k, total = np.sqrt(3 * (1 - alpha)), 0
    for z in (1, 1 + 4 / 3 * boundary(eta)):
        d = np.hypot(reach, z)
        total += np.exp(-k * z) - (z / d * np.exp(-k * d) if np.isfinite(d) else 0)
    return alpha / 2 * total


# ------------------------------ without translucent things ------------------------------


def test_is_path_without_subsurface():
    """The same samples as `path`, bit for bit, with every option."""
    things = {
        "sky": SKY,
        "ball": {"type": "sphere", "bsdf": {"type": "plastic"}},
        "lamp": {"type": "sphere", "center": [2, 0, 0], "emitter": {"type": "area"}},
    }
    sensor = view((0, -6, 0), 40, 16, (0, 0, 1))
    for options in ({"max_depth": 3}, {"rr_depth": 2}, {"hide_emitters": True}):
        pictures = [
            np.array(mi.render(scene(sensor=sensor, **things), spp=4, integrator=integrator))
            for integrator in (
                mi.load_dict({"type": kind} | options) for kind in ("path", "dipole")
            )
        ]
        assert np.array_equal(*pictures)


@pytest.mark.false_alarms(1e-3)
def test_hidden_emitters_with_subsurface(chance, radiance):
    """A translucent thing out of sight changes nothing but noise: hidden lamps stay hidden."""
    things = {
        "ball": {"type": "sphere", "bsdf": {"type": "plastic"}},
        "lamp": {"type": "sphere", "center": [2, 0, 0], "emitter": {"type": "area"}},
        "sensor": view((0, -6, 0), 30, 16, (0, 0, 1)),
    }
    away = {"away": {"type": "sphere", "center": [0, 500, 0], "bsdf": translucent()}}
    for options in ({"hide_emitters": True, "max_depth": 4}, {"max_depth": 2}):
        path, dipole = (
            radiance(
                scene(**things, **extra), 2048, integrator=mi.load_dict({"type": kind} | options)
            )
            for kind, extra in (("path", {}), ("dipole", away))
        )
        chance.equal(dipole, path, precision=0.01, of=2)


# ------------------------------ profiles ------------------------------


def test_radius_inverts_the_tail():
    """tail(radius_of_tail(share)) = share to 2e-5 from 1 - 1e-4 down to 1e-7, any absorption."""
    share = np.concatenate([10.0 ** -np.linspace(0.05, 7, 60), 1 - 10.0 ** -np.linspace(1, 4, 20)])
    for z in (1e-4, 1.0, 1e4):
        for k in (0.0, 1e-3, 0.1, 1.0, 10.0):
            r = radius_of_tail(mi.Float(z), mi.Float(k / z), mi.Float(share))
            back = np.array(tail(mi.Float(z), mi.Float(k / z), r))
            np.testing.assert_allclose(back, share, rtol=1e-4 if k > 1 else 2e-5)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("profile", PROFILES)
def test_density_of_radii(profile, chance):
    """The density is normalized, and the radii drawn follow it (chi² of 16 cells)."""
    ones = mi.Spectrum(1)
    medium = SubsurfaceMedium(ones * 0.9, ones * 0.1, ones * 0, mi.Float(1.3), mi.Float(6), ones)
    kernel = PROFILES[profile](medium, mi.Float(1e9))
    n = 2_000_000
    r = (np.arange(n) + 0.5) * (6 / n)
    p = np.array(kernel.pdf(mi.Float(r)))[0] * 2 * np.pi * r
    assert p.sum() * (6 / n) == pytest.approx(1, abs=2e-4)
    u = chance.rng().random(chance.samples(400_000)).astype(np.float32)
    drawn = np.array(kernel.sample_radius(mi.UInt32(0), mi.Float(u)))
    edges = np.linspace(0, 6, 17)
    expected = np.add.reduceat(p, (edges[:-1] * n / 6).astype(int)) * (6 / n) * len(u)
    observed, _ = np.histogram(drawn, edges)
    dof = len(expected) - 1
    # Wilson and Hilferty: the cube root of chi² over its degrees of freedom is nearly normal.
    cube_root = (np.sum((observed - expected) ** 2 / expected) / dof) ** (1 / 3)
    z = (cube_root - (1 - 2 / (9 * dof))) / math.sqrt(2 / (9 * dof))
    chance.judge(0.5 * math.erfc(z / math.sqrt(2)))


def test_profiles_are_the_formulas():
    """R(r) of Jensen et al. 2001, eq. 4, and Christensen and Burley 2015, eq. 3 and 8, float64.

    The latter over the mean of 1 - F from outside, of which the plugin has a fit, to 0.3 %.
    """
    sigma_s, sigma_a, g, eta = np.array([0.9, 2, 5]), np.array([0.1, 0.5, 0.01]), 0.5, 1.3
    spectra = (mi.Spectrum(np.broadcast_to(x, 3).tolist()) for x in (sigma_s, sigma_a, g))
    medium = SubsurfaceMedium(*spectra, mi.Float(eta), mi.Float(0), mi.Spectrum(1))
    sigma_t, A = sigma_s * (1 - g) + sigma_a, boundary(eta)
    alpha, sigma_tr = sigma_s * (1 - g) / sigma_t, np.sqrt(3 * sigma_a * sigma_t)
    r = np.geomspace(1e-3, 10, 50)[:, None]
    R = 0
    for z in (1 / sigma_t, (1 + 4 / 3 * A) / sigma_t):
        d = np.hypot(r, z)
        R = R + alpha / (4 * np.pi) * z * (sigma_tr + 1 / d) * np.exp(-sigma_tr * d) / d**2
    got = PROFILES["standard"](medium, mi.Float(1e9)).value(mi.Float(r.ravel()))
    np.testing.assert_allclose(np.array(got).T, R, rtol=1e-4)

    k = np.sqrt(3 * (1 - alpha))
    R_d = alpha / 2 * (1 + np.exp(-4 / 3 * A * k)) * np.exp(-k)
    d = 1 / sigma_t / (1.85 - R_d + 7 * np.abs(R_d - 0.8) ** 3)
    R = R_d * (np.exp(-r / d) + np.exp(-r / (3 * d))) / (8 * np.pi * d * r)
    got = PROFILES["normalized"](medium, mi.Float(1e9)).value(mi.Float(r.ravel()))
    np.testing.assert_allclose(np.array(got).T, R / (1 - hemispherical(eta)), rtol=3e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("profile", ["standard", "normalized"])
@pytest.mark.parametrize("eta", [1.0, 1.5])
def test_reflectance_of_a_slab(profile, eta, chance, radiance):
    """Under a uniform sky: F_t (1 - F_mean) R_d; without the factor where F_t is normalized.

    Within 0.5 % for reduced albedos 0.3, 0.8, 0.99.
    """
    floor = slab(translucent(eta=eta))
    measured = radiance(scene(profile=profile, sky=SKY, floor=floor), 16384)
    F = fresnel(1.0, eta)
    inner = 1 - hemispherical(eta) if profile == "standard" else 1
    expected = (1 - F) * inner * reflectance(ALPHA, eta)
    chance.equal(measured, expected, allowed=0.005, precision=0.004)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("radius", [0.5, 3.0])
def test_probes_find_all_of_a_sphere(radius, chance, radiance):
    """A ball of half a free path or more, all of whose points count, the far side too.

    Points of a sphere at the chord length d make up the area 2 pi d dd, whatever its radius, so
    the integral over the ball is that over a disk of radius 2R: closed form. Within 1 %.
    """
    ball = {"type": "sphere", "radius": radius, "bsdf": translucent()}
    measured = radiance(scene(sky=SKY, ball=ball), 16384)
    F = fresnel(1.0, 1.3)
    expected = (1 - F) * (1 - hemispherical(1.3)) * reflectance(ALPHA, 1.3, 2 * radius)
    chance.equal(measured, expected, allowed=0.005, precision=0.004)


@pytest.mark.false_alarms(1e-3)
def test_search_radius(chance, radiance):
    """`r_max` cuts the profile there, and a slab returns what the disk does; within 0.5 %."""
    measured = radiance(scene(sky=SKY, floor=slab(translucent(r_max=2.0))), 8192)
    F = fresnel(1.0, 1.3)
    expected = (1 - F) * (1 - hemispherical(1.3)) * reflectance(ALPHA, 1.3, 2.0)
    chance.equal(measured, expected, allowed=0.005, precision=0.004)


@pytest.mark.false_alarms(1e-3)
def test_spectral_variant(chance, radiance):
    """A grey slab has the same reflectance where channels are wavelengths; R_d is 0.299."""
    mi.set_variant("llvm_ad_spectral")
    try:
        material = {"type": "subsurface", "sigma_s": 0.9, "sigma_a": 0.1, "level": -2}
        floor = slab(material | {"specular_reflectance": 0.0})
        measured = radiance(scene(sky=SKY | {"radiance": rgb(0.5)}, floor=floor))
    finally:
        mi.set_variant("llvm_ad_rgb")
    F = fresnel(1.0, 1.3)
    expected = 0.5 * (1 - F) * (1 - hemispherical(1.3)) * reflectance(0.9, 1.3)
    chance.equal(measured, np.full(3, expected), allowed=0.01, precision=0.01)


# ------------------------------ light and geometry ------------------------------


@pytest.mark.false_alarms(1e-3)
def test_emitter_hits_and_samples(chance, radiance):
    """A lamp that is found by chance alone gives the same mean as one that is looked for."""
    lamp = {
        "type": "sphere",
        "center": [0, 0, 4],
        "radius": 2,
        "emitter": {"type": "area", "radiance": rgb(5)},
    }
    hidden = lamp | {"emitter": lamp["emitter"] | {"sampling_weight": 0.0}}
    dark = {"type": "point", "position": [0, 0, -9], "intensity": 1e-9}
    results = []
    for source in (lamp, hidden):
        things = {"lamp": source, "floor": slab(translucent(0.9, level=-1)), "dark": dark}
        results.append(radiance(scene(sensor=view((50, 0, 50)), **things), 4096))
    chance.equal(*results, precision=0.02)


@pytest.mark.false_alarms(1e-3)
def test_parallel_light_on_a_slab(chance, radiance):
    """F_t(1) F_t(cos_i) cos_i E R_d / pi: diffusion alone, lit by a lamp that has to be sampled."""
    cos_i = 0.6
    light = {"type": "directional", "direction": [0.8, 0, -cos_i], "irradiance": 1.0}
    F_t = (1 - fresnel(1.0, 1.3)) * (1 - fresnel(cos_i, 1.3))
    expected = F_t * cos_i / np.pi * reflectance(ALPHA, 1.3)
    measured = radiance(scene(light=light, floor=slab(translucent())), 16384)
    chance.equal(measured, expected, allowed=3e-3, precision=3e-3)


@pytest.mark.false_alarms(1e-3)
def test_single_scattering_of_a_slab(chance, radiance):
    """Level -1 under parallel light, against the closed form of a half space.

    A small search radius leaves no diffusion. Seen along the normal (cos 1 inside), lit at cos_i
    (cos_t inside): L = F_t(1)/eta^2 F_t(cos_i) (cos_i/cos_t) E p alpha / (1 + 1/cos_t); g = 0.5,
    -0.5 and 0.
    """
    eta, cos_i, alpha, g = 1.4, 0.6, 0.5, np.array([0.5, -0.5, 0.0])
    light = {"type": "directional", "direction": [0.8, 0, -cos_i], "irradiance": 1.0}
    medium = translucent(alpha, eta=eta, level=-1, g=rgb(g), r_max=1e-4)
    measured = radiance(scene(light=light, floor=slab(medium)), 16384)
    cos_t = np.sqrt(1 - (1 - cos_i**2) / eta**2)
    phase = (1 - g**2) / (4 * np.pi * (1 + g**2 + 2 * g * cos_t) ** 1.5)
    transmitted = (1 - fresnel(1.0, eta)) * (1 - fresnel(cos_i, eta)) / eta**2
    expected = transmitted * cos_i / cos_t * phase * alpha / (1 + 1 / cos_t)
    chance.equal(measured, expected, allowed=1e-3, precision=4e-3)


@pytest.mark.false_alarms(1e-3)
def test_clear_medium_is_glass(chance, radiance):
    """Without coefficients the ball is that of `dielectric`, before a floor and under a lamp."""
    things = {
        "sky": SKY | {"radiance": rgb([0.2, 0.3, 0.4])},
        "floor": {
            "type": "rectangle",
            "to_world": transform().translate([0, 0, -1.5]).scale(3),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "checkerboard"}},
        },
        "sensor": view((0, -5, 3), 40, 16),
    }
    clear = translucent(0, level=-1, sigma_a=0.0, specular_reflectance=1.0)
    glass = {"type": "dielectric", "int_ior": 1.3, "ext_ior": 1.0}
    results = [
        radiance(scene(kind, ball={"type": "sphere", "bsdf": bsdf}, **things), 256)
        for kind, bsdf in (("dipole", clear), ("path", glass))
    ]
    chance.equal(*results, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_inside_masks_bumps_and_instances(chance, radiance):
    """The material is found below other BSDFs and in instances; neighbours do not share light."""
    flat = {"type": "bitmap", "bitmap": mi.Bitmap(np.full((4, 4), 0.5, dtype=np.float32))}
    material = translucent(0.9, level=-1)
    plain = {"type": "sphere", "bsdf": material}
    group = {"type": "shapegroup", "ball": plain}
    instances = {
        "group": group,
        "one": {"type": "instance", "group": {"type": "ref", "id": "group"}},
        "two": {
            "type": "instance",
            "group": {"type": "ref", "id": "group"},
            "to_world": transform().translate([0, 0, -2.001]),
        },
    }
    lone = {"one": plain, "two": {"type": "sphere", "center": [0, 0, -2.001], "bsdf": material}}
    wrapped = [
        {"type": "mask", "opacity": 1.0, "b": material},
        {"type": "bumpmap", "t": flat, "b": material},
        {"type": "blendbsdf", "weight": 1e-6, "a": material, "b": {"type": "diffuse"}},
    ]
    sensor = view((0, -8, 0), 10, 8, (0, 0, 1))
    expected = radiance(scene(sensor=sensor, sky=SKY, ball=plain), 256)
    for bsdf in wrapped:
        ball = plain | {"bsdf": bsdf}
        chance.equal(radiance(scene(sensor=sensor, sky=SKY, ball=ball), 256), expected, of=4)
    expected = radiance(scene(sensor=sensor, sky=SKY, **lone), 256)
    instanced = radiance(scene(sensor=sensor, sky=SKY, **instances), 256)
    chance.equal(instanced, expected, precision=0.01, of=4)


# ------------------------------ what is one object ------------------------------


def grid(x=(-500.0, 500.0), y=(-500.0, 500.0), z=0.0):
    """A PLY file's mesh: a rectangle across Z of two triangles."""
    mesh = mi.Mesh("part", 4, 2)
    corners = [(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(corners).astype(np.float32)
    parameters["faces"] = np.array([0, 1, 2, 0, 2, 3], np.uint32)
    parameters.update()
    return mesh


@pytest.fixture
def ply(tmp_path):
    """Function from a mesh and a material to the dictionary of a shape in a PLY file."""

    def shape(mesh, bsdf, name):
        mesh.write_ply(str(tmp_path / f"{name}.ply"))
        return {"type": "ply", "filename": str(tmp_path / f"{name}.ply"), "bsdf": bsdf}

    return shape


def slab_reflectance(alpha, eta=1.3):
    """What a slab returns of a uniform sky along its normal, without its mirror."""
    return (1 - fresnel(1.0, eta)) * (1 - hemispherical(eta)) * reflectance(alpha, eta)


def instances_of(shapes, *offsets):
    group = {"type": "shapegroup"} | shapes
    return {"group": group} | {
        f"instance{i}": {
            "type": "instance",
            "group": {"type": "ref", "id": "group"},
            "to_world": transform().translate(list(offset)),
        }
        for i, offset in enumerate(offsets)
    }


@pytest.mark.false_alarms(1e-3)
def test_an_instance_diffuses(chance, radiance):
    """A slab in an instance returns the closed form's light."""
    world = scene(sky=SKY, **instances_of({"a": slab(translucent())}, (0, 0, 0)))
    chance.equal(radiance(world, 8192), slab_reflectance(ALPHA), allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_an_instance_is_what_it_repeats(chance, radiance):
    """A ball with all orders of scattering, beside another one."""
    ball = {"type": "sphere", "bsdf": translucent(0.9, level=-1, g=0.5)}
    lone = radiance(scene(sky=SKY, ball=ball))
    instanced = radiance(scene(sky=SKY, **instances_of({"ball": ball}, (0, 0, 0), (0, 9, 0))))
    chance.equal(instanced, lone, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_two_instances_are_two_objects(chance, radiance):
    """A slab 0.1 free paths below another one takes no light from it: there is no light below."""
    shapes = {"a": slab(translucent(0.9))}
    measured = radiance(scene(sky=SKY, **instances_of(shapes, (0, 0, 0), (0, 0, -0.1))))
    chance.equal(measured, np.full(3, slab_reflectance(0.9)), allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("optimize", [True, False])
@pytest.mark.parametrize("grouped", [False, True])
def test_parts_of_a_surface_are_one_object(optimize, grouped, ply, chance, radiance):
    """Two halves of a slab, of two materials that differ by what makes none: no seam.

    Seen on the seam the slab returns the closed form's light. Files keep vertices apart.
    """
    halves = {
        side: ply(grid(x=x), translucent(0.9, **more), side)
        for side, x, more in (
            ("left", (-500.0, 0.0), {}),
            ("right", (0.0, 500.0), {"r_max": 1e4}),
        )
    }
    parts = instances_of(halves, (0, 0, 0)) if grouped else halves
    kind = {"type": "dipole", "rr_depth": 100}
    world = {"type": "scene", "integrator": kind, "sensor": view(), "sky": SKY}
    measured = radiance(mi.load_dict(world | parts, optimize=optimize))
    chance.equal(measured, np.full(3, slab_reflectance(0.9)), allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_objects_of_one_material_are_not_one_object(ply, chance, radiance):
    """`mi.load_dict` merges two slabs, 0.1 free paths apart, into one mesh.

    A lamp between them that shines on the lower one alone is not seen above.
    """
    slabs = {f"slab{i}": ply(grid(z=-0.1 * i), translucent(0.9), f"slab{i}") for i in (0, 1)}
    between = {"type": "point", "position": [0, 0, -0.05], "intensity": 3.0}
    kind = {"type": "dipole", "rr_depth": 100}
    world = {"type": "scene", "integrator": kind, "sensor": view(), "sky": SKY, "lamp": between}
    merged = mi.load_dict(world | slabs)
    assert len(merged.shapes()) == 1
    expected = np.full(3, slab_reflectance(0.9))
    chance.equal(radiance(merged), expected, allowed=0.005, precision=0.01)


@pytest.mark.false_alarms(1e-3)
def test_surfaces_of_one_name_are_one_object(ply, chance, radiance):
    """Two halves that do not touch, by a hair, are one object if the material says so."""
    gap = 1e-3
    kind = {"type": "dipole", "rr_depth": 100}
    world = {"type": "scene", "integrator": kind, "sensor": view((0.1, 0, 100)), "sky": SKY}
    world["sensor"]["to_world"] = transform().look_at([0.01, 0, 100], [0.01, 0, 0], [0, 1, 0])
    results = []
    for name in ("jade", ""):
        bsdf = translucent(0.9, object=name)
        halves = {
            "left": ply(grid(x=(-500.0, -gap)), bsdf, "left"),
            "right": ply(grid(x=(gap, 500.0)), bsdf, "right"),
        }
        results.append(radiance(mi.load_dict(world | halves)))
    expected = np.full(3, slab_reflectance(0.9))
    chance.equal(results[0], expected, allowed=0.005, precision=0.01)
    assert np.all(results[1].mean < 0.75 * expected)


# ------------------------------ ends of the ranges ------------------------------


EXTREMES = {
    "no absorption": {"sigma_a": 0.0},
    "no scattering": {"sigma_s": 0.0},
    "nothing": {"sigma_s": 0.0, "sigma_a": 0.0},
    "dense": {"sigma_s": 1e6},
    "black": {"sigma_a": 1e6},
    "g = 1": {"g": 1.0},
    "g = -1": {"g": -1.0},
    "g = 0.99": {"g": 0.99},
    "g = -0.99": {"g": -0.99},
    "eta = 1": {"eta": 1.0},
    "eta < 1": {"eta": 0.75},
    "eta = 2.4": {"eta": 2.4},
    "scale 1e-4": {"scale": 1e-4},
    "scale 1e4": {"scale": 1e4},
}


@pytest.mark.parametrize("profile", PROFILES)
def test_ends_of_the_ranges(profile):
    """Fourteen balls, each at one end: no NaN, nothing negative, no pixel over 100 medians."""
    balls = {}
    for i, extreme in enumerate(EXTREMES.values()):
        material = translucent(0.8, level=-1, specular_reflectance=1.0) | extreme
        balls[f"ball{i}"] = {"type": "sphere", "center": [2.5 * i, 0, 0], "bsdf": material}
    sensor = view((0, -8, 0), 20, 16, (0, 0, 1))
    shine = {"type": "area", "radiance": rgb(20)}
    lamp = {"type": "sphere", "center": [0, -4, 6], "emitter": shine}
    world = scene(profile=profile, sky=SKY, lamp=lamp, sensor=sensor, **balls)
    parameters = mi.traverse(world)
    for i, name in enumerate(EXTREMES):
        to_world = mi.ScalarTransform4f().translate([2.5 * i, 0, 0])
        parameters["sensor.to_world"] = to_world @ view((0, -8, 0), up=(0, 0, 1))["to_world"]
        parameters.update()
        picture = np.array(mi.render(world, spp=64, seed=i))
        assert np.all(np.isfinite(picture)), name
        assert picture.min() >= 0, name
        assert picture.max() < 100 * np.median(picture), name


@pytest.mark.false_alarms(1e-3)
def test_small_free_paths_are_local(chance, radiance):
    """With free paths below the rounding of positions a slab is still the closed form."""
    floor = slab(translucent(scale=1e4)) | {"to_world": transform().translate([0, 0, 7]).scale(90)}
    measured = radiance(scene(sky=SKY, floor=floor), 8192)
    F = fresnel(1.0, 1.3)
    expected = (1 - F) * (1 - hemispherical(1.3)) * reflectance(ALPHA, 1.3)
    chance.equal(measured, expected, allowed=0.01, precision=0.01)


def test_one_kernel():
    """A picture is one kernel, compiled once for all seeds."""
    world = scene(sky=SKY, floor=slab(translucent(level=-1)))
    mi.render(world, spp=4, seed=0)
    dr.eval()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(mi.render(world, spp=4, seed=1))
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert all(k["cache_hit"] for k in kernels)


def test_refuses():
    """Unknown profiles and depths are refused by name."""
    for parameters in ({"profile": "dipole"}, {"max_depth": -2}, {"rr_depth": 0}):
        with pytest.raises(RuntimeError, match=next(iter(parameters))):
            mi.load_dict({"type": "dipole", **parameters})
