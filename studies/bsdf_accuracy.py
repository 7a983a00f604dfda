"""Accuracy of the materials at full size: a table. ``make study-materials`` runs it.

The columns are the largest errors met: of the value against the float64 transcription (relative,
above 1e-30), of the sample weights against eval / pdf (relative), of f(i, o) against f(o, i)
(relative); the smallest p-value of 30 chi² tests of 10^6 samples each (0.0003 would reject); the
error of a sphere in a white furnace at 1024 samples a pixel (relative).
"""

import importlib.util
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

pytestmark = pytest.mark.study


def load(name):
    """The test module of that name beside this file."""
    path = Path(__file__).with_name(f"{name}.py")
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session", autouse=True)
def table():
    print("\n| material | value | weight | reciprocity | least p of 30 | furnace |")
    print("|---|---|---|---|---|---|", end="")


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
    return abs(furnace(material, 1024)[0] / expected - 1)


def row(name, measured, p, off):
    cells = [f"{x:.1e}" for x in np.max(measured, axis=0)] + ["-"] * (3 - len(measured[0]))
    print(f"\n| `{name}` | {' | '.join(cells)} | {p} | {off:.1e} |", flush=True)


@pytest.mark.parametrize("variant", ["ward", "duer", "balanced"])
def test_ward(variant, at, pairs, directions, chi2, albedo, furnace):
    test = load("test_ward")
    measured = []
    for alphas in test.ALPHAS:
        bsdf = mi.load_dict(test.ward(*alphas, variant, 0.5, 0.5))

        def formula(wi, wo, alphas=alphas):
            alphas = np.float32(alphas).astype(float)
            return test.transcription(wi, wo, *alphas, variant, 0.5, 0.5)

        measured.append(errors(bsdf, formula, at, pairs, directions))
    p = "-"
    if variant == "ward":  # one list covers all variants
        p = f"{min(chi2(test.chi2_cases(), sample_count=1_000_000)):.3f}"
    off = furnace_error(test.ward(0.3, 0.3, variant, 0.3, 0.6), albedo, furnace)
    row(f"ward, {variant}", measured, p, off)


def test_phong(at, pairs, directions, chi2, albedo, furnace):
    test = load("test_phong")
    measured = []
    for n in test.EXPONENTS:
        bsdf = mi.load_dict(test.phong(n, 0.0, 0.5))

        def formula(wi, wo, n=n):
            # Below 0.01 float32 does not resolve cos alpha to 1e-4: left out, see test_phong.
            c = test.cos_alpha(wi, wo)
            return np.where(c > 0.01, 0.5 * (n + 2) / (2 * np.pi) * np.maximum(c, 0) ** n, 0)

        measured.append(errors(bsdf, formula, at, pairs, directions))
    p = f"{min(chi2(test.chi2_cases(), sample_count=1_000_000)):.3f}"
    row("phong", measured, p, furnace_error(test.phong(20, 0.3, 0.6), albedo, furnace))


@pytest.mark.parametrize("fresnel", ["schlick", "exact"])
def test_glass(fresnel, at, directions, furnace):
    test = load("test_schlickglass")
    value, weight = 0.0, 0.0
    for n in test.INDICES:
        bsdf, wi = mi.load_dict(test.glass(n, fresnel)), directions(10_000, 5, below=True)
        F, cos2, _, factor = test.transcription(wi, float(np.float32(n)), 1.0, fresnel)
        shares = {test.REFLECT: F, test.REFRACT: (1 - F) * factor}
        u = mi.Float(np.random.default_rng(1).random(len(wi)).astype(np.float32))
        bs, both = bsdf.sample(mi.BSDFContext(), at(wi), u, mi.Point2f(0.5))
        both = np.array(both)[0] * np.array(bs.pdf)
        for k, share in shares.items():
            alone = np.array(bsdf.sample(test.lobe(k), at(wi), 0.5, mi.Point2f(0.5))[1])[0]
            resolved = (cos2 > 2e-3) & (share > 1e-8)
            if resolved.any():
                value = max(value, largest(alone[resolved], share[resolved]))
            drawn = np.array(bs.sampled_component) == k
            if drawn.any():
                weight = max(weight, largest(both[drawn], alone[drawn].astype(float)))
    off = abs(furnace(test.glass(1.5, fresnel), 1024, max_depth=60)[0] - 1)
    row(f"schlickglass, {fresnel}", [(value, weight)], "-", off)
