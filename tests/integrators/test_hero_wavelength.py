"""`surfacepath` in dispersive glass: the stock path tracer's mean, with less noise."""

import mitsuba as mi
import numpy as np
import pytest

from relume import integrators  # noqa: F401  registers the plugins

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
    """The Cornell box with both blocks of glass, without a reconstruction filter.

    Its lamp is as wide as the ceiling: rare paths through the glass to a small one hold much light.
    """
    d = mi.cornell_box()
    d["light"]["to_world"] = d["light"]["to_world"] @ mi.ScalarTransform4f().scale(4)
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


@pytest.fixture
def measure(chance, level):
    """Mean over the picture as a `Level` of its channels, from 16 runs."""
    return lambda scene, spp: level(chance.runs(scene, spp, 16).mean(axis=(1, 2)))


@pytest.mark.false_alarms(1e-3, reduced=4)
def test_constant_dispersion_is_no_dispersion(spectral, measure, chance):
    """n² = 2.25 as a dispersion formula gives the picture of int_ior = 1.5, in every channel.

    The wavelengths are parted, although nothing is gained; so a factor too many or too few would
    show as a factor of up to 4. Under `path` each refraction parts anew: unbiased as well.
    """
    plain = measure(cornell("path", PLAIN), 64)
    for integrator, spp in (("surfacepath", 64), ("path", 96)):
        parted = measure(cornell(integrator, CONSTANT), spp)
        chance.equal(parted, plain, precision=0.02, of=2)


@pytest.mark.false_alarms(1e-3, reduced=4)
def test_both_protocols_agree(spectral, measure, chance):
    """A glass that really disperses: hero once against a new choice at each refraction."""
    once, each = (measure(cornell(name, HEAVY), 48) for name in ("surfacepath", "path"))
    chance.equal(once, each, precision=0.02)


def furnace(integrator, **shapes):
    """Scene of `shapes` filling most of the view, under a sky that is the same all over."""
    return mi.load_dict(
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


SPHERE = {"type": "sphere", "bsdf": HEAVY}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(("integrator", "spp"), [("surfacepath", 64), ("path", 384)])
def test_white_furnace(integrator, spp, spectral, measure, chance):
    """Dispersive glass under a uniform sky is invisible: white, not tinted.

    The sky's own colour is taken from the picture without the sphere.
    """
    with_sphere = measure(furnace(integrator, sphere=SPHERE), spp)
    chance.equal(with_sphere, measure(furnace(integrator), spp), precision=4e-3)


@pytest.mark.false_alarms(1e-3)
def test_the_hero_saves_noise(spectral, chance):
    """Through two refractions the hero keeps 4 times its share; new choices 16 times, 1 in 4 times.

    The variance over the 8x8 central pixels, which all see the same, differs by 2 at least.
    """
    once, each = (
        chance.runs(furnace(name, sphere=SPHERE), 64, 4)[:, 12:20, 12:20].var(axis=(0, 1, 2))
        for name in ("surfacepath", "path")
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
                "integrator": {"type": "surfacepath", "max_depth": 3},
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
