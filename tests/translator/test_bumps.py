"""Bump maps: the slope as documented, and to which side the normal turns.

A picture that gets brighter by g bytes with each texel turns the normal by arctan(25.5 g / 255),
against the way in which it brightens (section 11.8: n' = n + (n x V) gx - (n x U) gy, n x V = -U).
Under light from the direction l a Lambert surface then shows rho emission (n' . l).
"""

import math

import numpy as np
import pytest

STEP = 2  # bytes for each texel
TAN = 25.5 * STEP / 255
TILT = math.atan(TAN)
RAMP = np.arange(0, 128) * STEP

U_RAMP = np.broadcast_to(RAMP[None, :, None], (128, 128, 3))
V_RAMP = np.broadcast_to(RAMP[::-1, None, None], (128, 128, 3))  # the top row is v = 1


PANEL = "uvplane -1 -1 0\nU 2 0 0\nV 0 2 0\n"


@pytest.fixture
def shown(view, measure, write_picture):
    """Radiance (channel 0) of a white square in z = 0 under parallel light along `light`."""

    def run(picture, light, surface=PANEL, lines="", at=(0, 0, 0), dialect="manual"):
        write_picture("bump.png", picture)
        text = view((at[0], at[1], 5), at) + f"OBJECT\ninfinity_light {light}\nemission 1 1 1\n"
        text += "color 0 0 0\nreflection diffuse\n\nOBJECT\n" + surface
        text += f"color 1 1 1\nreflection diffuse\n{lines}\n"
        return measure(text, spp=16, runs=2, dialect=dialect).mean[0]

    return run


@pytest.mark.parametrize("picture", [U_RAMP, V_RAMP])
def test_slope(shown, picture):
    """Light along the flat normal: the cosine of the tilt, 1 / sqrt(1 + 0.2²)."""
    assert shown(picture, "0 0 -1", lines="bump_texture bump.png\n") == pytest.approx(
        math.cos(TILT), rel=1e-3
    )


@pytest.mark.parametrize(
    ("picture", "light", "sign"),
    [
        (U_RAMP, "1 0 -1", 1),  # from -X, to which the normal turns
        (U_RAMP, "-1 0 -1", -1),
        (U_RAMP, "0 1 -1", 0),
        (V_RAMP, "0 1 -1", 1),
        (V_RAMP, "0 -1 -1", -1),
        (V_RAMP, "1 0 -1", 0),
    ],
)
def test_direction(shown, picture, light, sign):
    """n' . l = (cos tilt + sign sin tilt) / sqrt(2)."""
    expected = (math.cos(TILT) + sign * math.sin(TILT)) / math.sqrt(2)
    measured = shown(picture, light, lines="bump_texture bump.png\n")
    assert measured == pytest.approx(expected, rel=1e-3)


def test_slope_does_not_depend_on_size(shown):
    """What counts is the step from texel to texel, not how large a texel is."""
    big = "uvplane -10 -10 0\nU 20 0 0\nV 0 20 0\n"
    measured = shown(U_RAMP, "1 0 -1", big, "bump_texture bump.png\n")
    assert measured == pytest.approx(math.cos(TILT - math.pi / 4), rel=1e-3)


@pytest.mark.parametrize(("dialect", "x", "tilted"), [
    ("prender", -0.5, True), ("prender", 0.5, False), ("prender", 1.5, True),
    ("prender", 2.5, False), ("manual", -0.5, True), ("manual", 0.5, False),
])  # fmt: skip
def test_tiles_of_bumps(shown, dialect, x, tilted):
    """In dialect `prender` a bump map lies on a uvplane as a picture does: once to each length."""
    half = np.where(np.arange(128)[None, :, None] < 64, U_RAMP, 128)
    light, lines = "0.70710678 0 -0.70710678", "bump_texture bump.png\n"
    measured = shown(half, light, lines=lines, at=(x, 0, 0), dialect=dialect)
    assert measured == pytest.approx(math.cos(TILT * tilted - math.pi / 4), rel=1e-3)


MESH = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


@pytest.mark.parametrize("mtl", [True, False])
def test_meshes_have_bumps_too(shown, tmp_path, mtl):
    """bump_texture and map_Bump on a mesh (row bump: without effect in the program)."""
    used = "mtllib quad.mtl\nusemtl m\n" if mtl else ""
    (tmp_path / "quad.obj").write_text(f"{used}{MESH}f 1/1 2/2 3/3 4/4\n")
    (tmp_path / "quad.mtl").write_text("newmtl m\nmap_Bump bump.png\nKd 1 1 1\n")
    lines = "" if mtl else "bump_texture bump.png\n"
    measured = shown(U_RAMP, "1 0 -1", "objfile quad.obj\n", lines)
    assert measured == pytest.approx(math.cos(TILT - math.pi / 4), rel=2e-3)
    measured = shown(V_RAMP, "0 1 -1", "objfile quad.obj\n", lines)
    assert measured == pytest.approx(math.cos(TILT - math.pi / 4), rel=2e-3)


def test_bumped_sphere(shown):
    """On a sphere u runs around +Z; a texel is as high as pi R / rows there.

    v grows by 1 / pi for each radian from the pole, so a ramp over v has the slope that it has on a
    plane: 45 degrees from the pole, light along the flat normal shows the cosine of the tilt.
    """
    a = math.pi / 4
    at = (math.sin(a), 0, math.cos(a))
    light = " ".join(str(-x) for x in at)
    measured = shown(V_RAMP, light, "sphere 0 0 0 1\n", "bump_texture bump.png\n", at)
    assert measured == pytest.approx(math.cos(TILT), rel=2e-3)


def test_broken_picture_is_reported(translated, tmp_path):
    """A bump map that is no picture gives an error of kind asset."""
    (tmp_path / "bump.png").write_bytes(b"no picture")
    with pytest.raises(Exception, match=r"bump\.png") as caught:
        translated("OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nbump_texture bump.png\n")
    assert [p.kind for p in caught.value.problems] == ["asset"]


def test_note(translated, write_picture):
    """The line is marked as an approximation."""
    write_picture("bump.png", U_RAMP)
    document = translated("OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nbump_texture bump.png\n").document
    report = next(r for r in document.lines.all if r.keyword == "bump_texture")
    assert report.outcome == "approximated"
    assert "bump" in report.note
