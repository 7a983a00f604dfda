"""Parsing of `OBJECT` blocks: shapes, attributes, and the words of real files (section 1.5)."""

import pytest

from relume.translator.shapes import Annulus, Disk, InfinityLight, MeshFile, Plane, Sphere, UVPlane
from tests.translator.reading import BALL, ball, error, outcomes, scene

# -- words of real files (1.5) --------------------------------------------------------------------


def test_normals_under_any_word():
    """The line below `plane`, `disk` and `disk2` may start with any word, such as `nromal`."""
    for word in ("normal", "nromal", "n"):
        (block,) = scene(f"OBJECT\ndisk 1 2 3 4\n{word} 0 2 0\n").objects
        assert block.shape == Disk((1, 2, 3), 4, (0, 2, 0))
    (block,) = scene("OBJECT\nplane 1 2 3\nnormal 0 2 0\n").objects
    assert block.shape == Plane((1, 2, 3), (0, 2, 0))
    (block,) = scene("OBJECT\ndisk2 1 2 3 5 4\nnormal 0 2 0\n").objects
    assert block.shape == Annulus((1, 2, 3), 5, 4, (0, 2, 0))


def test_a_forgotten_normal_is_an_error():
    """An attribute where the normal must stand would be swallowed by the program."""
    line, column, _, message = error("OBJECT\nplane 0 0 0\ncolor 1 1 1\n")
    assert (line, column) == (3, 1)
    assert "expects a line 'normal x y z'" in message


@pytest.mark.parametrize("order", [("U 1 0 0", "V 0 0 1"), ("V 0 0 1", "U 1 0 0")])
def test_edges_in_either_order(order):
    """The first letter decides."""
    (block,) = scene("OBJECT\nuvplane 0 0 0\n" + "\n".join(order)).objects
    assert block.shape == UVPlane((0, 0, 0), (1, 0, 0), (0, 0, 1))


def test_a_uvplane_without_edges_is_left_out():
    """One real file: the block has no shape, its lines are accounted for, nothing else is lost."""
    text = "OBJECT\nuvplane 0 0 0\nemission 1 1 1\ncolor 0 0 0\n\n" + BALL
    assert len(scene(text).objects) == 1
    report = outcomes(text)
    assert [report[line][1] for line in (1, 2, 3, 4)] == ["ignored"] * 4
    assert "without a usable shape" in report[1][2]
    assert "uvplane expects a line 'U x y z'" in error("OBJECT\nuvplane 0 0 0\nU 1 0 0\n")[3]


def test_anything_that_starts_like_specular():
    """The program compares six letters."""
    for word in ("specular", "specul", "specula", "specularity"):
        assert ball(f"{word} 1 2 3\n").specular == (1, 2, 3)


@pytest.mark.parametrize(
    ("line", "field", "value"),
    [("circle_map 1", "hemisphere_map", True), ("hemisphere_map 1", "hemisphere_map", True),
     ("normal 0 1 0", "normal", 0), ("normal -1", "normal", -1), ("normal -1.0", "normal", -1)],
)
def test_old_words(line, field, value):
    """Older names, and `normal` with a vector, of which the program reads the first integer."""
    assert getattr(ball(line + "\n"), field) == value


@pytest.mark.parametrize("line", ["coef 2", "direct_normal 0 -1 0", "texture_coef 0.5"])
def test_words_without_effect(line):
    """Noted and passed over, as in the program."""
    assert ball(line + "\ncolor 1 1 1\n").color == (1, 1, 1)
    assert outcomes(BALL + line + "\n")[3][1] == "ignored"


def test_an_unknown_shape_of_a_real_file():
    """`diskX` leaves its object out, with a note at every line."""
    text = "OBJECT\ndiskX 0 0 25\ncolor 1 1 1\n"
    assert scene(text).objects == []
    assert {outcome for _, outcome, _ in outcomes(text).values()} == {"ignored"}


def test_bssrdf_takes_one_line():
    """The program throws the line below away."""
    assert ball("BSSRDF\n0\ncolor 1 1 1\n").color == (1, 1, 1)


# -- objects --------------------------------------------------------------------------------------


def test_shapes():
    """The shapes without lines below them."""
    lines = ("objfile a b\\ソ.obj", "infinity_light 0 -2 0", "sphere 0 0 0 -2")
    document = scene("\n\n".join("OBJECT\n" + line for line in lines))
    assert [block.shape for block in document.objects] == [
        MeshFile("a b\\ソ.obj"), InfinityLight((0, -2, 0)), Sphere((0, 0, 0), 2)]
    assert "radius -2 read as 2" in document.objects[2].lines.all[1].note
