"""Bulk conversion of OBJ text: numbers, face corners, triangles, vertices without duplicates."""

import warnings

import numpy as np

BLANK = np.isin(np.arange(256), (9, 10, 32))
"""Which bytes separate values: blank, tab and line feed."""

MAX_DIGITS = 18
"""Longest index, sign included, that fits 64 bits."""


def column(table, k):
    """The k-th number of every line."""
    values, counts, _ = table
    if len(counts) and (counts == counts[0]).all():
        return values.reshape(len(counts), -1)[:, k]
    return values[np.cumsum(counts) - counts + k]


def count_tokens(text):
    """Number of tokens in a text and in each of its lines."""
    blank = BLANK[np.frombuffer(text, np.uint8)]
    begin = np.flatnonzero(blank[:-1] & ~blank[1:])
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == 10)
    return len(begin), np.diff(np.searchsorted(begin, ends), prepend=0)


def parse_numbers(text, dtype):
    """Numbers of a text up to the first malformed one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            return np.fromstring(text, dtype, sep=" ")
        except ValueError:
            return np.empty(0)


def parse_corners(text, count):
    """Corners as written (count, 3), 0 where absent; None if one is malformed."""
    raw = np.frombuffer(text, np.uint8)
    slash = raw == 47
    delimiter = BLANK[raw] | slash
    starts = np.flatnonzero(delimiter[:-1] & ~delimiter[1:]) + 1
    ends = np.flatnonzero(~delimiter[:-1] & delimiter[1:]) + 1
    numbers = parse_numbers(text.replace(b"/", b" "), np.int64)
    if len(numbers) != len(starts) or (ends - starts).max() > MAX_DIGITS or (numbers == 0).any():
        return None
    slashes = np.flatnonzero(slash)
    if not len(slashes):
        corners = np.zeros((count, 3), np.int64)
        corners[:, 0] = numbers
        return corners
    before = raw[slashes - 1]
    if BLANK[before].any() or delimiter[slashes[before == 47] - 2].any():
        return None
    return _fields(raw, starts, numbers, count)


def _fields(raw, starts, numbers, count):
    """Sort numbers into v, vt and vn by the slashes before them."""
    leads = BLANK[raw[starts - 1]]
    double = ~leads & (raw[starts - 2] == 47)
    single = ~leads & ~double
    after_lead = np.concatenate(([False], leads[:-1]))
    texture = single & after_lead
    third = single & np.concatenate(([False], texture[:-1]))
    if (single & ~texture & ~third).any() or (double & ~after_lead).any():
        return None
    corner = np.cumsum(leads) - 1
    corners = np.zeros((count, 3), np.int64)
    for k, field_k in enumerate((leads, texture, double | third)):
        corners[corner[field_k], k] = numbers[field_k]
    return corners


def fan(corners, counts):
    """Triangles (T, 3 corners, 3 attributes) and the face that each belongs to."""
    first = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(counts)), counts - 2)
    base = first[owner]
    step = np.arange(len(owner)) - (first - 2 * np.arange(len(counts)))[owner]
    return corners[np.stack([base, base + step + 1, base + step + 2], axis=1)], owner


def split_by_label(labels):
    """(label, indices) for each label, in order of first appearance."""
    if (labels == labels[0]).all():
        return [(labels[0], slice(None))]
    order = np.argsort(labels, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    parts.sort(key=lambda part: part[0])
    return [(labels[part[0]], part) for part in parts]


def unify(corners):
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


def join_lines(data):
    """Blank the line ends that a backslash of a numeric line escapes; also their offsets."""
    joints = []
    pieces, done = [], 0
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


def decode(raw):
    """A name: UTF-8 where it is, else cp932."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp932", errors="replace")
