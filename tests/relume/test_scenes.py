"""The example scenes: each checks, says what to look for, and renders."""

from pathlib import Path

import numpy as np
import pytest

import relume
from relume.checking import check_file

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.txt"))
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
