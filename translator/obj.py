"""Wavefront OBJ meshes: one triangle mesh per material, with vertex colours and located errors.

Mitsuba's stock ``obj`` plugin is the fastest reader there is, but it ignores vertex colours and
materials, refuses negative indices, and returns uninitialised memory for several malformed files.
`features` scans a file for everything the stock plugin would get wrong; only where it says `plain`
may the file go there. (Should the stock plugin still refuse such a file, `read_obj` says where the
mistake is.) `read_obj` reads every file, in bulk: the lines are sorted by keyword, and the numbers
of all lines of a keyword are converted at once.

Coordinates are those of the file: v of a texture coordinate grows upwards, where the stock plugin
by default hands on 1 - v.
"""

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

MAX_BYTES = 1 << 30
"""Largest OBJ file that is read (1 GiB, about 25 million triangles)."""

_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_CORNER = re.compile(rb"[+-]?\d+(/([+-]?\d+)?(/([+-]?\d+)?)?)?")
_TOKEN = re.compile(rb"[^ \t\n]+")
_IGNORED = {b"", b"g", b"o", b"s"}
_V, _VT, _VN, _F, _USEMTL, _MTLLIB, _OTHER = range(7)
_ATTRIBUTES = ("vertex", "texture coordinate", "normal")


class MeshError(Exception):
    """A mesh file that cannot be read.

    Attributes:
        path: the file, as it was given.
        line: line number from 1, or None where the whole file is meant.
        column: column in bytes from 1, or None.
        message: what is wrong, without the place.
    """

    def __init__(self, path, line, column, message):
        self.path, self.line, self.column, self.message = path, line, column, message
        place = [str(path)] + [str(n) for n in (line, column) if n is not None]
        super().__init__(f"{':'.join(place)}: {message}")


@dataclass
class Group:
    """The faces of one material, with one index per distinct (v, vt, vn) triple.

    Attributes:
        material: name after ``usemtl`` in its first spelling, None before any ``usemtl``.
        line: line of the first such ``usemtl``, None where there is none.
        vertices: float64 (V, 3), in file units.
        faces: int32 (F, 3) into `vertices`; polygons are fans about their first corner.
        normals: unit vectors float64 (V, 3), or None where the file gives none for all corners.
        uv: float64 (V, 2), v upwards, or None.
        colors: linear RGB float64 (V, 3), or None.
        source: int64 (V,), index of the OBJ vertex behind each mesh vertex.
    """

    material: str | None
    line: int | None
    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    colors: np.ndarray | None
    source: np.ndarray


@dataclass
class ObjFile:
    """What an OBJ file holds.

    Attributes:
        groups: one `Group` per material that has faces, in order of appearance.
        mtllib: names after ``mtllib``, with their lines, in file order.
        notes: (line, text) of what was read otherwise than written.
        positions: all vertices of the file, float64 (N, 3).
        triangles: all triangles as indices into `positions`, int64 (T, 3).
    """

    groups: list[Group]
    mtllib: list[tuple[int, str]]
    notes: list[tuple[int, str]]
    positions: np.ndarray = field(repr=False)
    triangles: np.ndarray = field(repr=False)

    @cached_property
    def _normals(self):
        return vertex_normals(self.positions, self.triangles)

    def smooth_normals(self, group):
        """Area-weighted normals of a group, float64 (V, 3), smooth across texture seams and groups."""
        return self._normals[group.source]


@dataclass(frozen=True)
class Features:
    """Whether Mitsuba's stock ``obj`` plugin reads a file as `read_obj` does.

    Attributes:
        plain: True if it does.
        reason: why not, None where it does.
        has_normals: all corners name a normal (known only where plain).
        has_uv: all corners name a texture coordinate (known only where plain).
    """

    plain: bool
    reason: str | None
    has_normals: bool
    has_uv: bool


