"""`schlickglass` with one index against a float64 transcription, and in the furnace."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

INDICES = [0.5, 0.8, 0.999, 1.0, 1.001, 1.33, 1.5, 2.0, 3.0]
REFLECT, REFRACT = 0, 1


def glass(int_ior=1.5, fresnel="schlick", **more):
    return {"type": "schlickglass", "int_ior": int_ior, "fresnel": fresnel, **more}


def lobe(component, mode=None):
    ctx = mi.BSDFContext(mi.TransportMode.Radiance if mode is None else mode)
    ctx.component = component
    return ctx


def transcription(wi, n_inside, n_outside, fresnel):
    """(F, cos²theta_2, refracted direction, (n1/n2)²) in float64, by the manual's formulas.

    The ray arrives along -wi; n faces the side it comes from.
    """
    wi = wi.astype(float) / np.linalg.norm(wi.astype(float), axis=1, keepdims=True)
    outside = wi[:, 2] > 0
    n1 = np.where(outside, n_outside, n_inside)
    n2 = np.where(outside, n_inside, n_outside)
    n = np.stack([0 * n1, 0 * n1, np.where(outside, 1, -1)], axis=1)
    ray = -wi
    ray_n = (ray * n).sum(1)
    cos2 = 1 - (n1 / n2) ** 2 * (1 - ray_n**2)
    cos_t = np.sqrt(np.maximum(cos2, 0))
    T = ray * (n1 / n2)[:, None] - ((n1 / n2) * ray_n + cos_t)[:, None] * n
    if fresnel == "schlick":
        F_0 = ((n1 - n2) / (n1 + n2)) ** 2
        F = F_0 + (1 - F_0) * (1 - np.where(outside, -ray_n, cos_t)) ** 5
    else:
        c = -ray_n
        F = ((n1 * c - n2 * cos_t) / (n1 * c + n2 * cos_t)) ** 2 / 2
        F += ((n2 * c - n1 * cos_t) / (n2 * c + n1 * cos_t)) ** 2 / 2
    return np.where(cos2 > 0, F, 1), cos2, T, (n1 / n2) ** 2


@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
@pytest.mark.parametrize("n", INDICES)
def test_lobes_are_the_formulas(n, fresnel, at, directions):
    """F, (1 - F)(n1/n2)² and both directions on 10 000 directions of either side.

    Each lobe alone carries its whole weight. Relative error 1e-4 but for two limits of float32:
    F is right to 1e-12 absolute (equal indices near normal incidence, F = (1 - cos)^5), and where
    the refracted ray lies within 2.6 degrees of the surface (cos² < 2e-3) 1 - F is right to 1e-4
    absolute.
    """
    bsdf = mi.load_dict(glass(n, fresnel))
    wi = directions(10_000, 5, below=True)
    n_inside, si, none = np.float64(np.float32(n)), at(wi), mi.Point2f(0.5)
    F, cos2, T, factor = transcription(wi, n_inside, 1.0, fresnel)

    bs, weight = bsdf.sample(lobe(REFLECT), si, 0.5, none)
    np.testing.assert_allclose(np.array(weight)[0], F, rtol=1e-4, atol=1e-12)
    np.testing.assert_array_equal(np.array(bs.wo).T, wi * [-1, -1, 1])

    bs, weight = bsdf.sample(lobe(REFRACT), si, 0.5, none)
    weight, wo = np.array(weight)[0], np.array(bs.wo).T
    total, clear = cos2 <= -1e-6, cos2 > 2e-3
    assert np.all(weight[total] == 0)
    np.testing.assert_allclose(weight[clear], ((1 - F) * factor)[clear], rtol=1e-4)
    np.testing.assert_allclose(weight / factor, 1 - F, rtol=0, atol=1e-4)
    np.testing.assert_allclose(wo[clear], T[clear], atol=2e-6)
    expected = np.where(wi[:, 2] > 0, n_inside, 1 / n_inside)
    np.testing.assert_allclose(np.array(bs.eta), expected, rtol=1e-6)


@pytest.mark.parametrize("n", [100.0, 1000.0])
def test_what_a_high_index_lets_out(n, at):
    """Out of a high index within 1/n of the normal: cos theta_2 = sqrt(1 - (n s)²) to 2e-5 and
    (1 - F) n² to 1e-4, for directions that rounding has made 1e-6 shorter, too, as a hundred
    reflections inside a ball do."""
    u = np.linspace(0, 0.98, 50)
    wi = np.stack([u / n, 0 * u, -np.sqrt(1 - (u / n) ** 2)], axis=1)
    for length in (1.0, 1 - 1e-6):
        _, cos2, _, factor = transcription(wi, n, 1.0, "schlick")
        si = at(wi * length)
        bs, weight = mi.load_dict(glass(n)).sample(lobe(REFRACT), si, 0.5, mi.Point2f(0.5))
        np.testing.assert_allclose(np.array(bs.wo)[2], np.sqrt(cos2), atol=2e-5)
        F_0 = ((1 - n) / (1 + n)) ** 2
        through = (1 - F_0) * (1 - (1 - np.sqrt(cos2)) ** 5)
        np.testing.assert_allclose(np.array(weight)[0], through * factor, rtol=1e-4)


@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
@pytest.mark.parametrize("n", INDICES)
def test_weight_is_lobe_over_probability(n, fresnel, at, directions):
    """With both lobes on, weight times probability is the lobe of the test above, to 1e-4."""
    bsdf = mi.load_dict(glass(n, fresnel))
    wi = directions(10_000, 6, below=True)
    si, none = at(wi), mi.Point2f(0.5)
    u = np.random.default_rng(1).random(len(wi)).astype(np.float32)
    bs, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(u), none)
    component = np.array(bs.sampled_component)
    for k in (REFLECT, REFRACT):
        alone, whole = bsdf.sample(lobe(k), si, 0.5, none)
        drawn = component == k
        got = (np.array(weight)[0] * np.array(bs.pdf))[drawn]
        np.testing.assert_allclose(got, np.array(whole)[0][drawn], rtol=1e-4)
        np.testing.assert_array_equal(np.array(bs.wo).T[drawn], np.array(alone.wo).T[drawn])


@pytest.mark.false_alarms(1e-3)
def test_lobes_are_drawn_with_their_probability(at, chance):
    """30 parameter sets of 100 000 draws: the count of reflections against its binomial law."""
    glasses = [(0.7, "schlick"), (1, "schlick"), (1.5, "schlick"), (1.5, "exact"), (2.4, "exact")]
    cosines = (0.95, 0.8, 0.3, 0.1, -0.97, -0.85)
    cases = [(n, fresnel, cos) for n, fresnel in glasses for cos in cosines]
    assert len(cases) == 30
    for n, fresnel, cos in cases:
        wi = np.array([[np.sqrt(1 - cos * cos), 0, cos]])
        p = transcription(wi, n, 1.0, fresnel)[0][0]
        u = chance.rng().random(100_000).astype(np.float32)
        si = at(np.broadcast_to(wi, (len(u), 3)))
        bs, _ = mi.load_dict(glass(n, fresnel)).sample(
            mi.BSDFContext(), si, mi.Float(u), mi.Point2f(0.5)
        )
        reflected = int(np.sum(np.array(bs.sampled_component) == REFLECT))
        if p in (0, 1):
            assert reflected == p * len(u)
        else:
            chance.count(reflected, len(u), p, (n, fresnel, cos), of=len(cases))


def test_radiance_is_scaled_and_importance_is_not(at):
    """The adjoint: importance carries no (n1/n2)², so weight_radiance = weight_importance/eta²."""
    bsdf = mi.load_dict(glass(1.5))
    for cos in (0.7, -0.9):
        si = at(np.array([np.sqrt(1 - cos * cos), 0, cos]))
        weights = [
            np.array(bsdf.sample(lobe(REFRACT, mode), si, 0.5, mi.Point2f(0.5))[1])[0, 0]
            for mode in (mi.TransportMode.Radiance, mi.TransportMode.Importance)
        ]
        eta = 1.5 if cos > 0 else 1 / 1.5
        assert weights[0] == pytest.approx(weights[1] / eta**2, rel=1e-6)


def test_agrees_with_the_stock_dielectric(at, directions):
    """`exact` is Mitsuba's own smooth dielectric: same directions, same lobes."""
    stock = mi.load_dict({"type": "dielectric", "int_ior": 1.7, "ext_ior": 1.2})
    ours = mi.load_dict(glass(1.7, "exact", ext_ior=1.2))
    wi = directions(10_000, 9, below=True)
    for k in (REFLECT, REFRACT):
        (a, v), (b, w) = (m.sample(lobe(k), at(wi), 0.5, mi.Point2f(0.5)) for m in (stock, ours))
        np.testing.assert_allclose(np.array(w), np.array(v), rtol=1e-3, atol=1e-5)
        a, b, visible = np.array(a.wo), np.array(b.wo), np.array(v)[0] > 1e-2
        np.testing.assert_allclose(b[:, visible], a[:, visible], atol=1e-4)


