"""`pssmlt` and `erpt` fill films as stock integrators do: formats, filters, borders, crops."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.registration import on_every_variant

METHODS = {
    "pssmlt": {"type": "pssmlt", "fallback": False, "bootstrap": 1.0},
    "independent": {"type": "pssmlt", "fallback": True, "direct_samples": 0.0},
    "erpt": {"type": "erpt", "length": 16, "bootstrap": 1.0},
}
FORMATS = ("rgb", "rgba", "luminance", "luminance_alpha", "xyz", "xyza")
FILTERS = ("box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos")


def define():
    class Edge(mi.SamplingIntegrator):
        """Colour (4, 1, 0.5) right of the line x + y = 0.1 on the film, dim grey left of it.

        Left of x = -0.5 nothing is seen, and alpha is 0.
        """

        def sample(self, scene, sampler, ray, medium=None, active=True):
            bright = ray.o.x + ray.o.y > 0.1
            twice = 2 * sampler.next_1d()
            L = mi.Color3f(4, 1, 0.5) if mi.is_rgb else mi.Spectrum(2)
            return dr.select(bright, L, 0.1) * twice, ray.o.x < 0.5, []

    mi.register_integrator("edge", Edge)


on_every_variant(define)


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("llvm_ad_rgb")


def scene(**film):
    film = {"type": "hdrfilm", "width": 6, "height": 6, "rfilter": {"type": "box"}} | film
    sensor = {"type": "orthographic", "film": film}
    return mi.load_dict({"type": "scene", "sensor": sensor, "sky": {"type": "constant"}})


def walk(method):
    return mi.load_dict(METHODS[method] | {"nested": {"type": "edge"}})


def compare(world, method, chance, level, spp=64, **limits):
    """Judge the pictures of a method by those that the nested integrator renders itself."""
    own = level(chance.runs(world, spp, runs=24, integrator=walk(method)))
    stock = level(chance.runs(world, 4 * spp, runs=24, integrator=mi.load_dict({"type": "edge"})))
    assert own.mean.shape == stock.mean.shape
    chance.equal(own, stock, **limits)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("pixel_format", FORMATS)
@pytest.mark.parametrize("method", METHODS)
def test_formats(method, pixel_format, chance, level):
    """Proves: every format of the film has the channels and values that it is to have."""
    compare(scene(pixel_format=pixel_format), method, chance, level)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("variant", ["llvm_ad_mono", "llvm_ad_spectral"])
def test_variants(variant, chance, level):
    mi.set_variant(variant)
    compare(scene(pixel_format="rgba"), "pssmlt", chance, level)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("border", [False, True])
@pytest.mark.parametrize("rfilter", FILTERS)
def test_filters(rfilter, border, chance, level):
    """Proves: pixels see as far as the filter reaches, also across the border if it is sampled.

    Stock pictures divide by the sum of the weights drawn, which differs from their mean by 1 %.
    """
    world = scene(rfilter={"type": rfilter}, sample_border=border)
    compare(world, "pssmlt", chance, level, spp=128, allowed=0.02)


@pytest.mark.false_alarms(1e-3)
def test_crop(chance, level):
    """Proves: a crop window shows its part of the picture."""
    crop = {"crop_offset_x": 3, "crop_offset_y": 1, "crop_width": 2, "crop_height": 4}
    compare(scene(rfilter={"type": "gaussian"}, **crop), "pssmlt", chance, level, allowed=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_the_film_holds_the_picture(method):
    """Proves: what `render` returns is in the film, and without `develop` nothing is returned."""
    world, integrator = scene(pixel_format="rgba"), walk(method)
    film = world.sensors()[0].film()
    first = integrator.render(world, spp=16, seed=1)
    assert np.array_equal(np.array(film.bitmap()), np.array(first))
    nothing = integrator.render(world, spp=16, seed=2, develop=False)
    assert nothing.shape in ((), (0,))
    second = np.array(film.develop())
    assert second.shape == (6, 6, 4) and not np.array_equal(second, np.array(first))
    again = np.array(integrator.render(world, spp=16, seed=2))
    assert np.array_equal(second, again)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_no_picture_of_colours_is_refused(method):
    """Proves: films of spectra, and AOVs inside or around, are refused in words."""
    mi.set_variant("llvm_ad_spectral")
    band = {"type": "spectrum", "value": [(400, 1.0), (700, 1.0)]}
    bands = {"type": "specfilm", "width": 4, "height": 4, "band": band}
    sensor = {"type": "orthographic", "film": bands}
    world = mi.load_dict({"type": "scene", "sensor": sensor, "sky": {"type": "constant"}})
    with pytest.raises(ValueError, match="films of colours, no SpecFilm"):
        walk(method).render(world, spp=4)
    mi.set_variant("llvm_ad_rgb")
    nested = {"type": "edge"}
    aov = {"type": "aov", "aovs": "dd:depth", "nested": {"type": "path"}}
    for inside in (aov, {"type": "moment", "nested": {"type": "path"}}):
        with pytest.raises(RuntimeError, match="renders colours, no AOVs"):
            mi.load_dict(METHODS[method] | {"nested": inside})
    for around in ({"type": "aov", "aovs": "dd:depth"}, {"type": "moment"}):
        with pytest.raises(RuntimeError) as raised:
            mi.load_dict(around | {"nested": METHODS[method] | {"nested": nested}})
        assert "SamplingIntegrator" in str(raised.value)
