"""Bulk conversion of OBJ text: numbers, face corners, triangles, vertices without duplicates.

Numbers are converted in blocks that fit the cache. A block is reduced to its runs of digits; eight
digits at a time become a number by arithmetic on one 64-bit word (the multiplications add up
neighbouring digits, then pairs, then fours). Decimals with at most 15 digits are then a whole
number over a power of ten, which one division rounds correctly. Blocks with exponents or more
digits go through `numpy.fromstring`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

BLANK = np.isin(np.arange(256), (9, 10, 32))
"""Which bytes separate values: blank, tab and line feed."""

MAX_DIGITS = 16
"""Most digits that an index may have."""

_PAD = 16
_BLOCK = 1 << 17
_POWERS = 10.0 ** np.arange(17)
_KEEP = np.array([0] + [(1 << 64) - (1 << 64 - 8 * k) for k in range(1, 9)], np.uint64)


Table: TypeAlias = tuple[np.ndarray, np.ndarray]
"""All numbers of some lines, one behind the other, and how many each line has."""

Convert: TypeAlias = Callable[[np.ndarray, np.ndarray, int], np.ndarray]
"""`decimals` or `corners`: from bytes, the eight bytes from each on as one word, and a count."""


class MalformedError(Exception):
    """Some value of a text is malformed; the caller looks for it line by line."""


def column(table: Table, k: int) -> np.ndarray:
    """The k-th number of every line.

    Args:
        table: the numbers.
        k: from 0, less than every count.
    """
    values, counts = table
    if len(counts) and (counts == counts[0]).all():
        return values.reshape(len(counts), -1)[:, k]
    return values[np.cumsum(counts) - counts + k]


def parse_lines(text: bytes, keyword: bytes, convert: Convert) -> Table:
    """Convert all lines of a keyword.

    Args:
        text: whole lines that begin with the keyword, without comments.
        keyword: ``b"v"``, ``b"vt"``, ``b"vn"`` or ``b"f"``.
        convert: `decimals` or `corners`.

    Returns:
        What `convert` returns for each block, joined, and the number of values of each line.

    Raises:
        MalformedError: a value is no number or corner.
    """
    raw = np.full(len(text) + _PAD, 32, np.uint8)
    raw[_PAD:] = np.frombuffer(text, np.uint8)
    words: np.ndarray = np.ndarray(len(text) + _PAD - 7, "<u8", raw, strides=(1,))
    values: list[np.ndarray] = []
    counts: list[np.ndarray] = []
    low = 0
    while low < len(text):
        high = text.rfind(b"\n", low, low + _BLOCK) + 1 or text.find(b"\n", low) + 1
        block = raw[low + _PAD : high + _PAD]
        ends = np.flatnonzero(block == 10)
        starts = np.concatenate(([0], ends[:-1] + 1))
        for k in range(len(keyword)):
            block[starts + k] = 32
        blank = block <= 32
        first = np.flatnonzero(blank[:-1] & ~blank[1:])
        values.append(convert(block, words[low:], len(first)))
        counts.append(np.diff(np.searchsorted(first, ends), prepend=0))
        low = high
    if not values:
        return convert(raw[:1], words, 0), np.zeros(0, np.int64)
    return np.concatenate(values), np.concatenate(counts)


def _digit_runs(block: np.ndarray, words: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Begin, end and value (at most 16 digits) of the runs of digits in a block."""
    digit = block - np.uint8(48) < 10
    edges = np.flatnonzero(digit[1:] != digit[:-1]) + 1
    begin, end = edges[::2], edges[1::2]
    length = end - begin
    if len(length) and length.max() > 16:
        raise MalformedError
    value = _eight_digits(words[end + (_PAD - 8)], np.minimum(length, 8))
    if len(length) and length.max() > 8:
        upper = _eight_digits(words[end + (_PAD - 16)], np.maximum(length - 8, 0))
        value += upper * np.uint64(100_000_000)
    return begin, end, value.astype(np.int64)


