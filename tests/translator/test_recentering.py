"""Scenes moved to where single precision serves: the same picture wherever they were written."""

import mitsuba as mi
import numpy as np
import pytest

import relume
from relume.translator import read_text, translate
from relume.translator.recentering import SIZE, recentering

SCENE = """\
IMAGE
24 16
SAMPLING
64
SUPERSAMPLING
1
CAMERA_POS
{camera}
CAMERA_DIR
0 -2 -11
CAMERA_MATRIX
translate {shift}
rotation 0 10 0

LENS
{lens}
BACKGROUND
0.1 0.1 0.2

OBJECT
sphere -1.5 1 0 1
color 0.9 0.5 0.5
reflection diffuse
{transform}

OBJECT
disk 1.5 0.5 0 1
normal 0.1 1 0.2
color 0.2 0.9 0.2
reflection diffuse
{transform}

OBJECT
plane 0 0 0
normal 0 1 0
color 0.5 0.5 0.5
reflection diffuse
{transform}

OBJECT
sphere 0 4 1 0.2
emission 9 8 7
spot_light 1
spot_light_dir 0.1 -1 0
spot_light_angle 40 20
spot_attenuation {attenuation}
{transform}

OBJECT
uvplane -1 3 -1
U 1 0 0
V 0 0 1
emission 2 2 1
parallel_light 1
parallel_light_dir 0.2 -1 0
{transform}

OBJECT
infinity_light 0.3 -1 -0.5
emission 0.2 0.2 0.2
"""


def scene(scale=1.0, offset=(0.0, 0.0, 0.0)):
    """The scene at another scale and place. The camera's own transform comes after: its lines turn
    the direction alone and translate the position."""

    def numbers(values):
        return " ".join(f"{x:.17g}" for x in values)

    return SCENE.format(
        camera=numbers([0, 3 * scale, 11 * scale]),
        shift=numbers(offset),
        lens=numbers([0.05 * scale, 10 * scale]),
        attenuation=numbers([0.5, 0.3 / scale, 0.2 / scale**2]),
        transform=f"scale {scale:.17g} {scale:.17g} {scale:.17g}\ntranslate {numbers(offset)}",
    ).replace("rotation 0 10 0\n", "" if any(offset) else "rotation 0 10 0\n")


def picture(text):
    return relume.render(read_text(text, environ={}), seed=1)


@pytest.mark.parametrize("scale", [1e-6, 1e-3])
def test_a_tiny_scene_looks_like_a_large_one(scale):
    """The same random numbers: pixels agree but where rounding sends a path another way. The spot
    has all three attenuations, the camera a lens, and the beam and the infinity light an
    irradiance: each has its own rule under a change of scale."""
    large, tiny = picture(scene()), picture(scene(scale))
    assert large.std() > 0.1
    assert np.isclose(tiny, large, rtol=1e-3).mean() > 0.97
    assert tiny.mean() == pytest.approx(large.mean(), rel=2e-3)


def test_a_scene_far_away_looks_like_one_here():
    """A million away, where the numbers of single precision are 1/16 apart."""
    here = scene().replace("rotation 0 10 0\n", "")
    far = scene(offset=(1e6, -1e6, 5e5))
    assert np.isclose(picture(far), picture(here), rtol=1e-3).mean() > 0.97


def test_the_report_says_so():
    """At the first object, once."""
    translation = translate(read_text(scene(1e-5), environ={}))
    notes = [r.note for r in translation.document.lines.all if "rays keep" in r.note]
    assert len(notes) == 1
    assert "times as large: there rays keep their digits" in notes[0]


def test_ordinary_scenes_stay_where_they_are():
    translation = translate(read_text(scene(), environ={}))
    entries = [e for e in translation.scene.values() if isinstance(e, dict)]
    ball = next(e for e in entries if e["type"] == "sphere")
    assert ball["center"] == [-1.5, 1.0, 0.0] and ball["radius"] == 1.0


def test_when_a_scene_is_moved():
    """Where its place is ten sizes from the origin, or its size a tenth of a unit; enlarged by a
    power of ten, and only if it is small."""
    assert recentering(np.zeros(3), 1.0) is None
    assert recentering(np.array([100.0, 0, 0]), 15.0) is None
    assert recentering(np.zeros(3), 0.0) is None
    far = recentering(np.array([1e6, 0, 0]), 10.0)
    assert far.scale == 1 and tuple(far.center) == (1e6, 0, 0)
    assert far.note().text == "rendered about (1e+06, 0, 0): there rays keep their digits"
    tiny = recentering(np.array([1.0, 0, 0]), 3e-4)
    assert tiny.scale == 1e6 and SIZE / 4 < tiny.scale * 3e-4 < 4 * SIZE


def entry(value, kind):
    """The first dictionary of a type in a nested one."""
    if not isinstance(value, dict):
        return None
    if value.get("type") == kind:
        return value
    return next((found for x in value.values() if (found := entry(x, kind))), None)


@pytest.mark.parametrize(
    "kind, place, lines",
    [("homogeneous", "OBJECT\nsphere", "participatingMedia\n1\nSCATTERING\n2\n2 2 2\n"
                                      "ABSORBING\n1\n1 1 1\n\nOBJECT\nsphere"),
     ("subsurface", "color 0.9 0.5 0.5\nreflection diffuse\n",
      "color 1 1 1\nreflection reflection\nreflection Subsurface_Scattering\n"
      "SCATTERING\n2\n2 2 2\nABSORBING\n1\n1 1 1\nBSSRDF\n1\nMATERIAL_R_MAX\n1\n")],
)  # fmt: skip
def test_coefficients_follow_the_scale(kind, place, lines):
    """Per length: a medium ten times as large is ten times as thin, and light enters from ten
    times as far."""
    written, moved = (
        translate(read_text(scene(size).replace(place, lines, 1), environ={}))
        for size in (1.0, 1e-4)
    )
    scale = moved.document.lens[0] / (1e-4 * 0.05)
    assert scale > 1
    one, other = entry(written.scene, kind), entry(moved.scene, kind)
    assert other["scale"] * scale == pytest.approx(one["scale"])
    if kind == "subsurface":
        assert other["r_max"] == pytest.approx(one["r_max"] * scale)


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_meshes_are_moved_too(offset, tmp_path):
    """A scene of a mesh alone, whose size is in its file: bounds of what Mitsuba gets."""
    (tmp_path / "tiny.obj").write_text("v 0 0 0\nv 1e-3 0 0\nv 0 1e-3 0\nf 1 2 3\n")
    text = (
        f"CAMERA_POS\n{offset} 0 2e-3\nTARGET_POS\n{offset} 0 0\n\nOBJECT\nobjfile tiny.obj\n"
        f"color 1 1 1\nreflection diffuse\ntranslate {offset} 0 0\n"
    )
    translation = translate(read_text(text, environ={}), asset_path=(tmp_path,))
    mi.set_variant("llvm_ad_rgb")
    box = mi.load_dict(translation.dictionary()).bbox()
    assert np.abs([*box.min, *box.max]).max() < 2 * SIZE
    assert max(box.extents()) > SIZE / 20