def test_hemispherical_reflectance():
    """2 ∫ F cos dcos at n = 1.5: 0.0857 for Schlick's term, 0.0918 for Fresnel's (quadrature)."""
    cos = (np.arange(20_000) + 0.5) / 20_000
    wi = np.stack([np.sqrt(1 - cos**2), 0 * cos, cos], axis=1)
    si = dr.zeros(mi.SurfaceInteraction3f, len(cos))
    si.wi = mi.Vector3f(wi.T.astype(np.float32))
    for fresnel, expected in (("schlick", 0.0857), ("exact", 0.0918)):
        bsdf = mi.load_dict(glass(1.5, fresnel))
        F = np.array(bsdf.sample(lobe(REFLECT), si, 0.5, mi.Point2f(0.5))[1])[0]
        assert 2 * np.mean(F * cos) == pytest.approx(expected, abs=5e-5)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("n", [0.6, 1.0, 1.5])
@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
def test_white_furnace(n, fresnel, furnace, chance):
    """Clear glass under a sky of 1 is invisible: what F takes, 1 - F gives, and n² cancels."""
    chance.equal(furnace(glass(n, fresnel), 32, max_depth=60), 1, allowed=1e-4, precision=2e-3)


def test_tints(at):
    """Each lobe is multiplied by its own tint, once."""
    bsdf = mi.load_dict(
        glass(
            1.5,
            specular_reflectance={"type": "rgb", "value": [0.1, 0.2, 0.3]},
            specular_transmittance={"type": "rgb", "value": [0.9, 0.8, 0.7]},
        )
    )
    si = at(np.array([0, 0, 1.0]))
    for u, expected in ((0.0, [0.1, 0.2, 0.3]), (0.9, np.array([0.9, 0.8, 0.7]) / 2.25)):
        weight = bsdf.sample(mi.BSDFContext(), si, u, mi.Point2f(0.5))[1]
        np.testing.assert_allclose(np.array(weight).ravel(), expected, rtol=1e-5)


