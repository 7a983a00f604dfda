"""Notes where media are denser than rays of single precision and roulette allow."""

import pytest

from relume.translator import read_text, translate

BALL = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection reflection\n"


def notes(text):
    document = translate(read_text("CAMERA_POS\n0 0 9\nDEPTH\n8\n" + text, environ={})).document
    return [r.note for r in document.lines.all if r.outcome == "approximated"]


def filled(s, a, lines=""):
    medium = f"SCATTERING\n0\n{s} {s} {s}\nABSORBING\n0\n{a} {a} {a}\n{lines}"
    return notes(f"\n{BALL}reflection Subsurface_Scattering\nBSSRDF\n0\n{medium}")


@pytest.mark.parametrize(
    ("sigma", "depth"),
    [(100, None), (110, None), (114, "0.02"), (1e3, "0.18"), (1e6, "1.8e+02")],
)
def test_where_walks_begin(sigma, depth):
    """Rays start 1.788e-4 off a ball whose outermost point is one unit from the origin; from 0.02
    mean free paths on, where 1 % of the light is lost, a note says so."""
    found = [n for n in filled(0.9 * sigma, 0.1 * sigma) if "single precision" in n]
    assert bool(found) == bool(depth)
    if depth:
        assert f"rays start {depth} mean free paths below" in found[0]


def test_where_nothing_is_absorbed_the_depth_does_not_matter():
    assert not any("single precision" in n for n in filled(1e5, 0))


@pytest.mark.parametrize(
    ("s", "a", "lines", "told"),
    [(5, 0, "", False), (100, 0, "", True), (100, 1, "", False), (100, 0.1, "", True),
     (100, 0, "PAHASE\n1\n", False)],
)  # fmt: skip
def test_long_walks_in_an_object(s, a, lines, told):
    """sigma_s sigma_s' scatterings in a ball of radius 1, or 1 / (1 - albedo) where these are
    fewer; past DEPTH + 100 roulette has ended nearly all paths."""
    assert any("roulette ends" in n for n in filled(s, a, lines)) == told


@pytest.mark.parametrize(("s", "told"), [("0.1", False), ("10", True)])
def test_long_walks_around_all_objects(s, told):
    fog = f"participatingMedia\n1\nSCATTERING\n0\n{s} {s} {s}\n\n{BALL}"
    assert any("roulette ends" in n for n in notes(fog)) == told
