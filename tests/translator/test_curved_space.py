"""Scenes with holes: where holes and mouths are, which side objects are on, skies and disks."""

import numpy as np
import pytest

from relume.integrators.metrics import kerr
from relume.textures import accretiondisk
from relume.translator import checks, curved_space, environment_maps, read_text, translate
from relume.translator.diagnostics import SceneError

HEAD = "CAMERA_POS\n0 -40 0\nCAMERA_DIR\n0 1 0\nCAMERA_UPVEC\n0 0 1\n"
BALL = "OBJECT\nsphere 0 0 9 1\nemission 1 1 1\n\n"
DISK = "OBJECT\ndisk 0 0 0 20\nnormal 0 0 2\nemission 1 2 3\ndisk_map 1\n"
HOLE = "BLACKHOLE 0 0 0\n"


@pytest.fixture
def pictures(tmp_path, monkeypatch):
    """A folder with pictures `a` to `c` of 4 x 2 texels, all of one byte; skies stay small."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 8)
    for k, name in enumerate("abc", 1):
        (tmp_path / f"{name}.ppm").write_bytes(b"P6\n4 2\n255\n" + bytes([k] * 24))
    return tmp_path


def translated(text, folder=None, dialect="manual", environ=None):
    return translate(
        read_text(HEAD + text, environ=environ or {}), dialect, [folder] if folder else []
    )


def bent(text, folder=None, dialect="manual", environ=None):
    """The dictionary of `curvedspace` in a scene."""
    integrator = translated(text, folder, dialect, environ).scene["integrator"]
    while "integrator" in integrator:
        integrator = integrator["integrator"]
    assert integrator["type"] == "curvedspace"
    return integrator


def texel(entry):
    """The byte of all texels of a sky."""
    return round(float(entry["picture"].pixels.mean()) * 255 / entry.get("scale", 1))


def test_flat_scenes_know_nothing_of_it():
    """Neither the integrator nor the sensor changes, nor are the plugins named."""
    found = translated(BALL)
    assert found.plan.integrator == "surfacepath" and found.plan.sensor == "perspective"
    assert set(found.plan.plugins) == {"surfacepath"}


@pytest.mark.parametrize(("lines", "environ", "center"), [
    ("BLACKHOLE 1 2 3\ndist 7\n", {}, [1, 2, 3]),
    ("BLACKHOLE\ndist 7\n", {}, [0, -33, 0]),
    ("BLACKHOLE\n", {}, [0, 9960, 0]),
    ("BLACKHOLE\ndist 7\n", {"BLACK_HOLE_Z": "2*9"}, [0, -22, 0]),
    ("BLACKHOLE 1 2 3\n", {"BLACK_HOLE_Z": "9"}, [1, 2, 3]),
])  # fmt: skip
def test_center_of_a_hole(lines, environ, center):
    """As the head line tells, else before the camera."""
    assert bent(lines, environ=environ)["center"] == pytest.approx(center)


def test_spin_chooses_the_metric():
    """Without spin the cheaper one."""
    assert bent(HOLE)["metric"] == "schwarzschild" and "spin" not in bent(HOLE)
    found = bent(HOLE + "angular_momentum -0.99999\n")
    assert (found["metric"], found["spin"]) == ("kerr", -0.99999)


@pytest.mark.parametrize(("value", "steps"), [("800", 800), ("-5", -1), ("0", 1), ("99.9", 99)])
def test_budget_of_steps(value, steps):
    """Whole, one at least, or without limit."""
    assert bent(f"{HOLE}geodesics_max_length {value}\n")["geodesics_max_length"] == steps


def test_a_scene_that_is_moved_takes_its_hole_along():
    """The hole keeps its place among the objects; its scene is never enlarged, as M is 1."""
    far = "CAMERA_POS\n90000 0 0\nCAMERA_DIR\n1 0 0\nOBJECT\nsphere 90009 0 0 1\nemission 1 1 1\n\n"
    found = translated(far + "BLACKHOLE 90005 0 0\n")
    center = np.array(found.scene["integrator"]["center"])
    ball = next(v for k, v in found.scene.items() if k.startswith("object"))
    assert np.array(ball["center"]) - center == pytest.approx(np.array([4, 0, 0]))
    assert ball["radius"] == 1 and abs(center).max() < 100


# ---- wormholes


def test_mouths_before_the_camera_or_where_they_are_told():
    """Neither `in` nor `out`: before the camera, and nothing but a sky on the other side."""
    found = bent("WORMHOLE\ndist 30\nRho 2\n")
    assert found["mouth_in"] == pytest.approx([0, -10, 0]) and found["rho"] == 2
    assert found["other"] == {"type": "scene"} and found["start_side"] == 1
    found = bent("WORMHOLE\n", environ={"WORM_HOLE_Z": "30"})
    assert found["mouth_in"] == pytest.approx([0, -10, 0])
    assert bent("WORMHOLE\nout 0 0 9\n")["mouth_in"] == [0, 0, 0]


def test_mouths_in_one_room():
    """Nearer than 1e5 they share their objects."""
    found = bent(BALL + "WORMHOLE\nin 0 0 0\nout 0 0 30\n")
    assert (found["mouth_in"], found["mouth_out"]) == ([0, 0, 0], [0, 0, 30])
    assert "other" not in found


@pytest.mark.parametrize(("camera", "side"), [("0 -40 0", 1), ("0 1e8-40 0", 2)])
def test_rooms_of_their_own(camera, side):
    """Each object is on the side of its nearer mouth; the other side is about its mouth, to the
    last digit, and so is the camera if it is there."""
    there = BALL.replace("0 0 9", "1e8 0 9").replace("1e8 0", "0.25 1e8")
    found = translated(f"CAMERA_POS\n{camera}\n{BALL}{there}WORMHOLE\nin 0 0 0\nout 0 1e8 0\n")
    hole = found.scene["integrator"]
    (near,) = [v for k, v in found.scene.items() if k.startswith("object")]
    (far,) = [v for k, v in hole["other"].items() if k.startswith("object")]
    assert near["center"] == [0, 0, 9] and far["center"] == [0.25, 0, 9]
    assert hole["mouth_out"] == [0, 0, 0] and hole["start_side"] == side
    assert np.array(found.scene["sensor"]["to_world"].rows)[:3, 3] == pytest.approx([0, -40, 0])


def test_skies_of_a_wormhole(pictures):
    """Each side has its picture and factor; `sign -1` exchanges them."""
    lines = "in 0 0 0\nbackground_texture1 a.ppm\nbackground_texture2 b.ppm\ncoef2 3\n"
    for out, where in (("out 0 0 1e7\n", "other"), ("", "other"), ("out 0 0 9\n", "sky2")):
        for sign, first, second, scale in (("", 1, 2, 3), ("sign -1\n", 2, 1, 1)):
            found = translated("WORMHOLE\n" + lines + out + sign, pictures)
            hole = found.scene["integrator"]
            sky = hole[where] if where == "sky2" else hole["other"]["background"]
            assert texel(found.scene["background"] | {"scale": 1}) == first
            assert texel(sky | {"scale": 1}) == second and sky["scale"] == scale


def test_what_a_wormhole_leaves_out(pictures):
    """Its scene shows no `background_texture`, and a black hole's files are not asked for."""
    text = "background_texture a.ppm\nWORMHOLE\nin 0 0 0\n\nBLACKHOLE 0 0 0\n"
    text += "accretion_disk_texture missing.png\n\n" + DISK
    found = translated(text, pictures)
    assert "background" not in found.scene and found.scene["integrator"]["metric"] == "wormhole"
    assert "accretiondisk" not in found.plan.plugins


