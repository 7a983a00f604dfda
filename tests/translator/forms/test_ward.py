"""Parameters of the Ward model (section 8.5)."""

import pytest

from tests.translator.reading import BALL, ball, error, outcomes


@pytest.mark.parametrize(
    ("line", "value"),
    [("ward_brdf 0.5 0.6 0.1 0.2", (0.5, 0.6, 0.1, 0.2)),
     ("ward_brdf 0.6 0.1 0.2", (1, 0.6, 0.1, 0.2)),
     ("ward_brdf 0.1 0.2", (1, 1, 0.1, 0.2))],
)
def test_old_forms_of_ward(line, value):
    """Two and three values stand for rho_d 1, and rho_s 1 (16 real files)."""
    assert ball(line + "\n").ward_brdf == value
    assert ("old form" in outcomes(BALL + line)[3][2]) == (len(line.split()) < 5)


def test_ward_needs_lobes():
    """alpha 0 is no lobe; five values are too many."""
    assert error(BALL + "ward_brdf 0 1 0 0.1\n")[:3] == (3, 15, "range")
    assert error(BALL + "ward_brdf 0 1 1 1 1\n")[:3] == (3, 19, "syntax")


def test_remarks_on_its_numbers():
    """A number that the program read as octal is noted, as for any other keyword."""
    assert "'010' read as decimal" in outcomes(BALL + "ward_brdf 1 1 010 1\n")[3][2]
