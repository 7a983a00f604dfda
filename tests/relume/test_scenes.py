"""The example scenes: each checks, says what to look for, renders, and looks as its reference."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import relume
from relume.checking import check_file
from studies import regression

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.txt"))
REFERENCES = Path(__file__).parents[1] / "references"
CHECKED = [scene for scene in SCENES if scene.stem not in regression.FOUND_BY_HITS]
UNSUPPORTED = {}
"""Scenes of features that are not rendered yet."""


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_scene_checks(scene):
    report = check_file(scene, environ={})
    assert report["errors"] == []
    assert report["status"] == ("unsupported" if scene.stem in UNSUPPORTED else "ok")


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_scene_says_what_to_look_for_and_names_its_picture(scene):
    lines = scene.read_text(encoding="utf-8").splitlines()
    comment = [line for line in lines[: lines.index("")] if line.startswith("# ")]
    assert any("Look for:" in line for line in comment) and len(lines[0]) > 10
    assert relume.read(scene, {}).output == f"{scene.stem}.bmp"


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_scene_is_small(scene):
    """The pictures are looked at often: at most 320x240, and few enough samples."""
    plan = check_file(scene, environ={})["plan"]
    assert plan["width"] * plan["height"] <= 320 * 240
    assert plan["width"] * plan["height"] * plan["spp"] < 25e6


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_scene_renders(scene):
    """Every pixel is finite; RGB pictures hold no negative values, spectral ones may (colours that
    RGB cannot hold); no picture is black or white all over."""
    document = relume.read(scene, {})
    width, height = document.image
    image = relume.render(document, size=(width // 8, height // 8), spp=16)
    assert np.isfinite(image).all()
    assert image.min() >= 0 or scene.stem == "prism"
    assert 0.01 < np.clip(image, 0, 1).mean() < 0.95 and image.std() > 0.01


@cache
def checked(scene):
    """The check of a scene against its stored reference."""
    reference = REFERENCES / f"{scene.stem}.exr"
    try:
        return regression.check(scene, reference)
    except ValueError as error:
        pytest.fail(f"{error}; it is made by: make study-references SCENE={scene.name}")


@pytest.mark.parametrize("scene", CHECKED, ids=lambda path: path.stem)
def test_scene_looks_as_its_reference(scene):
    """Whole picture, blocks and pixels against far more samples of another seed.

    The seed is fixed. With other seeds an unchanged scene would fail in 0.04 % of cases, all of
    them together in 1 % (`regression.RATE`); tests/references/README.md tells what each sees.
    """
    check = checked(scene)
    assert check.side.not_finite == 0
    for name, level in check.scores().items():
        place = level.place(np.abs(level.z))
        assert not level.differ, f"{name} differs at {place}: z = {level.z[place]:+.1f}"


@pytest.mark.parametrize("scene", CHECKED, ids=lambda path: path.stem)
def test_an_error_of_the_picture_would_be_seen(scene):
    """An error of 2 % in the mean of a channel is found with probability 0.9, or 3 % where that
    would take more samples than any check gets; the noise of the check itself blurs the figure."""
    check = checked(scene)
    most = check.about["check_spp"] == regression.SAMPLES[-1]
    assert check.smallest_errors()[0].max() < (0.03 if most else 1.25 * regression.AIM)


def test_references_are_small_and_of_scenes():
    files = list(REFERENCES.glob("*.exr"))
    assert {file.stem for file in files} <= {scene.stem for scene in SCENES}
    assert sum(file.stat().st_size for file in files) < 2e6
