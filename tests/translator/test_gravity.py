"""Blocks of general relativity: read, although the manual does not know them."""

from relume.translator import parse, read_text
from relume.translator.gravity import BlackHole, WormHole


def test_gravity_blocks():
    """Outside the manual, but read, each with its own table of keywords."""
    text = "BLACKHOLE 1 2 3\ndist 5\nbackground_texture sky.png\n\nWORMHOLE\nin 0 0 1\n"
    document = read_text(text, environ={})
    assert document.gravity == [
        BlackHole((1, 2, 3), dist=5, background_texture="sky.png"), WormHole(entrance=(0, 0, 1))]


def test_errors_and_unknown_lines():
    """A position of two numbers is an error, and so is a misspelt line; others are passed over."""
    lines = ["BLACKHOLE 1 2", "distt 5", "charge 1", "coef 3", "", "DEPTH", "4"]
    document, problems = parse(lines, "", {})
    found = [(p.line, p.column, p.kind) for p in problems]
    assert found == [(1, 14, "syntax"), (2, 1, "keyword")]
    assert document.gravity == [BlackHole(coef=3)]
    assert document.depth == 4
    assert [(r.line, r.outcome) for r in document.gravity[0].lines.all] == [
        (1, "translated"), (3, "ignored"), (4, "translated")]
