"""Wavefront OBJ meshes: one triangle mesh per material, with vertex colours and located errors.

Mitsuba's stock ``obj`` plugin is the fastest reader there is, but it ignores vertex colours and
materials, refuses negative indices, and returns uninitialised memory for several malformed files.
`obj_scan.stock_obstacle` scans a file for all that the stock plugin would get wrong; only where it
finds nothing may the file go there. `read_obj` reads every file, in bulk: the lines are sorted by
keyword, and the numbers of all lines of a keyword are converted at once.

Coordinates are those of the file: v of a texture coordinate grows upwards, where the stock plugin
by default hands on 1 - v.
"""

from __future__ import annotations

import bisect
import re
from pathlib import Path

import numpy as np

from .obj_faces import CornerTables, triangulated
from .obj_model import Group, MeshError, ObjFile, keep_freed_memory, open_mesh
from .obj_text import (
    BLANK,
    MAX_DIGITS,
    MalformedError,
    Table,
    column,
    corners,
    decimals,
    decode,
    join_lines,
    parse_lines,
    split_by_label,
    unify,
)
from .outcome_rows import Note
from .outcomes import make_note

_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_NO_NUMBER = re.compile(rb"[+-]?(nan(\(\w*\))?|inf(inity)?)", re.IGNORECASE)
_MICROSOFT = re.compile(rb"1\.#(IND|QNAN|SNAN|INF)\w*")
_CORNER = re.compile(rb"[+-]?\d+(/([+-]?\d+)?(/([+-]?\d+)?)?)?")
_BLANKED = bytes(c if c in b"\t\n" or c > 31 else 32 for c in range(256))
_INDENT = re.compile(rb"[ \t]*")
_INDENTS = re.compile(rb"^[ \t]+", re.MULTILINE)
_COMMENT = re.compile(rb"#[^\n]*")
_TOKEN = re.compile(rb"[^ \t\n]+")
_IGNORED = {b"", b"g", b"o", b"s"}
_V, _VT, _VN, _F, _USEMTL, _MTLLIB, _OTHER = range(7)
_KEYWORDS = (b"v", b"vt", b"vn")
_ATTRIBUTES = ("vertex", "texture coordinate", "normal")
_FEWEST = {_V: 3, _VT: 1, _VN: 3}
_REPAIRS = (
    "colors-not-finite",
    "texture-coordinates-not-finite",
    "normals-not-finite",
)
_LARGEST = (2 - 2.0**-23) * 2.0**127  # of single precision


def read_obj(path: str | Path) -> ObjFile:
    """Read an OBJ file.

    Faces may have any number of corners of the forms a, a/b, a//c and a/b/c with positive or
    negative indices. Vertex colours count if the last ``v`` line has at least six numbers.
    ``usemtl`` names that differ only in case are one material. Normals and texture coordinates that
    are no numbers (``nan``) count as none and as 0.

    Args:
        path: OBJ file.

    Returns:
        `ObjFile`.

    Raises:
        MeshError: no regular file, too large, not text, a malformed or non-finite number, an index
            that is 0 or names nothing, a vertex beyond single precision, no faces.
    """
    keep_freed_memory()
    with open_mesh(path) as file:
        return _Reader(path, file.read()).read()


