"""Stand-ins for missing meshes: where they are, and that they are told."""

import numpy as np
import pytest

import relume
from relume.checking import check_file
from relume.loading import open_session, translated
from relume.options import RenderOptions
from relume.translator import translate
from relume.translator.diagnostics import SceneError

SCENE = """\
IMAGE
32 24
SAMPLING
4
SUPERSAMPLING
1
CAMERA_POS
{camera}
TARGET_POS
{target}
SCREEN
20 20 40
BACKGROUND
0.2 0.3 0.9

OBJECT
objfile {file}
{transforms}
color 0.9 0.5 0.1
reflection diffuse
"""


@pytest.fixture
def scene(tmp_path):
    """A function that writes a scene with a missing mesh."""

    def write(file="lost/teapot.obj", camera="0 3 14", target="0 2 0", transforms=""):
        path = tmp_path / "scene.txt"
        text = SCENE.format(file=file, camera=camera, target=target, transforms=transforms)
        path.write_text(text)
        return path

    return write


def share(path):
    """Share of the picture that is not the background."""
    picture = relume.render(path, stand_ins=True, spp=1, seed=1)
    return float((np.abs(picture - [0.2, 0.3, 0.9]).max(axis=2) > 1e-3).mean())


def corners(path):
    """Vertices of the mesh in the world: (n, 3)."""
    options = RenderOptions(stand_ins=True)
    with open_session(translated(path, options), options) as session:
        boxes = [shape.bbox() for shape in session.scene.shapes()]
        return np.array([[*box.min] for box in boxes] + [[*box.max] for box in boxes])


@pytest.mark.parametrize(
    "transforms",
    [
        "",
        "scale 400 400 400\ntranslate 1 2 0",
        "scale 1e-3 1e-3 2e-3\nrotation 10 200 30",
        "translate 5000 0 0",
        "scale 55 55 55\ntranslate 0 -235 20\nrotation 0 130 0",
    ],
)
def test_a_block_is_seen_whatever_the_mesh_was_transformed_by(scene, transforms):
    """It undoes the transformation: it fills about the same part of the picture."""
    assert 0.03 < share(scene(transforms=transforms)) < 0.4


def test_a_block_stands_where_the_mesh_has_its_origin_if_that_is_seen(scene):
    found = corners(scene(transforms="scale 9 9 9\ntranslate 1 2 3"))
    assert found.mean(axis=0) == pytest.approx([1, 2, 3], abs=1e-3)


@pytest.mark.parametrize("camera, target", [("0 0 0", "1 0 0"), ("-90 55 210", "0 20 -100")])
@pytest.mark.parametrize("file", ["sponza2.obj", "a\\MuseumHall.obj", "San-Miguel/x.obj"])
def test_a_hall_surrounds_the_camera(scene, camera, target, file):
    path = scene(file=file, camera=camera, target=target, transforms="scale 3 3 3")
    found, at = corners(path), np.array(camera.split(), float)
    assert (found.min(axis=0) < at)[[0, 2]].all() and (at < found.max(axis=0))[[0, 2]].all()
    assert share(path) > 0.5


def test_they_are_told_and_only_shown_if_asked_for(scene):
    path = scene()
    with pytest.raises(SceneError, match=r"--stand-ins shows a block or a hall instead"):
        translate(relume.read(path))
    made = translate(relume.read(path), stand_ins=True)
    assert made.stand_ins == ("lost/teapot.obj",)
    result = check_file(path, stand_ins=True)
    (line,) = (line for line in result["lines"] if line["codes"] == ["stand-in"])
    assert line["note"] == "no such file: a block is shown instead"


def test_files_that_are_there_are_shown_themselves(scene, tmp_path):
    path = scene(file="tri.obj")
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert translate(relume.read(path), stand_ins=True).stand_ins == ()
