"""Scenes with surfaces that light crosses, and lamps behind them, against closed forms.

Opacities: `d` of MTL files, alpha of pictures, glass of index 1. Lamps: spheres, beams, spots and
the sun, emitting surfaces with holes.
"""

import math

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from relume.translator import read_text, translate

FLOOR = "OBJECT\nuvplane -9 -9 0\nU 18 0 0\nV 0 18 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
VEIL = "OBJECT\nuvplane -9 -9 5\nU 18 0 0\nV 0 18 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n"
GLASS = "OBJECT\nsphere 0 0 5 2\ncolor 1 1 1\nreflection reflection\nrefractive_index {index}\n\n"
LAMP = "OBJECT\nsphere 0 0 30 2\nemission 100 100 100\ncolor 0 0 0\nreflection diffuse\n\n"
LIGHTS = {
    "infinity": "OBJECT\ninfinity_light 0 0 -1\nemission 1 1 1\ncolor 0 0 0\n\n",
    "parallel": "OBJECT\nuvplane -3 -3 10\nU 6 0 0\nV 0 6 0\nemission 1 1 1\nparallel_light 1\n"
    "parallel_light_dir 0 0 -1\ncolor 0 0 0\nreflection diffuse\n\n",
    "spot": "OBJECT\nsphere 0 0 10 0.1\nemission 7 7 7\nspot_light 1\nspot_light_dir 0 0 -1\n"
    "color 0 0 0\nreflection diffuse\n\n",
    "lamp": LAMP,
}
SEEN = {"infinity": 0.5, "parallel": 0.5, "spot": 0.035, "lamp": 0.5 * 100 * (2 / 30) ** 2}
"""Radiance of the floor where nothing stands between: rho emission cos, / d² of the spot; and
rho L R² / D²."""


@pytest.fixture
def veil(write_picture, tmp_path):
    """Scene text of a rectangle of an opacity, by a picture's alpha or an MTL file's `d`."""

    def text(alpha, by="alpha", level=255):
        if by == "alpha":
            pixels = np.full((4, 4, 4), level, np.uint8)
            pixels[..., 3] = round(255 * alpha)
            Image.fromarray(pixels).save(tmp_path / "veil.png")
            return VEIL + "texture veil.png\n\n"
        (tmp_path / "veil.mtl").write_text(f"newmtl a\nd {alpha}\n")
        corners = "v -9 -9 5\nv 9 -9 5\nv 9 9 5\nv -9 9 5\n"
        (tmp_path / "veil.obj").write_text(f"mtllib veil.mtl\n{corners}usemtl a\nf 1 2 3 4\n")
        return "OBJECT\nobjfile veil.obj\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"

    return text


LOOK = ((0, 3, 2), (0, 0, 0))
"""A camera below the veil that sees the middle of the floor."""


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("by", ["alpha", "d"])
def test_an_absent_surface_casts_no_shadow(measure, view, agrees, veil, light, by):
    agrees(measure(view(*LOOK) + FLOOR + veil(0, by) + LIGHTS[light], spp=512), SEEN[light])


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("light", ["infinity", "lamp"])
def test_veils_hold_back_their_share(measure, view, agrees, veil, light):
    """Two black veils of opacity 0.4, one behind the other, pass 0.6²."""
    black = veil(0.4, "d").replace("color 0.5 0.5 0.5", "color 0 0 0")
    black += black.replace("diffuse\n", "diffuse\ntranslate 0 0 1\n")
    agrees(measure(view(*LOOK) + FLOOR + black + LIGHTS[light], spp=512), 0.6**2 * SEEN[light])


@pytest.mark.false_alarms(1e-3)
def test_a_half_there_surface_before_a_lamp(measure, view, agrees, veil):
    """Seen from the lamp's side, it reflects d rho L R² / D² of a lamp at the distance D = 25."""
    expected = 0.5 * 0.5 * 100 * (2 / 25) ** 2
    agrees(measure(view((0, 6, 20), (0, 0, 5)) + veil(0.5, "d") + LAMP, spp=1024), expected)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("light", ["infinity", "parallel", "spot"])
