"""Radiance pictures (``.hdr``): RGBE pixels, flat or run-length coded in the old or the new way.

Ward, "Real Pixels", Graphics Gems II (1991). Values are mantissa * 2^(exponent - 136); EXPOSURE
and other header variables do not change them.
"""

from __future__ import annotations

import re

import numpy as np

_RESOLUTION = re.compile(rb"([+-])([XY]) +(\d{1,9}) +([+-])([XY]) +(\d{1,9})[ \r]*\n")
_HEADER_BYTES = 1 << 16
_ONE = np.float32(1)
_LONGEST_RUN = 1 << 26


def read_header(data: bytes) -> tuple[int, int, tuple[str, str], int]:
    """Width, height, how to turn the stored rows, and where the pixels begin.

    Args:
        data: the file.

    Returns:
        (width, height, axes, offset); axes is (signs and letters) such as ``("-Y", "+X")``.

    Raises:
        ValueError: no such header, or XYZE pixels.
    """
    end = data.find(b"\n\n", 0, _HEADER_BYTES)
    found = _RESOLUTION.match(data, end + 2) if end >= 0 else None
    if not found or found[2] == found[5]:
        raise ValueError("the Radiance header has no resolution line")
    if re.search(rb"^FORMAT=.*xyze", data[:end], re.MULTILINE):
        raise ValueError("Radiance pixels in XYZ are not supported")
    first, second = found[1] + found[2], found[4] + found[5]
    sizes = {found[2]: int(found[3]), found[5]: int(found[6])}
    return sizes[b"X"], sizes[b"Y"], (first.decode(), second.decode()), found.end()


def read_pixels(data: bytes) -> np.ndarray:
    """Linear RGB, float32 (H, W, 3), top row first.

    Args:
        data: the file, of acceptable size.

    Raises:
        ValueError: malformed or incomplete.
    """
    width, height, (outer, inner), offset = read_header(data)
    count, length = (height, width) if outer[1] == "Y" else (width, height)
    rgbe = _scanlines(data, offset, count, length)
    if outer[1] == "X":
        rgbe = rgbe.transpose(1, 0, 2)
    if "+Y" in (outer, inner):
        rgbe = rgbe[::-1]
    if "-X" in (outer, inner):
        rgbe = rgbe[:, ::-1]
    exponents = rgbe[..., 3:].astype(np.int32)
    return rgbe[..., :3] * np.ldexp(_ONE, exponents - 136) * (exponents > 0)


def _scanlines(data: bytes, at: int, count: int, length: int) -> np.ndarray:
    """RGBE bytes, uint8 (count, length, 4); each row is coded in its own way."""
    out = np.empty((count, length, 4), np.uint8)
    mark = b"\2\2" + length.to_bytes(4, "big")[2:]
    left = out[0, :0]  # what a run of the old code has left for the next row
    for row in range(count):
        if not len(left) and 8 <= length < 32768 and data[at : at + 4] == mark:
            at += 4
            line = bytearray()
            for channel in range(1, 5):
                at = _new_runs(data, at, line, channel * length)
            out[row] = np.frombuffer(line, np.uint8).reshape(4, length).T
            continue
        pixels = left
        if len(left) < length:
            before = left[-1:] if len(left) else out[row - 1, -1:] if row else left
            more, at = _old_runs(data, at, length - len(left), before)
            pixels = np.concatenate((left, more))
        out[row], left = pixels[:length], pixels[length:]
    return out


def _new_runs(data: bytes, at: int, line: bytearray, end: int) -> int:
    """Append one channel of a scanline, up to `end` bytes in all; returns the next offset."""
    while len(line) < end:
        if at + 1 >= len(data):
            raise ValueError("the pixels are incomplete: the file ends within a scanline")
        code = data[at]
        if code > 128:
            line += data[at + 1 : at + 2] * (code - 128)
            at += 2
        elif code:
            line += data[at + 1 : at + 1 + code]
            at += 1 + code
        else:
            raise ValueError("a run of length 0")
    if len(line) > end:
        raise ValueError("a run reaches over the end of its scanline")
    return at


def _old_runs(data: bytes, at: int, need: int, before: np.ndarray) -> tuple[np.ndarray, int]:
    """At least `need` pixels of flat data, in which (1, 1, 1, n) repeats the one before n times.

    The n of k such marks in a row are the bytes of one number, lowest first.

    Args:
        data: the file.
        at: where the pixels begin.
        need: how many.
        before: the pixel before them, uint8 (1, 4), or none (0, 4).

    Returns:
        The pixels, uint8 (N, 4), more than `need` where a run ends later, and the next offset.
    """
    stored = np.frombuffer(data, np.uint8, min((len(data) - at) // 4, need) * 4, at).reshape(-1, 4)
    mark = (stored[:, :3] == 1).all(axis=1)
    if not mark.any() and len(stored) == need:
        return stored, at + 4 * need
    source = np.maximum.accumulate(np.where(mark, -1, np.arange(len(stored))))
    digit = np.minimum(np.arange(len(stored)) - source - 1, 4)
    repeats = np.where(mark, stored[:, 3].astype(np.int64) << (8 * np.where(mark, digit, 0)), 1)
    total = np.cumsum(np.minimum(repeats, _LONGEST_RUN))
    if len(stored) and source[0] < 0 and not len(before):
        raise ValueError("a run before the first pixel")
    if not len(stored) or total[-1] < need:
        have = int(total[-1]) if len(stored) else 0
        raise ValueError(f"the pixels are incomplete: a row ends after {have} of {need}")
    last = int(np.searchsorted(total, need))
    repeats = np.minimum(repeats, _LONGEST_RUN)[: last + 1]
    known = np.concatenate((before, stored))  # where there is one before, all indices grow by 1
    pixels = known[np.repeat(source[: last + 1] + len(before), repeats)]
    return pixels, at + 4 * (last + 1)
