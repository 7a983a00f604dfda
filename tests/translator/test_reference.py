"""The reference page is what the tables say."""

import re
from pathlib import Path

import pytest

from relume.translator.dialects import DIFFERENCES
from relume.translator.document import Document
from relume.translator.forms.reflections import REFLECTIONS
from relume.translator.keywords import rows
from relume.translator.objects import SceneObject
from relume.translator.reference import page
from relume.translator.shapes import SHAPES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "keywords.md"


def test_the_committed_page_is_current():
    """After a change of a table: `python -m relume.translator.reference > docs/keywords.md`."""
    assert PAGE.read_text(encoding="utf-8") == page()


def test_every_word_has_its_row():
    """Each keyword, shape, reflection and row of the dialects opens one line of a table."""
    opened = re.findall(r"^\| `(?:reflection )?([^`]+)`", page(), re.MULTILINE)
    names = [row.name for cls in (Document, SceneObject) for row in rows(cls)]
    names.remove("SUFFIX_SYMBOL")  # no keyword, an environment variable alone
    assert {*names, *SHAPES, *REFLECTIONS, *DIFFERENCES} <= set(opened)
    assert all(line.count("|") in (3, 5, 7) for line in page().splitlines() if line.startswith("|"))


@pytest.mark.parametrize("cls", [Document, SceneObject])
def test_docstrings_document_every_field(cls):
    """The tables also make the docstrings: name, keyword and sentence of each field."""
    for row in rows(cls):
        assert f"        {row.field}: {row.doc} (`{row.name}`, default " in cls.__doc__