class _Reader:
    """One reading of one file: `data` is its text with all line ends as line feeds and all
    other control characters as blanks."""

    def __init__(self, path: str | Path, data: bytes) -> None:
        self.path = path
        self.notes: list[tuple[int, Note]] = []
        if b"\0" in data:
            line = data.count(b"\n", 0, data.index(b"\0")) + 1
            raise MeshError(path, line, None, "binary data: this is no OBJ text file")
        data = data.removeprefix(b"\xef\xbb\xbf") + b"\n"
        if b".#" in data:  # not the beginning of a comment
            data = _MICROSOFT.sub(lambda found: b"nan".ljust(len(found[0])), data)
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        self.data, self.joints = join_lines(data.translate(_BLANKED))
        self.starts, self.kinds = self.classify()

    def read(self) -> ObjFile:
        v, vt, vn = (self.numbers(kind) for kind in (_V, _VT, _VN))
        positions, colors = self.vertices(*v)
        uv = texture_coordinates(vt)
        normals = np.stack([column(vn, k) for k in range(3)], axis=1)
        lines, faces, counts = self.corners((len(positions), len(uv), len(normals)))
        triangles, owner, concave = triangulated(faces, counts, positions)
        if len(concave):
            self.note_faces(lines[concave], "concave-faces")
        materials, labels = self.materials(lines)
        tables = CornerTables(positions, uv, normals, triangles)
        groups = []
        for label, members in split_by_label(labels[owner]):
            name, line = materials[label]
            share = triangles[members], lines[owner[members]]
            groups.append(self.group(*share, name, line, tables, positions, colors))
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
            indent = _INDENT.match(self.data, starts[line])
            assert indent is not None  # it may be empty
            starts[line] = indent.end()
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

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset in the file as it was."""
        index = int(np.searchsorted(self.starts, offset, side="right")) - 1
        joints = bisect.bisect_left(self.joints, offset)
        start = self.ends[index - 1] if index else -1
        if joints:
            start = max(start, self.joints[joints - 1])
        return index + joints + 1, int(offset - start)

    def error(self, offset: int, message: str) -> MeshError:
        line, column = self.place(offset)
        return MeshError(self.path, line, column, message)

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
            usable = self.repaired(kind, lines)
            if usable is None:
                raise self.bad_number(lines) from error
            values, counts = parse_lines(usable, _KEYWORDS[kind], decimals)
        need = _FEWEST[kind]
        short = np.flatnonzero(counts < need)
        if len(short):
            message = f"{_ATTRIBUTES[kind]} with {counts[short[0]]} of {need} numbers"
            raise self.error(self.starts[lines[short[0]]], message)
        return values, counts

    def bad_number(self, lines):
        for line in lines:
            for offset, token in self.tokens(line):
                if not _is_finite(token):
                    return self.error(offset, f"{decode(token)!r} is not a finite number")
        raise AssertionError("every token is a number")

    def repaired(self, kind, lines):
        """The text of the lines of a kind with numbers in place of what is none and may be missing;
        None where others are no numbers."""
        texts, wrong = [], []
        for line in lines:
            words = [token for _, token in self.tokens(line)]
            bad = [k for k, word in enumerate(words) if not _is_finite(word)]
            if bad:
                if not _may_be_missing(kind, words, bad):
                    return None
                wrong.append(line)
                filled = b"1" if kind == _V else b"0"
                words = [
                    filled if k in bad or kind == _VN else word for k, word in enumerate(words)
                ]
            texts.append(b" ".join([_KEYWORDS[kind], *words]))
        self.note_faces(np.array(wrong), _REPAIRS[kind])
        return b"\n".join([*texts, b""])

    def vertices(self, values, counts):
        """Positions (N, 3), and colours (N, 3) or None."""
        table = values, counts
        positions = np.stack([column(table, k) for k in range(3)], axis=1)
        far = np.flatnonzero((np.abs(positions) > _LARGEST).any(axis=1))
        if len(far):
            line = np.flatnonzero(self.kinds == _V)[far[0]]
            raise self.error(self.starts[line], "a vertex beyond single precision")
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
        """Lines of all faces, their corners as indices from 0 (C, 3), -1 for none, and how many
        corners each has."""
        lines, text = self.lines_of(_F)
        if not len(lines):
            raise MeshError(self.path, None, None, "has no faces")
        try:
            found, counts = parse_lines(text, b"f", corners)
        except MalformedError as error:
            raise self.bad_corner(lines) from error
        short = counts < 3
        if short.any():
            if short.all():
                message = f"face with {counts[0]} of at least 3 corners"
                raise self.error(self.starts[lines[0]], message)
            self.note_faces(lines[short], "faces-of-few-corners")
            found = found[np.repeat(~short, counts)]
            lines, counts = lines[~short], counts[~short]
        for k, size in enumerate(sizes):
            index = found[:, k]
            if k and not size and index.any():
                naming = np.repeat(lines, counts)[index != 0]
                self.note_faces(naming, "attribute-missing", attribute=_ATTRIBUTES[k])
                index[:] = 0
            negative = index < 0
            if negative.any():
                seen = np.cumsum(self.kinds == (_V, _VT, _VN)[k])[lines]
                index[negative] += np.repeat(seen, counts)[negative] + 1
                index[negative & (index < 1)] = size + 1
            wrong = np.flatnonzero(index > size)
            if len(wrong):
                raise self.missing(lines, counts, wrong[0], _ATTRIBUTES[k], size)
        return lines, found - 1, counts

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

    def note_faces(self, lines, code, /, **values):
        """Note, at the first of some lines, how many there are."""
        line = self.place(self.starts[lines.min()])[0]
        note = make_note(code, count=len(np.unique(lines)), **values)
        self.notes.append((line, note))

    def note_other_lines(self):
        seen: dict[bytes, int] = {}
        for line in np.flatnonzero(self.kinds == _OTHER).tolist():
            word = (self.line(line).split(None, 1) or [b""])[0]
            if word not in _IGNORED and not word.startswith(b"#"):
                seen.setdefault(word, line)
        for word, line in list(seen.items())[:20]:
            note = make_note("obj-lines-ignored", word=repr(decode(word[:40])))
            self.notes.append((self.place(self.starts[line])[0], note))

    # -- groups ---------------------------------------------------------------------------------

    def materials(self, faces):
        """[(name, line)] and the material of each face, given its line, as an index into it."""
        switches = np.flatnonzero(self.kinds == _USEMTL)
        materials: list[tuple[str | None, int | None]] = [(None, None)]
        known: dict[str, int] = {}
        labels = [0]
        for switch in switches:
            name = self.rest(switch)
            if name.casefold() not in known:
                known[name.casefold()] = len(materials)
                materials.append((name, self.place(self.starts[switch])[0]))
            labels.append(known[name.casefold()])
        return materials, np.array(labels)[np.searchsorted(switches, faces)]

    def group(self, triangles, lines, name, line, tables, positions, colors):
        triangles = triangles.copy()
        if len(bare := tables.complete_uv(triangles)):
            self.note_faces(lines[bare], "corners-without-texture-coordinate")
        if len(bare := tables.complete_normals(triangles)):
            self.note_faces(lines[bare], "corners-without-normal")
        corners = triangles.reshape(-1, 3)
        given = corners[0] >= 0
        source, attributes, faces = unify(np.maximum(corners, 0))
        return Group(
            material=name,
            normals=tables.normals[attributes[:, 1]] if given[2] else None,
            uv=tables.uv[attributes[:, 0]] if given[1] else None,
            line=line,
            vertices=positions[source],
            faces=faces.reshape(-1, 3).astype(np.int32),
            colors=None if colors is None else colors[source],
            source=source,
        )


def texture_coordinates(table: Table) -> np.ndarray:
    """(u, v) of all ``vt`` lines, float64 (N, 2); v is 0 where a line has one number."""
    values, counts = table
    uv = np.zeros((len(counts), 2))
    if len(counts):
        uv[:, 0] = column(table, 0)
        pairs = counts > 1
        uv[pairs, 1] = values[(np.cumsum(counts) - counts)[pairs] + 1]
    return uv


def _may_be_missing(kind: int, words: list[bytes], bad: list[int]) -> bool:
    """Whether the words that are no finite numbers belong to a colour, or are ``nan`` and the like.

    Args:
        kind: of the line.
        words: all its values.
        bad: which of them are no finite numbers.
    """
    if kind == _V:
        return bad[0] >= 3 and len(words) >= 6
    return all(_NUMBER.fullmatch(words[k]) or _NO_NUMBER.fullmatch(words[k]) for k in bad)


def _is_finite(token: bytes) -> bool:
    return bool(_NUMBER.fullmatch(token)) and bool(np.isfinite(float(token)))
