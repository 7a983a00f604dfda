"""The passes of a translation: each leaves its inputs alone, so that they can be run again."""

import copy
from pathlib import Path

import pytest

from relume.translator import read, read_text, translate
from relume.translator.assets import Assets
from relume.translator.object_entries import translate_objects
from relume.translator.scene import assembled, placed, translate_surroundings, working_copy

ROOT = Path(__file__).parents[2]
FAR = "CAMERA_POS\n1e6 0 9\nTARGET_POS\n1e6 0 0\n\nOBJECT\nsphere 1e6 0 0 1\n"


def test_placing_leaves_the_document_where_it_is():
    """What is moved is a document of its own; the first line of its objects says so."""
    document = working_copy(read_text(FAR, environ={}), "manual")
    scene = placed(document, "manual", Assets(document).find)
    assert document.camera_pos == (1e6, 0, 9) and not document.objects[0].transforms
    # The middle of the ball and the camera is (1e6, 0, 4).
    assert scene.document.camera_pos == (0, 0, 5)
    assert scene.geometry.camera == pytest.approx([0, 0, 5])
    assert document.objects[0].lines.of("")[0].codes == ("recentred",)


def test_ordinary_documents_are_not_moved():
    document = working_copy(read_text(FAR.replace("1e6", "0"), environ={}), "manual")
    assert placed(document, "manual", Assets(document).find).document is document


@pytest.mark.parametrize("dialect", ["manual", "prender"])
def test_a_working_copy_has_the_defaults_of_its_dialect(dialect):
    """The program limited the luminance where a file is silent; a line that says 0 counts."""
    document = read_text("", environ={})
    limit = {"manual": 0, "prender": 0.025}[dialect]
    assert working_copy(document, dialect).luminance_cutoff == limit
    assert document.luminance_cutoff == 0
    document = read_text("luminance_cutoff\n0\n", environ={})
    assert working_copy(document, dialect).luminance_cutoff == 0


SCENES = ("ambient", "fog", "glass", "milk", "prism", "shadow", "sky", "spot", "sss")
"""Scenes of `scenes/` with lamps, domes, both kinds of media, and glass by wavelength."""


@pytest.mark.parametrize("name", SCENES)
def test_passes_can_be_repeated(name, plain):
    """A pass run twice on the same results gives the same: nothing is kept between the two."""
    document = read(ROOT / "scenes" / f"{name}.txt", environ={})
    whole = translate(document)
    copied = working_copy(document, "manual")
    scene = placed(copied, "manual", Assets(document).find)
    for _ in range(2):
        objects, problems = translate_objects(scene)
        entries = copy.deepcopy(list(objects.entries))
        surroundings = translate_surroundings(scene, objects, problems)
        found = assembled(scene, objects, surroundings)
        assert list(objects.entries) == entries
        assert plain(found.scene) == plain(whole.scene)
        assert found.plan == whole.plan