def _eight_digits(word: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Value of the last `length` of eight digits, the first digit in the lowest byte."""
    word = word & np.uint64(0x0F0F0F0F0F0F0F0F) & _KEEP[length]
    word = word * np.uint64(10) + (word >> np.uint64(8))
    low = (word & np.uint64(0x000000FF000000FF)) * np.uint64(0x000F424000000064)
    high = ((word >> np.uint64(16)) & np.uint64(0x000000FF000000FF)) * np.uint64(0x0000271000000001)
    return (low + high) >> np.uint64(32)


def decimals(block: np.ndarray, words: np.ndarray, count: int) -> np.ndarray:
    """The `count` decimal numbers of a block, float64."""
    try:
        values = _short_decimals(block, words)
    except MalformedError:
        values = _any_decimals(block)
    if len(values) != count or not np.isfinite(values).all():
        raise MalformedError
    return values


def _any_decimals(block: np.ndarray) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(block.tobytes(), np.float64, sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise MalformedError from error


def _short_decimals(block: np.ndarray, words: np.ndarray) -> np.ndarray:
    """Numbers without exponents of at most 15 digits; everything in the block must belong to one.

    A run of digits leads a number or, after a point, is its fraction.
    """
    begin, end, value = _digit_runs(block, words)
    length = end - begin
    fraction = block[begin - 1] == 46
    joined = fraction & (np.concatenate(([-1], end[:-1])) == begin - 1)
    first = ~joined
    start = (begin - fraction)[first]
    before = block[start - 1]
    signed = (before == 43) | (before == 45)
    pointed = (block[end] == 46) & ~fraction
    marks = sum(map(np.count_nonzero, (signed, pointed, fraction & first)))
    if (
        not (block[start - 1 - signed] <= 32).all()
        or not ((block[end] <= 32) | pointed).all()
        or not (np.concatenate((joined[1:], [False])) | (block[end + pointed] <= 32)).all()
        or np.count_nonzero(block > 32) != length.sum() + marks
    ):
        raise MalformedError
    number = np.cumsum(first) - 1
    whole, digits = np.zeros((2, np.count_nonzero(first)))
    leads = ~fraction
    whole[number[leads]] = value[leads]
    places = length[fraction]
    behind = number[fraction]
    whole[behind] = whole[behind] * _POWERS[places] + value[fraction]
    digits[behind] = places
    if whole.max(initial=0) >= 1e15:
        raise MalformedError
    return whole / _POWERS[digits.astype(np.int64)] * np.where(before == 45, -1.0, 1.0)


def corners(block: np.ndarray, words: np.ndarray, count: int) -> np.ndarray:
    """The `count` corners of a block as written, int64 (count, 3); 0 where an index is absent."""
    begin, end, value = _digit_runs(block, words)
    before = block[begin - 1]
    signed = (before == 43) | (before == 45)
    start = begin - signed
    slash = np.flatnonzero(block == 47)
    if (
        (value == 0).any()
        or np.count_nonzero(block > 32) != (end - start).sum() + len(slash)
        or not ((block[start - 1] <= 32) | (block[start - 1] == 47)).all()
    ):
        raise MalformedError
    value[before == 45] *= -1
    found = np.zeros((count, 3), np.int64)
    if not len(slash):
        if len(value) != count:
            raise MalformedError
        found[:, 0] = value
        return found
    behind = block[slash - 1]
    if (behind <= 32).any() or (block[slash[behind == 47] - 2] == 47).any():
        raise MalformedError
    for k, (corner, chosen) in enumerate(_fields(block, start)):
        found[corner, k] = value[chosen]
    return found


def _fields(block: np.ndarray, start: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """For v, vt and vn: the corners that have it, and which of the numbers it is."""
    leads = block[start - 1] <= 32
    double = ~leads & (block[start - 2] == 47)
    single = ~leads & ~double
    after_lead = np.concatenate(([False], leads[:-1]))
    texture = single & after_lead
    third = single & np.concatenate(([False], texture[:-1]))
    if (single & ~texture & ~third).any() or (double & ~after_lead).any():
        raise MalformedError
    corner = np.cumsum(leads) - 1
    return [(corner[chosen], chosen) for chosen in (leads, texture, double | third)]


def split_by_label(labels: np.ndarray) -> list[tuple[int, np.ndarray | slice]]:
    """(label, indices) for each label, in order of first appearance."""
    if (labels == labels[0]).all():
        return [(int(labels[0]), slice(None))]
    order = np.argsort(labels, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    parts.sort(key=lambda part: int(part[0]))
    return [(int(labels[part[0]]), part) for part in parts]


def unify(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One index per distinct corner.

    Most vertices of a mesh have one texture coordinate and normal only. So each vertex first takes
    those of its last corner, and only the corners that differ are sorted.

    Args:
        corners: indices (v, vt, vn) of each corner, int64 (C, 3), not negative.

    Returns:
        v of each new vertex, its (vt, vn), and the new index of each corner.
    """
    v, pair = corners[:, 0], corners[:, 1:]
    known, v = np.unique(v, return_inverse=True) if len(v) < v.max() // 4 else (None, v)
    used = np.zeros(v.max() + 1, bool)
    used[v] = True
    main = np.zeros((len(used), 2), np.int64)
    main[v] = pair
    index = (np.cumsum(used) - 1)[v]
    sources, pairs = np.flatnonzero(used), main[used]
    differs = np.flatnonzero((main[v] != pair).any(axis=1))
    if len(differs):
        key = v[differs]
        for k in range(2):
            _, column = np.unique(pair[differs, k], return_inverse=True)
            _, key = np.unique(key * (column.max() + 1) + column, return_inverse=True)
        _, sample = np.unique(key, return_index=True)
        index[differs] = len(sources) + key
        sources = np.concatenate((sources, v[differs][sample]))
        pairs = np.concatenate((pairs, pair[differs][sample]))
    return sources if known is None else known[sources], pairs, index


def join_lines(data: bytes) -> tuple[bytes, list[int]]:
    """Blank the line ends that a backslash of a numeric line escapes; also their offsets."""
    joints: list[int] = []
    pieces: list[bytes] = []
    done = 0
    at = data.find(b"\\\n")
    while at >= 0:
        start = data.rfind(b"\n", 0, at) + 1
        continued = joints and joints[-1] == start - 1
        line = data[start:at].lstrip()
        if continued or (line[:1] in (b"v", b"f") and b"#" not in line):
            joints.append(at + 1)
            pieces += [data[done:at], b"  "]
            done = at + 2
        at = data.find(b"\\\n", at + 2)
    return b"".join([*pieces, data[done:]]) if joints else data, joints


def decode(raw: bytes) -> str:
    """A name: UTF-8 where it is, else cp932."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp932", errors="replace")
