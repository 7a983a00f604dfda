"""Which files are read while a scene is translated, so that nothing is written over them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_read: ContextVar[set[Path] | None] = ContextVar("files_read", default=None)


@contextmanager
def recorded() -> Iterator[set[Path]]:
    """Context with a set that takes the path of every file that is read in it."""
    files: set[Path] = set()
    token = _read.set(files)
    try:
        yield files
    finally:
        _read.reset(token)


def record(path: str | os.PathLike[str]) -> None:
    """Say that a file is read."""
    files = _read.get()
    if files is not None:
        files.add(Path(path))
