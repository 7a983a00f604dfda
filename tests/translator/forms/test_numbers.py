"""Numbers, whole numbers and switches, also from environment variables (section 2)."""

import pytest

from relume.translator import read_text
from relume.translator.diagnostics import SceneError
from tests.translator.reading import error, outcomes, scene


@pytest.mark.parametrize("word", ["ENV_LIGHT", "ENVLIGHT"])
@pytest.mark.parametrize("gap", [" ", "\n"])
def test_ambient_light_in_both_forms_and_spellings(word, gap):
    """Manual and program differ in word and place; all four are read."""
    assert scene(f"{word}{gap}0.1 0.2 0.3\n").ambient == (0.1, 0.2, 0.3)


def test_integers_are_scanned():
    """`IMAGE` and the like take leading integers and drop what follows, with a note."""
    text = "IMAGE\n64 48 pixels\n"
    assert scene(text).image == (64, 48)
    assert "'pixels' after the value ignored" in outcomes(text)[1][2]
    assert error("IMAGE\n64.5 48\n")[:3] == (2, 1, "value")
    assert scene("IMAGE\n2*32 40+8\n").image == (64, 48)


def test_environment_in_a_file():
    """`%NAME%` on the line below a keyword of one number or `VAR`; 0 where it is not set."""
    text = "VAR T\n%TIME%\nDEPTH\n%DEEP%\nSAMPLING\n%N% per pixel\n"
    document = read_text(text, environ={"TIME": "2.5", "N": "7"})
    assert (document.variables["T"], document.depth, document.sampling) == (2.5, 0, 7)
    notes = {report.line: report.note for report in document.lines.all}
    assert notes[2] == "from environment variable TIME"
    assert "DEEP is not set: 0" in notes[3]


@pytest.mark.parametrize("given", ["", "1 2", "x", "nan", "1e999", "7.5"])
def test_environment_that_is_no_number(given):
    """An error at the line that asks for it."""
    with pytest.raises(SceneError) as caught:
        read_text("SAMPLING\n%N%\n", environ={"N": given})
    assert caught.value.problems[0].line == 2


@pytest.mark.parametrize("value", ["%N", "%", "%%"])
def test_environment_without_a_name(value):
    """`%` without an end or a name."""
    assert error(f"DEPTH\n{value}\n")[:3] == (2, 1, "syntax")


def test_environment_only_for_single_numbers():
    """`SCREEN` takes three numbers, so `%` is no operand there."""
    assert error("SCREEN\n%N%\n")[:3] == (2, 1, "syntax")


def test_messages_name_the_keyword_as_it_is_spelt():
    """The reader of the file looks for that word."""
    assert error("pre_sample\n0\n")[3] == "pre_sample must be above 0, found 0"
    assert error("pre_sample\n1 2\n")[3] == "pre_sample expects 1 value, found 2 in '1 2'"
