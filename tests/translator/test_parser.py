"""Parsing: the rules of the file format, one by one, and errors with line and column.

Section numbers are those of the scene language's description.
"""

import pytest

from relume.translator import read
from relume.translator.diagnostics import SceneError
from relume.translator.shapes import UVPlane
from tests.translator.reading import BALL, ball, error, errors, outcomes, scene

# -- forms of keywords (1.2, 1.3) -----------------------------------------------------------------


def test_next_line_and_same_line():
    """Values stand below `IMAGE` and beside `color`."""
    document = scene("IMAGE\n64 48\nDEPTH\n 3\n" + BALL + "color  0.1\t0.2 0.3\n")
    assert (document.image, document.depth) == ((64, 48), 3)
    assert document.objects[0].color == (0.1, 0.2, 0.3)


def test_values_beside_a_next_line_keyword():
    """The program would not know that line; here it is an error that shows the way."""
    line, column, kind, message = error("IMAGE 64 48\n")
    assert (line, column, kind) == (1, 7, "syntax")
    assert "next line" in message and "64 48" in message


@pytest.mark.parametrize("rest", ["", "\n64 48\n"])
def test_missing_values(rest):
    """An empty line or the end of the file where values must follow."""
    line, column, kind, message = error("IMAGE\n" + rest)
    assert (line, column, kind) == (1, 6, "syntax")
    assert "found " + ("an empty line" if rest else "the end of the file") in message or rest == ""


def test_keywords_are_case_sensitive():
    """`image` is no keyword but clearly meant to be one."""
    line, column, kind, message = error("image\n")
    assert (line, column, kind) == (1, 1, "keyword")
    assert "did you mean 'IMAGE'?" in message


def test_indented_keyword():
    """Keywords start in the first column; the program passes over indented ones without a word."""
    assert error(" IMAGE\n")[2:] == ("keyword", "'IMAGE': a keyword must start in the first column")
    assert error(BALL + "\tcolor 1 1 1\n")[:3] == (3, 1, "keyword")


def test_blank_lines_between_keywords():
    """They mean nothing on the level of the file."""
    assert scene("\n\nIMAGE\n64 48\n\n \n\nDEPTH\n3\n").depth == 3


def test_an_empty_line_ends_a_block():
    """`emission` below it belongs to nothing."""
    text = BALL + "color 1 1 1\n\nemission 2 2 2\n"
    assert scene(text).objects[0].emission == (0, 0, 0)
    note = "outside any OBJECT block, which an empty line ends"
    assert outcomes(text)[5] == ("emission", "ignored", note)


def test_a_line_of_blanks_does_not_end_a_block():
    """Only a line without any character does."""
    assert ball(" \t\nemission 2 2 2\n").emission == (2, 2, 2)


def test_the_end_of_the_file_ends_a_block():
    """15 real files lack the last line end."""
    assert ball("color 1 1 1").color == (1, 1, 1)


def test_two_blocks():
    """An `OBJECT` line inside a block opens no other: an empty line has been forgotten."""
    document = scene(BALL + "\n" + BALL + "color 1 1 1\n")
    assert [block.color for block in document.objects] == [(0, 0, 0), (1, 1, 1)]


def test_crlf():
    """Line ends of Windows leave nothing behind in names."""
    assert scene("OUTPUT\r\nimage.hdr\r\n").output == "image.hdr"


@pytest.mark.parametrize(
    "text",
    ["DEPTH \n3\n", "DEPTH\n3 \n", "OUTPUT\na.bmp \t\n", "ENV_LIGHT 1 1 1 \n",
     BALL + "color 1 1 1 \n", BALL + "reflection diffuse \n", BALL + "texture a.png \n",
     "OBJECT \nsphere 0 0 0 1\n", "OBJECT\nsphere 0 0 0 1 \n",
     "OBJECT\nplane 0 0 0\nnormal 0 1 0 \n", BALL + "scale 1 1 1 \n",
     "CAMERA_MATRIX \nrotation 0 1 0\n"],
)
def test_trailing_blanks_are_accepted_with_a_note(text):
    """9 real files have one; the program dies of it."""
    document = scene(text)
    assert document == scene("\n".join(line.rstrip() for line in text.split("\n")))
    notes = [report.note for report in document.lines.all if "blank at the end" in report.note]
    assert len(notes) == 1