def vertex_normals(vertices, faces):
    """Area-weighted averages of the normals of the adjacent faces.

    Args:
        vertices: float (V, 3).
        faces: int (F, 3).

    Returns:
        Unit vectors float64 (V, 3); (0, 0, 1) where the adjacent faces have no area.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    weighted = np.cross(b - a, c - a)
    total = np.zeros((len(vertices), 3))
    for axis in range(3):
        for corner in range(3):
            total[:, axis] += np.bincount(
                faces[:, corner], weights=weighted[:, axis], minlength=len(vertices)
            )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.where(length > 0, length, 1), (0.0, 0.0, 1.0))


def plain(path):
    """True if Mitsuba's stock ``obj`` plugin reads the file as `read_obj` does; see `features`."""
    return features(path).plain


def features(path):
    """Scan an OBJ file for what Mitsuba's stock plugin ignores or misreads.

    Plain files consist of ``v``, ``vt``, ``vn``, ``f``, comments and grouping lines; their faces
    are triangles and quads with positive indices that all name the same attributes; the last
    vertex has no colour. Ranges of indices are left to the stock plugin, which checks them.

    Args:
        path: OBJ file.

    Returns:
        `Features`.

    Raises:
        MeshError: the file cannot be opened or is too large.
    """
    scan = _PlainScan()
    try:
        scan.read(_read_bytes(path))
    except _NotPlainError as reason:
        return Features(False, str(reason), False, False)
    return Features(True, None, scan.form in ("a//c", "a/b/c"), scan.form in ("a/b", "a/b/c"))


class _NotPlainError(Exception):
    pass


