"""Notes where media are denser than single precision and roulette allow."""

import pytest

from relume.translator import read_text, translate
from relume.translator.dense_media import why_followed
from relume.translator.media import HomogeneousMedium

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
    plan = translate(read_text(f"CAMERA_POS\n0 0 9\n{fog}{BALL}{milk}", environ={})).plan
    assert plan.integrator == "randomwalk"


def in_fog(s, a=0, depth=8, g=0, things=BALL):
    fog = f"participatingMedia\n1\nSCATTERING\n0\n{s} {s} {s}\nABSORBING\n0\n{a} {a} {a}\n"
    head = f"CAMERA_POS\n0 0 9\nDEPTH\n{depth}\n{fog}PAHASE {g} {g} {g}\n\n"
    return translate(read_text(head + things, environ={}))


@pytest.mark.parametrize(
    ("s", "a", "depth", "kind"),
    [(0.1, 0, 8, "volpath"), (10, 0, 8, "randomwalk"), (10, 0, 1e6, "volpath"),
     (10, 10, 8, "volpath"), (1, 0.01, 8, "randomwalk")],
)  # fmt: skip
def test_walks_longer_than_depth_are_followed_and_told(s, a, depth, kind):
    """Of walks that DEPTH does not cover `volpath` loses what they carry."""
    found = in_fog(s, a, depth)
    told = [r.note for r in found.document.lines.all if "walks of about" in (r.note or "")]
    assert found.plan.integrator == kind
    assert bool(told) == (kind == "randomwalk")


def test_how_many_steps_are_told():
    """Balls are crossed in one step but where g differs from channel to channel."""
    fog = "participatingMedia\n1\nSCATTERING\n0\n100 100 100\nPAHASE {}\n\n" + BALL
    assert any("up to about 2e+03 steps" in n for n in notes(fog.format("0 0 0")))
    assert not any("up to about 2e+03 steps" in n for n in notes(fog.format("0.1 0 0")))


LAMP = "OBJECT\nsphere 0 3 0 {r}\nemission 9 9 9\ncolor 0 0 0\nreflection diffuse\n\n"


@pytest.mark.parametrize(
    ("r", "s", "kind"), [(0.01, 0.05, "randomwalk"), (1, 0.05, "volpath"), (0.01, 1e-4, "volpath")]
)
def test_small_lamps_in_a_medium(r, s, kind):
    assert in_fog(s, things=LAMP.format(r=r) + BALL).plan.integrator == kind


@pytest.mark.parametrize(
    ("s", "a", "g", "r", "why"),
    [(4.75, 0, 0, 1, ""), (4.89, 0, 0, 1, "walks longer than DEPTH"),
     (10, 0.38, 0, 1, ""), (10, 0.36, 0, 1, "walks longer than DEPTH"),
     (9, 0, 0.77, 1, ""), (9, 0, 0.75, 1, "walks longer than DEPTH"),
     (1, 0, 0, 0.0205, ""), (1, 0, 0, 0.0195, "small lamps in a medium"),
     (0.0490, 0, 0, 0.001, ""), (0.0510, 0, 0, 0.001, "small lamps in a medium")],
)  # fmt: skip
def test_where_walks_begin_to_be_followed(s, a, g, r, why):
    """The limits, from 2 to 4 % below and above them: 28 scatterings at DEPTH 8, a lamp of 1/100 of
    the medium's radius (2 for lamps, else 1), an optical depth of 0.1."""
    lamp = {"type": "sphere", "radius": r, "emitter": {"type": "area"}}
    fog = HomogeneousMedium((s,) * 3, (a,) * 3, (g,) * 3)
    assert why_followed(fog, 2.0 if r < 1 else 1.0, 8, [lamp]) == why


@pytest.mark.parametrize(("s", "g", "why"), [(0.98, 0, False), (1.02, 0, True), (9, 0.9, False)])
def test_spots_are_followed_in_haze(s, g, why):
    """From a reduced optical depth of 1 on; DEPTH covers all walks."""
    fog = HomogeneousMedium((s,) * 3, (0,) * 3, (g,) * 3)
    assert bool(why_followed(fog, 1.0, 100, [{"type": "falloffspot"}])) == why


@pytest.mark.false_alarms(1e-3)
def test_a_plane_without_end_in_fog_loses_nothing(measure, view, agrees):
    """Nothing absorbs, and the sky of 1 is on all sides. Faces of the plane are as large as far."""
    white = "color 1 1 1\nreflection diffuse\n\n"
    plane = f"OBJECT\nplane 0 0 0\nnormal 0 1 0\n{white}OBJECT\nsphere 0 1 0 1\n{white}"
    fog = "participatingMedia\n1\nSCATTERING\n0\n0.5 0.5 0.5\n\nBACKGROUND\n1 1 1\n\n"
    text = view((0, 3, 8), (0, 1, 0)) + fog + plane
    assert translate(read_text(text, environ={})).plan.integrator == "randomwalk"
    agrees(measure(text, spp=128), 1)
