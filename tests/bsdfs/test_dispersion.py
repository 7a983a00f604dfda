"""Dispersion of `schlickglass`: indices, unbiasedness of both protocols, minimum deviation."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.bsdfs.dispersion import HERO_WAVELENGTH, SODIUM_D, index_squared, parse_coefficients

# Schott's data sheet of N-BK7 and N-SF11, micrometres: n_d = 1.51680 and 1.78472 at 587.6 nm.
BK7 = "1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653"
SF11 = "1.73759695 0.013188707 0.313747346 0.0623068142 1.89878101 155.23629"
# A legacy scene's glass, n = 1.936 at 589.3 nm.
HEAVY = "3.5139564 -2.4812508E-2 4.6252559E-2 9.1313596E-3 1.0777108E-3 1.0819677E-4"

GLASSES = [("sellmeier3", BK7), ("sellmeier3", SF11), ("cauchy6", HEAVY), ("formula99", "")]


def glass(formula, coefficients, **more):
    return {
        "type": "schlickglass",
        "dispersion": formula,
        "coefficients": coefficients,
        **more,
    }


def index(formula, coefficients, nm):
    return np.sqrt(index_squared(formula, parse_coefficients(formula, coefficients), nm))


def hero_context():
    ctx = mi.BSDFContext()
    ctx.type_mask |= HERO_WAVELENGTH
    return ctx


def test_published_indices():
    assert index("sellmeier3", BK7, 587.56) == pytest.approx(1.51680, abs=1e-5)
    assert index("sellmeier3", SF11, 587.56) == pytest.approx(1.78472, abs=1e-5)
    assert index("cauchy6", HEAVY, SODIUM_D) == pytest.approx(1.936, abs=5e-4)
    # 1.4 + 50 / (589.3 - 230)
    assert index("formula99", "", SODIUM_D) == pytest.approx(1.53916, abs=1e-5)
    assert index("formula99", "1.5,40 200", 500.0) == pytest.approx(1.5 + 40 / 300)
    # Missing coefficients are 0.
    assert index("cauchy6", "2.25", 500.0) == 1.5
    assert index("sellmeier3", "1.25", 500.0) == 1.5


@pytest.mark.parametrize(("formula", "coefficients"), GLASSES)
def test_rgb_takes_the_sodium_line(formula, coefficients, at, directions):
    ours = mi.load_dict(glass(formula, coefficients))
    plain = mi.load_dict(
        {"type": "schlickglass", "int_ior": float(index(formula, coefficients, SODIUM_D))}
    )
    wi = directions(1000, 1, below=True)
    u = np.random.default_rng(1).random(1000).astype(np.float32)
    (a, v), (b, w) = (
        m.sample(mi.BSDFContext(), at(wi), mi.Float(u), mi.Point2f(0.5)) for m in (ours, plain)
    )
    np.testing.assert_allclose(np.array(v), np.array(w), rtol=1e-6)
    np.testing.assert_allclose(np.array(a.wo), np.array(b.wo), atol=1e-6)


WAVELENGTHS = [430.0, 510.0, 590.0, 670.0]


def every_choice(bsdf, ctx, at, cos, grid=400):
    """Sample on a grid of (sample1, sample2.x): all choices in their proportions."""
    u, v = (x.ravel() for x in np.meshgrid(*[(np.arange(grid) + 0.5) / grid] * 2))
    si = at(np.broadcast_to([np.sqrt(1 - cos * cos), 0, cos], (len(u), 3)))
    si.wavelengths = mi.Spectrum(WAVELENGTHS)
    bs, weight = bsdf.sample(ctx, si, mi.Float(u), mi.Point2f(v, 0.5))
    return bs, np.array(weight)


def schlick(cos, n):
    """(F, transmitted radiance (1 - F)(n1/n2)², x of the refracted ray) for one index."""
    eta = n if cos > 0 else 1 / n
    sin = np.sqrt(1 - cos * cos)
    cos_t2 = 1 - (sin / eta) ** 2
    outer = cos if cos > 0 else np.sqrt(np.maximum(cos_t2, 0))
    F_0 = ((n - 1) / (n + 1)) ** 2
    F = np.where(cos_t2 > 0, F_0 + (1 - F_0) * (1 - outer) ** 5, 1)
    return F, (1 - F) / eta**2, -sin / eta


@pytest.mark.parametrize("cos", [0.9, 0.4, -0.95, -0.9, -0.82, -0.7])
@pytest.mark.parametrize(("formula", "coefficients"), GLASSES)
def test_any_integrator_sees_the_right_mean(formula, coefficients, cos, spectral, at):
    """Without the hero's bit every wavelength gets its own F and 1 - F in its own direction.

    Mean over a grid of all random choices, per wavelength, against the closed forms; the grid's
    resolution (1/400) bounds the error. cos -0.82 and less crosses total reflection, for some
    wavelengths earlier than for others.
    """
    bsdf = mi.load_dict(glass(formula, coefficients))
    bs, weight = every_choice(bsdf, mi.BSDFContext(), at, cos)
    reflected = np.array(bs.sampled_component) == 0
    wo_x = np.array(bs.wo)[0]
    for i, nm in enumerate(WAVELENGTHS):
        F, transmitted, x = schlick(cos, index(formula, coefficients, nm))
        assert (weight[i] * reflected).mean() == pytest.approx(F, abs=0.005)
        refracted = ~reflected & (weight[i] > 0)
        assert (weight[i] * refracted).mean() == pytest.approx(transmitted, abs=0.01)
        np.testing.assert_allclose(wo_x[refracted], x, atol=1e-4)
        # Only one wavelength passes at a time, with four times its share.
        assert np.all((weight[:, refracted] > 0).sum(axis=0) == 1)


@pytest.mark.parametrize("cos", [0.9, 0.4, -0.95, -0.9, -0.82, -0.7])
def test_the_hero_is_followed_on_request(cos, spectral, at):
    """With the bit: wavelength 0 in its own direction, unscaled and marked; reflections for all."""
    bsdf = mi.load_dict(glass("cauchy6", HEAVY))
    bs, weight = every_choice(bsdf, hero_context(), at, cos)
    reflected = np.array(bs.sampled_component) == 0
    for i, nm in enumerate(WAVELENGTHS):
        F, transmitted, x = schlick(cos, index("cauchy6", HEAVY, nm))
        assert (weight[i] * reflected).mean() == pytest.approx(F, abs=5e-3)
        if i == 0:
            assert (weight[i] * ~reflected).mean() == pytest.approx(transmitted, abs=1e-2)
            np.testing.assert_allclose(np.array(bs.wo)[0][~reflected], x, atol=1e-5)
        else:
            assert np.all(weight[i][~reflected] == 0)
    marked = (np.array(bs.sampled_type) & HERO_WAVELENGTH) != 0
    np.testing.assert_array_equal(marked, ~reflected)


def test_one_index_needs_no_hero(spectral, at):
    """Without dispersion all wavelengths stay, whoever asks."""
    bsdf = mi.load_dict({"type": "schlickglass", "int_ior": 1.5})
    for ctx in (mi.BSDFContext(), hero_context()):
        bs, weight = every_choice(bsdf, ctx, at, 0.8)
        assert np.all(weight > 0)
        assert not np.any(np.array(bs.sampled_type) & HERO_WAVELENGTH)


def deviation(bsdf, apex, incidence, nm):
    """Angle [rad] by which a prism in the xz plane turns rays; `nm` and `incidence` of one shape.

    The prism is two rectangles that meet in the y axis at z = 0 and open towards -z with the angle
    `apex`; their normals point outwards. A ray comes from the left at `incidence` to the normal.
    """
    T = mi.ScalarTransform4f
    faces = {}
    for name, sign in (("left", -1), ("right", 1)):
        turn = T().rotate([0, 1, 0], sign * (90 - np.degrees(apex) / 2))
        faces[name] = {
            "type": "rectangle",
            "to_world": turn @ T().translate([sign, 0, 0]),
            "bsdf": bsdf,
        }
    scene = mi.load_dict({"type": "scene", **faces})
    # Outward normal of the left face, and the incident direction in the plane of the prism.
    a = apex / 2
    n = np.array([-np.cos(a), 0, np.sin(a)])
    along = np.array([np.sin(a), 0, np.cos(a)])
    d = np.multiply.outer(np.cos(incidence), -n) + np.multiply.outer(np.sin(incidence), along)
    shape, d = incidence.shape, d.reshape(-1, 3)
    start = -along * 0.8 - 0.5 * d
    ray = mi.Ray3f(mi.Point3f(start.T), mi.Vector3f(d.T))
    ray.wavelengths = mi.Spectrum(mi.Float(nm.ravel()))
    for _ in range(2):
        si = scene.ray_intersect(ray)
        assert dr.all(si.is_valid())
        ctx = hero_context()
        ctx.component = 1
        bs, weight = si.bsdf().sample(ctx, si, 0.5, mi.Point2f(0.5))
        assert dr.all(weight[0] > 0)
        ray = si.spawn_ray(si.to_world(bs.wo))
    out = np.array(ray.d).T.astype(float)
    assert not dr.any(scene.ray_test(ray))
    turned = np.arctan2(np.linalg.norm(np.cross(d, out), axis=1), (d * out).sum(axis=1))
    return turned.reshape(shape)


@pytest.mark.parametrize(("formula", "coefficients"), [GLASSES[i] for i in (0, 1, 3)])
def test_minimum_deviation_of_a_prism(formula, coefficients, spectral):
    """A 60 degree prism turns light by at least 2 asin(n sin(A/2)) - A, to 0.01 degrees.

    Rays are traced through the plugin over 1 degree of incidence around the symmetric passage;
    their least deviation is compared per wavelength, 380 to 780 nm.
    """
    apex = np.radians(60)
    bsdf = mi.load_dict(glass(formula, coefficients))
    nm, offset = np.meshgrid(np.arange(380.0, 781.0, 40.0), np.linspace(-0.5, 0.5, 41))
    symmetric = np.arcsin(index(formula, coefficients, nm) * np.sin(apex / 2))
    least = deviation(bsdf, apex, symmetric + np.radians(offset), nm).min(axis=0)
    assert np.all(np.degrees(abs(least - (2 * symmetric[0] - apex))) < 0.01)


@pytest.mark.parametrize("hero", [False, True])
@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
def test_all_values_are_valid(hero, fresnel, spectral, at, assert_valid):
    for formula, coefficients in GLASSES:
        bsdf = mi.load_dict(glass(formula, coefficients, fresnel=fresnel))

        def lit(wi):
            si = at(wi)
            si.wavelengths = mi.Spectrum([360.0, 480.0, 600.0, 830.0])
            return si

        assert_valid(bsdf, lit, hero_context() if hero else None)
