"""How a document shows itself: a line in a console, tables in a notebook."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from html import escape
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from relume.translator.keywords import rows
from relume.translator.plan import samples, samples_reason

if TYPE_CHECKING:
    from relume.translator.document import Document
    from relume.translator.objects import SceneObject

HOLES = {"BlackHole": "black hole", "WormHole": "wormhole"}
"""What the blocks that bend space are called."""

LONGEST = 60
"""Characters of a setting that are shown."""


class Displayed:
    """Gives `Document` a short `repr`, and tables in notebooks."""

    def __repr__(self: Document) -> str:  # type: ignore[misc]
        return f"<Document {summary(self)}>"

    def _repr_html_(self: Document) -> str:  # type: ignore[misc]
        return tables(self)


def summary(document: Document) -> str:
    """What a document is, such as `room.txt: 640x480 pixels, 16 spp, 4 objects, 1 black hole`."""
    width, height = document.image
    count = len(document.objects)
    objects = "1 object" if count == 1 else f"{count} objects"
    name = PurePath(document.path).name or "without a name"
    kinds = Counter(HOLES[type(block).__name__] for block in document.gravity)
    holes = [f"{count} {kind}{'s' if count > 1 else ''}" for kind, count in kinds.items()]
    return ", ".join(
        [f"{name}: {width}x{height} pixels", f"{samples(document)} spp", objects, *holes]
    )


def tables(document: Document) -> str:
    """HTML of a document: its settings that are not the defaults, and its objects by kind."""
    cls: Any = type(document)  # mypy takes it for unhashable, as documents are
    settings = [
        (row.name, _short(getattr(document, row.field)))
        for row in rows(cls)
        if getattr(document, row.field) not in (row.default, None)
    ]
    settings.append(("samples of a pixel", f"{samples(document)}: {samples_reason(document)}"))
    kinds = Counter(_kind(block) for block in document.objects)
    objects = [(str(count), *kind) for kind, count in kinds.items()]
    holes = [
        (HOLES[type(block).__name__], row.name, _short(getattr(block, row.field)))
        for block in document.gravity
        for row in rows(type(block))
        if getattr(block, row.field) not in (row.default, None)
    ]
    return (
        f"<div><b>{escape(summary(document))}</b>"
        + _table(("keyword", "value"), settings)
        + (_table(("objects", "shape", "surface", "emits"), objects) if objects else "")
        + (_table(("bends space", "keyword", "value"), holes) if holes else "")
        + "</div>"
    )


def _kind(block: SceneObject) -> tuple[str, str, str]:
    """Shape and surface of an object, and whether it emits light."""
    surface = block.reflection.kind or "diffuse"
    if block.reflection.subsurface:
        surface += ", subsurface"
    emits = any(block.emission) or block.ibl_texture is not None
    return type(block.shape).__name__, surface, "yes" if emits else ""


def _short(value: object) -> str:
    if isinstance(value, tuple):
        text = " ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in value)
    else:
        text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"


def _table(heading: Iterable[str], lines: Iterable[Iterable[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in line) + "</tr>" for line in lines
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
