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
from dataclasses import dataclass

import numpy as np

from .obj_model import (
    MAX_BYTES,
    Group,
    MeshError,
    ObjFile,
    keep_freed_memory,
    open_mesh,
    vertex_normals,
)
from .obj_scan import NotPlainError, PlainScan
from .obj_text import (
    BLANK,
    MAX_DIGITS,
    MalformedError,
    column,
    corners,
    decimals,
    decode,
    fan,
    join_lines,
    parse_lines,
    split_by_label,
    unify,
)
from .outcomes import make_note

__all__ = [
    "MAX_BYTES",
    "Features",
    "Group",
    "MeshError",
    "ObjFile",
    "features",
    "plain",
    "read_obj",
    "vertex_normals",
]

_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_CORNER = re.compile(rb"[+-]?\d+(/([+-]?\d+)?(/([+-]?\d+)?)?)?")
_INDENT = re.compile(rb"[ \t]*")
_INDENTS = re.compile(rb"^[ \t]+", re.MULTILINE)
_COMMENT = re.compile(rb"#[^\n]*")
_TOKEN = re.compile(rb"[^ \t\n]+")
_IGNORED = {b"", b"g", b"o", b"s"}
_V, _VT, _VN, _F, _USEMTL, _MTLLIB, _OTHER = range(7)
_KEYWORDS = (b"v", b"vt", b"vn")
_ATTRIBUTES = ("vertex", "texture coordinate", "normal")


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
    scan = PlainScan()
    keep_freed_memory()
    try:
        with open_mesh(path) as file:
            scan.read(file)
    except NotPlainError as reason:
        return Features(False, str(reason), False, False)
    return Features(True, None, "n" in scan.attributes, "t" in scan.attributes)


def read_obj(path):
    """Read an OBJ file.

    Faces may have any number of corners of the forms a, a/b, a//c and a/b/c with positive or
    negative indices. Vertex colours count if the last ``v`` line has at least six numbers.
    ``usemtl`` names that differ only in case are one material.

    Args:
        path: OBJ file.

    Returns:
        `ObjFile`.

    Raises:
        MeshError: no regular file, too large, not text, a malformed or non-finite number, an index
            that is 0 or names nothing, a face with fewer than three corners, no faces.
    """
    keep_freed_memory()
    with open_mesh(path) as file:
        return _Reader(path, file.read()).read()


