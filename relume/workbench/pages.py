"""Pages from the templates beside this file, filled in by Jinja2; all text in HTML is escaped."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).parent / "templates"

Table: TypeAlias = tuple[Sequence[str], Iterable[Sequence[str]]]
"""The heading row and the other rows."""


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=lambda name: name is not None and name.endswith(".html"),
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )


def filled(template: str, **fields: Any) -> str:
    """A template with its fields filled in.

    Args:
        template: name of a file of `templates`; in `.html` fields are escaped, but for `Markup`.
        fields: what stands in the template.

    Raises:
        jinja2.UndefinedError: a field is missing.
    """
    return _environment().get_template(template).render(fields)


def asset(name: str) -> Markup:
    """A style or script of `templates`, to stand in a page as it is."""
    return Markup((FOLDER / name).read_text(encoding="utf-8"))


def png(figure: Figure) -> bytes:
    """A figure as the contents of a PNG file."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    return drawn.getvalue()


def summary(
    title: str,
    verdict: str,
    good: bool,
    png: bytes,
    tables: Iterable[Table] = (),
    notes: Iterable[str] = (),
) -> str:
    """A piece of HTML that shows a result in a notebook and needs nothing else.

    Args:
        title: what was measured.
        verdict: what was found, in a sentence.
        good: whether it is what one wishes for.
        png: a picture of it.
        tables: its figures.
        notes: what else is to be said.
    """
    picture = base64.b64encode(png).decode()
    return filled(
        "summary.html",
        title=title,
        verdict=verdict,
        good=good,
        png=picture,
        tables=list(tables),
        notes=list(notes),
    )
