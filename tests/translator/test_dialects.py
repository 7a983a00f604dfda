"""The two dialects: rows of kind `switch` change what they say, no other row changes anything."""

import math

import numpy as np
import pytest

from relume.translator import read_text, translate
from relume.translator.dialects import DIALECTS, DIFFERENCES
from relume.translator.outcomes import make_note

BALL = "OBJECT\nsphere 0 0 0 1\n"
GREY = "color 0.4 0.4 0.4\nspecular 0.4 0.4 0.4\n"
OFF = "luminance_cutoff\n0\n"
"""The program's own cutoff wraps the integrator; scenes that ask for none have none."""

MOVING = "velocity\n0 0 0.5\nspecial_relativity_effects\n1\n"
UNIT = "OBJECT\nuvplane 0 0 0\nU 1 0 0\nV 0 1 0\n"

SSS = BALL + "reflection Subsurface_Scattering\n"
WALK = SSS + "BSSRDF\n0\n"
FOG = "participatingMedia\n1\nSCATTERING\n0\n1 1 1\n"


def both(text, **options):
    """Translations of a scene in the dialects `manual` and `prender`."""
    document = read_text(text, environ={})
    return [translate(document, dialect, **options) for dialect in DIALECTS]


def notes(translation):
    return " ".join(report.note for report in translation.document.lines.all)


def inner_bsdf(translation):
    return translation.scene["object_3"]["bsdf"]["bsdf"]


def test_unknown_dialect():
    """A misspelt dialect is an error, not the default."""
    with pytest.raises(ValueError, match="unknown dialect 'maual'"):
        translate(read_text("", environ={}), "maual")


def test_camera_angle():
    """Horizontal in the manual, vertical in the program: tan(fov_y / 2) differs by the aspect."""
    manual, program = both(OFF + "IMAGE\n200 100\nCAMERA_ANGLE\n60\n")
    half = math.radians(manual.scene["sensor"]["fov"]) / 2
    assert math.tan(half) == pytest.approx(math.tan(math.radians(30)) / 2)
    assert program.scene["sensor"]["fov"] == pytest.approx(60)
    assert "camera-angle" in notes(manual) and "camera-angle" in notes(program)


def test_uvplane_extent():
    """The program squares the lengths of the edges: 2 becomes 4, and 0.5 becomes 0.25."""
    text = OFF + "OBJECT\nuvplane 1 1 1\nU 2 0 0\nV 0 0.5 0\n"
    for translation, size in zip(both(text), ((2, 0.5), (4, 0.25)), strict=True):
        to_world = np.array(translation.scene["object_3"]["to_world"].rows)
        corners = np.array([[-1, -1, 0, 1], [1, -1, 0, 1], [1, 1, 0, 1]]) @ to_world.T
        expected = [[1, 1, 1], [1 + size[0], 1, 1], [1 + size[0], 1 + size[1], 1]]
        assert corners[:, :3] == pytest.approx(np.array(expected))
        assert "uvplane-extent" in notes(translation)


def test_uvplane_texture(tmp_path):
    """One picture over the plane, or one to each length of its edges: 2 and 0.5."""
    (tmp_path / "paint.ppm").write_bytes(b"P6\n4 4\n255\n" + bytes(range(48)))
    text = OFF + "OBJECT\nuvplane 1 1 1\nU 2 0 0\nV 0 0.5 0\ntexture paint.ppm\n"
    manual, program = both(text, asset_path=[tmp_path])
    assert "to_uv" not in inner_bsdf(manual)["reflectance"]
    rows = inner_bsdf(program)["reflectance"]["to_uv"].rows
    assert np.array(rows) == pytest.approx(np.diag([2, 0.5, 1, 1]))
    assert "uvplane-texture" in notes(manual) and "uvplane-texture" in notes(program)


def test_uvplane_light():
    """An area lamp, or one whose looks are larger than what gives light: 4 x 0.25, and 2 x 0.5."""
    lamp = "OBJECT\nuvplane 1 1 1\nU 2 0 0\nV 0 0.5 0\nemission 1 2 3\n"
    manual, program = both(OFF + "nextEventEstimation\n1\n" + lamp)
    assert manual.scene["object_5"]["emitter"]["type"] == "area"
    emitter = program.scene["object_5"]["emitter"]
    assert emitter["type"] == "apparentlamp"
    assert emitter["radiance"]["value"] == [1, 2, 3]
    assert (emitter["origin"], emitter["edge_u"], emitter["edge_v"]) == (
        [1, 1, 1], [2, 0, 0], [0, 0.5, 0]
    )  # fmt: skip
    assert "uvplane-light" in notes(manual) and "uvplane-light" in notes(program)
    for unlike in (lamp, "nextEventEstimation\n1\n" + lamp + "color 0.1 0.1 0.1\n"):
        emitters = [t.scene[f"object_{3 + 2 * ('next' in unlike)}"]["emitter"] for t in
                    both(OFF + unlike)]  # fmt: skip
        assert [emitter["type"] for emitter in emitters] == 2 * [
            "twosidedarea" if "color" in unlike else "area"
        ]


