"""From objects to entries: each object alone gives what it gives among the others."""

from pathlib import Path

import pytest

from relume.translator import read, read_text
from relume.translator.assets import Assets
from relume.translator.media import HomogeneousMedium
from relume.translator.object_entries import Contents, translate_object, translate_objects
from relume.translator.scene import placed, working_copy

ROOT = Path(__file__).parents[2]
BALL = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection reflection\n"
FILLED = BALL + "reflection Subsurface_Scattering\nSCATTERING\n0\n1 1 1\nBSSRDF\n{}\n\n"


def prepared(document, dialect="manual"):
    return placed(working_copy(document, dialect), dialect, Assets(document).find)


SCENES = ("ambient", "fog", "glass", "milk", "prism", "shadow", "sky", "spot", "sss")
"""Scenes of `scenes/` with lamps, domes, both kinds of media, and glass by wavelength."""


@pytest.mark.parametrize("name", SCENES)
def test_objects_do_not_depend_on_those_before_them(name, plain):
    """In reverse order and one by one, every object becomes what it becomes in file order."""
    document = read(ROOT / "scenes" / f"{name}.txt", environ={})
    together, problems = translate_objects(prepared(document))
    assert not problems
    scene = prepared(document)
    alone = [
        translate_object(scene, index, block)
        for index, block in reversed(list(enumerate(scene.document.objects)))
    ]
    again = Contents.of_all(reversed(alone))
    assert list(again.entries) == list(together.entries)
    assert plain(again.entries) == plain(together.entries)
    assert (again.media, again.dipole) == (together.media, together.dipole)


@pytest.mark.parametrize(("bssrdf", "media", "dipole"), [(0, 1, False), (1, 0, True)])
def test_contents_tell_what_an_integrator_must_render(bssrdf, media, dipole):
    """A simulated medium, or the dipole: known from the result of the object alone."""
    scene = prepared(read_text(FILLED.format(bssrdf), environ={}))
    found = translate_object(scene, 0, scene.document.objects[0])
    assert (len(found.media), found.dipole) == (media, dipole)


def test_contents_add_up():
    """Entries and media in order; one object suffices for the dipole."""
    one, other = (HomogeneousMedium((x,) * 3, (0.0,) * 3) for x in (1.0, 2.0))
    first = Contents({"a": {"type": "sphere"}}, (one,))
    second = Contents({"b": {"type": "disk"}}, (other,), dipole=True)
    found = Contents.of_all([first, second])
    assert list(found.entries) == ["a", "b"]
    assert (found.media, found.dipole) == ((one, other), True)
    assert not Contents.of_all([]).entries


DOME = "OBJECT\nhemisphere {} 0 0 1\ncolor 1 1 1\nreflection diffuse\n"


@pytest.mark.parametrize("light", ["emission 1 1 1\n", "ambient"])
def test_equal_lights_have_names_of_their_own(light):
    """Mitsuba merges what is equal: two shapes must not share one emitter."""
    ambient = "ENV_LIGHT 1 1 1\n\n" if light == "ambient" else ""
    emission = "" if ambient else light
    text = ambient + "".join(DOME.format(x) + emission + "\n" for x in (0, 3))
    found, _ = translate_objects(prepared(read_text(text, environ={})))
    assert [entry["emitter"]["name"] for entry in found.entries.values()] == list(found.entries)


def test_every_broken_file_is_a_problem(tmp_path):
    """One run tells all of them, at the lines that name them."""
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(b"no picture")
    text = "".join(BALL.replace("reflection reflection", f"texture {tmp_path / name}") + "\n"
                   for name in ("a.png", "b.png"))  # fmt: skip
    _, problems = translate_objects(prepared(read_text(text, environ={})))
    assert [(problem.line, problem.kind) for problem in problems] == [(4, "asset"), (9, "asset")]


def test_the_first_far_dome_is_the_environment_in_any_order():
    """Mitsuba takes one environment map: which dome it is is decided before any is made."""
    sky = ROOT / "scenes" / "assets" / "sky.hdr"
    dome = f"OBJECT\nsphere 0 0 0 {{}}\nibl_texture {sky}\npanoramic_map 1\n\n"
    text = "CAMERA_POS\n0 0 9\n\n" + BALL + "\n" + dome.format(1e5) + dome.format(2e5)
    scene = prepared(read_text(text, environ={}))
    for index, kind in ((2, "sphere"), (1, "envmap"), (2, "sphere"), (1, "envmap")):
        found = translate_object(scene, index, scene.document.objects[index])
        assert [entry["type"] for entry in found.entries.values()] == [kind]
