"""Checks of several values together, or of values with their meaning."""

import pytest

from relume.translator import read_text
from relume.translator.checks import check
from relume.translator.diagnostics import SceneError
from relume.translator.document import Document
from relume.translator.objects import SceneObject
from relume.translator.shapes import Disk

BALL = "OBJECT\nsphere 0 0 0 1\n"


def problem(text):
    with pytest.raises(SceneError) as caught:
        read_text(text, environ={})
    (found,) = caught.value.problems
    return found.line, found.kind, found.message


@pytest.mark.parametrize(
    ("text", "line", "kind", "message"),
    [
        ("IMAGE\n16000 16000\n", 2, "range", "IMAGE of 16000 x 16000 pixels"),
        ("SAMPLING\n2^30\nSUPERSAMPLING\n2^6\n", 2, "range", "samples a pixel"),
        ("metropolisTransport\n1\nmutation\n1e20\n", 4, "range", "mutations a pixel: expected"),
        ("CAMERA_DIR\n0 0 1e-200\n", 2, "value", "too near or too far to tell"),
        ("CAMERA_POS\n0 0 0\nTARGET_POS\n0 0 1e-200\n", 4, "value", "too near or too far"),
        ("CAMERA_UPVEC\n0 0 1e-200\n", 2, "value", "CAMERA_UPVEC is too short"),
        ("CAMERA_DIR\n0 0 -1\nCAMERA_MATRIX\nrotation 90 0 0\n", 4, "value", "0 1 0 unless"),
        ("CAMERA_DIR\n0 0 -1\nCAMERA_UPVEC\n0 0 5\n", 4, "value", "parallel to the viewing"),
        ("CAMERA_DIR\n0 -3 0\n", 2, "value", "parallel to the viewing"),
        ("CAMERA_POS\n0 0 0\nTARGET_POS\n0 7 0\n", 4, "value", "parallel to the viewing"),
        ("CAMERA_UPVEC\n0 0.04 1\nCAMERA_MATRIX\ntranslate 0 0 9\n", 2, "value", "parallel"),
        ("LENS\n2 0\n", 2, "range", "focuses at distance 0"),
        ("OBJECT\nplane 0 0 0\nnormal 0 0 0\n", 1, "value", "a normal of length 0"),
        ("OBJECT\ndisk 0 0 0 1\nnormal 0 0 0\n", 1, "value", "a normal of length 0"),
        ("OBJECT\ninfinity_light 0 0 0\n", 1, "value", "a direction of length 0"),
        ("OBJECT\nuvplane 0 0 0\nU 1 1 0\nV -2 -2 0\n", 1, "value", "edges that span no area"),
        ("OBJECT\nuvplane 0 0 0\nU 0 0 0\nV 0 0 1\n", 1, "value", "edges that span no area"),
        (BALL + "scale 1 0 1\n", 1, "value", "scale by 0"),
        (BALL + "spot_light 1\nspot_light_angle 100 30\n", 4, "range", "0 < w <= 90"),
        (BALL + "spot_light 1\nspot_light_dir 0 1e-200 0\n", 4, "value", "is too short"),
    ],
)
def test_problems(text, line, kind, message):
    """Each is one error at the line of the value (0 where the file does not set it)."""
    found = problem(text)
    assert found[:2] == (line, kind)
    assert message in found[2]


@pytest.mark.parametrize(
    "text",
    [
        "IMAGE\n8192 8192\n",
        "CAMERA_DIR\n0 0 -1e-100\n",
        "CAMERA_DIR\n0 0 0\n",
        "CAMERA_POS\n1 2 3\nTARGET_POS\n1 2 3\n",
        "CAMERA_UPVEC\n0 0 0\n",
        "CAMERA_DIR\n0 -1 0\nCAMERA_MATRIX\nrotation 45 0 0\n",
        BALL + "spot_light 1\nspot_light_angle 20 30\n",
        BALL + "spot_light 1\nspot_light_dir 0 0 0\n",
        "CAMERA_DIR\n0 0 -1\nCAMERA_UPVEC\n0 1e-6 5\n",
        "CAMERA_DIR\n0 0 0\nTARGET_POS\n0 1 2\n",  # the target replaces the direction
        BALL + "spot_light_angle 20 30\n",  # it is no spot light
        BALL + "scale -1 1 1\n",
        "OBJECT\nuvplane 0 0 0\nU 1e-100 0 0\nV 0 1e30 0\n",
    ],
)
def test_what_is_allowed(text):
    """Unusual, but with a meaning."""
    read_text(text, environ={})


def test_documents_made_in_python():
    """A document without lines is checked as well; its problems have no line."""
    assert check(Document()) == []
    document = Document(image=(10**9, 1), objects=[SceneObject(Disk((0, 0, 0), 1, (0, 0, 0)))])
    assert [found.line for found in check(document)] == [0, 0]
