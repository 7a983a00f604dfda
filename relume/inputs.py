"""The files that a scene reads: nothing that is written goes over one of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from relume.fingerprint import FILE_KEY
from relume.output import OutputError, split_extension

FileId = tuple[int, int]
"""Device and inode: the same for all names and links of a file, in whatever case of letters."""


class Inputs:
    """Files that are read, told apart by what they are, not by their names.

    Args:
        paths: the files; those that do not exist are left out.
    """

    def __init__(self, paths: Iterable[str | os.PathLike[str]] = ()) -> None:
        self._names: dict[FileId, Path] = {}
        for path in paths:
            if (found := file_id(path)) is not None:
                self._names.setdefault(found, Path(path))

    def and_(self, *paths: str | os.PathLike[str]) -> Inputs:
        """These files and others."""
        return Inputs([*self._names.values(), *paths])

    def over(self, path: str | os.PathLike[str]) -> Path | None:
        """The file of these that lies at a path, by the name under which it is read; else None."""
        found = file_id(path)
        return None if found is None else self._names.get(found)

    def refuse(self, *outputs: str | os.PathLike[str]) -> None:
        """Refuse to write over one of these files.

        Args:
            outputs: paths that are about to be written.

        Raises:
            OutputError: one of them is one of these files.
        """
        for path in outputs:
            if (name := self.over(path)) is not None:
                same = "" if os.fspath(path) == os.fspath(name) else f", which is {name}"
                raise OutputError(
                    f"cannot write {path}{same}: the scene reads this file; give another name"
                )

    def spared(self, path: Path, beside: Callable[[Path], Path] = lambda path: path) -> Path:
        """The path, or the first with `_` appended to its stem that is none of these files.

        Args:
            path: of a file that is about to be written.
            beside: gives the path of another that is written with it.
        """
        while self.over(path) or self.over(beside(path)):
            stem, extension = split_extension(path.name)
            path = path.with_name(f"{stem}_{extension}")
        return path


def file_id(path: str | os.PathLike[str]) -> FileId | None:
    """What tells a file from all others, links followed; None if there is none."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return status.st_dev, status.st_ino


def file_names(scene: Any) -> Iterator[str]:
    """The names of all files in a scene's plain dictionary."""
    if isinstance(scene, dict):
        for key, value in scene.items():
            if key == FILE_KEY and isinstance(value, str | Path):
                yield str(value)
            else:
                yield from file_names(value)
