"""Layers: albedo, normal, depth, position and object of what is seen."""

import math

import numpy as np
import OpenEXR
import pytest
from click.testing import CliRunner

from relume import aovs, loading, metadata
from relume.cli import main
from relume.options import RenderOptions

SCENE = """\
IMAGE
32 24
SAMPLING
4
SUPERSAMPLING
1
CAMERA_POS
0 0 10
TARGET_POS
0 0 0
SCREEN
32 24 40
BACKGROUND
0.2 0.4 3

OBJECT
plane 0 0 -5
normal 0 0 1
color 0.7 0.5 0.3
reflection diffuse
"""
BALL = "\nOBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection {kind}\n{more}\n"


@pytest.fixture
def layers(tmp_path):
    """A function that renders layers of a scene: the planes, stacked by layer."""

    def render(objects="", names=tuple(aovs.LAYERS), text=SCENE, **options):
        path = tmp_path / "scene.txt"
        path.write_text(text + objects)
        options = RenderOptions(**options)
        with loading.open_session(loading.translated(path, options), options) as session:
            planes = aovs.render_layers(session, names)
        return {
            name: np.stack([planes[f"{name}.{channel}"] for channel in aovs.LAYERS[name]], -1)
            for name in names
        }

    return render


def test_a_wall_is_seen_as_it_is(layers):
    """Straight ahead of the camera at z = 10: colour, normal and place of its plane, by hand."""
    found = layers()
    middle = found["position"][12, 16]
    assert found["albedo"] == pytest.approx(np.broadcast_to([0.7, 0.5, 0.3], (24, 32, 3)), rel=1e-5)
    assert found["normal"] == pytest.approx(np.broadcast_to([0, 0, 1], (24, 32, 3)), abs=1e-5)
    assert found["position"][..., 2] == pytest.approx(-5, abs=1e-4)
    assert found["depth"][12, 16, 0] == pytest.approx(math.dist(middle, (0, 0, 10)), rel=1e-5)
    assert found["position"][11, 15] + middle == pytest.approx([0, 0, -10], abs=1e-5), "its middle"
    assert (found["object"] == 1).all()
    turned = layers(text=SCENE.replace("normal 0 0 1", "normal 0 0 -1"))
    assert np.array_equal(turned["normal"], found["normal"]), "towards the camera"


def test_layers_are_the_same_in_many_launches(layers, monkeypatch):
    """One ray goes through each pixel of these: of five rows of pixels at a time, too."""
    names, ball = ("depth", "position", "object"), BALL.format(kind="diffuse", more="")
    whole = layers(ball, names)
    monkeypatch.setattr(aovs, "SAMPLES_PER_LAUNCH", 5 * 32)
    parts = layers(ball, names)
    assert all(np.array_equal(parts[name], whole[name]) for name in names)


def test_guides_behind_coloured_glass_have_its_colour_twice(layers):
    """Light crosses the surface of the ball on its way in and out."""
    found = layers(BALL.format(kind="reflection", more="").replace("1 1 1\n", "0.5 0.8 1\n"))
    seen = found["denoising_albedo"][11:13, 15:17].mean(axis=(0, 1))
    assert seen == pytest.approx(np.array([0.7, 0.5, 0.3]) * [0.5**2, 0.8**2, 1], abs=0.08)


@pytest.mark.parametrize("kind", ["specular", "reflection"])
def test_guides_follow_mirrors_and_glass_and_albedo_does_not(layers, kind):
    """In the middle of the ball the sky is seen (mirror), or almost the wall alone (glass)."""
    found = layers(BALL.format(kind=kind, more=""))
    ball = np.s_[11:13, 15:17]
    assert (found["object"][ball] == 2).all() and found["depth"][12, 16, 0] < 9.1
    assert found["albedo"][ball] == pytest.approx(1, abs=0.02)
    assert found["normal"][ball][..., 2].min() > 0.95
    wall = found["denoising_albedo"][0, 0]
    assert wall == pytest.approx([0.7, 0.5, 0.3], rel=1e-5)
    if kind == "specular":
        assert found["denoising_albedo"][ball] == pytest.approx(
            np.broadcast_to([0.2, 0.4, 1], (2, 2, 3)), rel=1e-5
        ), "the sky, up to white"
        assert np.abs(found["denoising_normal"][ball]).max() == 0
    else:
        seen = found["denoising_albedo"][ball].mean(axis=(0, 1))
        assert seen == pytest.approx([0.7, 0.5, 0.3], abs=0.08)
        assert found["denoising_normal"][ball][..., 2].mean() > 0.85


def test_nothing_is_far_away(layers):
    found = layers(
        text=SCENE.partition("\nOBJECT")[0], objects=BALL.format(kind="diffuse", more="")
    )
    assert (found["depth"][0, 0] == aovs.NOWHERE) and (found["object"][0, 0] == 0)
    assert found["albedo"][0, 0] == pytest.approx([0.2, 0.4, 1], rel=1e-5)


def test_a_picture_has_its_layers_by_the_names_that_others_read(room, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["render", str(room()), "-o", "a.exr", "--aov", "normal,depth,object"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    with OpenEXR.File("a.exr", separate_channels=True) as file:
        channels = {name: channel.pixels.copy() for name, channel in file.channels().items()}
    layers = {"normal.X", "normal.Y", "normal.Z", "depth.Z", "object.X"}
    assert set(channels) == {"R", "G", "B", *layers}
    names = metadata.of_file("a.exr")[aovs.OBJECTS].splitlines()
    assert len(names) == 4 and all(line.split()[1].startswith("object_") for line in names)
    assert channels["object.X"].max() <= 4 and (channels["object.X"] % 1 == 0).all()
    CliRunner().invoke(main, [*words[:3], "b.exr"])
    with OpenEXR.File("b.exr", separate_channels=True) as file:
        for name in "RGB":
            assert np.array_equal(file.channels()[name].pixels, channels[name]), "the same picture"


@pytest.mark.parametrize(
    "words, status, said",
    [
        (("-o", "a.png", "--aov", "depth"), 1, "layers are for pictures in OpenEXR"),
        (("-o", "a.exr", "--aov", "depht"), 2, "no layer 'depht'"),
        (("-o", "a.exr", "--aov", "depth", "--variant", "scalar_rgb"), 1, "renders no layers"),
    ],
)
def test_what_cannot_have_layers_says_so(room, tmp_path, monkeypatch, words, status, said):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["render", str(room()), *words])
    assert result.exit_code == status and said in result.stderr
