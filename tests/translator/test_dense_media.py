"""Notes where media are denser than single precision and roulette allow."""

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
    ("sigma", "rounded"), [(1e5, None), (3.3e5, None), (3.4e5, "0.02"), (1e6, "0.06")]
)
def test_where_coordinates_are_too_coarse(sigma, rounded):
    """The outermost point of a ball is one unit from the origin, known to 2^-24; from 0.02 mean
    free paths on a note says so."""
    found = [n for n in filled(0.9 * sigma, 0.1 * sigma) if "single precision" in n]
    assert bool(found) == bool(rounded)
    if rounded:
        assert f"rounded to {rounded} mean free paths" in found[0]


def test_where_nothing_is_absorbed_rounding_does_not_matter():
    assert not any("single precision" in n for n in filled(1e8, 0))


@pytest.mark.parametrize(("s", "a"), [(100, 0), (1e4, 0), (100, 0.1)])
def test_long_walks_in_an_object_are_followed(s, a):
    assert not any("roulette ends" in n for n in filled(s, a))


def test_long_walks_around_objects_with_an_inside_are_followed():
    """There `randomwalk` renders the medium around all objects, too."""
    fog = "participatingMedia\n1\nSCATTERING\n0\n10 10 10\n\n"
    milk = "reflection Subsurface_Scattering\nBSSRDF\n0\nMATERIAL_SYMBOL\nWholemilk\n"
    assert not any("roulette ends" in n for n in notes(fog + BALL + milk))


@pytest.mark.parametrize(("s", "told"), [("0.1", False), ("10", True)])
def test_long_walks_around_all_objects(s, told):
    fog = f"participatingMedia\n1\nSCATTERING\n0\n{s} {s} {s}\n\n{BALL}"
    assert any("roulette ends" in n for n in notes(fog)) == told
