"""The plan takes the smallest means: variant, integrator, sensor and plugins of small scenes."""

import pytest

from relume.translator import read_text, translate
from relume.translator.plan import bootstrap, with_samples

BALL = "OBJECT\nsphere 0 0 0 1\n"
PANEL = "OBJECT\nuvplane 0 0 0\nU 1 0 0\nV 0 1 0\n"
FOG = "participatingMedia\n1\nSCATTERING\n0\n1 1 1\n\n"
RGB, SPECTRAL = "llvm_ad_rgb", "llvm_ad_spectral"

SCENES = {
    "empty": ("", RGB, "surfacepath", "perspective", ["surfacepath"], 32),
    "room": (
        "SAMPLING\n3\nSUPERSAMPLING\n2\n" + "OBJECT\nsphere 0 -1e5 0 1e5\ncolor 1 1 1\n"
        "reflection diffuse\n\n" + BALL + "emission 1 1 1\n",
        RGB,
        "surfacepath",
        "perspective",
        ["surfacepath", "twosidedarea"],
        12,
    ),
    "mirror": (
        BALL + "color 1 1 1\nreflection specular\n",
        RGB,
        "surfacepath",
        "perspective",
        ["surfacepath"],
        32,
    ),
    "glass": (
        BALL + "color 1 1 1\nreflection reflection\n",
        RGB,
        "surfacepath",
        "perspective",
        ["schlickglass", "surfacepath"],
        32,
    ),
    "dispersion": (
        BALL + "color 1 1 1\nreflection reflection99\n",
        SPECTRAL,
        "surfacepath",
        "perspective",
        ["schlickglass", "surfacepath"],
        32,
    ),
    "ward": (
        BALL + "specular 1 1 1\nreflection ward_brdf\nward_brdf 0.1 0.2\n",
        RGB,
        "surfacepath",
        "perspective",
        ["surfacepath", "ward"],
        32,
    ),
    "phong": (
        BALL + "specular 1 1 1\nreflection phong_brdf\nphong_brdf 0 1 9\n",
        RGB,
        "surfacepath",
        "perspective",
        ["phong", "surfacepath"],
        32,
    ),
    "spot": (
        BALL + "emission 1 1 1\nspot_light 1\n",
        RGB,
        "surfacepath",
        "perspective",
        ["falloffspot", "surfacepath"],
        32,
    ),
    "beam": (
        PANEL + "emission 1 1 1\nparallel_light 1\n",
        RGB,
        "surfacepath",
        "perspective",
        ["parallelbeam", "surfacepath"],
        32,
    ),
    "panel": (PANEL + "emission 1 1 1\n", RGB, "surfacepath", "perspective", ["surfacepath"], 32),
    "sun": (
        "OBJECT\ninfinity_light 0 -1 0\nemission 1 1 1\n",
        RGB,
        "surfacepath",
        "perspective",
        ["surfacepath"],
        32,
    ),
    "shining dome": (
        "OBJECT\nhemisphere 0 0 0 1\nemission 1 1 1\n",
        RGB,
        "surfacepath",
        "perspective",
        ["surfacepath", "twosidedarea"],
        32,
    ),
    "lens": (
        "CAMERA_DIR\n0 0 -1\nLENS\n1 10\n",
        RGB,
        "surfacepath",
        "thinlens",
        ["surfacepath"],
        32,
    ),
    "tilted lens": (
        "LENS\n1 10\n",
        RGB,
        "surfacepath",
        "screencamera",
        ["screencamera", "surfacepath"],
        32,
    ),
    "wide pixels": (
        "SCREEN\n20 30 40\n",
        RGB,
        "surfacepath",
        "screencamera",
        ["screencamera", "surfacepath"],
        32,
    ),
    "response": (
        "sensor_response\n2\n",
        RGB,
        "samplescale",
        "perspective",
        ["samplescale", "surfacepath"],
        32,
    ),
    "cutoff": (
        "luminance_cutoff\n0.5\n",
        RGB,
        "samplescale",
        "perspective",
        ["samplescale", "surfacepath"],
        32,
    ),
    "grey fog": (FOG, RGB, "volpath", "perspective", [], 32),
    "coloured fog": (
        FOG + "ABSORBING\n0\n0 1 2\nPAHASE 0.1 0.2 0.3\n",
        RGB,
        "volpathmis",
        "perspective",
        ["hgrgb"],
        32,
    ),
    "no fog": ("participatingMedia\n1\n", RGB, "surfacepath", "perspective", ["surfacepath"], 32),
    "prism in fog": (
        FOG.replace("1 1 1", "0 0 1e-4") + BALL + "reflection reflection99\n",
        SPECTRAL,
        "volpathmis",
        "perspective",
        ["schlickglass"],
        32,
    ),
    "dense fog": (
        FOG + BALL + "reflection diffuse\n",
        RGB,
        "randomwalk",
        "perspective",
        ["randomwalk"],
        32,
    ),
    "marble": (
        BALL + "reflection Subsurface_Scattering\nBSSRDF\n1\nMATERIAL_SYMBOL\nMarble\n",
        RGB,
        "dipole",
        "perspective",
        ["dipole", "subsurface"],
        32,
    ),
    "milk": (
        BALL + "reflection Subsurface_Scattering\nBSSRDF\n0\nMATERIAL_SYMBOL\nWholemilk\n",
        RGB,
        "randomwalk",
        "perspective",
        ["randomwalk", "schlickglass"],
        32,
    ),
    "milk in fog": (
        FOG + BALL + "reflection Subsurface_Scattering\nBSSRDF\n0\nMATERIAL_SYMBOL\nWholemilk\n",
        RGB,
        "randomwalk",
        "perspective",
        ["randomwalk", "schlickglass"],
        32,
    ),
    "metropolis": (
        "metropolisTransport\n1\nSUPERSAMPLING\n3\n",
        RGB,
        "pssmlt",
        "perspective",
        ["bdpt", "pssmlt"],
        16,
    ),
    "energy redistribution": (
        "energyRedistributionPathTracing\n1\nmetropolisTransport\n1\nmutation\n5\n",
        RGB,
        "erpt",
        "perspective",
        ["bdpt", "erpt"],
        40,
    ),
    "no mutations": (
        "energyRedistributionPathTracing\n1\nmutation\n-1\n",
        RGB,
        "erpt",
        "perspective",
        ["bdpt", "erpt"],
        256,
    ),
    "metropolis in fog": (
        FOG + "metropolisTransport\n1\nmutation\n0.2\n",
        RGB,
        "pssmlt",
        "perspective",
        ["pssmlt"],
        8,
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_plans(name):
    """Pinned: a change here is a change of what scenes need."""
    text, variant, integrator, sensor, plugins, spp = SCENES[name]
    translation = translate(read_text(text, environ={}))
    plan = translation.plan.as_dict()
    assert plan["variant"] == variant
    assert plan["integrator"] == translation.scene["integrator"]["type"] == integrator
    assert plan["sensor"] == translation.scene["sensor"]["type"] == sensor
    assert plan["plugins"] == plugins
    assert plan["spp"] == spp
    assert (plan["width"], plan["height"]) == (320, 240)
    assert all(plan["reasons"][key] for key in ("variant", "integrator", "sensor", "spp"))


def test_reasons():
    """They name what made the choice."""
    reasons = translate(read_text(SCENES["dispersion"][0], environ={})).plan.reasons
    assert "dispersion" in reasons["variant"] and "dispersion" in reasons["integrator"]
    reasons = translate(read_text(SCENES["response"][0], environ={})).plan.reasons
    assert "samplescale" in reasons["integrator"]
    reasons = translate(read_text(SCENES["wide pixels"][0], environ={})).plan.reasons
    assert "not square" in reasons["sensor"]


@pytest.mark.parametrize(
    ("depth", "start"), [("0", 1), ("3", 4), ("2.9", 3), ("1e9", 10**9 + 1), ("1e12", 2**30 + 1)]
)
def test_roulette(depth, start):
    """DEPTH is the first path depth without a limit: roulette starts beyond it, paths never end."""
    scene = translate(read_text(f"DEPTH\n{depth}\n", environ={})).scene
    assert scene["integrator"] == {"type": "surfacepath", "max_depth": -1, "rr_depth": start}


@pytest.mark.parametrize(
    ("lines", "start"),
    [
        ("", None),
        ("metropolisTransport\n1\n", 9),
        ("participatingMedia\n1\nSCATTERING\n0\n.1 .1 .1\n", 9),
    ],
)
def test_roulette_of_files_that_ask_for_none(lines, start):
    """Path tracers start it where it costs least; chains and media from the program's depth on."""
    integrator = translate(read_text(lines, environ={})).scene["integrator"]
    assert integrator.get("paths", integrator).get("rr_depth") == start


def test_samples_asked_for_keep_the_share_of_the_bootstrap():
    """Three of `mlt_sample` to five mutations, whatever number of samples replaces them."""
    document = read_text("metropolisTransport\n1\nmutation\n5\nmlt_sample\n3\n", environ={})
    assert bootstrap(document) == bootstrap(with_samples(document, 64)) == pytest.approx(0.6)
