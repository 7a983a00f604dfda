"""Notes where glass is thinner than rays of single precision can tell."""

import mitsuba as mi
import pytest

from relume.translator import read_text, translate
from relume.translator.precision import RAY_OFFSET

GLASS = "color 1 1 1\nreflection reflection\n\n"


def notes(objects, words="rays miss"):
    """Notes with some words, on thin glass, of a scene about the origin, of size 10."""
    ball = "OBJECT\nsphere 0 0 0 5\ncolor 1 1 1\nreflection diffuse\n\n"
    head = "CAMERA_POS\n0 0 4\nTARGET_POS\n0 0 0\nCAMERA_UPVEC\n0 1 0\n\n"
    document = translate(read_text(head + ball + objects, environ={})).document
    return [r.note for r in document.lines.all if words in r.note]


def sheet(gap, shift=0.0):
    faces = (f"OBJECT\nuvplane {shift} {y} 0\nU 0 0 2\nV 2 0 0\n{GLASS}" for y in (0, -gap))
    return "".join(faces)


def test_the_offset_is_that_of_mitsuba():
    mi.set_variant("llvm_ad_rgb")
    assert pytest.approx(mi.math.RayEpsilon, rel=1e-3) == RAY_OFFSET


@pytest.mark.parametrize("thickness, told", [(1e-6, True), (1e-4, True), (1e-3, False)])
def test_thin_sheets_of_glass(thickness, told):
    """Rays start 1.8e-4 off a sheet whose middle is one unit from the origin."""
    assert bool(notes(sheet(thickness))) == told
    if told:
        assert "rays miss what is nearer than 0.00018" in notes(sheet(thickness))[0]


def test_the_offset_grows_with_the_place():
    assert not notes(sheet(1e-3)) and notes(sheet(1e-3, shift=30))


@pytest.mark.parametrize("radius, told", [(2e-5, True), (1e-3, False)])
def test_tiny_glass_balls(radius, told):
    assert bool(notes(f"OBJECT\nsphere 0.5 0 0 {radius}\n{GLASS}")) == told


def test_faces_across_and_other_materials_are_not_meant():
    level, upright = (f"OBJECT\nplane 0 0 0\nnormal {n}\n{GLASS}" for n in ("0 1 0", "1 0 0"))
    assert not notes(level + upright)
    assert not notes(sheet(1e-6).replace("reflection reflection", "reflection diffuse"))


LAMP = "emission 1 1 1\ncolor 0 0 0\nreflection diffuse\n\n"


@pytest.mark.parametrize(
    "glass, radius, told",
    [
        ("sphere 0 0 0 1", 0.0899, True),  # 10 from the centre, 9 from the surface
        ("sphere 0 0 0 1", 0.0902, False),
        ("plane 0 2 0\nnormal 0 1 0", 0.0799, True),
        ("plane 0 2 0\nnormal 0 1 0", 0.0802, False),
        ("sphere 0 10 0 2", 0.01, False),  # the lamp is inside
    ],
)
def test_small_lamps_behind_glass(glass, radius, told):
    """A lamp is told where half its angle from the nearest glass has a sine below 0.01."""
    lamp = f"OBJECT\nsphere 0 10 0 {radius}\n{LAMP}"
    found = notes(f"OBJECT\n{glass}\n{GLASS}" + lamp, "glass sees this lamp")
    assert bool(found) == told
    if told:
        assert "0.02 rad: one path in 1e+04" in found[0]


def test_small_lamps_without_refracting_glass_are_not_meant():
    lamp = f"OBJECT\nsphere 0 10 0 0.001\n{LAMP}"
    for kind in ("reflection diffuse", "reflection reflection\nrefractive_index 1"):
        glass = "OBJECT\nsphere 0 0 0 1\n" + GLASS.replace("reflection reflection", kind)
        assert not notes(glass + lamp, "glass sees this lamp")
