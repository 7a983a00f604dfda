"""Accretion disks: where their picture lies, how they shine, and how much they let through."""

import mitsuba as mi
import numpy as np
import pytest

from relume import textures  # noqa: F401  registers the plugins
from relume.textures.blackbodies import BlackBodies


@pytest.fixture(autouse=True)
def variant(request):
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    mi.set_variant("llvm_ad_rgb")


def bitmap(pixels):
    return {"type": "bitmap", "raw": True, "filter_type": "nearest",
            "bitmap": mi.Bitmap(np.asarray(pixels, np.float32))}  # fmt: skip


WHITE = np.ones((1, 1, 3))


def disk(pixels=WHITE, **parameters):
    return mi.load_dict({"type": "accretiondisk", "picture": bitmap(pixels),
                         "outer_radius": 60.0} | parameters)  # fmt: skip


def at(x, towards):
    """Interactions at points of the plane z = 0 (n, 3), seen from directions (n, 3)."""
    x, towards = np.broadcast_arrays(np.asarray(x, float), np.asarray(towards, float))
    si = mi.SurfaceInteraction3f()
    si.p = mi.Point3f(*x.T)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.wi = si.to_local(mi.Vector3f(*towards.T))
    si.t = mi.Float(np.ones(len(x)))
    return si


def test_layout():
    """Columns to +X, rows from the top to +Y; the middle is the inner edge, the sides half-way."""
    pixels = np.zeros((8, 8, 3))
    pixels[..., 0] = np.arange(8)[None] / 10
    pixels[..., 1] = np.arange(8)[:, None] / 10
    texture = disk(pixels, quantity="reflectance", center=[1, 2, 0])
    ρ = 0.3
    r = 6 + ρ * 54
    angles = np.linspace(0.1, 6.2, 9)
    x = np.array([1 + r * np.cos(angles), 2 + r * np.sin(angles), 0 * angles]).T
    c = np.array(texture.eval(at(x, [0, 0, 1]))).T
    column = np.floor(8 * (0.5 + ρ * np.cos(angles)))
    row = np.floor(8 * (0.5 + ρ * np.sin(angles)))
    assert np.allclose(c[:, 0], column / 10) and np.allclose(c[:, 1], row / 10)
    # Inside, within the hole of the disk, and beyond the picture's sides there is nothing.
    ends = np.array([[6.9, 2, 0], [7.1, 2, 0], [33.9, 2, 0], [34.1, 2, 0]])
    assert (np.array(disk(center=[1, 2, 0]).eval(at(ends, [0, 0, 1])))[0] > 0).tolist() == [
        False, True, True, False]  # fmt: skip
    hole = disk(center=[1, 2, 0], hole_radius=10.0)
    assert (np.array(hole.eval(at(ends, [0, 0, 1])))[0] > 0).tolist() == [False, False, True, False]


def test_layout_of_other_normals():
    """A disk about +X: the picture's right and up are Y x X and so on, as for +Z."""
    pixels = np.zeros((2, 2, 3))
    pixels[:, 1, 0] = 1
    texture = disk(pixels, quantity="reflectance", normal=[1, 0, 0])
    x = np.array([[0, 0, 20.0], [0, 0, -20], [0, 20, 1], [0, -20, 1]])
    c = np.array(texture.eval(at(x, [1, 0, 0])))[0]
    # up = Y x X = -Z, right = X x up = Y
    assert c.tolist() == [1, 1, 1, 0]


