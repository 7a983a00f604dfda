"""Variables that a file defines (section 2)."""

import pytest

from relume.translator.shapes import Sphere
from tests.translator.reading import error, outcomes, scene


def test_variables():
    """Global, usable in all expressions below their definition, also in blocks."""
    document = scene("VAR R\n2*3\nVAR b2\nR^2\n" + "OBJECT\nsphere R 0 0 b2\ncolor 1/R R-6 0\n")
    assert document.variables == {"R": 6, "b2": 36}
    assert document.objects[0].shape == Sphere((6, 0, 0), 36)
    assert document.objects[0].color == (1 / 6, 0, 0)


def test_a_variable_must_be_defined_before_its_use():
    """There is no look ahead."""
    assert error("DEPTH\na\nVAR a\n1\n")[:3] == (2, 1, "syntax")


@pytest.mark.parametrize("name", ["", "a_b", "2a", "a b", "é"])
def test_names_of_variables(name):
    """A letter, then letters and digits of ASCII."""
    line, _, kind, message = error(f"VAR {name}\n1\n")
    assert (line, kind) == (1, "syntax")
    assert "letters and digits" in message


def test_the_first_of_repeated_variables_counts():
    """The one exception."""
    text = "VAR a\n1\nVAR a\n2\nDEPTH\na\n"
    assert scene(text).depth == 1
    assert outcomes(text)[3][1:] == ("ignored", "a is defined already, the first definition counts")
