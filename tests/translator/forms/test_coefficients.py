"""Coefficients of media (sections 10.1 and 10.2)."""

import pytest

from relume.translator import read_text
from relume.translator.diagnostics import SceneError

BALL = "OBJECT\nsphere 0 0 0 1\n"


def scene(text):
    return read_text(text, environ={})


def ball(lines):
    """The object that attribute lines make of a sphere."""
    (block,) = scene(BALL + lines).objects
    return block


def outcomes(text):
    """Keyword, outcome and note of each reported line, by line number."""
    return {r.line: (r.keyword, r.outcome, r.note) for r in scene(text).lines.all}


def error(text):
    """Line, column, kind and message of the one error."""
    with pytest.raises(SceneError) as caught:
        scene(text)
    (p,) = caught.value.problems
    return p.line, p.column, p.kind, p.message


def test_scattering_has_a_mean_that_is_not_used():
    """Two lines below `SCATTERING`; the first is a dummy."""
    assert ball("SCATTERING\n99\n1 2 3\n").scattering == (1, 2, 3)
    assert outcomes("SCATTERING\n99\n1 2 3\n")[2][1] == "ignored"
    assert error("SCATTERING\n1 2 3\n\n")[0] == 2
