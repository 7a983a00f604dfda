"""Every line of a scene is accounted for, once, and says what became of it."""

import pytest

from relume.translator import read, read_text, translate
from relume.translator.diagnostics import SceneError
from relume.translator.line_outcomes import DOCUMENT_ROWS, MAPS, OBJECT_ROWS
from relume.translator.outcome_rows import KINDS

BALL = "OBJECT\nsphere 0 0 0 1\n"
SSS = BALL + "reflection Subsurface_Scattering\n"
FOG = "participatingMedia\n1\nSCATTERING\n0\n1 1 1\n"
DISK = "OBJECT\ndisk 0 0 0 1\nnormal 0 1 0\n"
HOLE = "BLACKHOLE 0 0 0\n"
MOUTHS = "WORMHOLE\nin 0 0 0\nout 0 0 30\n"
MOVING = "velocity\n0 0 0.5\nspecial_relativity_effects\n1\n"
PANEL = "OBJECT\nuvplane 0 0 0\nU 1 0 0\nV 0 1 0\n"


def reports(text):
    """The reports of a translated scene by line number."""
    translation = translate(read_text(text, environ={}))
    found = translation.document.lines.all
    assert len({report.line for report in found}) == len(found)
    return {report.line: report for report in found}


def explained(found):
    """Whether all lines that are not translated say why; lines below one another that share a fate
    share the note of the first."""
    reason = None
    for report in found:
        reason = report.outcome if report.note else reason
        if report.outcome not in ("translated", reason):
            return False
    return True


def test_every_line_has_one_report(scene_file):
    """All lines that are neither blank nor comments, in the order of the file, for whole files."""
    try:
        document = read(scene_file, environ={})
    except SceneError:
        pytest.skip("the file has errors")
    lines = scene_file.read_bytes().replace(b"\r\n", b"\n").split(b"\n")
    wanted = [k + 1 for k, line in enumerate(lines) if line.strip() and not line.startswith(b"#")]
    assert [report.line for report in document.lines.all] == wanted
    assert all(r.outcome in KINDS and r.keyword for r in document.lines.all)
    assert explained(document.lines.all)


def test_translation_keeps_the_account(scene_file):
    """Translating changes outcomes and notes, never the lines; what is lost has a reason."""
    try:
        document = read(scene_file, environ={})
        translated = translate(document).document
    except SceneError:
        pytest.skip("the file has errors, or names files that are not here")
    assert [r.line for r in translated.lines.all] == [r.line for r in document.lines.all]
    for before, after in zip(document.lines.all, translated.lines.all, strict=True):
        assert KINDS.index(after.outcome) >= KINDS.index(before.outcome)
    assert explained(translated.lines.all)


def test_the_document_is_left_as_it_is():
    """Notes of a translation are made in a copy."""
    document = read_text("metropolisTransport\n1\n" + BALL, environ={})
    translate(document)
    assert {report.outcome for report in document.lines.all} == {"translated"}


BOTH = "metropolisTransport\n1\nenergyRedistributionPathTracing\n1\n"

