"""From attribute lines to BSDF dictionaries, for every kind of reflection and both dialects."""

import pytest

from relume.translator.diagnostics import SceneError
from relume.translator.scene_values import Color

COLORS = "color 0.5 0.25 0.125\nspecular 0.2 0.4 0.6\n"


def rgb(*values):
    return {"type": "rgb", "value": [pytest.approx(x) for x in values]}


def twosided(bsdf):
    return {"type": "twosided", "bsdf": bsdf}


DIFFUSE = {"type": "diffuse", "reflectance": rgb(0.5, 0.25, 0.125)}
MIRROR = {
    "type": "conductor",
    "material": "none",
    "specular_reflectance": rgb(0.5, 0.25, 0.125),
}


@pytest.fixture
def bsdf(translated):
    """The BSDF's dictionary of an object with the given lines, and its line reports by text."""

    def make(lines, dialect="manual", text="OBJECT\nsphere 0 0 0 1\n"):
        lines = COLORS + lines
        result = translated(text + lines, dialect)
        entries = [e for e in result.scene.values() if isinstance(e, dict) and "bsdf" in e]
        reports = {r.keyword: r for r in result.document.lines.all}
        return entries[0]["bsdf"], reports

    return make


@pytest.mark.parametrize("dialect", ["manual", "prender"])
@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("", twosided(DIFFUSE)),
        ("reflection diffuse\n", twosided(DIFFUSE)),
        ("reflection specular\n", twosided(MIRROR)),
        # roughness is the weight of Lambert: 1 and 0 leave one of the two
        ("reflection diffuse\nroughness 0\n", twosided(MIRROR)),
        ("reflection specular\nroughness 1\n", twosided(DIFFUSE)),
        # a reflection line sets its own weight: a roughness before it is lost
        ("roughness 0.3\nreflection diffuse\n", twosided(DIFFUSE)),
        (
            "reflection specular\nroughness 0.25\n",
            twosided({"type": "blendbsdf", "weight": 0.25, "bsdf_0": MIRROR, "bsdf_1": DIFFUSE}),
        ),
        # the last reflection line counts
        ("reflection ward_brdf\nreflection specular\n", twosided(MIRROR)),
    ],
)
def test_lambert_and_mirror(bsdf, dialect, lines, expected):
    """Section 8.1: neither dialect changes anything; without a line the surface is diffuse."""
    assert bsdf(lines, dialect)[0] == expected


def glass(**more):
    color = rgb(0.5, 0.25, 0.125)
    return {
        "type": "schlickglass",
        "ext_ior": 1.0,
        "specular_reflectance": color,
        "specular_transmittance": color,
    } | more


@pytest.mark.parametrize(
    ("lines", "index"),
    [
        ("reflection reflection\n", 1.5),
        ("reflection reflection\nrefractive_index 2.4\n", 2.4),
        ("refractive_index 0.6\nreflection reflection\n", 0.6),
        ("reflection reflection\nrefractive_index 0\n", 1.5),
    ],
)
def test_glass(bsdf, lines, index):
    """Section 8.4: one-sided, since it tells inside from outside; `color` tints both parts."""
    found, reports = bsdf(lines)
    assert found == glass(int_ior=index)
    if lines.endswith(" 0\n"):
        assert "0 read as 1.5" in reports["refractive_index"].note


@pytest.mark.parametrize("dialect", ["manual", "prender"])
@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("reflection reflection99\n", {"dispersion": "formula99"}),
        (
            "reflection reflection1\n1 2 3 4 5 6\n",
            {"dispersion": "cauchy6", "coefficients": "1 2 3 4 5 6"},
        ),
        # missing coefficients are 0
        (
            "reflection reflection2\n1.25 6.5e-3 0.25\n",
            {"dispersion": "sellmeier3", "coefficients": "1.25 0.0064999999999999997 0.25 0 0 0"},
        ),
        # a plain glass line before it does not matter
        ("reflection reflection\nreflection reflection99\n", {"dispersion": "formula99"}),
    ],
)
def test_dispersion(bsdf, lines, expected, dialect):
    """Section 8.7: the formula and its coefficients take the place of the index."""
    found, reports = bsdf(lines + "refractive_index 1.7\n", dialect)
    assert found == glass(**expected)
    assert reports["refractive_index"].outcome == "ignored"


@pytest.mark.parametrize(
    ("dialect", "variant"), [("manual", "llvm_ad_spectral"), ("prender", "llvm_ad_rgb")]
)
def test_dispersion_chooses_the_variant(translated, dialect, variant):
    """Row dispersion-rgb: wavelengths in the dialect manual, one index at 589.3 nm in prender."""
    text = f"OBJECT\nsphere 0 0 0 1\n{COLORS}reflection reflection99\n"
    plan = translated(text, dialect).plan
    assert plan.variant == variant
    assert "surfacepath" in plan.plugins


def ward(diffuse, specular, u=0.1, v=0.4):
    lobe = {"specular_reflectance": rgb(*specular), "alpha_u": u, "alpha_v": v}
    return twosided(
        {"type": "ward", "diffuse_reflectance": rgb(*diffuse), "tangent_frame": "world", **lobe}
    )