class _PlainScan:
    """Walks over a file in blocks that fit the cache, and in each over runs of lines of a keyword.

    Delimiters are all bytes below "0": blanks, line ends, signs, points and slashes.
    """

    BLOCK = 1 << 18
    MAX_RUNS = 20000
    FORMS = {0: "a", 1: "a/b", 2: "a/b/c", -2: "a//c"}
    USED = {"a": set(), "a/b": {"t"}, "a//c": {"n"}, "a/b/c": {"n", "t"}}

    def __init__(self):
        self.form = None
        self.attributes = set()
        self.runs = 0

    def read(self, data):
        last = max(data.rfind(b"\nv "), data.rfind(b"\nv\t")) + 1
        if len(data[last : data.find(b"\n", last)].split()) >= 7:
            raise _NotPlainError("vertex colours")
        start = 0
        while start < len(data):
            end = data.rfind(b"\n", start, start + self.BLOCK) + 1
            end = end or data.find(b"\n", start) + 1 or len(data)
            self.block(data[start:end].replace(b"\r\n", b"\n"))
            start = end
        if self.form is None:
            raise _NotPlainError("no faces")
        if self.attributes != self.USED[self.form]:
            raise _NotPlainError("texture coordinates or normals that no face uses")

    def block(self, block):
        text = np.frombuffer(block if block.endswith(b"\n") else block + b"\n", np.uint8)
        delimiters = np.flatnonzero(text < 48)
        kinds = text[delimiters]
        ends = np.flatnonzero(kinds == 10)
        starts = np.concatenate(([0], delimiters[ends[:-1]] + 1))
        first = text[starts]
        cuts = [0, *(np.flatnonzero(first[1:] != first[:-1]) + 1).tolist(), len(first)]
        self.runs += len(cuts)
        if self.runs > self.MAX_RUNS:
            raise _NotPlainError("vertices and faces alternate")
        for a, b in zip(cuts, cuts[1:], strict=False):
            keyword = chr(first[a])
            if keyword not in "vf":
                if keyword not in "#gos\n":
                    raise _NotPlainError(f"lines that begin with {keyword!r}")
                continue
            low, high = starts[a], delimiters[ends[b - 1]] + 1
            run = slice(ends[a - 1] + 1 if a else 0, ends[b - 1] + 1)
            check = self.faces if keyword == "f" else self.numbers
            check(text[low:high], delimiters[run] - low, kinds[run], starts[a:b] - low)

    def faces(self, text, delimiters, kinds, starts):
        if np.count_nonzero(text > 57) != len(starts):
            raise _NotPlainError("faces with other characters than digits and slashes")
        if (text[delimiters[:-1] + 1] == 48).any():
            raise _NotPlainError("indices that begin with 0")
        if np.diff(delimiters).max() > 10:
            raise _NotPlainError("indices above a thousand million")
        line = int(np.argmax(kinds == 10)) + 1
        if len(kinds) % line == 0 and (kinds[line:] == kinds[:-line]).all():
            delimiters, kinds = delimiters[:line], kinds[:line]
        self.corners(delimiters, kinds)

    def corners(self, delimiters, kinds):
        """Check the delimiters of whole ``f`` lines: equal forms, three or four corners."""
        if not np.isin(kinds, (9, 10, 32, 47)).all():
            raise _NotPlainError("indices with a sign")
        slash = kinds == 47
        touching = np.diff(delimiters) == 1
        if (touching & (slash[1:] != slash[:-1])).any():
            raise _NotPlainError("slashes without an index")
        double = np.concatenate(([0], np.cumsum(touching & slash[1:] & slash[:-1])))
        blank = np.flatnonzero(~slash)
        slashes, doubles = np.diff(blank) - 1, np.diff(double[blank])
        corner = (np.diff(delimiters[blank]) > 1) & (kinds[blank[:-1]] != 10)
        forms = np.where(doubles == 0, slashes, -slashes)[corner]
        count = np.concatenate(([0], np.cumsum(corner)))[np.flatnonzero(kinds[blank] == 10)]
        count = np.diff(count, prepend=0)
        if count.min() < 3 or count.max() > 4:
            raise _NotPlainError("faces with fewer than 3 or more than 4 corners")
        form = self.FORMS.get(int(forms[0]))
        if form is None or (forms != forms[0]).any() or self.form not in (None, form):
            raise _NotPlainError("corners that name different attributes")
        self.form = form

    def numbers(self, text, delimiters, kinds, starts):
        if not np.isin(kinds, (9, 10, 32, 43, 45, 46)).all():
            raise _NotPlainError("characters that belong to no number")
        second = text[starts + 1]
        named = [name for name in "nt" if (second == ord(name)).any()]
        self.attributes.update(named)
        letters = np.count_nonzero(text > 57) - len(starts) - np.isin(second, (110, 116)).sum()
        point, sign = kinds == 46, (kinds == 43) | (kinds == 45)
        before = text[delimiters[sign] - 1]
        exponent = (before | 32) == 101
        if (point[1:] & point[:-1]).any() or not ((before <= 32) | exponent).all():
            raise _NotPlainError("malformed numbers")
        if letters:
            self.exponents(text, delimiters, kinds, letters)

    def exponents(self, text, delimiters, kinds, letters):
        """Check that all letters are the e of a well-formed exponent."""
        e = np.flatnonzero((text | 32) == 101)
        after = np.searchsorted(delimiters, e)
        signed = (delimiters[after] == e + 1) & (kinds[after] != 10) & (kinds[after] != 32)
        end = after + signed
        if (
            letters != len(e)
            or (np.diff(after) == 0).any()
            or (kinds[end] > 32).any()
            or (delimiters[end] == e + 1 + signed).any()
        ):
            raise _NotPlainError("malformed numbers")


def _read_bytes(path):
    """The bytes of a regular file of acceptable size."""
    try:
        if not Path(path).is_file():
            what = "is not a regular file" if Path(path).exists() else "does not exist"
            raise MeshError(path, None, None, what)
        if Path(path).stat().st_size > MAX_BYTES:
            raise MeshError(path, None, None, f"larger than {MAX_BYTES >> 20} MiB")
        return Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise MeshError(path, None, None, f"cannot be read: {error}") from error