# ---- accretion disks

TEXTURES = "accretion_disk_texture a.ppm\naccretion_disk_texture b.ppm\n"


def disks(text, folder, dialect="manual"):
    """The radiance of each accretion disk."""
    scene = translated(text, folder, dialect).scene
    return [v["emitter"]["radiance"] for k, v in scene.items() if k.startswith("object")]


def test_numbers_of_disks(pictures):
    """A disk without a number has that of the disk before; beyond the list is the last picture."""
    numbered = [DISK, DISK + "blackhole_disk 1\n", DISK, DISK + "blackhole_disk 7\n"]
    found = disks("\n".join([*numbered, HOLE + TEXTURES]), pictures)
    assert [texel(x["picture"]) for x in found] == [1, 2, 2, 2]
    lines = translated("\n".join([*numbered, HOLE + TEXTURES]), pictures).document.lines.all
    assert [r.outcome for r in lines if r.keyword == "blackhole_disk"] == [
        "translated", "approximated"]


def test_what_a_disk_is_told(pictures):
    """Place and spin of the hole, its size and normal, the share of the shift, a temperature."""
    text = (
        "color_doppler_factor_effect\n0.25\nuse_accretion_disk_temperature\n1\n"
        + DISK.replace("disk 0 0 0 20", "disk2 1 2 3 10 4") + "scale 2 2 2\n\n"
        + "BLACKHOLE 2 4 6\nangular_momentum 0.5\n" + TEXTURES
    )  # fmt: skip
    (disk,) = disks(text, pictures)
    assert {k: disk[k] for k in ("center", "spin", "normal", "outer_radius", "hole_radius")} == {
        "center": [2, 4, 6], "spin": 0.5, "normal": [0, 0, 1],
        "outer_radius": pytest.approx(20), "hole_radius": pytest.approx(8)}  # fmt: skip
    assert (disk["shift"], disk["temperature"]) == (0.25, curved_space.HOTTEST)
    assert disk["scale"]["value"] == [1, 2, 3] and disk["quantity"] == "radiance"


