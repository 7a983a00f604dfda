"""What the material tests share: variants, interactions, directions, quadrature, chi²."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from mitsuba.python.chi2 import ChiSquareTest

from relume import bsdfs  # noqa: F401  registers the plugins


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def spectral(rgb):
    mi.set_variant("llvm_ad_spectral")
    yield
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def at():
    """Interaction seen from the local directions `wi`, shape (N, 3) or (3,)."""

    def interaction(wi, uv=(0.5, 0.5)):
        wi = np.atleast_2d(wi)
        si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
        si.wi = mi.Vector3f(wi.T.astype(np.float32))
        si.uv = uv
        si.sh_frame = mi.Frame3f([0, 0, 1])
        si.n = [0, 0, 1]
        return si

    return interaction


@pytest.fixture
def directions():
    """N unit vectors of float32 above the surface, a tenth of them at 89.9° and beyond 89°."""

    def draw(count, seed, below=False):
        rng = np.random.default_rng(seed)
        cos = rng.uniform(0.001, 1, count)
        cos[: count // 20] = np.cos(np.radians(89.9))
        cos[count // 20 : count // 10] = np.cos(np.radians(rng.uniform(89, 89.9, count // 20)))
        rng.shuffle(cos)
        phi, sin = rng.uniform(0, 2 * np.pi, count), np.sqrt(1 - cos**2)
        if below:
            cos *= rng.choice([-1, 1], count)
        return np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1).astype(np.float32)

    return draw


@pytest.fixture
def pairs(at, directions):
    """10 000 pairs (wi, wo): half at random, half with wo drawn by the material's own lobe."""

    def draw(bsdf, seed):
        wi, wo = directions(10_000, seed), directions(10_000, seed + 1)
        u = np.random.default_rng(seed + 2).random((3, 5000)).astype(np.float32)
        bs, _ = bsdf.sample(
            mi.BSDFContext(), at(wi[:5000]), mi.Float(u[0] * 0), mi.Point2f(u[1:]), True
        )
        drawn = np.array(bs.wo).T
        usable = drawn[:, 2] > 1e-3
        wo[:5000][usable] = drawn[usable]
        return wi, wo

    return draw


@pytest.fixture
def hemisphere():
    """Midpoint rule over the upper hemisphere: ``integral(f, n)``, f of (N, 3) directions."""

    def integral(f, n=1000):
        z, phi = (np.arange(n) + 0.5) / n, (np.arange(2 * n) + 0.5) * np.pi / n
        z, phi = (x.ravel() for x in np.meshgrid(z, phi))
        sin = np.sqrt(1 - z * z)
        values = f(np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=1))
        return values.mean(axis=-1) * 2 * np.pi

    return integral


@pytest.fixture
def albedo(at, hemisphere):
    """Directional albedo (channel 0) seen from `degrees` off the normal, by quadrature of eval."""

    def quadrature(bsdf, degrees, n=1000, ctx=None):
        angle = np.radians(degrees)
        wi = np.array([np.sin(angle), 0, np.cos(angle)])

        def f(wo):
            si = at(np.broadcast_to(wi, wo.shape))
            value = bsdf.eval(ctx or mi.BSDFContext(), si, mi.Vector3f(wo.T.astype(np.float32)))
            return np.array(value)[0].astype(float)

        return hemisphere(f, n)

    return quadrature


@pytest.fixture
def mean_albedo(albedo):
    """Albedo over the disk that a sphere shows, 2 ∫ a(cos) cos dcos: 12-point Gauss rule in cos.

    In r² or sin² the rule would miss what some lobes do near the edge (0.3 % for `duer`).
    """

    def quadrature(bsdf):
        x, w = np.polynomial.legendre.leggauss(12)
        cos = (x + 1) / 2
        angles = np.degrees(np.arccos(cos))
        return sum(w * cos * [albedo(bsdf, angle, 150) for angle in angles])

    return quadrature


