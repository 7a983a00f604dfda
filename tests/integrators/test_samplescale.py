"""The `samplescale` integrator: factor and luminance limit of every sample."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.session import Session

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono")


@pytest.fixture(params=VARIANTS)
def variant(request):
    mi.set_variant(request.param)


def wrapped(**parameters):
    return mi.load_dict({"type": "samplescale", "nested": {"type": "path"}} | parameters)


def sky(radiance, **shapes):
    """A scene in which every sample has the same radiance."""
    film = {"type": "hdrfilm", "width": 4, "height": 3, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "film": film | {"pixel_format": "luminance"}}
    return mi.load_dict(
        {"type": "scene", "sensor": sensor, "sky": {"type": "constant", "radiance": radiance}}
        | shapes
    )


def luminance(scene, integrator, spp=64):
    return np.array(mi.render(scene, integrator=integrator, spp=spp))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "parameters, expected",
    [
        ({}, 2),
        ({"response": 0.5}, 1),
        ({"luminance_limit": 0.0}, 2),
        ({"luminance_limit": 3.0}, 2),
        ({"luminance_limit": 0.5}, 0.5),
        ({"luminance_limit": 0.5, "response": 3.0}, 1.5),
        ({"response": 0.0}, 0),
    ],
)
def test_closed_form_on_samples_of_one_radiance(variant, parameters, expected, chance, level):
    """k min(L, Y_max) for grey samples of luminance L = 2; the limit comes before the factor.

    Grey samples have their luminance in the spectral variant, too, whatever their wavelengths.
    """
    radiance = {"type": "uniform", "value": 2.0} if mi.is_spectral else 2.0
    spp = 1024 if mi.is_spectral else 4
    pictures = chance.runs(sky(radiance), spp, integrator=wrapped(**parameters))
    measured = level(pictures.mean(axis=(1, 2, 3)))
    chance.equal(measured, expected, allowed=1e-3 if mi.is_spectral else 1e-5, precision=5e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("limit, expected", [(3.0, 2.0), (0.5, 0.5)])
def test_dispersed_samples(limit, expected, chance, level):
    """A ball of dispersive glass in a white sky of 2, whose paths keep one wavelength of four."""
    mi.set_variant("llvm_ad_spectral")
    glass = {"type": "schlickglass", "dispersion": "formula99"}
    ball = {"type": "sphere", "center": [0, 0, 3], "bsdf": glass}
    scene = sky({"type": "uniform", "value": 2.0}, ball=ball)
    integrator = wrapped(luminance_limit=limit, nested={"type": "surfacepath"})
    pictures = chance.runs(scene, 1024, integrator=integrator)
    measured = level(pictures.mean(axis=(1, 2, 3)))
    chance.equal(measured, expected, allowed=1e-3, precision=5e-3)


@pytest.mark.false_alarms(1e-3)
def test_coloured_light_in_a_spectral_variant(chance, level):
    """Light of one colour has its luminance on average, and stays below the limit."""
    mi.set_variant("llvm_ad_spectral")
    scene = sky({"type": "rgb", "value": [2.0, 0.3, 0.2]})
    free, held = (
        level(chance.runs(scene, 1024, integrator=integrator).mean(axis=(1, 2, 3)))
        for integrator in (wrapped(), wrapped(luminance_limit=10.0))
    )
    chance.equal(held, free, precision=0.01)


def test_colour_is_kept():
    """A sample is scaled as a whole: ratios of its channels stay (weights known to four digits)."""
    mi.set_variant("llvm_ad_rgb")
    scene = sky({"type": "rgb", "value": [4.0, 1.0, 0.5]})
    ray = dr.zeros(mi.RayDifferential3f)
    ray.d = mi.Vector3f(0, 0, 1)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, 1)
    L, _, aovs = wrapped(luminance_limit=0.5).sample(scene, sampler, ray)
    Y = 0.2126 * 4 + 0.7152 * 1 + 0.0722 * 0.5
    assert np.allclose(np.array(L).ravel(), np.array([4, 1, 0.5]) * 0.5 / Y, rtol=3e-4)
    assert aovs == []


def test_black_samples_stay_black():
    mi.set_variant("llvm_ad_rgb")
    assert (luminance(sky(0.0), wrapped(luminance_limit=0.5)) == 0).all()


def test_it_forwards_the_nested_integrators_outputs():
    mi.set_variant("llvm_ad_rgb")
    aov = {"type": "aov", "aovs": "distance:depth"}
    made = mi.load_dict({"type": "samplescale", "response": 2.0, "nested": aov})
    assert made.aov_names() == mi.load_dict(aov).aov_names()
    assert "AOV" in str(made)


@pytest.mark.parametrize(
    "nested", [{}, {"nested": {"type": "ptracer"}}, {"a": {"type": "path"}, "b": {"type": "path"}}]
)
def test_it_takes_one_sampling_integrator(nested):
    mi.set_variant("llvm_ad_rgb")
    with pytest.raises(RuntimeError, match="one nested sampling integrator"):
        mi.load_dict({"type": "samplescale", **nested})


# ---- pictures of `bdpt`


def over_bdpt(**parameters):
    nested = {"type": "bdpt", "max_depth": 4, "merge_radius": 0.5}
    return mi.load_dict({"type": "samplescale", "nested": nested} | parameters)


def lit_floor():
    to_world = mi.ScalarTransform4f().translate([0, 0, 4])
    back = {"type": "rectangle", "to_world": to_world.rotate([0, 1, 0], 180).scale(3)}
    spot = {"type": "spot", "cutoff_angle": 30.0}
    film = {"type": "hdrfilm", "width": 4, "height": 3, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "film": film | {"pixel_format": "rgba"}}
    return mi.load_dict({"type": "scene", "sensor": sensor, "back": back, "spot": spot})


def test_a_picture_of_bdpt_is_multiplied():
    """Bit for bit by a power of two, in passes and by `mi.render`; its alpha is not."""
    mi.set_variant("llvm_ad_rgb")
    scene = lit_floor()
    plain, halved = over_bdpt(), over_bdpt(response=0.5)
    pictures = [np.array(mi.render(scene, integrator=x, spp=4)) for x in (plain, halved)]
    assert pictures[0][..., :3].min() > 0
    assert np.array_equal(pictures[0] * np.float32([0.5, 0.5, 0.5, 1]), pictures[1])
    for sampler in ("owen", "independent"):
        sums = []
        for made in (plain.nested, plain, halved):
            session = Session(scene, 8, integrator=made, per_pass=4, sampler=sampler)
            assert not session.by_sample
            sums.append(session.render_pass(1, 4).sum)
        assert np.array_equal(sums[0], sums[1]) and np.array_equal(sums[0] / 2, sums[2])
        assert halved.nested.pass_index == 1


def test_bdpt_takes_no_limit_and_tells_no_samples():
    mi.set_variant("llvm_ad_rgb")
    with pytest.raises(RuntimeError, match="luminance_limit bounds samples of rays"):
        over_bdpt(luminance_limit=1.0)
    made = over_bdpt()
    with pytest.raises(RuntimeError, match="pssmlt takes one nested sampling integrator"):
        mi.load_dict({"type": "pssmlt", "nested": made})
    parameters = mi.traverse(made)
    parameters["luminance_limit"] = 1.0
    with pytest.raises(ValueError, match="luminance_limit bounds samples of rays"):
        parameters.update()