def test_index_matched_glass_casts_no_shadow(measure, view, agrees, light):
    """By Schlick's formula it reflects at grazing angles, but nothing of these lights."""
    text = view(*LOOK) + FLOOR + GLASS.format(index=1) + LIGHTS[light]
    agrees(measure(text, spp=512), SEEN[light])


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("alpha", [0, 0.4, 1])
def test_a_lamp_shines_where_it_is(measure, view, agrees, veil, alpha):
    """Before a background of 0.1 it shows alpha + (1 - alpha) 0.1, and lights a floor likewise.

    From the middle of the floor the veil, of half-width 9 at the distance 5, has the form factor F.
    """
    alpha = round(255 * alpha) / 255
    shining = veil(alpha, level=0).replace("color 0.5 0.5 0.5", "color 0 0 0\nemission 1 1 1")
    sky = "BACKGROUND\n0.1 0.1 0.1\n\n"
    expected = alpha + (1 - alpha) * 0.1
    agrees(measure(view((0, 0, 20), (0, 0, 5)) + sky + shining, spp=1024), expected, of=2)
    below = shining.replace("U 18 0 0\nV 0 18 0", "U 0 18 0\nV 18 0 0")
    a = 9 / 5
    F = 4 / math.pi * a / math.hypot(1, a) * math.atan(a / math.hypot(1, a))
    lit = measure(view(*LOOK) + sky + FLOOR + below, spp=4096)
    agrees(lit, 0.5 * (F * expected + (1 - F) * 0.1), of=2)


FOG = "participatingMedia\n1\nABSORBING\n1e-9\n1e-9 1e-9 1e-9\nSCATTERING\n0\n0 0 0\n\n"
MARBLE = (
    "OBJECT\nsphere 900 0 0 1\nreflection Subsurface_Scattering\nMATERIAL_SYMBOL\nMarble\n\n"
)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("else_", [FOG, MARBLE], ids=["fog", "dipole"])
@pytest.mark.parametrize("by", ["alpha", "d"])
def test_the_same_beside_media_and_the_dipole(measure, view, agrees, veil, else_, by):
    """A veil of 0.4 before a lamp and the sun, and one that shines."""
    alpha = round(255 * 0.4) / 255
    black = veil(alpha, by, 0).replace("color 0.5 0.5 0.5", "color 0 0 0")
    for light in ("infinity", "lamp"):
        text = view(*LOOK) + else_ + FLOOR + black + LIGHTS[light]
        agrees(measure(text, spp=512), (1 - alpha) * SEEN[light], of=3)
    sky = "BACKGROUND\n0.1 0.1 0.1\n\n"
    shining = black.replace("color 0 0 0", "color 0 0 0\nemission 1 1 1")
    text = view((0, 0, 20), (0, 0, 5)) + else_ + sky + shining
    agrees(measure(text, spp=1024), alpha + (1 - alpha) * 0.1, of=3)


NOTE = "no ray can meet this light"


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize(
    ("glass", "told"),
    [
        (GLASS.format(index=1.5), True),
        (GLASS.format(index=1), False),
        (GLASS.replace("reflection reflection", "reflection reflection99").format(index=1), True),
        ("", False),
    ],
)
def test_lights_that_glass_hides_are_told(light, glass, told):
    translation = translate(read_text(FLOOR + glass + LIGHTS[light], environ={})).path_traced()
    reports = [r for r in translation.document.lines.all if NOTE in r.note]
    assert bool(reports) == (told and light != "lamp")
    assert all(r.keyword in ("OBJECT", "infinity_light", "uvplane", "sphere") for r in reports)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("sky", ["hemisphere 0 0 0 200\nhemisphere_map 1", "sphere 0 0 0 300"])
def test_shadow_catchers_show_what_lamps_add(measure, view, agrees, write_picture, sky):
    """Under a sky of 1 and a lamp, of form factor R² / D²: V L_behind + rho F L.

    Behind the catcher is the dark lower half of a hemisphere, or the sky of a sphere.
    """
    write_picture("sky.png", np.full((4, 4, 3), 255))
    catcher = (
        "OBJECT\nuvplane -4 0 4\nU 8 0 0\nV 0 0 -8\ncolor 0.5 0.5 0.5\nreflection diffuse\n"
        "shadow 1\n\n"
    )
    lamp = "OBJECT\nsphere 0 12 0 1\nemission 50 50 50\ncolor 0 0 0\nreflection diffuse\n\n"
    dome = f"OBJECT\n{sky}\nibl_texture sky.png\ncolor 0 0 0\nreflection diffuse\n\n"
    F = 1 / 12**2
    expected = 0.5 * F * 50 + (0 if sky.startswith("hemi") else 1 - F)
    agrees(measure(view((0, 6, 12), (0, 0, 0)) + catcher + lamp + dome, spp=4096), expected)


def test_scenes_without_such_surfaces_are_those_of_path(load, view):
    """The same samples: `surfacepath` costs and changes nothing there."""
    scene = load(view((0, 3, 20), (0, 0, 0), width=1) + FLOOR + LAMP)
    pictures = [
        np.array(mi.render(scene, integrator=mi.load_dict({"type": kind, "max_depth": 4}), spp=4))
        for kind in ("path", "surfacepath")
    ]
    np.testing.assert_allclose(*pictures, rtol=1e-5)
