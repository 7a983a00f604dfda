"""Scenes sent to a worker: a small dictionary, and arrays and files by their hash."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relume.fingerprint import FILE_KEY, content_hash, file_hash

Contents = np.ndarray | bytes
"""What travels by its hash: an array, or the bytes of a file."""


@dataclass(frozen=True)
class Content:
    """In the place of an array or file: the hash under which its content travels.

    Attributes:
        hash: `content_hash` of the array, or `file_hash` of the file.
        suffix: the file's extension; None for an array.
    """

    hash: str
    suffix: str | None = None


def pack(value: Any) -> tuple[Any, dict[str, Contents]]:
    """Take arrays and files out of a translated scene.

    Args:
        value: `Translation.scene`, or a value in it.

    Returns:
        The value with `Content` in their places, and a dictionary of arrays and bytes by hash.
    """
    contents: dict[str, Contents] = {}

    def packed(value: Any, key: str | None = None) -> Any:
        if key == FILE_KEY and isinstance(value, str | Path):
            place = Content(file_hash(value), Path(value).suffix)
            contents[place.hash] = Path(value).read_bytes()
            return place
        if isinstance(value, np.ndarray):
            place = Content(content_hash(value))
            contents[place.hash] = value
            return place
        return _mapped(value, packed)

    return packed(value), contents


def unpack(value: Any, contents: Mapping[str, Any], folder: str | Path) -> Any:
    """Undo `pack`; files are written into a folder.

    Args:
        value: the packed scene.
        contents: arrays and bytes by hash.
        folder: an existing folder.
    """

    def unpacked(value: Any, _key: str | None = None) -> Any:
        if not isinstance(value, Content):
            return _mapped(value, unpacked)
        if value.suffix is None:
            return contents[value.hash]
        path = Path(folder) / (value.hash + value.suffix)
        path.write_bytes(contents[value.hash])
        return str(path)

    return unpacked(value)


def _mapped(value: Any, change: Callable[..., Any]) -> Any:
    """A container with `change(item, key)` of its items; any other value as it is."""
    if isinstance(value, dict):
        return {key: change(item, key) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(change(item) for item in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, Content | type):
        fields = {f.name: change(getattr(value, f.name)) for f in dataclasses.fields(value)}
        return dataclasses.replace(value, **fields)
    return value