def four_velocity_ratio(a, x, photon):
    """g from four-vectors in Boyer and Lindquist's metric at the equator, photon in the scene."""
    r = np.sqrt(x[0] ** 2 + x[1] ** 2 - a * a)
    R, D, S = r * r + a * a, r * r - 2 * r + a * a, r * r
    g = np.zeros((4, 4))  # t, r, θ, φ
    g[0, 0], g[0, 3] = -(1 - 2 / r), -2 * a / r
    g[3, 0], g[1, 1], g[2, 2] = g[0, 3], S / D, S
    g[3, 3] = R + 2 * a * a / r
    phi = np.arctan2(x[1], x[0])
    e = np.array([np.cos(phi), np.sin(phi), 0]), np.array([-np.sin(phi), np.cos(phi), 0])
    k = np.zeros(4)
    k[1] = photon @ e[0] / (r / np.sqrt(R))
    k[2] = -photon[2] / r
    k[3] = photon @ e[1] / np.sqrt(R)
    space = k @ g @ k
    k[0] = max(np.roots([g[0, 0], 2 * g[0, 3] * k[3], space]).real)
    omega = 1 / (r**1.5 + a)
    u = np.array([1, 0, 0, omega])
    u /= np.sqrt(-u @ g @ u)
    return (-k @ g[0]) / (-k @ g @ u)


