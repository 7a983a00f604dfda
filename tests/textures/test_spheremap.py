"""The texture spheremap: the texel of the map, whatever the coordinates of the shape."""

import mitsuba as mi
import numpy as np
import pytest

from relume import dome_maps, textures  # noqa: F401  registers the plugin

W, H = 16, 8


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def image():
    return np.random.default_rng(1).random((H, W, 3)).astype(np.float32)


@pytest.fixture
def load(image):
    def make(**parameters):
        picture = {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True,
                   "filter_type": "nearest"}  # fmt: skip
        return mi.load_dict({"type": "spheremap", "picture": picture, **parameters})

    return make


def at(points):
    """An interaction at points (N, 3) whose coordinates must not matter."""
    si = mi.SurfaceInteraction3f()
    si.p, si.uv = mi.Point3f(points.T), mi.Point2f(0.123, 0.456)
    return si


def expected(image, name, n):
    """Texels of Mitsuba's nearest filter, whose v = 0 is the top row, clear of their edges."""
    u, v = dome_maps.FORMULAS[name](dome_maps.Numpy, *n.T)
    x, y = W * u, H * v
    clear = np.minimum(np.abs(x - np.round(x)), np.abs(y - np.round(y))) > 0.01
    return image[np.minimum(y, H - 1).astype(int), np.minimum(x, W - 1).astype(int)], clear


@pytest.fixture
def n():
    found = np.random.default_rng(2).normal(size=(1000, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("name", dome_maps.FORMULAS)
def test_texels(load, image, n, name):
    """At the point c + r n of a sphere the texel of n."""
    texture = load(map=name, center=[3, -2, 5])
    texels, clear = expected(image, name, n)
    found = np.array(texture.eval(at([3, -2, 5] + 4 * n))).T
    assert clear.mean() > 0.8
    assert np.allclose(found[clear], texels[clear], atol=1e-6)


def test_ellipsoid(load, image, n):
    """`to_sphere` undoes the scale of an ellipsoid."""
    to_sphere = mi.ScalarTransform4f().scale([1, 1 / 3, 1])
    texture = load(map="panoramic", center=[1, 0, 0], to_sphere=to_sphere)
    texels, clear = expected(image, "panoramic", n)
    found = np.array(texture.eval(at([1, 0, 0] + n * [2, 6, 2]))).T
    assert np.allclose(found[clear], texels[clear], atol=1e-6)


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
def test_inside_a_bsdf(image, n, variant):
    """Lambert's reflectance and the opacity of `mask`, in RGB and in spectral variants."""
    mi.set_variant(variant)
    grey = np.repeat(image[..., :1], 3, axis=2)
    picture = {"type": "bitmap", "bitmap": mi.Bitmap(grey), "raw": False, "filter_type": "nearest"}
    covering = {"type": "spheremap", "map": "angular", "picture": picture}
    bsdf = mi.load_dict({"type": "diffuse", "reflectance": covering})
    si = at(n)
    si.wi = mi.Vector3f(0, 0, 1)
    if mi.is_spectral:
        si.wavelengths = mi.sample_rgb_spectrum(mi.Spectrum(0.5))[0]
    texels, clear = expected(grey, "angular", n)
    found = np.pi * np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1))).T
    # Spectra of greys are flat to half a percent.
    assert np.allclose(found[clear], texels[clear][:, :1], atol=5e-3)
    single = {"type": "bitmap", "bitmap": mi.Bitmap(image[..., :1]), "raw": True,
              "filter_type": "nearest"}  # fmt: skip
    opacity = {"type": "spheremap", "map": "angular", "picture": single}
    mask = mi.load_dict({"type": "mask", "opacity": opacity, "bsdf": {"type": "diffuse"}})
    passed = np.array(mask.eval_null_transmission(si))[0]
    assert np.allclose(1 - passed[clear], texels[clear][:, 0], atol=1e-6)


def test_one_texture_is_nested():
    with pytest.raises(Exception, match="one nested texture"):
        mi.load_dict({"type": "spheremap", "map": "angular"})
    with pytest.raises(Exception, match="mercator"):
        mi.load_dict({"type": "spheremap", "map": "mercator", "t": {"type": "checkerboard"}})