@pytest.fixture
def furnace(chance, level):
    """Mean of the disk of a unit sphere of `bsdf` under a sky of radiance 1, seen from afar.

    For an orthographic view the disk is covered uniformly, so that an opaque sphere gives
    2 * integral of albedo(theta) cos sin dtheta. A `Level` of 8 runs.
    """

    def render(bsdf, spp, max_depth=2):
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": max_depth, "rr_depth": 100},
                "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
                "sphere": {"type": "sphere", "bsdf": bsdf},
                "sensor": {
                    "type": "orthographic",
                    "to_world": mi.ScalarTransform4f().look_at([0, -5, 0], [0, 0, 0], [0, 0, 1]),
                    "film": {
                        "type": "hdrfilm",
                        "width": 128,
                        "height": 128,
                        "rfilter": {"type": "box"},
                        "pixel_format": "rgb",
                    },
                },
            }
        )
        means = chance.runs(scene, spp).mean(axis=(1, 2))
        # The window [-1, 1]² holds the disk and, around it, the sky itself.
        disk = np.pi / 4
        return level((means - (1 - disk)) / disk)

    return render


@pytest.fixture
def assert_valid():
    """Assert that everything a material returns is finite and not negative, ends included."""

    def check(bsdf, at, ctx=None):
        cos = np.array([0, 1e-30, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 0.5, 1, -1e-6, -0.5, -1])
        phi = np.array([0, 0.5, 1.0, 2.0, np.pi])
        z, p = (x.ravel() for x in np.meshgrid(cos, phi))
        sin = np.sqrt(1 - z * z)
        w = np.stack([sin * np.cos(p), sin * np.sin(p), z], axis=1).astype(np.float32)
        i, j = (x.ravel() for x in np.meshgrid(np.arange(len(w)), np.arange(len(w))))
        si, ctx = at(w[i]), ctx or mi.BSDFContext()
        wo = mi.Vector3f(w[j].T)
        results = [*bsdf.eval_pdf(ctx, si, wo)]
        u = np.array([0, 1e-7, 0.25, 0.5, 0.9, 1 - 2.0**-24], dtype=np.float32)
        for s in (0.0, 0.5, 1 - 2.0**-24):
            i, a, b = (x.ravel() for x in np.meshgrid(np.arange(len(w)), u, u))
            bs, weight = bsdf.sample(ctx, at(w[i.astype(int)]), mi.Float(s), mi.Point2f(a, b))
            results += [weight, bs.pdf]
            # A direction that came with a weight is a unit vector.
            drawn = np.array(dr.any(weight != 0))
            norm = np.array(dr.norm(bs.wo))
            np.testing.assert_allclose(norm[drawn], 1, atol=2e-5)
        for result in results:
            values = np.array(result)
            assert np.all(np.isfinite(values))
            assert np.all(values >= 0)

    return check


@pytest.fixture
def chi2(at, chance):
    """Judge (material, wi, domain, jacobian, ctx) tuples by `mi.chi2`, all of them together.

    `jacobian` is the solid angle per unit of the domain; the density is integrated with `ires`²
    points a cell. Where samples are reduced there are fewer tuples, drawn at random.
    """

    def run(cases, ires=32, sample_count=200_000, res=51):
        if chance.reduced > 1:
            drawn = chance.rng().permutation(len(cases))[: chance.samples(len(cases))]
            cases = [cases[k] for k in drawn]
        for material, wi, domain, jacobian, ctx in cases:
            bsdf = mi.load_dict(material)

            def sample(u, bsdf=bsdf, wi=wi, ctx=ctx):
                si = at(np.broadcast_to(wi, (dr.width(u), 3)))
                bs, weight = bsdf.sample(ctx, si, u.x, mi.Point2f(u.y, u.z))
                return bs.wo, dr.select(dr.any(weight != 0), mi.Float(1), 0)

            def pdf(wo, bsdf=bsdf, wi=wi, ctx=ctx, jacobian=jacobian):
                si = at(np.broadcast_to(wi, (dr.width(wo), 3)))
                return bsdf.pdf(ctx, si, wo) * jacobian(wo)

            test = ChiSquareTest(
                domain=domain,
                sample_func=sample,
                pdf_func=pdf,
                sample_dim=3,
                sample_count=sample_count,
                res=res,
                ires=ires,
                seed=chance.seed(),
            )
            passed = test.run(significance_level=0, quiet=True)
            assert passed, (material, wi, test.messages)
            chance.judge(test.p_value, (material, wi), of=len(cases))

    return run