# -- comments (1.4) -------------------------------------------------------------------------------


def test_comments_between_a_keyword_and_its_value():
    """One is common in real files; more of them change nothing."""
    assert scene("IMAGE\n#320 240\n64 48\n").image == (64, 48)
    assert scene("IMAGE\n#1 1\n# 2 2\n64 48\n").image == (64, 48)
    assert scene("#\nIMAGE\n# x\n64 48\n#\n").image == (64, 48)


def test_comments_in_a_block():
    """Above the shape, between the lines of a shape and between attributes."""
    shape = "OBJECT\n# wall\nuvplane 0 0 0\n#U 2 0 0\nU 1 0 0\n# a\nV 0 1 0\n"
    (block,) = scene(shape + "#c\n#d\ncolor 1 1 1").objects
    assert block.shape == UVPlane((0, 0, 0), (1, 0, 0), (0, 1, 0))
    assert block.color == (1, 1, 1)


def test_no_trailing_comments():
    """`#` behind a value is an error, as in the program."""
    line, column, kind, message = error(BALL + "color 1 1 1 # red\n")
    assert (line, column, kind) == (3, 13, "syntax")
    assert "# red" in message


def test_a_disabled_block():
    """`#OBJECT` disables all lines of its block; each is accounted for."""
    text = "#OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection diffuse\n\n" + BALL
    assert len(scene(text).objects) == 1
    report = outcomes(text)
    for line in (2, 3, 4):
        assert report[line][1:] == ("ignored", "part of the OBJECT block disabled in line 1")


@pytest.mark.parametrize(
    "lines",
    ["SCATTERING\n0\n1 2 3\n", "ABSORBING\n0\n1 2 3\n", "PAHASE\n0.5\n", "PAHASE 0.1 0.2 0.3\n"],
)
def test_global_keywords_in_a_disabled_block_do_not_act(lines):
    """The program applies them to the whole scene (danger of 1.4); here they are noted instead."""
    text = "#OBJECT\nsphere 0 0 0 1\n" + lines + "\n"
    document = scene(text)
    assert (document.scattering, document.absorbing, document.phase) == ((0, 0, 0),) * 3
    assert "would apply it to the whole scene" in outcomes(text)[3][2]
    assert {outcome for _, outcome, _ in outcomes(text).values()} == {"ignored"}


def test_a_disabled_block_ends_like_any_other():
    """At an empty line, at the next block, or at a keyword that no object has."""
    block = "#OBJECT\nsphere 0 0 0 1\n"
    assert scene(block + "\nSCATTERING\n0\n1 2 3\n").scattering == (1, 2, 3)
    assert len(scene(block + BALL).objects) == 1
    assert scene(block + "IMAGE\n64 48\nSCATTERING\n0\n1 2 3\n").scattering == (1, 2, 3)


def test_a_disabled_camera_matrix():
    """Its lines are passed over, too."""
    document = scene("#CAMERA_MATRIX\nrotation 0 1 0\ntranslate 1 1 1\n")
    assert document.camera_matrix == []
    assert [report.outcome for report in document.lines.all] == ["ignored", "ignored"]


def test_values_left_over_by_a_disabled_keyword():
    """`#THREAD` leaves a bare number behind, which the program ignores."""
    assert outcomes("#THREAD\n4\n")[2] == ("4", "ignored", "a value of the disabled THREAD")
    assert outcomes("4\n")[1] == ("4", "ignored", "a value without a keyword")
    assert outcomes("#OUTPUT\nx.bmp\n")[2][1] == "ignored"


# -- repeated keywords ----------------------------------------------------------------------------


def test_the_last_of_repeated_keywords_counts():
    """The lines before it say which line replaced them."""
    text = "DEPTH\n3\nDEPTH\n4\n"
    assert scene(text).depth == 4
    assert outcomes(text)[1] == outcomes(text)[2] == ("DEPTH", "ignored", "set again in line 3")
    assert outcomes(text)[4] == ("DEPTH", "translated", "")
    assert ball("color 1 1 1\ncolor 0 0 0\n").color == (0, 0, 0)


# -- other blocks and words ----------------------------------------------------------------------


