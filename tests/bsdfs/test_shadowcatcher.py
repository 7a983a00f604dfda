"""`shadowcatcher` on its own: sampling, densities and values where a part of the sky is hidden."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from mitsuba.python.chi2 import ChiSquareTest, SphericalDomain

RHO = [0.5, 0.4, 0.3]
SKY = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}


@pytest.fixture
def catcher():
    """A catcher at the origin, normal +Z, below a black disk of radius 1 at height 1.

    A direction is blocked within 45 degrees of the normal; the share of the open ones is
    V = 1 - sin²(45 degrees) = 1/2.
    """
    bsdf = mi.load_dict({"type": "shadowcatcher", "reflectance": {"type": "rgb", "value": RHO}})
    disk = {"type": "disk", "to_world": mi.ScalarTransform4f().translate([0, 0, 1])}
    bsdf.scene = mi.load_dict({"type": "scene", "sky": SKY, "disk": disk})
    yield bsdf
    bsdf.scene = None


@pytest.mark.false_alarms(1e-3)
def test_chi2(catcher, at, chance):
    """The reflected directions follow cos / pi where the sky is hidden, and nothing elsewhere.

    chi² for two views, the directions that go straight on left out.
    """
    for wi in [(0, 0, 1), (0.6, 0, -0.8)]:

        def sample(u, wi=wi):
            si = at(np.broadcast_to(wi, (dr.width(u), 3)))
            bs, _ = catcher.sample(mi.BSDFContext(), si, u.x, mi.Point2f(u.y, u.z))
            reflected = mi.has_flag(bs.sampled_type, mi.BSDFFlags.DiffuseReflection)
            return bs.wo, dr.select(reflected, mi.Float(1), 0)

        def pdf(wo, wi=wi):
            return catcher.pdf(mi.BSDFContext(), at(np.broadcast_to(wi, (dr.width(wo), 3))), wo)

        test = ChiSquareTest(
            domain=SphericalDomain(),
            sample_func=sample,
            pdf_func=pdf,
            sample_dim=3,
            sample_count=200_000,
            res=51,
            ires=32,
            seed=chance.seed(),
        )
        assert test.run(significance_level=0, quiet=True), (wi, test.messages)
        chance.judge(test.p_value, wi, of=2)


@pytest.mark.false_alarms(1e-3)
def test_share_of_open_directions(catcher, at, chance):
    """Half of the samples go straight on with the weight 1, half are reflected with rho.

    Of n = 10^6 samples the share has the standard error 5e-4.
    """
    u = chance.rng().random((3, 10**6)).astype(np.float32)
    wi = np.broadcast_to((0.6, 0, 0.8), (10**6, 3))
    bs, weight = catcher.sample(mi.BSDFContext(), at(wi), mi.Float(u[0]), mi.Point2f(u[1:]))
    on = np.array(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null))
    chance.scores((on.mean() - 0.5) / 5e-4)
    weight, wo = np.array(weight).T, np.array(bs.wo).T
    assert np.all(weight[on] == 1)
    assert np.allclose(wo[on], [-0.6, 0, -0.8])
    assert np.allclose(weight[~on], RHO)
    assert np.all(wo[~on, 2] > np.cos(np.radians(45.01)))


def test_values_agree(catcher, at, directions):
    """eval = rho cos / pi inside the blocked cone on the viewer's side, and 0 elsewhere."""
    wi, wo = directions(10_000, 1), directions(10_000, 2, below=True)
    si, ctx, wo_ = at(wi), mi.BSDFContext(), mi.Vector3f(wo.T)
    value, pdf = (np.array(x) for x in catcher.eval_pdf(ctx, si, wo_))
    assert np.array_equal(value, np.array(catcher.eval(ctx, si, wo_)))
    assert np.array_equal(pdf, np.array(catcher.pdf(ctx, si, wo_)))
    clear = np.abs(wo[:, 2] - np.sqrt(0.5)) > 1e-4  # the disk's edge in float32
    cone = wo[:, 2] > np.sqrt(0.5)
    expected = np.where(cone, wo[:, 2], 0) / np.pi
    assert np.allclose(pdf[clear], expected[clear], rtol=1e-5)
    assert np.allclose(value[:, clear], np.outer(RHO, expected[clear]), rtol=1e-5)


def test_unknown_scene_is_diffuse(at, directions):
    """Outside `shadowcatching` the plugin is a Lambert surface of the same reflectance."""
    color = {"type": "rgb", "value": RHO}
    own = mi.load_dict({"type": "shadowcatcher", "reflectance": color})
    lambert = mi.load_dict({"type": "diffuse", "reflectance": color})
    si, wo = at(directions(1000, 3)), mi.Vector3f(directions(1000, 4).T)
    ctx = mi.BSDFContext()
    assert np.allclose(own.eval(ctx, si, wo), lambert.eval(ctx, si, wo), rtol=1e-5)
    assert np.allclose(own.eval_diffuse_reflectance(si), lambert.eval_diffuse_reflectance(si))


def test_values_are_valid(catcher, at, assert_valid):
    """Nothing NaN, infinite or negative, grazing and perpendicular directions included."""
    assert_valid(catcher, at)


def test_reflectance_is_a_parameter():
    """`traverse` reaches the reflectance, default 0.2."""
    parameters = mi.traverse(mi.load_dict({"type": "shadowcatcher"}))
    assert np.allclose(parameters["reflectance.value"], 0.2)
