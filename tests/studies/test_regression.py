"""Scenes against stored references: what is made, what is found, what is refused."""

import numpy as np
import pytest

from relume.session import Session
from relume.workbench import estimate_files
from studies import regression


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A scene of a sky and a floor, and its reference."""
    folder = tmp_path_factory.mktemp("regression")
    scene, path = folder / "floor.txt", folder / "floor.exr"
    scene.write_text(
        "IMAGE\n320 240\nSAMPLING\n4\nSUPERSAMPLING\n1\nDEPTH\n3\nCAMERA_POS\n0 3 14\n"
        "TARGET_POS\n0 2 0\nSCREEN\n20 20 40\nBACKGROUND\n0.4 0.5 0.7\n\n"
        "OBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 0.7 0.6 0.5\nreflection diffuse\n\n"
        "OBJECT\nsphere 0 2 0 2\ncolor 0.2 0.4 0.8\nreflection diffuse\n"
    )
    regression.make(scene, path, spp=32)
    return scene, path


def test_the_file_tells_how_it_was_made(made):
    stored, about = estimate_files.read(made[1])
    assert stored.pixels.mean.shape == (36, 48, 3)
    assert about["scene"] == "floor.txt" and about["method"] == "surfacepath"
    assert (about["check_spp"], about["spp"], about["runs"]) == (4, 32, 32)
    assert about["versions"]["mitsuba"]


@pytest.mark.false_alarms(2 * regression.RATE)
def test_an_unchanged_scene_passes(made, chance):
    for _ in range(2):
        found = regression.check(*made, chance.seed())
        for name, level in found.scores().items():
            chance.scores(level.z, name, of=6)
    assert found.smallest_errors()[0].max() < regression.AIM


@pytest.mark.parametrize("channel", range(3))
def test_a_picture_that_is_2_percent_brighter_fails(made, monkeypatch, channel):
    """The check says that it sees less than that in any channel, with power 0.9; it does."""
    image = Session.image
    factor = np.ones(3)
    factor[channel] = 1 + regression.AIM
    monkeypatch.setattr(Session, "image", lambda session: factor * image(session))
    whole = regression.check(*made).scores()["whole"]
    assert whole.differ and (np.abs(whole.z[0, 0]) > whole.threshold).tolist() == [
        c == channel for c in range(3)
    ]


def test_a_block_that_is_darker_fails(made, monkeypatch):
    """By twice the error that is said to be found there."""
    errors = regression.check(*made).smallest_errors()[1]
    row, column = 7, 5
    assert errors[row, column].max() < 0.2
    image = Session.image

    def changed(session):
        picture = image(session)
        picture[4 * row : 4 * row + 4, 4 * column : 4 * column + 4] *= 1 - 2 * errors[row, column]
        return picture

    monkeypatch.setattr(Session, "image", changed)
    blocks = regression.check(*made).scores()["blocks"]
    assert (np.abs(blocks.z) > blocks.threshold).any(axis=2).sum() == 1
    assert blocks.place(np.abs(blocks.z))[:2] == (row, column)


def test_a_reference_of_another_text_is_refused(made, tmp_path):
    scene = tmp_path / "floor.txt"
    scene.write_text(made[0].read_text().replace("0.2 0.4 0.8", "0.2 0.4 0.7"))
    with pytest.raises(ValueError, match=r"made for another text of .*floor\.txt"):
        regression.check(scene, made[1])
    with pytest.raises(ValueError, match=r"none\.exr: no estimate"):
        regression.check(scene, tmp_path / "none.exr")


def test_small_pictures_keep_the_proportions():
    assert regression.small((320, 240)) == (48, 36)
    assert regression.small((320, 120)) == (68, 25)
    assert regression.small((10, 30)) == (24, 72)
