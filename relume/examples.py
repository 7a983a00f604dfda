"""`relume scenes`: the example scenes, listed, and copied with the files that they name."""

from __future__ import annotations

import difflib
import importlib.resources
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from relume.output import OutputError

TEXT = (".txt", ".obj", ".mtl")
"""Extensions of files that name other files."""


def folder() -> Path:
    """The folder of the scenes, in a checkout or where relume is installed."""
    return Path(str(importlib.resources.files("relume.scenes")))


def names() -> list[str]:
    """Names of all scenes, in order: those of their files without `.txt`."""
    return sorted(file.stem for file in folder().glob("*.txt"))


def opening(name: str) -> str:
    """What a scene shows: its first comment, as far as it does not say what to look for."""
    text = (folder() / f"{name}.txt").read_text(encoding="utf-8").partition("\n\n")[0]
    words = " ".join(line.removeprefix("#").strip() for line in text.splitlines())
    return words.partition("Look for:")[0].strip()


def print_names(console: Console) -> None:
    """Print the names of all scenes with what they show."""
    table = Table.grid(padding=(0, 2))
    for name in names():
        table.add_row(name, escape(opening(name)))
    console.print(table)


def copy(chosen: Iterable[str], target: str | Path) -> list[Path]:
    """Copy scenes with the meshes and pictures that they name.

    Args:
        chosen: names as `names` gives them, or those of the files.
        target: folder, which is made.

    Returns:
        Paths of the scene files written.

    Raises:
        ValueError: there is no scene of such a name.
        OutputError: a file of that name and of other content is there; nothing was written. Or a
            file cannot be written.
    """
    source, target = folder(), Path(target)
    scenes = [source / f"{_known(name)}.txt" for name in chosen]
    files = {file.relative_to(source) for scene in scenes for file in _with_named(scene)}
    for path in sorted(files):
        there = target / path
        if os.path.lexists(there) and not (
            there.is_file() and there.read_bytes() == (source / path).read_bytes()
        ):
            raise OutputError(f"{there} is there already, with other content: nothing was copied")
    try:
        for path in sorted(files):
            (target / path).parent.mkdir(parents=True, exist_ok=True)
            if not (target / path).exists():
                shutil.copyfile(source / path, target / path)
    except OSError as error:
        raise OutputError(f"cannot copy to {target}: {error.strerror}") from error
    return [target / scene.name for scene in scenes]


def _known(name: str) -> str:
    stem, known = name.removesuffix(".txt"), names()
    if stem in known:
        return stem
    near = difflib.get_close_matches(stem, known, 1)
    hint = f"did you mean '{near[0]}'?" if near else "relume scenes lists them"
    raise ValueError(f"there is no example scene '{name}'; {hint}")


def _with_named(file: Path) -> set[Path]:
    """A file, those that it names by paths from its own folder, those that these name, ..."""
    found = {file}
    if file.suffix in TEXT:
        for word in set(file.read_text(encoding="utf-8").split()):
            named = file.parent / word
            if named.suffix and named != file and named.is_file():
                found |= _with_named(named)
    return found
