"""What the `reflection` lines of an object add up to (section 8)."""

import pytest

from relume.translator import parse
from relume.translator.diagnostics import SceneError
from relume.translator.forms.reflections import Reflection
from tests.translator.reading import BALL, ball, scene

BELOW = "reflection Subsurface_Scattering\n"


@pytest.mark.parametrize(
    ("lines", "reflection", "roughness"),
    [
        ("", Reflection(), None),
        ("reflection diffuse\n", Reflection("diffuse"), 1),
        ("reflection specular\n", Reflection("specular"), 0),
        ("reflection diffuse\nroughness 0.3\n", Reflection("diffuse"), 0.3),
        ("roughness 0.3\nreflection diffuse\n", Reflection("diffuse"), 1),
        ("reflection diffuse\nreflection ward_brdf\n", Reflection("ward"), 1),
        ("reflection reflection\n" + BELOW, Reflection("glass", True), None),
        (BELOW, Reflection(None, True), None),
        (BELOW + "reflection reflection\n", Reflection("glass"), None),
        ("reflection reflection\nreflection reflection99\n",
         Reflection("glass", False, "formula99"), None),
        ("reflection reflection1\n1 2 3\n",
         Reflection("glass", False, "cauchy6", (1, 2, 3, 0, 0, 0)), None),
        ("reflection reflection2\n1\t2e-2 3 4 5 -6\n",
         Reflection("glass", False, "sellmeier3", (1, 0.02, 3, 4, 5, -6)), None),
    ],
)
def test_reflections(lines, reflection, roughness):
    """What the last `reflection` line makes of the ones before (8, 8.1, 8.7, 10.2)."""
    block = ball(lines)
    assert (block.reflection, block.roughness) == (reflection, roughness)


def test_a_bad_line_changes_nothing():
    """An unknown model, or missing coefficients: an error, and the lines before it still count."""
    text = BALL + "reflection glas\nreflection diffuse\nreflection reflection1\n\n"
    with pytest.raises(SceneError) as caught:
        scene(text)
    found = [(p.line, p.column, p.kind) for p in caught.value.problems]
    assert found == [(3, 12, "keyword"), (5, 11, "syntax")]
    document, _ = parse(text.split("\n"), "", {})
    assert document.objects[0].reflection == Reflection("diffuse")


@pytest.mark.parametrize(("numbers", "remarked"), [("1 2 3 4 5", True), ("1 2 3 4 5 6", False)])
def test_missing_coefficients_are_remarked(numbers, remarked):
    """At the line that lacks them."""
    reports = scene(BALL + f"reflection reflection2\n{numbers}\n").lines.all
    assert [bool(report.note) for report in reports] == [False, False, False, remarked]
