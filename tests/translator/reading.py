"""What tests of reading share: short scene files, and what becomes of their lines."""

import pytest

from relume.translator import read_text
from relume.translator.diagnostics import SceneError

BALL = "OBJECT\nsphere 0 0 0 1\n"


def scene(text):
    """The document of a text, without environment variables."""
    return read_text(text, environ={})


def ball(lines):
    """The object that attribute lines make of a sphere."""
    (block,) = scene(BALL + lines).objects
    return block


def outcomes(text):
    """Keyword, outcome and note of each reported line, by line number."""
    return {r.line: (r.keyword, r.outcome, r.note) for r in scene(text).lines.all}


def errors(text):
    """Line, column, kind and message of every error."""
    with pytest.raises(SceneError) as caught:
        scene(text)
    return [(p.line, p.column, p.kind, p.message) for p in caught.value.problems]


def error(text):
    """Line, column, kind and message of the only error."""
    (only,) = errors(text)
    return only
