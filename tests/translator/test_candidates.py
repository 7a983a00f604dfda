"""Which integrators may render a scene follows from its lamps and its surfaces alone."""

import pytest

from relume.translator import read_text, translate

FLOOR = "OBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
LAMP = "OBJECT\nsphere 0 5 0 1\nemission 1 1 1\n\n"
SPOT = "OBJECT\nsphere 0 5 0 1\nemission 1 1 1\nspot_light 1\n\n"
BEAM = "OBJECT\nuvplane 0 5 0\nU 1 0 0\nV 0 0 1\nemission 1 1 1\nparallel_light 1\n\n"
SUN = "OBJECT\ninfinity_light 0 -1 0\nemission 1 1 1\n\n"
GLASS = "OBJECT\nsphere 0 1 0 1\ncolor 1 1 1\nreflection reflection\n\n"
MIRROR = "OBJECT\nsphere 0 1 0 1\ncolor 1 1 1\nreflection specular\n\n"
SKY = "BACKGROUND\n1 1 1\n\n"
RESPONSE = "sensor_response\n2\n\n"
CUTOFF = "luminance_cutoff\n0.5\n\n"
FOG = "participatingMedia\n1\nSCATTERING\n0\n1 1 1\n\n"
CHAINS = "metropolisTransport\n1\n\n"

NAMED = {"a response and a spot": "samplescale"}
"""What has no choice but `bdpt`, and is planned for another plugin than `surfacepath`."""

BOTH = ("surfacepath", "bdpt")
SCENES = {
    "a lamp": (FLOOR + LAMP, BOTH),
    "a lamp and glass": (FLOOR + LAMP + GLASS, BOTH),
    "a lamp and a sky": (SKY + FLOOR + LAMP, BOTH),
    "a spot": (FLOOR + SPOT, BOTH),
    "a spot and glass": (FLOOR + SPOT + GLASS, ("bdpt",)),
    "a beam and a mirror": (FLOOR + BEAM + MIRROR, ("bdpt",)),
    "a sun and glass": (FLOOR + SUN + GLASS, ("bdpt",)),
    "a dark spot and glass": (
        FLOOR + LAMP + SPOT.replace("emission 1 1 1", "emission 0 0 0") + GLASS,
        BOTH,
    ),
    "the sky alone": (SKY + FLOOR + GLASS, ("surfacepath",)),
    "nothing shines": (FLOOR + GLASS, ("surfacepath",)),
    "a response": (RESPONSE + FLOOR + LAMP, ("samplescale", "bdpt")),
    "a response and a spot": (RESPONSE + FLOOR + SPOT + GLASS, ("bdpt",)),
    "a response and the sky": (RESPONSE + SKY + FLOOR + GLASS, ("samplescale",)),
    "a response and fog": (RESPONSE + FOG + FLOOR + LAMP, ("samplescale",)),
    "a cutoff": (CUTOFF + FLOOR + SPOT + GLASS, ("samplescale",)),
    "a response and a cutoff": (RESPONSE + CUTOFF + FLOOR + SPOT + GLASS, ("samplescale",)),
    "fog": (FOG + FLOOR + LAMP, ("randomwalk",)),
    "chains": (CHAINS + FLOOR + LAMP, ("pssmlt",)),
}


@pytest.mark.parametrize("name", SCENES)
def test_candidates(name):
    text, candidates = SCENES[name]
    translation = translate(read_text(text, environ={}))
    plan = translation.plan
    assert plan.candidates == candidates and plan.reasons["candidates"]
    # What is made of the dictionary does not depend on what a render chooses.
    assert plan.integrator == translation.scene["integrator"]["type"]
    planned = NAMED.get(name, "surfacepath") if candidates == ("bdpt",) else candidates[0]
    assert plan.integrator == planned


def codes(translation):
    return {code for line in translation.document.lines.all for code in line.codes}


def test_light_that_bdpt_finds_is_not_noted_as_missing():
    """It is where another integrator renders, and where the scene allows no `bdpt`."""
    code = "no-light-through-glass"
    found = translate(read_text(SCENES["a spot and glass"][0], environ={}))
    assert code not in codes(found)
    assert code in codes(found.path_traced())
    assert code not in codes(found)
    assert code in codes(translate(read_text(SCENES["a cutoff"][0], environ={})))