def test_the_largest_spins(pictures):
    """Those that the language allows are below 1; the plugins take them as far as they can."""
    for spin, taken in (("0.99999999", 0.999999), ("-0.9999999", -0.999999), ("0.9", 0.9)):
        text = DISK + "\n" + HOLE + f"angular_momentum {spin}\n" + TEXTURES
        assert bent(text, pictures)["spin"] == taken
        assert [disk["spin"] for disk in disks(text, pictures)] == [taken]
        assert taken in kerr.SPIN and taken in accretiondisk.SPIN


def test_only_disks_of_matter_are_accretion_disks(pictures):
    """Without a picture in the block, or without `disk_map`, they are plain disks."""
    for text in (DISK + "\n" + HOLE, DISK.replace("disk_map 1\n", "\n") + HOLE + TEXTURES):
        assert "accretiondisk" not in translated(text, pictures).plan.plugins


def test_a_disk_within_the_last_orbit_is_left_out(pictures):
    """Matter falls in below 6 M: nothing is left of a disk of radius 5."""
    text = DISK.replace("0 20", "0 5") + "\n" + HOLE + TEXTURES
    found = translated(text, pictures)
    assert not [k for k in found.scene if k.startswith("object")]
    assert "nothing orbits" in " ".join(r.note for r in found.document.lines.all)


def test_missing_disk_pictures_are_errors_at_their_line(pictures):
    """Of those that a disk shows alone."""
    text = HOLE + "accretion_disk_texture no.png\naccretion_disk_texture b.ppm\n\n" + DISK
    with pytest.raises(SceneError) as caught:
        translated(text, pictures)
    (problem,) = caught.value.problems
    assert (problem.line, problem.column, problem.kind) == (8, 24, "asset")
    assert translated(text + "blackhole_disk 1\n", pictures).plan.plugins.count("accretiondisk")


# ---- cameras


def test_cameras():
    """A velocity counts with its switch alone, and below the speed of light."""
    for lines, plugin, velocity in (
        ("velocity\n0 0 0.5\n", "perspective", None),
        ("velocity\n0 0 0.5\nspecial_relativity_effects\n1\n", "relativisticcamera", [0, 0, 0.5]),
        ("velocity\n0 0 -9\nspecial_relativity_effects\n1\n", "relativisticcamera",
         [0, 0, -0.999999]),
        ("special_relativity_effects\n1\n", "perspective", None),
        ("use_mollweide_projection\n1\n", "relativisticcamera", None),
    ):  # fmt: skip
        sensor = translated(lines + BALL).scene["sensor"]
        assert sensor["type"] == plugin
        assert sensor.get("velocity") == (velocity and pytest.approx(velocity))


def test_colours_of_motion_are_outermost():
    """Around the light in curved space, and inside the factor of the finished picture."""
    text = "velocity\n0 0 0.5\nspecial_relativity_effects\n1\ncolor_doppler_factor_effect\n0.5\n"
    integrator = translated(text + "sensor_response\n2\n" + HOLE).scene["integrator"]
    chain = []
    while integrator is not None:
        chain.append(integrator["type"])
        integrator = integrator.get("integrator") or integrator.get("nested")
    assert chain == ["samplescale", "dopplershift", "curvedspace", "surfacepath"]


# ---- what is said


def test_empty_scenes_with_holes_are_pictures(pictures):
    """A sky alone is worth a picture; black is told."""
    sky = translated("background_texture a.ppm\n" + HOLE, pictures)
    assert sky.picture_notes() == ()
    assert [note.code for note in translated(HOLE).picture_notes()] == ["no-light"]
    beyond = "WORMHOLE\nin 0 0 0\nbackground_texture2 a.ppm\n"
    assert translated(beyond, pictures).picture_notes() == ()


def test_variables_of_a_frame():
    """Which a file takes, and which of them are not set, is told of the picture as a whole."""
    text = HEAD + "VAR A\n%XX%\nVAR B\n%YY%\n" + BALL
    for environ, missing in (({}, "XX, YY"), ({"XX": "3"}, "YY"), ({"XX": "3", "YY": "0"}, None)):
        notes = translate(read_text(text, environ=environ)).picture_notes()
        assert [note.code for note in notes] == (["variables-taken"] if missing else [])
        if missing:
            assert notes[0].text.endswith(f"XX, YY; not set, and so 0: {missing}")


def test_mouths_that_meet():
    """Mouths that are no two places are an error of the scene."""
    document = read_text("DEPTH\n3\n", environ={})
    assert checks.check(document) == []
    with pytest.raises(SceneError, match="mouths"):
        read_text("WORMHOLE\nin 0 0 0\nout 0 0 2\nRho 1.1\n", environ={})
