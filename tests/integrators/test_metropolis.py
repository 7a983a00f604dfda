"""Metropolis light transport: `pssmlt` and `erpt` against known answers and `path`."""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.integrators.markovchains import ChainParameters, run_chains
from relume.integrators.metropolis import systematic_resampling
from relume.integrators.primarysamples import MUTATIONS, PathSampler, perturb
from relume.integrators.uniformsamples import uniform_samples
from relume.registration import on_every_variant

METHODS = {
    "mixed": {"type": "pssmlt", "mutation": "mixed", "fallback": False},
    "kelemen": {"type": "pssmlt", "mutation": "kelemen", "fallback": False},
    "lux": {"type": "pssmlt", "mutation": "lux", "fallback": False},
    "gaussian": {"type": "pssmlt", "mutation": "gaussian", "fallback": False},
    "small": {"type": "pssmlt", "large_step_probability": 0.0, "fallback": False},
    "large": {"type": "pssmlt", "large_step_probability": 1.0, "fallback": False},
    "erpt": {"type": "erpt", "length": 16},
}
"""Every way to walk."""


def integrator(method, **parameters):
    """A method of `METHODS` over `surfacepath`, or over `paths`."""
    paths = {"type": "surfacepath", "max_depth": 6}
    return mi.load_dict(METHODS[method] | {"bootstrap": 0.5, "paths": paths} | parameters)


