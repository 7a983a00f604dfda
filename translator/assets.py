"""Finding the files that a scene names."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from relume.translator import files_read
from relume.translator.diagnostics import LineReports, Problem
from relume.translator.document import Document
from relume.translator.expressions import clip
from relume.translator.shapes import MeshFile
from relume.translator.source_text import FileName

Find = Callable[[str], Path | None]
"""Function from the name of a file, as a scene gives it, to its path; None where it is missing."""


def existing(find: Find, name: str) -> Path:
    """Path of a file that is known to be there: `Assets.problems` tells those that are missing."""
    path = find(name)
    assert path is not None
    return path


MAX_ENTRIES = 100_000
"""Most entries of the folders of `asset_path` that are looked at."""


class Assets:
    """The files that a document names, found or missing.

    A name, without quotes around it, is looked for as given from the working directory, then beside
    the scene file (spec section 12.1), in the end without regard to the case of letters, then below
    the folders of `asset_path`; there the case of letters, `\\` against `/`, and in the end all
    folders of the name are disregarded.

    Args:
        document: the document.
        asset_path: folders to look in.
    """

    def __init__(self, document: Document, asset_path: Iterable[FileName] = ()) -> None:
        self.beside = Path(document.path).parent
        self.folders = [Path(folder) for folder in asset_path]
        self.index: dict[str, list[Path]] | None = None
        self.found: dict[str, Path | None] = {}
        self.named = list(self._named(document))
        for _, _, name in self.named:
            if name not in self.found:
                self.found[name] = self.find(name)
        for path in filter(None, self.found.values()):
            files_read.record(path)

    def problems(self) -> list[Problem]:
        """A problem of kind `asset` for each missing file, at the line that names it."""
        return [
            Problem(
                line, column, f"no such file '{clip(name, 80)}'; {self.remedy()}", "asset"
            )
            for line, column, name in self.named
            if self.found[name] is None
        ]

    def remedy(self) -> str:
        """The places that were looked in, and how others are named, for messages."""
        places = ["the working directory", "the folder of the scene"]
        looked = ", ".join(places + [str(folder) for folder in self.folders])
        return f"looked in {looked}; --asset-path DIR looks below DIR, too"

    def find(self, name: str) -> Path | None:
        """Path of the file of a name, or None."""
        try:
            for spelling in spellings(name):
                relative = spelling.replace("\\", "/")
                for path in (Path(relative), self.beside / relative):
                    if path.is_file():
                        return path
                found = in_any_case(self.beside, relative) or self._below_folders(relative)
                if found is not None:
                    return found
        except (OSError, ValueError):
            pass
        return None

    def _below_folders(self, relative: str) -> Path | None:
        if self.index is None:
            self.index = self._list()
        parts = [part.casefold() for part in relative.split("/") if part not in ("", ".", "..")]
        candidates = self.index.get(parts[-1], ()) if parts else ()
        # The file whose folders agree with the name's, from the end, in most places.
        return max(candidates, key=lambda path: _agreement(path, parts), default=None)

    def _list(self) -> dict[str, list[Path]]:
        index: dict[str, list[Path]] = {}
        entries = 0
        for folder in self.folders:
            for root, folders, files in os.walk(folder):
                folders.sort()
                entries += len(files) + len(folders)
                if entries > MAX_ENTRIES:
                    return index
                for file in sorted(files):
                    index.setdefault(file.casefold(), []).append(Path(root) / file)
        return index

    def _named(self, document: Document) -> Iterator[tuple[int, int, str]]:
        if document.background_texture is not None:
            yield self._place(document.lines, "background_texture", document.background_texture)
        for block in document.objects:
            if isinstance(block.shape, MeshFile):
                yield block.lines.line() + 1, 1, block.shape.file
            for field in ("texture", "bump_texture", "ibl_texture"):
                if (name := getattr(block, field)) is not None:
                    yield self._place(block.lines, field, name)

    def _place(self, lines: LineReports, field: str, name: str) -> tuple[int, int, str]:
        return lines.line(field), len(field) + 2, name


def spellings(name: str) -> Iterator[str]:
    """The names that a name may stand for: itself, and where it is in quotes what they enclose."""
    yield name
    if len(name) > 2 and name[0] == name[-1] and name[0] in "\"'":
        yield name[1:-1].strip()


def in_any_case(folder: Path, relative: str) -> Path | None:
    """The file of a relative path below a folder without regard to the case of letters, or None."""
    here = folder
    parts = [part for part in relative.split("/") if part not in ("", ".")]
    if not parts or relative.startswith("/"):
        return None
    for part in parts:
        if not (here / part).exists():
            alike = [each for each in _names(here) if each.casefold() == part.casefold()]
            if not alike:
                return None
            part = alike[0]
        here = here / part
    return here if here.is_file() else None


def _names(folder: Path) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except OSError:
        return []


def _agreement(path: Path, parts: list[str]) -> int:
    count = 0
    for have, want in zip(reversed(path.parts), reversed(parts), strict=False):
        if have.casefold() != want:
            break
        count += 1
    return count
