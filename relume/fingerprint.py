"""Fingerprints: two scenes have the same hash where they hold the same values, and only there.

The hash of a translated scene covers its dictionary in order, the arrays of its meshes and pictures
and the bytes of the files that it names; paths and times do not count. The order counts, since
Mitsuba picks lights in the order in which they are listed, and so do the names of the objects, that
are made from their lines.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relume.options import RenderOptions
from relume.version import version

if TYPE_CHECKING:
    from relume.translator.scene import Translation

PER_PASS = "number of samples of a pixel in a pass"
DIGEST = 16  # bytes: among 2^40 scenes, two collide with probability 2^-49
FILE_KEY = "filename"
"""Key of a scene dictionary whose value is the path of a file."""


def content_hash(value: Any) -> str:
    """The hash of a value by its content.

    Args:
        value: None, bool, int, float, str, bytes, `ndarray`, path, dataclass (such as
            `relume.translator.scene_values.Mesh`), or a list, tuple or dictionary of such; in a
            dictionary the value of `filename` is replaced by the content of that file.

    Returns:
        32 hexadecimal digits.

    Raises:
        TypeError: a value of another type.
        OSError: a file cannot be read.
    """
    digest = hashlib.blake2b(digest_size=DIGEST)
    for part in _parts(value):
        digest.update(part)
    return digest.hexdigest()


def file_hash(path: str | Path) -> str:
    """The hash of a file's bytes: 32 hexadecimal digits."""
    digest = hashlib.blake2b(digest_size=DIGEST)
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def versions() -> dict[str, str]:
    """Versions of what the values of a rendered sample depend on, by package."""
    libraries = {name: importlib.metadata.version(name) for name in ("mitsuba", "drjit")}
    return {"relume": version()} | libraries


def of_render(translation: Translation, options: RenderOptions, per_pass: int) -> dict[str, Any]:
    """What the samples of a pass depend on, besides its index and their number.

    Args:
        translation: the translated scene.
        options: their seed, sampler, integrator and variant count, and where these are None the
            planned ones.
        per_pass: samples of a pixel in a pass.

    Returns:
        Dictionary of JSON values.
    """
    plan = translation.plan
    return {
        "scene": content_hash(translation.scene),
        "size": f"{plan.width}x{plan.height}",
        "variant": options.variant or plan.variant,
        "integrator": options.integrator or plan.integrator,
        "sampler": options.sampler,
        "seed": options.seed,
        PER_PASS: per_pass,
    } | versions()


def differences(there: Mapping[str, Any], here: Mapping[str, Any]) -> Iterator[str]:
    """Sentences that say in what the fingerprints of two renders differ.

    Args:
        there: one.
        here: the other, called so in the sentences.
    """
    if there.get("scene") != here["scene"] and there.get("size") == here["size"]:
        yield "its scene has another content"
    for key in here:
        if key != "scene" and there.get(key) != here[key]:
            yield f"its {key} is {there.get(key)}, here {here[key]}"


def _parts(value: Any) -> Iterator[bytes | memoryview]:
    """Bytes of a value, prefixed with its type and length, so that no two values share them."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int):
        yield _tagged(b"i", repr(value).encode())
    elif isinstance(value, float):
        yield b"f" + struct.pack("<d", value)
    elif isinstance(value, str):
        yield _tagged(b"s", value.encode("utf-8", "surrogatepass"))
    elif isinstance(value, bytes):
        yield _tagged(b"b", value)
    elif isinstance(value, np.ndarray):
        array = np.ascontiguousarray(value, value.dtype.newbyteorder("<"))
        yield _tagged(b"a", f"{array.dtype.str}{array.shape}".encode())
        yield array.data.cast("B") if array.size else b""
    elif isinstance(value, dict):
        yield b"d%d:" % len(value)
        for key, item in value.items():
            yield from _parts(key)
            named = key == FILE_KEY and isinstance(item, str | Path)
            yield from [_tagged(b"F", file_hash(item).encode())] if named else _parts(item)
    elif isinstance(value, list | tuple):
        yield b"l%d:" % len(value)
        for item in value:
            yield from _parts(item)
    elif dataclasses.is_dataclass(value):
        yield _tagged(b"c", type(value).__name__.encode())
        for field in dataclasses.fields(value):
            yield from _parts(getattr(value, field.name))
    else:
        raise TypeError(f"no hash of a {type(value).__name__}")


def _tagged(kind: bytes, data: bytes) -> bytes:
    return kind + b"%d:" % len(data) + data
