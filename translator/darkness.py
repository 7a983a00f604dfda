"""Pictures that stay empty: scenes without light, and cameras that nothing is before."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note
from relume.translator.scene_values import Entry, Picture

QUANTITIES = ("radiance", "irradiance", "intensity")
"""Parameters that say how bright an emitter is."""


NOTHING_SHINES = make_note("no-light")
"""What a render says of a scene without emitters."""

NOTHING_SEEN = make_note("nothing-before-camera")
"""What a render says whose camera sees no surface."""

NOTHING_ARRIVES = make_note("no-light-arrives")
"""What a render says of a black picture of a scene in which something shines."""


def empty_picture_notes(entries: Iterable[Entry]) -> tuple[Note, ...]:
    """What makes the whole picture black, or shows the background alone: a note, or none.

    Args:
        entries: shapes and emitters of a scene.
    """
    entries = list(entries)
    if not any(map(shines, entries)):
        return (NOTHING_SHINES,)
    return () if any("bsdf" in entry for entry in entries) else (make_note("no-surface"),)


def shines(entry: Entry) -> bool:
    """Whether a shape or an emitter gives any light."""
    emitter = entry.get("emitter", entry)
    if any(key in emitter for key in QUANTITIES):
        return any(is_bright(emitter.get(key)) for key in QUANTITIES)
    picture = emitter.get("picture")
    if emitter.get("type") in ("envmap", "ibldome") and picture is not None:
        return emitter.get("scale", 1.0) > 0 and is_bright(picture)
    return False


def is_bright(value: Any) -> bool:
    """Whether a spectrum, a texture or a picture is above 0 anywhere."""
    if isinstance(value, Picture):
        return bool(np.any(np.asarray(value.pixels) > 0))
    if isinstance(value, dict):
        if value.get("scale", 1.0) == 0:
            return False
        return any(is_bright(value[key]) for key in ("value", "picture", "nested") if key in value)
    return value is not None and bool(np.any(np.asarray(value) > 0))
