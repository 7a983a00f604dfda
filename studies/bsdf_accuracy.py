"""Accuracy of the materials at full size: a table.

The columns are the largest errors met: of the value against the float64 transcription (relative,
above 1e-30), of the sample weights against eval / pdf (relative), of f(i, o) against f(o, i)
(relative); the smallest p-value of 30 chi² tests of 10^6 samples each (0.00003 would reject); the
error of a sphere in a white furnace at 1024 samples a pixel (relative).

The formulas and fixtures are those of the materials' tests, so pytest runs the measurements.
"""

import mitsuba as mi
import numpy as np
import pytest

from tests.bsdfs import test_phong as phong
from tests.bsdfs import test_schlickglass as schlickglass
from tests.bsdfs import test_ward as ward

FIXTURES = ("tests.conftest", "tests.bsdfs.conftest")
FURNACE_RUNS, FURNACE_SPP = 8, 1024

pytestmark = pytest.mark.false_alarms(1e-3)


def add_arguments(parser):
    parser.add_argument("--chi2-samples", type=int, default=1_000_000, help="of each chi² test")
    parser.add_argument("--only", default="", metavar="WORDS", help="as pytest's -k")


def run(options):
    plugins = [word for name in FIXTURES for word in ("-p", name)]
    chosen = ["-k", options.only] if options.only else []
    print("\n| material | value | weight | reciprocity | least p of 30 | furnace |")
    print("|---|---|---|---|---|---|", end="", flush=True)
    command = [__file__, "-s", "--no-header", *plugins, *chosen]
    return pytest.main(command, plugins=[Settings(options.chi2_samples)])


class Settings:
    """Pytest plugin: the options of the study, as fixtures."""

    def __init__(self, chi2_samples):
        self._chi2_samples = chi2_samples

    @pytest.fixture
    def chi2_samples(self):
        return self._chi2_samples


def f_cos(bsdf, wi, wo, at):
    return np.array(bsdf.eval(mi.BSDFContext(), at(wi), mi.Vector3f(wo.T)))[0].astype(float)


def largest(got, expected):
    usable = np.abs(expected) > 1e-30
    return np.max(np.abs(got[usable] / expected[usable] - 1))


def errors(bsdf, formula, at, pairs, directions):
    """(value, weight, reciprocity) for one parameter set; `formula(wi, wo)` is f in float64."""
    wi, wo = pairs(bsdf, 21)
    there, back = f_cos(bsdf, wi, wo, at) / wo[:, 2], f_cos(bsdf, wo, wi, at) / wi[:, 2]
    u = np.random.default_rng(5).random((3, len(wi))).astype(np.float32)
    ctx, si = mi.BSDFContext(), at(directions(len(wi), 22))
    bs, weight = bsdf.sample(ctx, si, mi.Float(u[0]), mi.Point2f(u[1:]))
    value, pdf = (np.array(x).astype(float) for x in bsdf.eval_pdf(ctx, si, bs.wo))
    drawn = pdf > 0
    ratio = largest(np.array(weight)[0][drawn], value[0][drawn] / pdf[drawn])
    return largest(there, formula(wi, wo)), ratio, largest(there, back)


def furnace_error(material, albedo, furnace):
    x, w = np.polynomial.legendre.leggauss(16)
    angles = np.degrees(np.arcsin(np.sqrt((x + 1) / 2)))
    expected = sum(w / 2 * [albedo(mi.load_dict(material), angle) for angle in angles])
    found = furnace(material, FURNACE_SPP // FURNACE_RUNS)
    return abs(found.mean[0] / expected - 1)


def least_p(chi2, cases, sample_count, chance):
    """The smallest p-value of the cases: `chance.p` is that of all together, by Šidák."""
    chi2(cases, sample_count=sample_count)
    return f"{-np.expm1(np.log1p(-chance.p) / len(cases)):.4f}"


def row(name, measured, p, off):
    cells = [f"{x:.1e}" for x in np.max(measured, axis=0)] + ["-"] * (3 - len(measured[0]))
    print(f"\n| `{name}` | {' | '.join(cells)} | {p} | {off:.1e} |", flush=True)


@pytest.mark.parametrize("variant", ["ward", "duer", "balanced"])
def test_ward(variant, at, pairs, directions, chi2, chi2_samples, albedo, furnace, chance):
    measured = []
    for alphas in ward.ALPHAS:
        bsdf = mi.load_dict(ward.ward(*alphas, variant, 0.5, 0.5))

        def formula(wi, wo, alphas=alphas):
            alphas = np.float32(alphas).astype(float)
            return ward.transcription(wi, wo, *alphas, variant, 0.5, 0.5)

        measured.append(errors(bsdf, formula, at, pairs, directions))
    p = "-"
    if variant == "ward":  # one list covers all variants
        p = least_p(chi2, ward.chi2_cases(), chi2_samples, chance)
    off = furnace_error(ward.ward(0.3, 0.3, variant, 0.3, 0.6), albedo, furnace)
    row(f"ward, {variant}", measured, p, off)


def test_phong(at, pairs, directions, chi2, chi2_samples, albedo, furnace, chance):
    measured = []
    for n in phong.EXPONENTS:
        bsdf = mi.load_dict(phong.phong(n, 0.0, 0.5))

        def formula(wi, wo, n=n):
            # Below 0.01 float32 does not resolve cos alpha to 1e-4: left out, see test_phong.
            c = phong.cos_alpha(wi, wo)
            return np.where(c > 0.01, 0.5 * (n + 2) / (2 * np.pi) * np.maximum(c, 0) ** n, 0)

        measured.append(errors(bsdf, formula, at, pairs, directions))
    p = least_p(chi2, phong.chi2_cases(), chi2_samples, chance)
    off = furnace_error(phong.phong(20, 0.3, 0.6), albedo, furnace)
    row("phong", measured, p, off)


@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
def test_glass(fresnel, at, directions, furnace, chance):
    value, weight = 0.0, 0.0
    for n in schlickglass.INDICES:
        bsdf, wi = mi.load_dict(schlickglass.glass(n, fresnel)), directions(10_000, 5, below=True)
        F, cos2, _, factor = schlickglass.transcription(wi, float(np.float32(n)), 1.0, fresnel)
        shares = {schlickglass.REFLECT: F, schlickglass.REFRACT: (1 - F) * factor}
        u = mi.Float(np.random.default_rng(1).random(len(wi)).astype(np.float32))
        bs, both = bsdf.sample(mi.BSDFContext(), at(wi), u, mi.Point2f(0.5))
        both = np.array(both)[0] * np.array(bs.pdf)
        for k, share in shares.items():
            alone = np.array(bsdf.sample(schlickglass.lobe(k), at(wi), 0.5, mi.Point2f(0.5))[1])[0]
            resolved = (cos2 > 2e-3) & (share > 1e-8)
            if resolved.any():
                value = max(value, largest(alone[resolved], share[resolved]))
            drawn = np.array(bs.sampled_component) == k
            if drawn.any():
                weight = max(weight, largest(both[drawn], alone[drawn].astype(float)))
    found = furnace(schlickglass.glass(1.5, fresnel), FURNACE_SPP // FURNACE_RUNS, max_depth=60)
    off = abs(found.mean[0] - 1)
    row(f"schlickglass, {fresnel}", [(value, weight)], "-", off)
