"""Reports of lines: they take fields and codes that exist, and lines only get worse."""

import copy

import pytest

from relume.translator import read_text
from relume.translator.diagnostics import LineReport, LineReports
from relume.translator.outcomes import make_note

TEXT = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nSCATTERING\n0\n1 1 1\n"


@pytest.fixture
def lines():
    """The line reports of an object."""
    (block,) = read_text(TEXT, environ={}).objects
    return block.lines


@pytest.mark.parametrize("owner", ["document", "object", "black hole", "worm hole"])
def test_unknown_fields_are_refused(owner):
    """A typo raises at once, whether or not the file sets the field that was meant."""
    document = read_text(TEXT + "\nBLACKHOLE\n\nWORMHOLE\n", environ={})
    blocks = [document, *document.objects, *document.gravity]
    lines = dict(zip(["document", "object", "black hole", "worm hole"], blocks, strict=True))
    lines = lines[owner].lines
    with pytest.raises(KeyError, match="has no field 'textrue'"):
        lines.becomes("textrue", "no-texture")
    with pytest.raises(KeyError, match="has no field 'textrue'"):
        lines.remark("textrue", "texture")
    for ask in (lines.of, lines.is_set, lines.line):
        with pytest.raises(KeyError, match="has no field 'textrue'"):
            ask("textrue")


def test_known_fields_need_no_line(lines):
    """A field that the file does not set has no lines to report on."""
    lines.becomes("texture", "no-texture-on-plane")
    assert lines.of("texture") == [] and not lines.is_set("texture")
    assert {report.outcome for report in lines.all} == {"translated", "ignored"}  # the dummy mean


def test_a_copy_knows_its_fields(lines):
    copy.deepcopy(lines).check("subsurface")
    with pytest.raises(KeyError):
        copy.deepcopy(lines).check("subsurfaces")


def test_verb_and_kind_must_agree(lines):
    """Who reads `remark` knows that the line stays translated."""
    with pytest.raises(ValueError, match="'lamp-not-shown' is of kind 'approximated'"):
        lines.remark("", "lamp-not-shown")
    with pytest.raises(ValueError, match="'index-zero' is of kind 'translated'"):
        lines.becomes("color", "index-zero")


def test_outcomes_never_rise():
    report = LineReport(1, "texture")
    report.becomes("medium-in-curved-space")
    report.becomes("no-texture-on-plane")
    report.remark("texture")
    assert report.outcome == "unsupported"
    assert report.codes == ("medium-in-curved-space", "no-texture-on-plane", "texture")


def test_notes_are_told_once():
    report = LineReport(1, "OBJECT")
    for file in ("a.png", "a.png", "b.png"):
        report.becomes("material-picture-missing", file=file, key="map_Kd")
    assert report.note == "no such file 'a.png' for map_Kd; no such file 'b.png' for map_Kd"
    assert report.codes == ("material-picture-missing",)


def test_all_lines_of_a_field_are_lowered_and_the_first_remarks(lines):
    """Keyword and values share a fate; a remark is read once."""
    lines.remark("scattering", "medium-units")
    lines.becomes("scattering", "no-subsurface")
    assert [report.codes for report in lines.of("scattering")] == [
        ("medium-units", "no-subsurface"),
        ("unused-mean", "no-subsurface"),
        ("no-subsurface",),
    ]


def test_a_note_about_another_file_names_the_place():
    report = LineReport(1, "OBJECT")
    report.add(make_note("mtl-halo").at("a.mtl:3"))
    assert (report.note, report.codes) == ("a.mtl:3: option '-halo' is ignored", ("mtl-halo",))


def test_reports_as_json():
    report = LineReport(3, "LENS")
    report.becomes("pinhole")
    assert report.as_dict() == {
        "line": 3,
        "keyword": "LENS",
        "outcome": "ignored",
        "note": "radius 0 or less: a pinhole",
        "codes": ["pinhole"],
    }


def test_names_besides_fields_are_declared():
    assert LineReports(LineReport, also=("more",)).of("more") == []