CASES = [
    ("DEPTH_LIMIT\n5\n", 1, "ignored", "nothing to harden"),
    ("mlt_r1r2\n0.1 0.2\n", 1, "ignored", "without effect"),
    ("metropolisTransport\n1\n", 1, "translated", "mlt"),
    ("metropolisTransport\n0\n", 1, "translated", ""),
    ("energyRedistributionPathTracing\n1\n", 1, "translated", "erpt"),
    (BOTH, 1, "ignored", "energy redistribution wins"),
    (BOTH, 3, "translated", "erpt"),
    ("metropolisTransport\n1\nmutation\n3\n", 3, "translated", ""),
    ("metropolisTransport\n1\nmlt_sample\n3\n", 3, "translated", ""),
    ("metropolisTransport\n1\nmutation\n20\nmlt_sample\n3\n", 5, "approximated", "a quarter"),
    ("metropolisTransport\n1\nmlt_resampling\n1\n", 3, "translated", ""),
    ("metropolisTransport\n1\nSUPERSAMPLING\n2\n", 3, "ignored", "by themselves"),
    ("metropolisTransport\n1\nluminance_cutoff\n2\n", 3, "ignored", "Metropolis"),
    ("mutation\n3\n", 1, "ignored", "no Metropolis"),
    ("mlt_sample\n3\n", 1, "ignored", "only metropolisTransport"),
    (BOTH + "mlt_resampling\n1\n", 5, "ignored", "only metropolisTransport"),
    ("participatingMedia\n1\n", 1, "ignored", "above 0"),
    ("participatingMedia\n0\n", 1, "translated", ""),
    ("participatingMedia\n1\nSCATTERING\n0\n1 1 1\n", 3, "translated", "medium-units"),
    ("participatingMedia\n1\nABSORBING\n0\n1 1 1\n", 3, "translated", ""),
    ("participatingMedia\n1\nABSORBING\n0\n1 1 1\nPAHASE\n0\n", 6, "translated",
     "medium-phase"),
    ("participatingMedia\n1\nABSORBING\n0\n1 1 1\n", 1, "translated", "fills a ball"),
    ("SCATTERING\n0\n1 1 1\n", 1, "ignored", "participatingMedia is 0"),
    ("ABSORBING\n0\n1 1 1\n", 1, "ignored", "participatingMedia is 0"),
    ("PAHASE\n0.5\n", 1, "ignored", "participatingMedia is 0"),
    ("map_coef 1 0 1 0\n", 1, "ignored", "no background_texture"),
    ("coef 2\n", 1, "ignored", "no background_texture"),
    ("velocity\n0 0 0.5\n", 1, "ignored", "special_relativity_effects is 0"),
    ("velocity\n0 0 0\n", 1, "translated", ""),
    (MOVING, 1, "translated", ""),
    (MOVING.replace("0.5", "1"), 1, "translated", "0.999999 of its speed"),
    ("special_relativity_effects\n1\n", 1, "ignored", "at rest"),
    ("special_relativity_effects\n0\n", 1, "translated", ""),
    ("use_accretion_disk_temperature\n1\n", 1, "ignored", "no accretion disk"),
    ("color_doppler_factor_effect\n1\n", 1, "ignored", "neither the camera moves"),
    (MOVING + "color_doppler_factor_effect\n1\n", 5, "translated", "doppler-cosine"),
    ("use_mollweide_projection\n1\n", 1, "translated", ""),
    (MOVING + "use_mollweide_projection\n1\n", 5, "translated", "mollweide-order"),
    ("use_mollweide_projection\n1\nSCREEN\n30 30 40\n", 3, "ignored", "all directions"),
    ("use_mollweide_projection\n1\nCAMERA_ANGLE\n40\n", 3, "ignored", "all directions"),
    (HOLE, 1, "translated", "hole-observer"),
    (HOLE + "dist 5\n", 2, "ignored", "tells the place"),
    (HOLE + "geodesics_max_length 90\n", 2, "translated", "hole-budget"),
    (HOLE + "initial_condition 1\n", 2, "ignored", "give the same"),
    (HOLE + "accretion_disk 20\n", 2, "ignored", "without effect"),
    (HOLE + "angular_momentum 0.9\n", 2, "translated", "hole-poles"),
    (HOLE + "angular_momentum -0.9999999\n", 2, "translated", "0.999999, which is taken"),
    (HOLE + "angular_momentum 0.999999\n", 2, "translated", "hole-poles"),
    (HOLE + "angular_momentum 0\n", 2, "translated", ""),
    (HOLE + "accretion_disk_texture missing.png\n", 2, "ignored", "no disk"),
    ("BLACKHOLE 50 52 219\n", 1, "approximated", "inside the horizon"),
    (HOLE + "\nBLACKHOLE 1 0 0\n", 1, "ignored", "line 3 bends space"),
    (MOUTHS + "\n" + HOLE + "coef 1\n", 6, "ignored", "line 1 bends space"),
    (HOLE + "\n" + FOG, 3, "unsupported", "no media"),
    (HOLE + "\n" + SSS, 5, "unsupported", "no media"),
    (HOLE + "\n" + BALL + "emission 1 1 1\nspot_light 1\n", 3, "approximated", "lights nothing"),
    (HOLE + "\nnextEventEstimation\n1\n", 3, "ignored", "by rays that meet it"),
    (MOUTHS, 1, "translated", "wormhole-mirrored"),
    (MOUTHS, 2, "translated", ""),
    ("background_texture missing.png\n" + MOUTHS, 1, "ignored", "a sky on each side"),
    ("WORMHOLE\nin 0 0 0\n", 1, "approximated", "no `out`"),
    ("WORMHOLE\nout 9 0 0\n", 1, "approximated", "no `in`"),
    (MOUTHS + "dist 3\n", 4, "ignored", "tells the place"),
    (MOUTHS + "a -0.5\n", 4, "translated", "-0.5 read as 0.5"),
    (MOUTHS + "sign -1\n", 4, "translated", "change places"),
    (MOUTHS + "sign 1\n", 4, "translated", ""),
    ("nextEventEstimation\n1\n", 1, "translated", "always sampled"),
    ("DEPTH\n3\n", 1, "translated", "roulette"),
    ("gamma_offset\n0\n", 1, "translated", "gamma"),
    ("TIMELIMIT\n1\n", 1, "translated", "timelimit"),
    ("CAMERA_ANGLE\n50\nSCREEN\n30 30 40\n", 3, "ignored", "CAMERA_ANGLE"),
    ("TARGET_POS\n0 0 0\nCAMERA_DIR\n0 0 -1\n", 3, "ignored", "TARGET_POS"),
    ("LENS\n0 5\n", 1, "ignored", "pinhole"),
    (BALL + "back 0\n", 3, "ignored", "without effect"),
    (BALL + "media_ignore_front_back 1\n", 3, "ignored", ""),
    (BALL + "blackhole_disk 1\n", 3, "ignored", "no accretion disk"),
    (DISK + "disk_map 1\nblackhole_disk 0\n", 5, "ignored", "no accretion disk"),
    (BALL + "disk_map 1\n", 3, "ignored", "no disk"),
    (DISK + "disk_map 1\n", 4, "ignored", "no texture"),
    (BALL + "background 1\n", 3, "ignored", "only planes and disks"),
    (PANEL + "background 1\n", 5, "translated", "background-object"),
    (PANEL + "background 1\n\n" + SSS, 5, "approximated", "there is a medium"),
    (DISK + "emission 1 1 1\n", 4, "translated", "disk-light"),
    (PANEL + "emission 1 1 1\n", 5, "translated", ""),
    (PANEL + "emission 1 1 1\ncolor 0 0 0.1\n", 5, "translated", "lit-uvplane"),
    (PANEL + "emission 1 1 1\nreflection specular\n", 5, "translated", "lit-uvplane"),
    *((BALL + f"{flag} 1\n", 3, "ignored", "neither texture") for flag in MAPS),
    (BALL + "shadow 1\n", 3, "ignored", "only planes"),
    (PANEL + "shadow 1\n", 5, "ignored", "no image-based light"),
    (BALL + "repeat 2\n", 3, "ignored", "no texture"),
    (BALL + "ibl_texture_coef 2\n", 3, "ignored", "no ibl_texture"),
    (BALL + "smooth 1\n", 3, "ignored", "no mesh"),
    (BALL + "r_refractive_index 1.3\n", 3, "ignored", "dipole"),
    (BALL + "SCATTERING\n0\n1 1 1\n", 3, "ignored", "no subsurface"),
    (BALL + "ABSORBING\n0\n1 1 1\n", 3, "ignored", "no subsurface"),
    (BALL + "PAHASE\n0\n", 3, "ignored", "no subsurface"),
    (BALL + "level\n1\n", 3, "ignored", "no subsurface"),
    (BALL + "BSSRDF\n1\n", 3, "ignored", "no subsurface"),
    (BALL + "MATERIAL_SYMBOL\nApple\n", 3, "ignored", "no subsurface"),
    (BALL + "MATERIAL_SCALE\n2\n", 3, "ignored", "no subsurface"),
    (BALL + "MATERIAL_R_MAX\n2\n", 3, "ignored", "no subsurface"),
    ("CAMERA_MATRIX\ntranslate 1 0 0\nrotation 0 9 0\n", 1, "translated",
     "camera-matrix-order"),
    ("OBJECT\nhemisphere 0 0 0 1\n", 1, "approximated", "hemisphere-inside"),
    (BALL + "scale 2 2 2\n", 1, "translated", "sphere-radius-scale"),
    ("OBJECT\ninfinity_light 0 -2 0\nemission 1 1 1\n", 1, "translated", "infinity-shadow"),
    (FOG + "BACKGROUND\n1 1 1\n", 1, "translated", "fog-sky"),
    ("nextEventEstimation\n1\n\n" + BALL + "reflection ward_brdf\nward_brdf 1 1 0.1 0.1\n", 1,
     "translated", "ward-nee"),
    ("nextEventEstimation\n1\n\n" + BALL + "reflection reflection\n", 1, "translated",
     "glass-nee"),
    *((BALL + f"reflection ward_brdf\nward_brdf 1 1 0.1 0.1\n{field} 1 1 1\n", 5, "translated",
       "ward-colour") for field in ("color", "specular")),
    (SSS, 3, "translated", "sss-dipole"),
    (SSS + "BSSRDF\n0\n", 3, "translated", "sss-simulation"),
    (FOG + "\n" + SSS, 9, "approximated", "simulated instead: there is a medium"),
    (SSS + "\n" + SSS + "BSSRDF\n0\n", 3, "approximated", "another object"),
    (SSS + "\nOBJECT\nsphere 9 0 0 1\nreflection reflection99\n", 3, "approximated",
     "wavelengths"),
    (SSS + "SCATTERING\n0\n1 1 1\n", 4, "translated", "sss-gate"),
    (SSS + "ABSORBING\n0\n1 1 1\n", 4, "translated", ""),
    (SSS + "PAHASE\n0\n", 4, "translated", ""),
    (SSS + "level\n-1\n", 4, "translated", ""),
    (SSS + "level\n0\n", 4, "translated", "level-0"),
    (SSS + "level\n3\n", 4, "approximated", "every order"),
    (SSS + "MATERIAL_SYMBOL\nChicken1\n", 4, "translated", "chicken"),
    (SSS + "PAHASE\n0\nMATERIAL_SYMBOL\nApple\n", 4, "ignored", "sets it anew"),
    (SSS + "refractive_index 2\nMATERIAL_SYMBOL\nApple\n", 4, "ignored", "sets the index"),
    (SSS + "refractive_index 0\n", 4, "translated", "read as 1.5"),
    (SSS + "color 2 1 1\n", 4, "translated", "cut off at 1"),
    (SSS + "MATERIAL_SCALE\n2\n", 4, "translated", ""),
    (SSS + "MATERIAL_SYMBOL\nApple\nMATERIAL_R_MAX\n2\n", 6, "translated", "light enters within"),
    (SSS + "BSSRDF\n0\nMATERIAL_R_MAX\n2\n", 6, "ignored", "dipole"),
    (BALL + "reflection specular\nreflection Subsurface_Scattering\n", 3, "approximated",
     "sss-base"),
    (BALL + "emission 1 1 1\nparallel_light 1\n", 4, "ignored", "only a uvplane"),
    (BALL + "parallel_light 1\nparallel_light_dir 0 1 0\n", 4, "ignored", "only a uvplane"),
    (PANEL + "parallel_light_dir 0 1 0\n", 5, "ignored", "parallel_light is 0"),
    (PANEL + "spot_light 1\n", 5, "ignored", "only a sphere"),
    (BALL + "spot_light_dir 0 1 0\n", 3, "ignored", "no spot light"),
    (BALL + "spot_light_angle 20 5\n", 3, "ignored", "no spot light"),
    (BALL + "spot_light_falloff 1\n", 3, "ignored", "no spot light"),
    (BALL + "spot_attenuation 0 0 1\n", 3, "ignored", "no spot light"),
    (BALL + "specular 1 1 1\n", 3, "ignored", "no use"),
    (BALL + "ward_brdf 0.1 0.1\n", 3, "ignored", "no use"),
    (BALL + "phong_brdf 0 1 5\n", 3, "ignored", "no use"),
    (BALL + "refractive_index 1.3\n", 3, "ignored", "no use"),
    (BALL + "reflection reflection\nroughness 0.5\n", 4, "ignored", "no use"),
    (BALL + "roughness 0.5\n", 3, "ignored", "without a reflection line"),
    (BALL + "reflection reflection99\nrefractive_index 1.3\n", 4, "ignored", "dispersion"),
    (BALL + "color 2 1 1\n", 3, "translated", "above 1"),
    (BALL + "scale 1 2 1\n", 1, "approximated", "ellipsoid"),
    ("OBJECT\ndisk2 0 0 0 2 1\nnormal 0 1 0\n", 1, "approximated", "ring"),
    (BALL + "emission 1 1 1\nspot_light 1\n", 1, "approximated", "not shown"),
    ("frobnicate 3\n", 1, "ignored", "no keyword"),
    ("ENV_LIGHT 1 1 1\n", 1, "translated", "ambient"),
    ("nextEventEstimation\n1\n\n" + 2 * (BALL + "emission 1 1 1\n\n"), 1, "translated",
     "several-lights"),
    (BALL + "reflection reflection\n", 3, "translated", "glass-fresnel"),
    (BALL + "reflection reflection99\n", 3, "translated", "dispersion-rgb"),
    (BALL + "reflection ward_brdf\nward_brdf 1 1 0.1 0.1\n", 4, "translated", "ward-exponent"),
    (BALL + "reflection phong_brdf\nphong_brdf 1 1 9\n", 4, "translated", "phong-cosine"),
    ("OBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 1 1 1\nemission 1 1 1\n", 5, "translated",
     "emits and reflects"),
]


