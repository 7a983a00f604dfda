"""What a picture file says of its render: texts by name in OpenEXR and PNG files.

Equal renders have equal texts, so that equal commands write equal files; times are not among them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from relume.accumulator import Accumulator
from relume.passes_file import Header
from relume.picture_formats import COMMENT
from relume.translator import Translation
from relume.version import version

PREFIX = "relume."
RENDER, SPP, NOISE, GAMMA = (PREFIX + name for name in ("render", "spp", "noise", "gamma"))
NOTES, DENOISED, CHOICE = (PREFIX + name for name in ("notes", "denoised", "choice"))


def of_picture(header: Header, accumulator: Accumulator) -> dict[str, str]:
    """What a picture says of its render.

    Args:
        header: which render it is.
        accumulator: what was rendered.
    """
    render = header.render
    facts = {
        "Software": f"relume {version()}",
        PREFIX + "integrator": str(render["integrator"]),
        PREFIX + "variant": str(render["variant"]),
        PREFIX + "seed": str(render["seed"]),
        SPP: str(accumulator.spp),
        RENDER: json.dumps(render, sort_keys=True),
    } | header.facts
    if header.gamma:
        facts[GAMMA] = f"{header.gamma:g}"
    if math.isfinite(noise := accumulator.noise()):
        facts[NOISE] = f"{noise:.4g}"
    return facts


def of_scene(translation: Translation, dialect: str) -> dict[str, str]:
    """What a translated scene says of its picture.

    Args:
        translation: the translated scene.
        dialect: by which it was translated.
    """
    facts = {PREFIX + "dialect": dialect}
    if translation.document.path:
        facts[PREFIX + "scene"] = Path(translation.document.path).name
    if translation.stand_ins:
        names = ", ".join(repr(name) for name in translation.stand_ins)
        facts[COMMENT] = f"relume --stand-ins: shown instead of missing files: {names}"
    if notes := "\n".join(losses(translation)):
        facts[NOTES] = notes
    return facts


def of_choice(why: str) -> dict[str, str]:
    """What a picture says of why it has its integrator; nothing where there was no choice."""
    return {CHOICE: why} if why else {}


def losses(translation: Translation) -> list[str]:
    """What of a scene is not rendered as written: `unsupported line 3, keyword: why`."""
    lines = [
        f"{line.outcome} line {line.line}, {line.keyword}: {line.note}"
        for outcome in ("unsupported", "approximated")
        for line in translation.document.lines.all
        if line.outcome == outcome and line.note
    ]
    return lines + [note.text for note in translation.picture_notes()]


def of_file(path: str | Path) -> dict[str, str]:
    """The texts of a picture file, of any program; empty where it has none or is no picture."""
    if Path(path).suffix.lower() == ".exr":
        return _texts(_exr_header(path))
    from PIL import Image

    try:
        with Image.open(path) as picture:
            picture.load()
            return _texts(getattr(picture, "text", {}))
    except (OSError, ValueError, SyntaxError):
        return {}


def _exr_header(path: str | Path) -> Mapping[str, Any]:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            return dict(file.header())
    except (RuntimeError, OSError):
        return {}


def _texts(attributes: Mapping[str, Any]) -> dict[str, str]:
    return {name: str(text) for name, text in attributes.items() if isinstance(text, str)}
