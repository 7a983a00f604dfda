"""Radiance pictures (``.hdr``): RGBE pixels, flat or run-length coded in the old or the new way.

Ward, "Real Pixels", Graphics Gems II (1991). Values are mantissa * 2^(exponent - 136); EXPOSURE
and other header variables do not change them.
"""

import re

import numpy as np

_RESOLUTION = re.compile(rb"([+-])([XY]) +(\d{1,9}) +([+-])([XY]) +(\d{1,9})[ \r]*\n")
_HEADER_BYTES = 1 << 16
_ONE = np.float32(1)


def read_header(data):
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


def read_pixels(data):
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


def _scanlines(data, at, count, length):
    """RGBE bytes, uint8 (count, length, 4)."""
    out = np.empty((count, length, 4), np.uint8)
    mark = b"\2\2" + length.to_bytes(4, "big")[2:]
    for row in range(count):
        if not 8 <= length < 32768 or data[at : at + 4] != mark:
            out[row:] = _old_runs(data, at, (count - row) * length).reshape(-1, length, 4)
            break
        at += 4
        line = bytearray()
        for channel in range(1, 5):
            at = _new_runs(data, at, line, channel * length)
        out[row] = np.frombuffer(line, np.uint8).reshape(4, length).T
    return out


def _new_runs(data, at, line, end):
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


def _old_runs(data, at, need):
    """`need` pixels of flat data, in which (1, 1, 1, n) repeats the pixel before it n times.

    The n of k such marks in a row are the bytes of one number, lowest first.
    """
    stored = np.frombuffer(data, np.uint8, (len(data) - at) // 4 * 4, at).reshape(-1, 4)[:need]
    mark = (stored[:, :3] == 1).all(axis=1)
    index = np.arange(len(stored))
    source = np.maximum.accumulate(np.where(mark, -1, index))
    digit = np.minimum(index - source - 1, 4)
    repeats = np.where(mark, stored[:, 3].astype(np.int64) << (8 * np.where(mark, digit, 0)), 1)
    total = np.cumsum(np.minimum(repeats, need))
    if len(stored) and source[0] < 0:
        raise ValueError("a run before the first pixel")
    if not len(stored) or total[-1] < need:
        have = int(total[-1]) if len(stored) else 0
        raise ValueError(f"the pixels are incomplete: {have} of {need}")
    last = int(np.searchsorted(total, need))
    repeats = np.minimum(repeats, need)[: last + 1]
    return stored[np.repeat(source[: last + 1], repeats)[:need]]