@pytest.mark.parametrize(("text", "line", "outcome", "words"), CASES, ids=lambda x: repr(x)[:60])
def test_outcomes(text, line, outcome, words):
    """What becomes of each keyword that sets nothing of its own in the scene."""
    report = reports(text)[line]
    assert report.outcome == outcome
    assert words in report.note


def test_every_row_applies_in_a_case():
    """Each row of the tables is met by at least one of the cases, but for pictures and meshes,
    which need files and are tested with them."""
    documents = [read_text(text, environ={}) for text, *_ in CASES]
    needs_files = {"disk-temperature", "texture", "ibl_texture", "repeat", *MAPS}
    for field, applies, code in DOCUMENT_ROWS:
        met = any(d.lines.is_set(field) and applies(d) for d in documents)
        assert met or code in needs_files, (field, code)
    for field, applies, code in OBJECT_ROWS:
        blocks = [block for d in documents for block in d.objects]
        met = any(b.lines.is_set(field) and applies(b) for b in blocks)
        assert met or field in needs_files, (field, code)


def test_a_value_line_shares_the_outcome_of_its_keyword():
    """Both lines of `participatingMedia` are unsupported: the value means nothing alone."""
    found = reports("BLACKHOLE 0 0 0\n\nparticipatingMedia\n1\n")
    assert found[3].outcome == found[4].outcome == "unsupported"