def test_turned_lamps_of_two_sizes():
    """Light leaves on the side of the normal: `normal -1` and a mirroring scale turn U x V."""
    lamp = "nextEventEstimation\n1\n\nOBJECT\nuvplane 0 0 0\nU 2 0 0\nV 0 3 0\nemission 1 1 1\n"
    for lines, side in (("", 1), ("normal -1\n", -1), ("scale -1 1 1\n", 1),
                        ("scale -1 1 1\nnormal -1\n", -1)):  # fmt: skip
        _, program = both(OFF + lamp + lines)
        emitter = program.scene["object_6"]["emitter"]
        across = np.cross(emitter["edge_u"], emitter["edge_v"])
        assert across == pytest.approx(np.array([0, 0, 6 * side]))


def test_ward_diffuse():
    """Both parts in full, or a blend by their means: a half each where they are equal."""
    manual, program = both(OFF + BALL + GREY + "reflection ward_brdf\nward_brdf 1 1 0.1 0.2\n")
    for translation, value in ((manual, 0.4), (program, 0.2)):
        parts = inner_bsdf(translation)
        assert parts["diffuse_reflectance"]["value"] == pytest.approx([value] * 3)
        assert parts["specular_reflectance"]["value"] == pytest.approx([value] * 3)
        assert "ward-diffuse" in notes(translation)


def test_phong_diffuse():
    """Both parts in full, or a blend by `roughness`."""
    text = OFF + BALL + GREY + "reflection phong_brdf\nphong_brdf 1 1 20\nroughness 0.25\n"
    for translation, diffuse, lobe in zip(both(text), (0.4, 0.1), (0.4, 0.3), strict=True):
        parts = inner_bsdf(translation)
        assert parts["diffuse_reflectance"]["value"] == pytest.approx([diffuse] * 3)
        assert parts["specular_reflectance"]["value"] == pytest.approx([lobe] * 3)
        assert "phong-diffuse" in notes(translation)


def test_dispersion_rgb():
    """By wavelength, or with one index under RGB."""
    manual, program = both(OFF + BALL + "color 1 1 1\nreflection reflection99\n")
    assert (manual.plan.variant, manual.plan.integrator) == ("llvm_ad_spectral", "surfacepath")
    assert (program.plan.variant, program.plan.integrator) == ("llvm_ad_rgb", "surfacepath")


def test_parallel_lamp():
    """A beam alone, or with its rectangle: seen in squared lengths, without light of its own under
    next event estimation, an area lamp else."""
    beam = "OBJECT\nuvplane 0 2 0\nU 2 0 0\nV 0 0 1\nemission 1 2 3\nparallel_light 1\n"
    for head, kind in (("", "area"), ("nextEventEstimation\n1\n", "apparentlamp")):
        manual, program = both(OFF + head + beam)
        name = "object_5" if head else "object_3"
        assert manual.scene[f"{name}_light"]["type"] == "parallelbeam"
        assert name not in manual.scene and "is not shown" in notes(manual)
        assert program.scene[f"{name}_light"]["type"] == "parallelbeam"
        assert program.scene[name]["emitter"]["type"] == kind
        assert program.scene[name]["emitter"]["radiance"]["value"] == [1, 2, 3]
        assert "parallel-lamp" in notes(program)


def test_infinity_length():
    """A direction, or a brightness that follows the vector's length."""
    manual, program = both(OFF + "OBJECT\ninfinity_light 0 -2 0\nemission 1 2 3\n")
    for translation, factor in ((manual, 1), (program, 2)):
        light = translation.scene["object_3_light"]
        expected = [math.pi * factor * k for k in (1, 2, 3)]
        assert light["irradiance"]["value"] == pytest.approx(expected)
        assert light["direction"] == [0, -1, 0]
        assert "infinity-length" in notes(translation)


def test_luminance_cutoff():
    """Off, or 0.025 where the file is silent: times the samples, for each sample alone."""
    manual, program = both("SAMPLING\n10\nSUPERSAMPLING\n2\n")
    assert manual.scene["integrator"]["type"] == "surfacepath"
    assert program.scene["integrator"]["type"] == "samplescale"
    assert program.scene["integrator"]["luminance_limit"] == pytest.approx(0.025 * 40)
    assert all(t.scene["integrator"]["type"] == "surfacepath" for t in both(OFF))
    limits = [t.scene["integrator"]["luminance_limit"] for t in both("luminance_cutoff\n0.5\n")]
    assert limits == [16, 16]