def film(width, height, rfilter="box"):
    return {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": rfilter}}


def cornell(width=12, height=12, rfilter="box", **sensor):
    """The lower half of the Cornell box: without the lamp, in which few samples hold much light."""
    d = mi.cornell_box() | {"integrator": {"type": "path", "max_depth": 6}}
    half = {"crop_offset_y": height, "crop_height": height, "crop_width": width}
    d["sensor"] |= {"film": film(width, 2 * height, rfilter) | half} | sensor
    return mi.load_dict(d)


def nothing(width, height):
    """A scene that the integrator `fold` needs for its sensor alone."""
    sensor = {"type": "orthographic", "film": film(width, height)}
    return mi.load_dict({"type": "scene", "sensor": sensor, "sky": {"type": "constant"}})


def steps_at(x, y, where):
    """A density with edges over [-1, 1]², 1/10 to 4."""
    return where(x + y < 0.5, where(x * y > 0, 4.0, 1.0), 0.1) + 0.25 * x * x


def define():
    class Fold(mi.SamplingIntegrator):
        """Radiance 3 v (1 + s) where u + v < 1 + x, else 0, for two numbers u, v drawn.

        x is the position on the film, from -1 to 1, s the parity of a third number, which is drawn
        only in the upper half of v. So paths differ in length, and the radiance has an edge.
        """

        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            u, v = sampler.next_2d()
            s = mi.Float(0)
            if v > 0.5:
                s = dr.select(sampler.next_1d() < 0.5, mi.Float(0), 2)
            L = dr.select(u + v < 1 + ray.o.x, 3 * v * (1 + s), 0)
            return mi.Spectrum(L), mi.Bool(True), []

    class Steps(mi.SamplingIntegrator):
        """Radiance `steps_at` of the position on the film."""

        def sample(self, scene, sampler, ray, medium=None, active=True):
            return mi.Spectrum(steps_at(ray.o.x, ray.o.y, dr.select)), mi.Bool(True), []

    class Rare(mi.SamplingIntegrator):
        """Radiance 2048 for one in 2048 paths, else 0; 1 on average."""

        def sample(self, scene, sampler, ray, medium=None, active=True):
            found = sampler.next_1d() < 1 / 2048
            return mi.Spectrum(dr.select(found, mi.Float(2048), 0)), mi.Bool(True), []

    class Parted(mi.SamplingIntegrator):
        """Radiance 3, of which direct light is 1."""

        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            self.radiance = props.get("radiance", 3.0)

        def with_depth_range(self, min_depth, max_depth):
            return mi.load_dict({"type": "parted", "radiance": 1.0 if max_depth == 2 else 2.0})

        def sample(self, scene, sampler, ray, medium=None, active=True):
            return mi.Spectrum(self.radiance), mi.Bool(True), []

    mi.register_integrator("parted", Parted)
    mi.register_integrator("fold", Fold)
    mi.register_integrator("steps", Steps)
    mi.register_integrator("rare", Rare)


on_every_variant(define)

FOLD = {"type": "fold"}


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("llvm_ad_rgb")


def luminance(pictures):
    return pictures @ [0.2126, 0.7152, 0.0722]


def fold_columns(columns=4, points=2000):
    """The picture of `fold`, one value for each column, by the midpoint rule.

    Over the drawn numbers it is the integral of g(v) clip(1 + x - v, 0, 1) with g = 3 v below
    v = 1/2 and 6 v above, as 1 + s is 2 there on average. x falls from left to right, as the
    sensor looks along +z.
    """
    v = (np.arange(points) + 0.5) / points
    x = 1 - 2 * (np.arange(columns * 100) + 0.5) / (columns * 100)
    g = 3 * v * np.where(v > 0.5, 2, 1)
    return np.mean(g * np.clip(1 + x[:, None] - v, 0, 1), axis=1).reshape(columns, -1).mean(1)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize("method", METHODS)
def test_known_density(method, chance, level):
    """A density over film and numbers drawn, with an edge and paths of two lengths, is met.

    Each of 32 renders is a picture of its own, so the test needs no assumption on the chains. A
    wrong acceptance, weight or number of a path shows: unmutated numbers beyond the current path
    (the mistake of lazy mutation) change the mean of the second column by 6 %.
    """
    walk = integrator(method, paths=FOLD, bootstrap=0.25)
    pictures = chance.runs(nothing(4, 4), 128, runs=32, integrator=walk)
    columns = level(pictures[..., 0].mean(1))
    error = np.sqrt(columns.variance[:3] / chance.reduced)
    assert np.all(error < 0.06 * fold_columns()[:3])
    chance.equal(columns, fold_columns())


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("large", [0.0, 0.3])
def test_chains_visit_by_density(large, chance):
    """A density in two dimensions, over the film, is met by how often chains visit 8 x 8 cells.

    Visits of a chain depend on each other, runs do not: Hotelling's T² of the cells over runs,
    with their covariance between runs, is the chi-square test for such counts. As t / (t + R - 1)
    it has the beta distribution of parameters k/2 and (R - k)/2 for k cells and R runs.
    """
    scene = nothing(8, 8)
    paths = PathSampler(scene, scene.sensors()[0], mi.load_dict({"type": "steps"}))
    R, k, chains = 256, 64, 512
    walk = ChainParameters(chance.samples(64), large, "kelemen", 1 / 64, 1 / 4)
    which = np.repeat([0, 1], chains // 2)
    visits = []
    for _ in range(R):
        seed, rng = chance.seed(), chance.rng()
        I = uniform_samples(paths, 2048, seed).luminance.reshape(2, -1)
        index = np.concatenate(
            [systematic_resampling(half, chains // 2, rng.random()) for half in I]
        )
        found = run_chains(paths, np.ones(k), index, which, 2048, (seed, chance.seed()), walk)
        share = found.film[1:, :, 0] * (2 / (chains * walk.steps))
        visits.append((I.mean(1)[:, None] * share).mean(0))
    # Twice as many rows as columns: no point lies on the edge; the midpoint rule is exact there.
    x, y = (1 - 2 * (np.arange(n) + 0.5) / n for n in (800, 1600))
    cells = steps_at(x[None, :], y[:, None], np.where).reshape(8, 200, 8, 100)
    off = np.mean(visits, 0) - cells.mean((1, 3)).ravel() / k
    T2 = R * off @ np.linalg.solve(np.cov(np.array(visits).T), off)
    x = (np.arange(100000) + 0.5) / 100000
    beta = x ** (k / 2 - 1) * (1 - x) ** ((R - k) / 2 - 1)
    chance.judge(beta[x >= T2 / (T2 + R - 1)].sum() / beta.sum(), f"T² = {T2:.1f}")


@pytest.mark.parametrize("method", METHODS)
def test_constant_radiance(method):
    """Where all paths are worth the same, weights and b leave no noise: the mean is exact."""
    picture = mi.render(
        nothing(4, 4), integrator=integrator(method, paths={"type": "path"}), spp=64
    )
    assert np.mean(np.array(picture)) == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("direct_samples", [0, 1 / 16])
def test_constant_parts(method, direct_samples):
    """The same where independent samples find direct light: each part counts once."""
    walk = integrator(method, paths={"type": "parted"}, direct_samples=direct_samples)
    picture = mi.render(nothing(4, 4), integrator=walk, spp=64)
    assert np.mean(np.array(picture)) == pytest.approx(3, rel=1e-5)


@pytest.mark.false_alarms(1e-3)
def test_few_seeds_leave_no_negative_pixels(chance, level):
    """Each half of the bootstrap finds one path on average, often none, and the mean is right.

    Pixels would be below 0 in one of 16 renders, did all of a bright path correct b.
    """
    walk = integrator("kelemen", paths={"type": "rare"}, bootstrap=1e-3)
    pictures = chance.runs(nothing(4, 4), 2048, runs=250, integrator=walk)
    assert np.all(pictures >= 0)
    chance.equal(level(pictures.mean((1, 2, 3))), 1.0, precision=0.05)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("method", METHODS)
def test_agrees_with_path(method, chance, level):
    """The Cornell box in 3 x 3 blocks of pixels, known to 5 % each, and its energy to 1.5 %."""
    scene = cornell()
    found, wanted = (
        luminance(chance.runs(scene, 32, runs=24, integrator=by)).reshape(24, 3, 4, 3, 4)
        for by in (integrator(method), None)
    )
    chance.equal(level(found.mean((2, 4))), level(wanted.mean((2, 4))), precision=0.05, of=2)
    energies = level(found.mean((1, 2, 3, 4))), level(wanted.mean((1, 2, 3, 4)))
    chance.equal(*energies, precision=0.015, of=2)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize("method", ["kelemen", "erpt"])
def test_direct_light_apart(method, chance, level):
    """Chains for indirect light and independent samples for the rest add up, if wrapped, too."""
    paths = {"type": "surfacepath", "max_depth": 6}
    paths = {"type": "samplescale", "response": 2.0, "nested": paths}
    paths = {"type": "shadowcatching", "nested": paths}
    walk = integrator(method, paths=paths, direct_samples=0.25)
    scene = cornell()
    found = luminance(chance.runs(scene, 32, runs=24, integrator=walk))
    wanted = 2 * luminance(chance.runs(scene, 32, runs=24))
    found, wanted = (x.reshape(24, 3, 4, 3, 4).mean((2, 4)) for x in (found, wanted))
    chance.equal(level(found), level(wanted), precision=0.05)
    spp = 24 * round(0.25 * chance.samples(32))
    assert f"direct light: {spp} independent samples per pixel" in walk.report()[1]


def test_fallback_renders_direct_light_with_the_rest():
    """Where chains do not pay, independent samples render all light at once."""
    paths = {"type": "surfacepath", "max_depth": 6}
    pictures = []
    for direct_samples in (0, 1):
        walk = {"type": "pssmlt", "direct_samples": direct_samples, "paths": paths}
        pictures.append(np.array(mi.render(cornell(), integrator=mi.load_dict(walk), spp=8)))
    assert np.array_equal(*pictures)


@pytest.mark.false_alarms(1e-3, reduced=4)
@pytest.mark.parametrize("chains", [2, 16, 1024])
def test_any_number_of_chains(chains, chance, level):
    """Two chains or a thousand: the same mean picture, with no bias from how they start."""
    walk = integrator("kelemen", paths=FOLD, bootstrap=0.25, chains=chains)
    # Many runs: those of the dark column are skew.
    pictures = chance.runs(nothing(4, 4), 64, runs=256, integrator=walk)
    chance.equal(level(pictures[..., 0].mean(1)), fold_columns())


@pytest.mark.false_alarms(1e-3, reduced=4)
def test_short_bootstrap_and_short_chains_are_unbiased(chance, level):
    """Eight seeds, 16 steps: a normalization by the resampled seeds would be dark by some 10 %."""
    walk = integrator("kelemen", paths=FOLD, bootstrap=0.1, chains=8)
    pictures = chance.runs(nothing(4, 4), 8, runs=600, integrator=walk)
    chance.equal(level(pictures[..., 0].mean((1, 2))), fold_columns().mean(), precision=0.05)


def test_launches_are_no_part_of_the_samples(monkeypatch):
    """Uniform samples traced in several launches are those of one."""
    scene = cornell()
    paths = PathSampler(scene, scene.sensors()[0], mi.load_dict({"type": "path", "max_depth": 6}))
    whole = uniform_samples(paths, 1000, seed=3)
    monkeypatch.setattr("relume.integrators.uniformsamples.SAMPLES_PER_LAUNCH", 700)
    parts = uniform_samples(paths, 1000, seed=3)
    assert np.array_equal(whole.f, parts.f) and np.array_equal(whole.pixel, parts.pixel)


@pytest.mark.parametrize("method", ["kelemen", "erpt"])
def test_same_seed_same_picture(method):
    """Bit for bit, on one thread or two; another seed gives another picture."""
    scene, walk = cornell(), integrator(method)
    threads = dr.thread_count()
    pictures = []
    try:
        for count, seed in ((1, 5), (2, 5), (2, 6)):
            dr.set_thread_count(count)
            pictures.append(np.array(mi.render(scene, integrator=walk, spp=32, seed=seed)))
    finally:
        dr.set_thread_count(threads)
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
    again = np.array(mi.render(scene, integrator=integrator(method), spp=32, seed=5))
    assert np.array_equal(pictures[0], again)


@pytest.mark.parametrize("method", ["kelemen", "erpt"])
def test_passes_share_their_kernels(method):
    """From the second render on nothing is compiled, whatever the seed and number of samples."""
    scene, walk = cornell(), integrator(method)
    mi.render(scene, integrator=walk, spp=32, seed=1)
    mi.render(scene, integrator=walk, spp=32, seed=2)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        mi.render(scene, integrator=walk, spp=48, seed=3)
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert kernels and all(k["cache_hit"] for k in kernels)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("method", ["kelemen", "erpt"])
def test_deep_paths(method, chance, level):
    """More numbers than a state keeps: inside a closed room that glows and reflects 0.9.

    Radiance is 1 / (1 - 0.9) = 10 everywhere. Roulette makes the paths differ in length and worth;
    a third of them draw more than the 128 numbers that are stored.
    """
    paths = {"type": "surfacepath", "max_depth": -1, "rr_depth": 8}
    room = {
        "type": "cube",
        "flip_normals": True,
        "bsdf": {"type": "diffuse", "reflectance": 0.9},
        "emitter": {"type": "area", "radiance": 1.0},
    }
    sensor = {"type": "perspective", "film": film(4, 4)}
    scene = mi.load_dict({"type": "scene", "sensor": sensor, "room": room})
    pictures = chance.runs(scene, 256, runs=16, integrator=integrator(method, paths=paths))
    chance.equal(level(pictures.mean((1, 2, 3))), 10.0, precision=0.03)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono"])
def test_lenses_filters_and_variants(variant, chance, level):
    """A thin lens and a tent filter, in colour, by wavelength and in grey, as `path` has it."""
    mi.set_variant(variant)
    lens = {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 4.0}
    scene = cornell(8, 8, "tent", **lens)
    by = (integrator("kelemen"), mi.load_dict({"type": "surfacepath", "max_depth": 6}))
    energies = (level(chance.runs(scene, 64, runs=24, integrator=i).mean((1, 2))) for i in by)
    chance.equal(*energies, precision=0.06)


@pytest.mark.false_alarms(1e-3)
def test_wrappers_and_media(chance, level):
    """Chains walk through fog and through what wraps the integrator: k times the path tracer."""
    fog = {"type": "homogeneous", "albedo": 0.8, "sigma_t": 0.3}
    scene = cornell(8, 8, medium=fog)
    paths = {"type": "volpath", "max_depth": 6}
    wrapped = {"type": "samplescale", "response": 2.0, "nested": paths}
    found = chance.runs(scene, 128, runs=24, integrator=integrator("kelemen", paths=wrapped))
    wanted = 2 * chance.runs(scene, 128, runs=24, integrator=mi.load_dict(paths))
    chance.equal(level(found.mean((1, 2))), level(wanted.mean((1, 2))), precision=0.06)


@pytest.mark.parametrize("method", ["kelemen", "erpt"])
def test_one_pixel_is_b(method):
    """A film of one pixel has the luminance that the chains' own estimate b gives.

    With `erpt` exactly: what the chains deposit is what the seeds have. With `pssmlt` the uniform
    samples take their share by themselves, so to 2 %.
    """
    walk = integrator(method)
    picture = np.array(mi.render(cornell(1, 1), integrator=walk, spp=4096, seed=1))
    b = float(walk.report()[0].split()[4].rstrip(","))
    assert luminance(picture).item() == pytest.approx(b, rel=1e-4 if method == "erpt" else 0.02)


def test_fallback_where_chains_do_not_pay():
    """Independent samples render the Cornell box, by default, and the report says so."""
    walk = mi.load_dict({"type": "pssmlt", "paths": {"type": "surfacepath", "max_depth": 6}})
    picture = np.array(mi.render(cornell(), integrator=walk, spp=64, seed=1))
    assert "independent samples" in walk.report()[1]
    # 64 samples of each of 144 pixels: the mean is right to 1 %.
    reference = np.array(mi.render(cornell(), spp=512, seed=2))
    assert picture.mean() == pytest.approx(reference.mean(), rel=0.05)


@pytest.mark.parametrize("method", ["kelemen", "erpt"])
def test_darkness(method):
    """A scene without light: a black picture, and a report without NaN."""
    sensor = {"type": "perspective", "film": film(4, 4)}
    ball = {"type": "sphere", "center": [0, 0, 3]}
    scene = mi.load_dict({"type": "scene", "sensor": sensor, "ball": ball})
    walk = integrator(method)
    assert np.all(np.array(mi.render(scene, integrator=walk, spp=16)) == 0)
    assert "b = 0, standard error 0" in walk.report()[0]


@pytest.mark.parametrize("name", MUTATIONS)
def test_mutations_are_symmetric(name):
    """The offset of 1 - r is minus that of r, within the sizes; a moved number stays in [0, 1)."""
    offset, s1, s2 = MUTATIONS[name]
    r, q = (dr.arange(mi.Float, 4096) + 0.5) / 4096, 0.25
    there, back = (np.array(offset(x, q, s1, s2)) for x in (r, 1 - r))
    assert there == pytest.approx(-back, abs=2e-6)
    assert np.all(np.abs(there) <= (s2 * 1.0001 if name != "gaussian" else 4 * s2))
    for u in (0.0, 1e-9, 0.5, 1 - 2.0**-24):
        u_new = np.array(perturb(mi.Float(u), mi.Float(there)))
        assert np.all((u_new >= 0) & (u_new < 1))
    if name == "mixed":
        # Half of the steps have one size, here half way from the largest to the smallest.
        assert np.abs(there).max() == pytest.approx(math.sqrt(s1 * s2), rel=1e-3)
        there = np.array(offset(r, 0.75, s1, s2))
    if name in ("mixed", "kelemen"):
        # The logarithm is uniform: half of all offsets are below the geometric mean of the sizes.
        assert np.mean(np.abs(there) < math.sqrt(s1 * s2)) == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("method", "wrong", "message"),
    [
        ("kelemen", {"bootstrap": 0.0}, "bootstrap is 0.0, but must be above 0"),
        ("kelemen", {"large_step_probability": 1.5}, "large_step_probability is 1.5, but must be"),
        ("kelemen", {"chains": 1}, "chains is 1, but must be 2 or more"),
        ("kelemen", {"mutation": "kelement"}, "mutation is 'kelement', but must be one of mixed"),
        ("kelemen", {"mutation_size_min": 0.1}, "mutation sizes are 0.1 and 0.015625, but must"),
        ("erpt", {"direct_samples": -1}, "direct_samples is -1, but must be 0 or more"),
        ("erpt", {"direct_samples": 0.1}, "PathIntegrator cannot leave out the light of some"),
        ("erpt", {"length": 0}, "length is 0, but must be 1 or more"),
        ("erpt", {"paths": {"type": "ptracer"}}, "erpt takes one nested sampling integrator"),
        ("erpt", {"paths": {"type": "prb"}}, "erpt nests path or its like, not PRBIntegrator"),
    ],
)
def test_errors(method, wrong, message):
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict(METHODS[method] | {"paths": {"type": "path"}} | wrong)