@pytest.mark.parametrize(
    ("text", "status"),
    [("", "ok"), (BALL + "frobnicate 1\n", "ok"), (HOLE + "\n" + FOG, "unsupported")],
)
def test_status(text, status):
    """`unsupported` as soon as one line is."""
    assert translate(read_text(text, environ={})).status() == status


@pytest.mark.parametrize("name", ["ward_brdf", "phong_brdf"])
def test_a_surface_without_its_parameters(name):
    """An error of kind `scene` at the reflection line."""
    with pytest.raises(SceneError) as caught:
        translate(read_text(BALL + f"reflection {name}\n", environ={}))
    (problem,) = caught.value.problems
    assert (problem.line, problem.kind) == (3, "scene")


def test_missing_assets():
    """Every file that is missing, at the line that names it, in one run."""
    text = "background_texture no.hdr\nOBJECT\nobjfile no.obj\n\n" + BALL + "texture no.png\n"
    with pytest.raises(SceneError) as caught:
        translate(read_text(text, environ={}))
    found = [(p.line, p.kind) for p in caught.value.problems]
    assert found == [(1, "asset"), (3, "asset"), (7, "asset")]


LAMP = "OBJECT\nsphere 0 9 0 1\nemission 1 1 1\nreflection diffuse\n\n"