@pytest.mark.parametrize("word", ["luminance_cutoff", "luminacnce_cuttoff"])
def test_luminance_cutoff_of_the_japanese_manual(word):
    """Misprinted there."""
    assert scene(f"{word}\n0.5\n").luminance_cutoff == 0.5


@pytest.mark.parametrize("word", ["mlt_sample", "pre_sample"])
def test_bootstrap_of_manual_and_program(word):
    """Two names of one thing."""
    assert scene(f"{word}\n0.5\n").mlt_sample == 0.5


def test_unknown_words_are_passed_over():
    """As the program does, with a note."""
    report = outcomes("frobnicate 1 2\n" + BALL + "shininess 3\n")
    assert report[1][:2] == ("frobnicate", "ignored")
    assert report[4][:2] == ("shininess", "ignored")


@pytest.mark.parametrize(
    ("text", "line", "meant"),
    [("IMAEG\n", 1, "IMAGE"), ("CAMERAPOS\n", 1, "CAMERA_POS"), ("OBJEKT\n", 1, "OBJECT"),
     (BALL + "colour 1 1 1\n", 3, "color"), (BALL + "emision 1 1 1\n", 3, "emission"),
     (BALL + "reflection difuse\n", 3, "diffuse"), (BALL + "translat 0 1 0\n", 3, "translate"),
     ("OBJECT\nsphare 0 0 0 1\n", 2, "sphere"), (BALL + "MATERIAL_SYMBOL\nketchup\n", 4, "Ketchup"),
     ("CAMERA_MATRIX\nrotatoin 0 1 0\n", 2, "rotation")],
)
def test_misspellings_name_the_nearest_word(text, line, meant):
    """An error, because a misspelt keyword changes the picture in silence."""
    found = error(text)
    assert found[0] == line
    assert f"did you mean '{meant}'?" in found[3]


# -- errors ---------------------------------------------------------------------------------------


def test_all_errors_in_one_run():
    """Every error of a file with its line, column and kind, in the order of the lines."""
    text = (
        "IMAGE\n0 48\nDEPTH\n1 2\nSCREEN\n30 30\nCAMERA_DIR\n0 0 1e-200\nSAMPLNG\n8\n\n"
        "OBJECT\nsphere 0 0 0\ncolor 1 1 -1\nemission 1 1 1/0\nreflection glass2\n\n"
        "OBJECT\nsphere 0 0 0 1\nMATERIAL_SYMBOL\nBetchup\nspot_light 1\nspot_light_angle 100 20\n"
    )
    assert [(line, column, kind) for line, column, kind, _ in errors(text)] == [
        (2, 1, "range"), (4, 3, "syntax"), (6, 6, "syntax"), (8, 1, "value"), (9, 1, "keyword"),
        (13, 13, "syntax"), (14, 11, "range"), (15, 14, "value"), (16, 12, "keyword"),
        (21, 1, "value"), (23, 1, "range"),
    ]


def test_described_errors_name_the_file(tmp_path):
    """`file:line:column: message`, and errors of the environment without a line."""
    path = tmp_path / "scene.txt"
    path.write_text("DEPTH\nx\n")
    with pytest.raises(SceneError) as caught:
        read(path, environ={"SAMPLING": "0"})
    first, second = str(caught.value).split("\n")
    assert first == f"{path}: environment variable SAMPLING must be 1 to {2**40:g}, found 0"
    assert second.startswith(f"{path}:2:1: DEPTH: unknown name 'x'")


@pytest.mark.parametrize(
    ("text", "message"),
    [("IMAGE\n1000000 1000000\n", "1 to 16384"), ("IMAGE\n1e400 1\n", "no finite value"),
     ("SCREEN\n1e-400 1 1\n", "above 0"), ("CAMERA_ANGLE\n180\n", "at most 179.9 [degree]"),
     ("SAMPLING\n9^9^9^9\n", "no finite value"), ("SUPERSAMPLING\n0\n", "1 to"),
     ("IMAGE\n16384 16384\n", "expected at most 67108864 in all"),
     ("SAMPLING\n2^40\nSUPERSAMPLING\n2^20\n", "samples a pixel")],
)
def test_absurd_numbers(text, message):
    """They end in a message, not in an attempt."""
    assert message in error(text)[3]