def test_angular_map(tmp_path):
    """The centre of a light probe is -Z, or +Z and mirrored."""
    (tmp_path / "probe.ppm").write_bytes(b"P6\n4 4\n255\n" + bytes(range(48)))
    dome = "OBJECT\nsphere 0 0 0 5\nibl_texture probe.ppm\nangular_map 1\n\n"
    text = OFF + "CAMERA_POS\n0 0 0\n" + dome + "OBJECT\nsphere 3 0 0 1\n"
    manual, program = both(text, asset_path=[tmp_path])
    assert manual.scene["object_5"]["emitter"]["map"] == "angular"
    assert program.scene["object_5"]["emitter"]["map"] == "angular_mirrored"
    assert "angular-map" in notes(manual) and "angular-map" in notes(program)


def test_sss_dipole():
    """Jensen's profile without a limit of the radius, or the program's with one."""
    found = both(OFF + SSS + "BSSRDF\n1\nMATERIAL_SYMBOL\nApple\n")
    profiles = [translation.scene["integrator"]["profile"] for translation in found]
    assert profiles == ["standard", "directional"]
    ends = [translation.scene["object_3"]["bsdf"]["r_max"] for translation in found]
    assert ends == [0, pytest.approx(1.25 * (np.log(1e4) / (1.97 + 0.046)) ** 0.5)]
    assert all("sss-dipole" in notes(translation) for translation in found)


def test_mlt():
    """Kelemen's mutation against the program's, which is LuxRender's."""
    manual, prender = (t.scene["integrator"] for t in both("metropolisTransport\n1\n" + OFF))
    assert manual["mutation"] == "kelemen"
    assert prender == manual | {"mutation": "lux"}


def test_sss_radius():
    """No limit, or the program's, by default; one that a file sets counts in both."""
    apple = OFF + SSS + "BSSRDF\n1\nMATERIAL_SYMBOL\nApple\n"
    program = 1.25 * (np.log(1e4) / (1.97 + 0.046)) ** 0.5
    for more, ends in (("", (0, program)), ("MATERIAL_R_MAX\n2\n", (2 * program,) * 2)):
        for translation, end in zip(both(apple + more), ends, strict=True):
            assert translation.scene["object_3"]["bsdf"]["r_max"] == pytest.approx(end)
            assert "sss-radius" in notes(translation)


def test_hole_observer():
    """Angles as a camera at rest sees them, or as the coordinates of the scene have them."""
    observers = [t.scene["integrator"]["observer"] for t in both(OFF + "BLACKHOLE 0 0 0\n")]
    assert observers == ["static", "coordinate"]
    assert all("hole-observer" in notes(t) for t in both("BLACKHOLE 0 0 0\n"))


def test_disk_motion(tmp_path):
    """Red shift and Doppler shift along the ray, or Doppler shift alone from the camera's place."""
    (tmp_path / "ring.ppm").write_bytes(b"P6\n4 4\n255\n" + bytes(range(48)))
    disk = "OBJECT\ndisk 0 0 0 20\nnormal 0 0 1\nemission 1 1 1\ndisk_map 1\n\n"
    hole = "BLACKHOLE 0 0 0\naccretion_disk_texture ring.ppm\n"
    found = both(OFF + "CAMERA_POS\n0 -40 9\n" + disk + hole, asset_path=[tmp_path])
    manual, program = (t.scene["object_5"]["emitter"]["radiance"] for t in found)
    assert manual["motion"] == "gravity" and "seen_from" not in manual
    assert program["motion"] == "doppler" and program["seen_from"] == [0, -40, 9]
    assert all("disk-motion" in notes(translation) for translation in found)


def test_every_switch_is_tested():
    """Each row of kind `switch` has a test above that is named after it."""
    switches = {row.id for row in DIFFERENCES.values() if row.kind == "switch"}
    tested = {id for id in switches if f"test_{id.replace('-', '_')}" in globals()}
    assert switches == tested