@pytest.mark.parametrize(
    ("id", "text", "line"),
    [
        ("roulette", "DEPTH\n3\n", 1),
        ("ambient", "ENV_LIGHT 1 1 1\n", 1),
        ("luminance-cutoff", "luminance_cutoff\n1\n", 1),
        ("several-lights", "nextEventEstimation\n1\n\n" + LAMP * 2, 1),
        ("glass-fresnel", "OBJECT\nsphere 0 0 0 1\nreflection reflection\n", 3),
        ("dispersion-rgb", "OBJECT\nsphere 0 0 0 1\nreflection reflection99\n", 3),
        (
            "ward-exponent",
            "OBJECT\nsphere 0 0 0 1\nreflection ward_brdf\nward_brdf 1 1 0.1 0.1\n",
            4,
        ),
        ("phong-cosine", "OBJECT\nsphere 0 0 0 1\nreflection phong_brdf\nphong_brdf 1 1 9\n", 4),
    ],
)
@pytest.mark.parametrize("dialect", ["manual", "prender"])
def test_a_line_names_the_row_of_the_dialects_that_it_touches(id, text, line, dialect):
    """Where manual and program differ, the line says so, by the row's id; other lines do not."""
    reports = translate(read_text(text, environ={}), dialect).document.lines.all
    assert [report.line for report in reports if f"{id}: " in report.note] == [line]


def test_one_lamp_is_no_several_lights():
    text = "nextEventEstimation\n1\n\n" + LAMP
    reports = translate(read_text(text, environ={})).document.lines.all
    assert not any("several-lights" in report.note for report in reports)
