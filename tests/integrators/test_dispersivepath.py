"""`dispersivepath`: the stock path tracer without dispersion, unbiased and less noisy with it."""

import mitsuba as mi
import numpy as np
import pytest

import integrators  # noqa: F401  registers the plugins

BOX = {"type": "box"}


def variant(name):
    """Fixture that sets a variant and returns to RGB."""

    @pytest.fixture
    def fixture():
        mi.set_variant(name)
        yield
        mi.set_variant("llvm_ad_rgb")

    return fixture


rgb, spectral = variant("llvm_ad_rgb"), variant("llvm_ad_spectral")


def cornell(integrator, glass, size=24, **options):
    """The Cornell box with both blocks of glass, without a reconstruction filter."""
    d = mi.cornell_box()
    d["integrator"] = {"type": integrator, "max_depth": 8, **options}
    d["sensor"]["film"] = {"type": "hdrfilm", "width": size, "height": size, "rfilter": BOX}
    d["small-box"]["bsdf"] = d["large-box"]["bsdf"] = glass
    return mi.load_dict(d)


PLAIN = {"type": "schlickglass", "int_ior": 1.5}
CONSTANT = {"type": "schlickglass", "dispersion": "cauchy6", "coefficients": "2.25"}
HEAVY = {
    "type": "schlickglass",
    "dispersion": "cauchy6",
    "coefficients": "3.5139564 -2.4812508E-2 4.6252559E-2 9.1313596E-3 1.0777108E-3 1.0819677E-4",
}


def runs(scene, spp, count=16):
    """`count` independent pictures, shape (count, height, width, 3)."""
    return np.array([np.array(mi.render(scene, spp=spp, seed=i)) for i in range(count)])


def assert_same(a, b):
    """Means of two sets of pictures agree within 4 standard errors in each channel (1 in 5000)."""
    a, b = a.mean((1, 2)), b.mean((1, 2))
    error = np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / len(a))
    assert np.all(error < 0.02 * a.mean(0))
    assert np.all(np.abs(a.mean(0) - b.mean(0)) <= 4 * error)


@pytest.mark.parametrize("options", [{}, {"max_depth": 2}, {"rr_depth": 2}, {"max_depth": -1}])
@pytest.mark.parametrize("bsdf", [PLAIN, {"type": "roughconductor"}], ids=lambda m: m["type"])
def test_is_path_without_dispersion(bsdf, options, rgb):
    """The same numbers as `path` from the same seed, pixel by pixel, to float32's rounding.

    Rounding may turn a path at a glass edge: one pixel in a hundred may differ.
    """
    a, b = (
        np.array(mi.render(cornell(name, bsdf, **options), spp=16, seed=3))
        for name in ("path", "dispersivepath")
    )
    assert np.mean(np.abs(a - b) > 1e-4 * (a + 1e-3)) < 0.01
    assert a.mean() == pytest.approx(b.mean(), rel=1e-3)


def test_constant_dispersion_is_no_dispersion(spectral):
    """n² = 2.25 as a dispersion formula gives the picture of int_ior = 1.5, in every channel.

    The wavelengths are parted, although nothing is gained; so a factor too many or too few would
    show as a factor of up to 4. Under `path` each refraction parts anew: unbiased as well.
    """
    plain = runs(cornell("path", PLAIN), 64)
    assert_same(plain, runs(cornell("dispersivepath", CONSTANT), 64))
    assert_same(plain, runs(cornell("path", CONSTANT), 256))


def test_both_protocols_agree(spectral):
    """A glass that really disperses: hero once against a new choice at each refraction."""
    assert_same(*(runs(cornell(name, HEAVY), 128) for name in ("dispersivepath", "path")))


def furnace(integrator, spp, **shapes):
    """Picture of `shapes` filling most of the view, under a sky that is the same all over."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": 40, "rr_depth": 100},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
            "sensor": {
                "type": "perspective",
                "fov": 20,
                "to_world": mi.ScalarTransform4f().look_at([0, -5, 0], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 32, "height": 32, "rfilter": BOX},
            },
            **shapes,
        }
    )
    return np.array(mi.render(scene, spp=spp, seed=1))


SPHERE = {"type": "sphere", "bsdf": HEAVY}


@pytest.mark.parametrize(("integrator", "spp"), [("dispersivepath", 1024), ("path", 4096)])
def test_white_furnace(integrator, spp, spectral):
    """Dispersive glass under a uniform sky is invisible: white, to 0.5 %, not tinted.

    The sky's own colour is taken from the picture without the sphere.
    """
    with_sphere = furnace(integrator, spp, sphere=SPHERE).mean((0, 1))
    assert with_sphere == pytest.approx(furnace(integrator, spp).mean((0, 1)), rel=5e-3)


def test_the_hero_saves_noise(spectral):
    """Through two refractions the hero keeps 4 times its share; new choices 16 times, 1 in 4 times.

    The variance over the 8x8 central pixels, which all see the same, differs by 2 at least.
    """
    once, each = (
        furnace(name, 256, sphere=SPHERE)[12:20, 12:20].var((0, 1))
        for name in ("dispersivepath", "path")
    )
    assert np.all(once < 0.5 * each)


def test_glass_parts_colours(spectral):
    """Seen from within heavy glass, a strip of light outside shows its colours side by side.

    Parallel rays meet the surface at 20 degrees and reach the height h of the strip displaced by
    h tan(theta(wavelength)) along it, sin theta = n sin 20°. Between 450 and 610 nm, about where
    blue and red of a display lie, n falls from 2.038 to 1.929: 28 pixels of 64 for h = 3. Green
    lies between. With one index the three stay together.
    """
    T, h, angle = mi.ScalarTransform4f, 3.0, np.radians(20)
    x = h * np.tan(np.arcsin(1.936 * np.sin(angle)))

    def centres(glass):
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "dispersivepath", "max_depth": 3},
                "strip": {
                    "type": "rectangle",
                    "to_world": T().translate([x, 0, h])
                    @ T().rotate([1, 0, 0], 180)
                    @ T().scale([0.01, 1, 1]),
                    "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
                },
                "surface": {"type": "rectangle", "to_world": T().scale(5), "bsdf": glass},
                "sensor": {
                    "type": "orthographic",
                    "to_world": T().look_at(
                        [-np.sin(angle), 0, -np.cos(angle)], [0, 0, 0], [0, 1, 0]
                    )
                    @ T().scale([0.3, 0.3, 1]),
                    "film": {"type": "hdrfilm", "width": 64, "height": 1, "rfilter": BOX},
                },
            }
        )
        image = np.array(mi.render(scene, spp=4096, seed=1))[0]
        return (image * np.arange(64)[:, None]).sum(0) / image.sum(0)

    red, green, blue = centres(HEAVY)
    assert abs(red - blue) == pytest.approx(28, rel=0.25)
    assert min(red, blue) < green < max(red, blue)
    assert np.ptp(centres({"type": "schlickglass", "int_ior": 1.936})) < 1


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"hide_emitters": True}, "cannot hide emitters"),
        ({"max_depth": -2}, "max_depth is -2, but must be -1 or more"),
        ({"rr_depth": 0}, "rr_depth is 0, but must be above 0"),
    ],
)
def test_errors(wrong, message, rgb):
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "dispersivepath", **wrong})
