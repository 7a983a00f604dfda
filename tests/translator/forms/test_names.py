"""Names of files and of measured materials (sections 10.3 and 13.5)."""

import pytest

from relume.translator import parse, read_text
from relume.translator.diagnostics import SceneError
from relume.translator.materials_table import MATERIALS
from tests.translator.reading import BALL


@pytest.mark.parametrize("name", ["a b.bmp", "#1.bmp", "ソ\\表.bmp", "2*3"])
@pytest.mark.parametrize(("before", "after"), [("OUTPUT\n ", " \t\n"), ("OUTPUT\n\t", "")])
def test_a_name_is_the_rest_of_its_line(before, after, name):
    """Blanks within it count, those at its ends do not; it is no expression."""
    assert read_text(before + name + after, environ={}).output == name


def test_a_missing_name():
    """An error behind the keyword."""
    with pytest.raises(SceneError, match="texture expects a name, found nothing"):
        read_text(BALL + "texture \n", environ={})


@pytest.mark.parametrize("name", ["Ketchup", "Lowfat Milk", "Head & Shoulders Shampoo"])
def test_materials(name):
    """Those of the table."""
    assert name in MATERIALS
    text = BALL + f"MATERIAL_SYMBOL\n{name}\n"
    assert read_text(text, environ={}).objects[0].material_symbol == name


@pytest.mark.parametrize(("name", "hint"), [
    ("ketchup", "; did you mean 'Ketchup'?"), ("Gravel", "; it is none of Apple, Chicken1")])
def test_unknown_materials(name, hint):
    """An error at the name; the lines count for nothing, and an earlier material stays."""
    lines = [*BALL.split("\n")[:2], "MATERIAL_SYMBOL", "Apple", "MATERIAL_SYMBOL", f"  {name}"]
    document, (problem,) = parse(lines, "", {})
    assert (problem.line, problem.column, problem.kind) == (6, 3, "value")
    assert problem.message.startswith(f"unknown material '{name}'{hint}")
    assert document.objects[0].material_symbol == "Apple"
    assert [report.line for report in document.lines.all] == [1, 2, 3, 4]