class _Reader:
    """One reading of one file: `data` is its text with all line ends as line feeds."""

    def __init__(self, path, data):
        self.path = path
        self.notes = []
        if b"\0" in data:
            line = data.count(b"\n", 0, data.index(b"\0")) + 1
            raise MeshError(path, line, None, "binary data: this is no OBJ text file")
        data = data.removeprefix(b"\xef\xbb\xbf") + b"\n"
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        self.data, self.joints = join_lines(data)
        self.starts, self.kinds = self.classify()

    def read(self):
        v, vt, vn = (self.numbers(kind) for kind in (_V, _VT, _VN))
        positions, colors = self.vertices(*v)
        uv = np.stack([column(vt, 0), column(vt, 1)], axis=1)
        normals = np.stack([column(vn, k) for k in range(3)], axis=1)
        faces, counts = self.corners((len(positions), len(uv), len(normals)))
        triangles, owner = fan(faces, counts)
        self.note_polygons(counts)
        materials, labels = self.materials()
        groups = []
        for label, members in split_by_label(labels[owner]):
            tables = positions, uv, normals, colors
            groups.append(self.group(triangles[members], *materials[label], *tables))
        self.note_other_lines()
        mtllib = [
            (self.place(self.starts[i])[0], name)
            for i in np.flatnonzero(self.kinds == _MTLLIB)
            for name in [self.rest(i)]
        ]
        notes = sorted(self.notes, key=lambda note: (note[0], note[1].text))
        return ObjFile(groups, mtllib, notes, positions, triangles[:, :, 0])

    # -- lines ----------------------------------------------------------------------------------

    def classify(self):
        """Offset of the keyword and kind of every line."""
        text = np.frombuffer(self.data, np.uint8)
        ends = np.flatnonzero(text == 10)
        starts = np.concatenate(([0], ends[:-1] + 1))
        indented = np.flatnonzero((text[starts] == 32) | (text[starts] == 9))
        for line in indented:
            starts[line] = _INDENT.match(self.data, starts[line]).end()
        self.ends = ends
        self.indented = len(indented) > 0
        padded = np.concatenate((text, np.full(2, 10, np.uint8)))
        first, second, third = (padded[starts + k] for k in range(3))
        kinds = np.full(len(starts), _OTHER, np.uint8)
        blank = BLANK[second]
        kinds[(first == ord("v")) & blank] = _V
        kinds[(first == ord("f")) & blank] = _F
        for letter, kind in ((b"t", _VT), (b"n", _VN)):
            kinds[(first == ord("v")) & (second == letter[0]) & BLANK[third]] = kind
        for line in np.flatnonzero((first == ord("u")) | (first == ord("m"))):
            keyword = self.data[starts[line] : ends[line]].split(None, 1)[0]
            kinds[line] = {b"usemtl": _USEMTL, b"mtllib": _MTLLIB}.get(keyword, _OTHER)
        return starts, kinds

    def line(self, index):
        return self.data[self.starts[index] : self.ends[index]]

    def rest(self, index):
        """What follows the keyword of a line, decoded."""
        words = self.line(index).split(None, 1)
        return decode(words[1].strip()) if len(words) > 1 else ""

    def place(self, offset):
        """Line and column of an offset in the file as it was."""
        before = [joint for joint in self.joints if joint < offset]
        line = self.data.count(b"\n", 0, offset) + len(before) + 1
        start = max(self.data.rfind(b"\n", 0, offset), *before[-1:], -1)
        return line, int(offset - start)

    def error(self, offset, message):
        return MeshError(self.path, *self.place(offset), message)

    def lines_of(self, kind):
        """Line indices of a kind, and their text, comments and keywords blanked."""
        chosen = self.kinds == kind
        edges = np.flatnonzero(np.diff(chosen, prepend=False, append=False))
        runs = [
            self.data[self.starts[a] : self.ends[b - 1] + 1]
            for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        ]
        text = b"".join(runs)
        if b"#" in text:
            text = _COMMENT.sub(b"", text)
        if self.indented:
            text = _INDENTS.sub(b"", text)
        return np.flatnonzero(chosen), text

    def tokens(self, line):
        """(offset, token) of the values in a line."""
        text = _COMMENT.sub(b"", self.line(line))
        found = [(self.starts[line] + m.start(), m.group()) for m in _TOKEN.finditer(text)]
        return found[1:]

    # -- numbers --------------------------------------------------------------------------------

    def numbers(self, kind):
        """All numbers of the lines of a kind, and how many each line has."""
        lines, text = self.lines_of(kind)
        try:
            values, counts = parse_lines(text, _KEYWORDS[kind], decimals)
        except MalformedError as error:
            raise self.bad_number(lines) from error
        need = 2 if kind == _VT else 3
        short = np.flatnonzero(counts < need)
        if len(short):
            message = f"{_ATTRIBUTES[kind]} with {counts[short[0]]} of {need} numbers"
            raise self.error(self.starts[lines[short[0]]], message)
        return values, counts

    def bad_number(self, lines):
        for line in lines:
            for offset, token in self.tokens(line):
                if not _NUMBER.fullmatch(token) or not np.isfinite(float(token)):
                    return self.error(offset, f"{decode(token)!r} is not a finite number")
        raise AssertionError("every token is a number")

    def vertices(self, values, counts):
        """Positions (N, 3), and colours (N, 3) or None."""
        table = values, counts
        positions = np.stack([column(table, k) for k in range(3)], axis=1)
        if not len(counts) or counts[-1] < 6:
            return positions, None
        short = counts < 6
        colors = np.ones((len(counts), 3))
        first = (np.cumsum(counts) - counts)[~short]
        for k in range(3):
            colors[~short, k] = values[first + 3 + k]
        if short.any():
            lines = np.flatnonzero(self.kinds == _V)
            line = self.place(self.starts[lines[np.argmax(short)]])[0]
            self.notes.append((line, make_note("vertices-without-color", count=short.sum())))
        return positions, colors

    # -- faces ----------------------------------------------------------------------------------

    def corners(self, sizes):
        """Corners of all faces as indices from 0 (C, 3), -1 for none; corners of each face."""
        lines, text = self.lines_of(_F)
        if not len(lines):
            raise MeshError(self.path, None, None, "has no faces")
        try:
            found, counts = parse_lines(text, b"f", corners)
        except MalformedError as error:
            raise self.bad_corner(lines) from error
        short = np.flatnonzero(counts < 3)
        if len(short):
            message = f"face with {counts[short[0]]} of at least 3 corners"
            raise self.error(self.starts[lines[short[0]]], message)
        for k, size in enumerate(sizes):
            index = found[:, k]
            negative = index < 0
            if negative.any():
                seen = np.cumsum(self.kinds == (_V, _VT, _VN)[k])[lines]
                index[negative] += np.repeat(seen, counts)[negative] + 1
                index[negative & (index < 1)] = size + 1
            wrong = np.flatnonzero(index > size)
            if len(wrong):
                raise self.missing(lines, counts, wrong[0], _ATTRIBUTES[k], size)
        return found - 1, counts

    def bad_corner(self, lines):
        for line in lines:
            for offset, token in self.tokens(line):
                if not _CORNER.fullmatch(token):
                    return self.error(offset, f"{decode(token)!r} is no corner of a face")
                fields = [part for part in token.split(b"/") if part]
                if any(int(part) == 0 for part in fields):
                    return self.error(offset, "index 0: indices begin at 1")
                if any(len(part.lstrip(b"+-")) > MAX_DIGITS for part in fields):
                    return self.error(offset, "index with too many digits")
        raise AssertionError("every corner is well formed")

    def missing(self, lines, counts, corner, what, size):
        face = int(np.searchsorted(np.cumsum(counts), corner, side="right"))
        offset, token = self.tokens(lines[face])[corner - (np.cumsum(counts) - counts)[face]]
        return self.error(offset, f"{decode(token)!r} names no {what}: there are {size}")

    def note_polygons(self, counts):
        many = np.flatnonzero(counts > 4)
        if len(many):
            line = self.place(self.starts[np.flatnonzero(self.kinds == _F)[many[0]]])[0]
            self.notes.append((line, make_note("many-cornered-faces", count=len(many))))

    def note_other_lines(self):
        seen = {}
        for line in np.flatnonzero(self.kinds == _OTHER).tolist():
            word = (self.line(line).split(None, 1) or [b""])[0]
            if word not in _IGNORED and not word.startswith(b"#"):
                seen.setdefault(word, line)
        for word, line in list(seen.items())[:20]:
            note = make_note("obj-lines-ignored", word=repr(decode(word[:40])))
            self.notes.append((self.place(self.starts[line])[0], note))

    # -- groups ---------------------------------------------------------------------------------

    def materials(self):
        """[(name, line)] and the material of each face as an index into it."""
        switches = np.flatnonzero(self.kinds == _USEMTL)
        faces = np.flatnonzero(self.kinds == _F)
        materials, known, labels = [(None, None)], {}, [0]
        for switch in switches:
            name = self.rest(switch)
            if name.casefold() not in known:
                known[name.casefold()] = len(materials)
                materials.append((name, self.place(self.starts[switch])[0]))
            labels.append(known[name.casefold()])
        return materials, np.array(labels)[np.searchsorted(switches, faces)]

    def group(self, triangles, name, line, positions, uv, normals, colors):
        corners = triangles.reshape(-1, 3)
        given = corners.min(axis=0) >= 0
        for k in np.flatnonzero(~given & (corners.max(axis=0) >= 0)):
            where = f"material {name!r}" if name else "faces without material"
            note = make_note("corners-without-attribute", where=where, attribute=_ATTRIBUTES[k])
            self.notes.append((line or 1, note))
        source, attributes, faces = unify(corners * given)
        unit = None
        if given[2]:
            unit = normals[attributes[:, 1]]
            length = np.linalg.norm(unit, axis=1, keepdims=True)
            unit = unit / length if length.min() > 0 else None
            if unit is None:
                self.notes.append((line or 1, make_note("normals-of-length-zero")))
        return Group(
            material=name,
            line=line,
            vertices=positions[source],
            faces=faces.reshape(-1, 3).astype(np.int32),
            normals=unit,
            uv=uv[attributes[:, 0]] if given[1] else None,
            colors=None if colors is None else colors[source],
            source=source,
        )