@pytest.mark.parametrize("a", [0.0, 0.9])
def test_red_shift(a):
    """Radiance is g^4, with g from the four-velocities of gas, light, and an eye at infinity."""
    rng = np.random.default_rng(2)
    radius, angle = rng.uniform(7, 25, 30), rng.uniform(0, 6.28, 30)
    x = np.array([radius * np.cos(angle), radius * np.sin(angle), 0 * radius]).T
    d = rng.normal(size=(30, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    L = np.array(disk(spin=a).eval(at(x, d)))[0]
    g = [four_velocity_ratio(a, *pair) for pair in zip(x, d, strict=True)]
    assert np.allclose(L ** 0.25, g, rtol=2e-5)  # fmt: skip


def test_face_on():
    """sqrt(1 - 3/r) with the hole's red shift, sqrt(1 - 1/(r - 2)) without."""
    r = np.array([6.5, 8, 20])
    si = at(np.array([r, 0 * r, 0 * r]).T, [0, 0, 1])
    with_hole, without = (np.array(disk(motion=m).eval(si))[0] for m in ("gravity", "doppler"))
    assert np.allclose(with_hole, (1 - 3 / r) ** 2, rtol=1e-4)
    assert np.allclose(without, (1 - 1 / (r - 2)) ** 2, rtol=1e-4)


def test_what_comes_towards_the_eye_is_bright():
    """Gas turns from +X to +Y; a straight line to an eye replaces the direction of the ray."""
    x, eye = np.array([[0, 10.0, 0], [0, -10, 0]]), np.array([1000.0, 0, 0])
    beta = 1 / np.sqrt(8)
    D = np.sqrt((1 - beta) / (1 + beta)), np.sqrt((1 + beta) / (1 - beta))
    grey = 0.1 * WHITE
    L = np.array(disk(grey, motion="doppler").eval(at(x, [1, 0, 0])))[0]
    assert np.allclose(L, 0.1 * np.array(D) ** 4, rtol=1e-4)
    L = np.array(disk(grey, motion="doppler", seen_from=eye.tolist()).eval(at(x, [0, 0, 1])))[0]
    assert np.allclose(L, 0.1 * np.array(D) ** 4, rtol=1e-3)
    bright = np.array(disk(motion="doppler").eval(at(x, [1, 0, 0])))[0]
    assert bright[1] == 1  # no channel above 1


def test_opacity():
    """min(alpha, |c| / 3); all from 0.99 on."""
    x = np.array([[20.0, 0, 0]])
    for c, alpha, want in (([3, 0, 0], 0.4, 0.4), ([0.6, 0, 0], 0.9, 0.2), ([9, 9, 9], 0.995, 1)):
        texture = disk(np.array([[c]]), alpha=alpha, quantity="opacity")
        assert np.array(texture.eval_1(at(x, [0, 0, 1]))) == pytest.approx(want, abs=1e-6)


def test_scale_is_the_emission_of_white():
    texture = disk(scale={"type": "rgb", "value": [10, 20, 30]})
    L = np.array(texture.eval(at([[20.0, 0, 0]], [0, 0, 1]))).ravel()
    assert np.allclose(L, (1 - 3 / 20) ** 2 * np.array([10, 20, 30]), rtol=1e-4)


def test_temperature():
    """The luminance of the picture, and Planck's colour at g T, whose peak is at 49/36 of r_i."""
    r = np.array([49 / 36 * 6, 20.0])
    texture = disk(0.5 * WHITE, temperature=4500.0)
    L = np.array(texture.eval(at(np.array([r, 0 * r, 0 * r]).T, [0, 0, 1]))).T
    g2 = 1 - 3 / r
    assert np.allclose(L @ [0.212671, 0.715160, 0.072169], 0.5 * g2**2, rtol=1e-3)
    f = (1 - np.sqrt(6 / r)) / r**3
    T = 4500 * (f / f[0]) ** 0.25 * np.sqrt(g2)
    colors = np.array(BlackBodies().eval(mi.Float(T), None)).T
    assert np.allclose(L, colors * (0.5 * g2**2)[:, None], rtol=1e-3)


def test_black_bodies():
    """Chromaticities of the Planckian locus (CIE 1931) at 2856, 5000 and 6504 K."""
    colors = np.array(BlackBodies().eval(mi.Float([2856, 5000, 6504]), None), np.float64)
    xyz = np.linalg.inv([[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556],
                         [0.055648, -0.204043, 1.057311]]) @ colors  # fmt: skip
    xy = (xyz[:2] / xyz.sum(axis=0)).T
    assert np.allclose(xy, [[0.4475, 0.4074], [0.3451, 0.3516], [0.3135, 0.3236]], atol=1e-3)
    assert np.allclose(xyz[1], 1, atol=1e-3)


@pytest.mark.parametrize("variant", ["llvm_ad_spectral"], indirect=True)
def test_spectra_of_black_bodies(variant):
    """Of luminance 1, by quadrature over wavelengths."""
    λ = np.arange(380.5, 780)
    bodies, y = BlackBodies(), np.array(mi.cie1931_xyz(mi.Float(λ)))[1]
    for T in (1000.0, 6500.0, 30000.0):
        L = np.array(bodies.eval(mi.Float(T), mi.Spectrum(mi.Float(λ))))[0]
        assert (L * y).sum() == pytest.approx(1, rel=2e-3)


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_mono"], indirect=True)
def test_other_variants(variant):
    """g^4 of the picture, and an opacity."""
    si = at([[20.0, 0, 0]], [0, 0, 1])
    if mi.is_spectral:
        si.wavelengths = mi.Spectrum(450, 500, 600, 700)
    si.uv = mi.Point2f(0.5)
    picture = {"type": "bitmap", "bitmap": mi.Bitmap(WHITE.astype(np.float32))}
    texture = disk(scale=2.0, picture=picture)
    L = np.array(texture.eval(si)).ravel()
    rest = np.array(mi.load_dict(picture).eval(si)).ravel()
    scale = np.array(texture.scale.eval(si)).ravel()
    assert np.allclose(L, (1 - 3 / 20) ** 2 * scale * rest, rtol=1e-4)
    assert np.array(texture.eval_1(si)) == pytest.approx(1 / np.sqrt(3), rel=1e-3)


@pytest.mark.parametrize(
    ("parameter", "message"),
    [({"outer_radius": 5.0}, "orbit, 6"), ({"spin": 1.5}, "spin is 1.5"),
     ({"mass": 0.0}, "mass is 0"), ({"shift": 2.0}, "shift is 2"),
     ({"temperature": -1.0}, "temperature is -1"), ({"motion": "still"}, "motion is 'still'")],
)  # fmt: skip
def test_bad_parameters(parameter, message):
    with pytest.raises(RuntimeError, match=message):
        disk(**parameter)
