"""Transforms of objects and of the camera (sections 5.3 and 6.3)."""

from relume.translator import parse
from relume.translator.forms.transforms import Transform
from tests.translator.reading import ball


def test_transforms_keep_their_order():
    """They are applied in the order of the file."""
    assert ball("translate 1 2 3\nscale 2 2 2\nrotation 0 90 0\n").transforms == [
        Transform("translate", (1, 2, 3)),
        Transform("scale", (2, 2, 2)),
        Transform("rotation", (0, 90, 0)),
    ]


def test_the_block_of_the_camera():
    """Up to an empty line; a line that is wrong does not end it."""
    lines = ["CAMERA_MATRIX", "rotation 0 90 0", "scale 1 2", "shear 1 2 3", "translate 1 2 3", ""]
    document, (problem,) = parse(lines, "", {})
    assert (problem.line, problem.column, problem.kind) == (3, 10, "syntax")
    assert document.camera_matrix == [
        Transform("rotation", (0, 90, 0)), Transform("translate", (1, 2, 3))]
    outcomes = [(report.line, report.outcome) for report in document.lines.all]
    assert outcomes == [
        (1, "translated"), (2, "translated"), (4, "ignored"), (5, "translated")]