@pytest.mark.parametrize(
    ("line", "dialect", "expected"),
    [
        # manual: the sum, rho_d color / pi + rho_s specular lobe
        ("0.5 0.25 0.1 0.4", "manual", ward((0.25, 0.125, 0.0625), (0.05, 0.1, 0.15))),
        ("0 1 0.1 0.4", "manual", ward((0, 0, 0), (0.2, 0.4, 0.6))),
        # old forms: rho_d = 1; three values start with rho_s
        ("0.1 0.4", "manual", ward((0.5, 0.25, 0.125), (0.2, 0.4, 0.6))),
        ("0.5 0.1 0.4", "manual", ward((0.5, 0.25, 0.125), (0.1, 0.2, 0.3))),
        # program: weighed by the means, here (0.875 / 3) / (0.875 / 3 + 1.2 / 3) = 0.875 / 2.075
        (
            "1 1 0.1 0.4",
            "prender",
            ward(
                [x * 0.875 / 2.075 for x in (0.5, 0.25, 0.125)],
                [x * 1.2 / 2.075 for x in (0.2, 0.4, 0.6)],
            ),
        ),
        # with one of the two black the other one has all the weight
        ("0 1 0.1 0.4", "prender", ward((0, 0, 0), (0.2, 0.4, 0.6))),
        ("1 0 0.1 0.4", "prender", ward((0.5, 0.25, 0.125), (0, 0, 0))),
        ("0 0 0.1 0.4", "prender", ward((0, 0, 0), (0, 0, 0))),
    ],
)
def test_ward(bsdf, line, dialect, expected):
    """Section 8.5 and row ward-diffuse, by hand."""
    found, reports = bsdf(f"reflection ward_brdf\nward_brdf {line}\n", dialect)
    assert found == expected
    mixed = all(any(found["bsdf"][lobe]["value"]) for lobe in LOBES)
    assert ("ward-diffuse" in reports["ward_brdf"].note) == mixed


LOBES = ("diffuse_reflectance", "specular_reflectance")


def phong(diffuse, specular):
    lobes = dict(zip(LOBES, (rgb(*diffuse), rgb(*specular)), strict=True))
    return twosided({"type": "phong", "exponent": 32.0, **lobes})


@pytest.mark.parametrize(
    ("lines", "dialect", "expected"),
    [
        ("phong_brdf 0.5 0.25 32\n", "manual", phong((0.25, 0.125, 0.0625), (0.05, 0.1, 0.15))),
        # program: roughness is the share of the diffuse part, 0 by default
        ("phong_brdf 0.5 0.25 32\n", "prender", phong((0, 0, 0), (0.05, 0.1, 0.15))),
        (
            "phong_brdf 1 1 32\nroughness 0.75\n",
            "prender",
            phong((0.375, 0.1875, 0.09375), (0.05, 0.1, 0.15)),
        ),
        (
            "phong_brdf 1 1 32\nroughness 0.75\n",
            "manual",
            phong((0.5, 0.25, 0.125), (0.2, 0.4, 0.6)),
        ),
    ],
)
def test_phong(bsdf, lines, dialect, expected):
    """Section 8.6 and row phong-diffuse, by hand; the manual has no use for roughness there."""
    found, reports = bsdf("reflection phong_brdf\n" + lines, dialect)
    assert found == expected
    assert "phong-diffuse" in reports["phong_brdf"].note or dialect == "prender"
    if "roughness" in lines and dialect == "manual":
        assert reports["roughness"].outcome == "ignored"


@pytest.mark.parametrize("kind", ["ward_brdf", "phong_brdf"])
def test_missing_parameters_are_an_error(translated, kind):
    """A glossy surface without its parameters has a located error instead of a guess."""
    with pytest.raises(SceneError) as caught:
        translated(f"OBJECT\nsphere 0 0 0 1\n{COLORS}reflection {kind}\n")
    (problem,) = caught.value.problems
    assert (problem.line, problem.kind) == (5, "scene")
    assert f"needs a line '{kind} ...'" in problem.message


def test_colors_above_one_are_kept(bsdf):
    """A reflectance above 1 is kept as written, with a note on its line (decisions)."""
    found, reports = bsdf("reflection diffuse\ncolor 2.5 0.5 1\n")
    color = found["bsdf"]["reflectance"]
    assert color == {"type": "srgb", "color": Color((2.5, 0.5, 1.0)), "unbounded": True}
    assert "not energy conserving" in reports["color"].note


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("reflection diffuse\ncolor 0.98 0 0\n", True),
        ("reflection specular\ncolor 0 0 1\n", True),
        ("reflection specular\ncolor 0.97 0.97 0.97\n", False),
        ("reflection reflection\ncolor 1 1 1\n", False),
    ],
)
def test_albedo_for_which_roulette_leaves_noise(bsdf, lines, told):
    """Of roulette's weights the variance is without bound above sqrt(0.95) = 0.975."""
    assert ("roulette" in bsdf(lines)[1]["color"].note) == told


@pytest.mark.parametrize(
    ("lines", "field"),
    [
        ("reflection diffuse\n", "specular"),
        ("reflection specular\nrefractive_index 1.4\n", "refractive_index"),
        ("reflection reflection\nroughness 0.4\n", "roughness"),
        ("reflection diffuse\nward_brdf 0 1 0.1 0.1\n", "ward_brdf"),
        ("reflection ward_brdf\nward_brdf 0 1 0.1 0.1\nphong_brdf 0 1 5\n", "phong_brdf"),
        ("roughness 0.4\n", "roughness"),
    ],
)
def test_useless_lines_are_said_to_be_ignored(bsdf, lines, field):
    """Every attribute that the surface does not use is accounted for."""
    assert bsdf(lines)[1][field].outcome == "ignored"


def test_missing_reflection_line_is_noted(bsdf):
    """Row no-reflection-line: diffuse as the manual says, not the program's mirror."""
    assert "no-reflection-line" in bsdf("")[1]["OBJECT"].note