def test_equal_indices_let_light_straight_through(at, directions):
    """Index 1: the refracted ray is the ray itself to the last bit, and the lobe is a `Null` one.

    So `volpath` sees a point light through a matched sphere as if the sphere were not there.
    """
    bsdf = mi.load_dict(glass(1.0, "exact"))
    wi = directions(10_000, 8, below=True)
    bs, weight = bsdf.sample(mi.BSDFContext(), at(wi), 0.0, mi.Point2f(0.5))
    np.testing.assert_array_equal(np.array(bs.wo).T, -wi)
    np.testing.assert_array_equal(np.array(weight), 1)
    assert np.all(np.array(bs.sampled_type) == int(mi.BSDFFlags.Null))

    def floor(*sphere):
        scene = {
            "type": "scene",
            "integrator": {"type": "volpath", "max_depth": 4},
            "lamp": {"type": "point", "position": [0, 0, 3], "intensity": 10.0},
            "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, -2, 2], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
        }
        for material in sphere:
            scene["sphere"] = {"type": "sphere", "center": [0, 0, 2], "radius": 0.5}
            scene["sphere"]["bsdf"] = material
        return np.array(mi.render(mi.load_dict(scene), spp=64, seed=1))

    np.testing.assert_allclose(floor(glass(1.0, "exact")), floor(), rtol=2e-3)
    # The stock dielectric, like any index but 1, blocks the point light.
    assert floor(glass(1.01, "exact")).mean() < 0.9 * floor().mean()


def test_index_can_be_changed(at, directions):
    """`parameters_changed` follows the index, also onto and off the matched one."""
    bsdf = mi.load_dict(glass(1.5))
    params = mi.traverse(bsdf)
    wi = directions(100, 1, below=True)
    for n in (1.0, 2.0):
        params["int_ior"] = n
        params.update()
        fresh = mi.load_dict(glass(n))
        a, b = (m.sample(lobe(REFRACT), at(wi), 0.5, mi.Point2f(0.5)) for m in (bsdf, fresh))
        np.testing.assert_allclose(np.array(a[1]), np.array(b[1]))
        np.testing.assert_array_equal(np.array(a[0].sampled_type), np.array(b[0].sampled_type))
        assert bsdf.flags() == fresh.flags()


@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
@pytest.mark.parametrize("n", [1e-3, *INDICES, 1e3])
def test_all_values_are_valid(n, fresnel, at, assert_valid):
    assert_valid(mi.load_dict(glass(n, fresnel)), at)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"int_ior": 0.0}, "int_ior is 0.0, but must be above 0"),
        ({"ext_ior": -1.0}, "ext_ior is -1.0, but must be above 0"),
        ({"fresnel": "fast"}, "fresnel is 'fast', but must be one of schlick, exact"),
        ({"dispersion": "cauchy"}, "dispersion is 'cauchy', but must be one of cauchy6"),
        ({"dispersion": "formula99", "int_ior": 1.5}, "exclude each other"),
        ({"dispersion": "formula99", "coefficients": "1 2 3 4"}, "takes 3 coefficients, not 4"),
        ({"dispersion": "cauchy6", "coefficients": "1, two"}, "could not convert string"),
        ({"dispersion": "cauchy6", "coefficients": "-1"}, "gives no real index"),
        ({"dispersion": "sellmeier3", "coefficients": "1 0.25"}, "gives no real index"),
    ],
)
def test_errors(wrong, message):
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "schlickglass", **wrong})