UNSWITCHED = {
    "screen": "SCREEN\n20 30 40\n",
    "camera-matrix-up": "CAMERA_MATRIX\nrotation 0 30 0\ntranslate 1 2 3\nscale 2 2 2\n",
    "sphere-rotation": "OBJECT\nsphere 1 0 0 1\nrotation 0 90 0\n",
    "ward-exponent": BALL + "specular 1 1 1\nreflection ward_brdf\nward_brdf 0 1 0.1 0.2\n",
    "glass-colour": BALL + "color 0.5 0.6 0.7\nreflection reflection\nrefractive_index 1.3\n",
    "no-reflection-line": BALL + "color 0.5 0.6 0.7\n",
    "roughness": BALL + "color 0.5 0.6 0.7\nreflection diffuse\nroughness 0.25\n",
    "emission-units": "OBJECT\ninfinity_light 0 -1 0\nemission 1 1 1\n",
    "spot": BALL + "emission 1 1 1\nspot_light 1\nspot_light_angle 30 10\n",
    "several-lights": (BALL + "emission 1 1 1\n\n") * 2,
    "erpt": "energyRedistributionPathTracing\n1\n",
    "ambient": "ENV_LIGHT 0.1 0.2 0.3\n" + BALL,
    "gamma": "gamma_offset\n0\n",
    "timelimit": "TIMELIMIT\n2\n",
    "medium-units": FOG,
    "medium-phase": FOG + "PAHASE\n0.5\n",
    "sss-simulation": WALK,
    "sss-base": WALK.replace("reflection Sub", "reflection diffuse\nreflection Sub"),
    "sss-gate": WALK + "SCATTERING\n0\n1 1 1\n",
    "chicken": WALK + "MATERIAL_SYMBOL\nChicken2\n",
    "roulette": "DEPTH\n3\nDEPTH_LIMIT\n5\n",
    "level-0": SSS + "level\n0\nSCATTERING\n0\n1 1 1\n",
    "disk-light": "OBJECT\ndisk 0 0 0 1\nnormal 0 1 0\nemission 1 1 1\n",
    "lit-uvplane": UNIT + "emission 1 1 1\ncolor 0.5 0.5 0.5\n",
    "background-object": UNIT + "background 1\ncolor 0.5 0.5 0.5\n",
    "sphere-radius-scale": BALL + "scale 2 2 2\n",
    "ward-colour": BALL + "reflection ward_brdf\nward_brdf 0.5 0.5 0.1 0.1\ncolor 1 1 1\n",
    "fog-sky": FOG + "BACKGROUND\n1 1 1\n",
    "wormhole-start": "WORMHOLE\nin 0 0 9\nout 0 0 -9\n",
    "wormhole-bounces": "WORMHOLE\nin 0 0 9\nout 0 0 -9\n\n" + BALL,
    "wormhole-mirrored": "WORMHOLE\nin 0 0 9\nout 1e6 0 -9\n\n" + BALL,
    "mollweide-order": MOVING + "use_mollweide_projection\n1\n",
    "doppler-cosine": MOVING + "color_doppler_factor_effect\n0.5\n",
}
NOTED = {"camera-matrix-up", "sphere-rotation", "no-reflection-line", "roughness", "emission-units",
         "spot", "gamma", "timelimit", "medium-units", "medium-phase", "sss-simulation", "sss-base",
         "sss-gate", "chicken", "level-0", "disk-light", "lit-uvplane", "background-object",
         "sphere-radius-scale", "ward-colour", "fog-sky", "wormhole-start", "wormhole-bounces",
         "wormhole-mirrored", "mollweide-order", "doppler-cosine"}
"""Rows that a line can touch without anything else to say."""


@pytest.mark.parametrize("id", UNSWITCHED)
def test_other_rows_change_nothing(id, plain):
    """The dialects translate a scene that touches the row alike."""
    assert DIFFERENCES[id].kind in ("same", "never")
    manual, program = both(OFF + UNSWITCHED[id])
    assert plain(manual.scene) == plain(program.scene)
    assert manual.plan == program.plan
    assert (f"{id}: " in notes(manual)) or id not in NOTED


def test_centres_of_spheres_turn_about_the_origin():
    """Row sphere-rotation, whose defect no dialect copies: (1, 0, 0) turned about Y is -Z."""
    for translation in both(OFF + UNSWITCHED["sphere-rotation"]):
        assert translation.scene["object_3"]["center"] == pytest.approx([0, 0, -1])


def test_notes_say_who_is_followed():
    """A note names its row, what is done, and what is not."""
    row = DIFFERENCES["infinity-length"]
    id, manual, program = row.id, row.manual, row.program
    found = [make_note(id, dialect=dialect).text for dialect in DIALECTS]
    assert found[0] == f"{id}: {manual}, as the manual; the program: {program}"
    assert found[1] == f"{id}: {program}, as the program; the manual says {manual}"
    id = "no-reflection-line"
    assert make_note(id, dialect="prender") == make_note(id)
