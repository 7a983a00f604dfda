"""A fast scan that says whether Mitsuba's stock ``obj`` plugin reads an OBJ file rightly.

The plugin ignores ``usemtl``, vertex colours and malformed faces, and reads uninitialised memory
where only some faces name a normal, where none uses the ones given, or where an index is 0. The
scan takes less than half the plugin's own time: a block of bytes is reduced to its delimiters,
and in a run of faces the delimiters of every line must repeat those of the first.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .obj_model import keep_freed_memory, open_mesh

_FORMS = {0: "v", 1: "vt", 2: "vtn", -2: "vn"}
"""Attributes that a corner of so many slashes names, in their order; -2 for a double slash."""

_DIGITS = 38
"""A number with more digits before the point, or such an exponent, may leave single precision."""


def _blank(characters: np.ndarray) -> np.ndarray:
    return (characters == 32) | (characters == 10) | (characters == 9)


class NotPlainError(Exception):
    """The message says what the stock plugin would get wrong."""


class PlainScan:
    """Walks over a file in blocks that fit the cache, and in each over runs of lines of a keyword.

    Delimiters are all bytes below "0": blanks, line ends, signs, points and slashes.
    """

    BLOCK = 1 << 18
    MAX_RUNS = 20000
    LONGEST_LINE = 4096

    def __init__(self) -> None:
        self.form = ""  # see `_FORMS`; of no faces so far
        self.counts = {"v": 0, "t": 0, "n": 0}
        self.last_vertex = b""
        self.repeated_form = b""
        self.runs = 0

    def read(self, file: BinaryIO) -> None:
        """Scan a file.

        Raises:
            NotPlainError: the stock plugin would get something wrong.
        """
        rest = b""
        while chunk := file.read(self.BLOCK):
            chunk = rest + chunk
            end = chunk.rfind(b"\n") + 1
            chunk, rest = chunk[:end], chunk[end:]
            if len(rest) > self.LONGEST_LINE:
                raise NotPlainError("very long lines")
            if chunk:
                self.block(chunk)
        self.block(rest + b"\n")
        if len(self.last_vertex.split()) >= 7:
            raise NotPlainError("vertex colours")
        if not self.form:
            raise NotPlainError("no faces")
        if any(self.counts[name] for name in "tn" if name not in self.form):
            raise NotPlainError("texture coordinates or normals that no face uses")

    def block(self, chunk: bytes) -> None:
        """Check whole lines."""
        if b"\r" in chunk:
            chunk = chunk.replace(b"\r\n", b"\n")
        text = np.frombuffer(chunk, np.uint8)
        delimiters = np.flatnonzero(text < 48)
        kinds = text.take(delimiters)
        if text[0] == ord("f") and self.repeated(text, delimiters, kinds):
            return
        ends = np.flatnonzero(kinds == 10)
        starts = np.concatenate(([0], delimiters[ends[:-1]] + 1))
        first = text[starts]
        cuts = [0, *(np.flatnonzero(first[1:] != first[:-1]) + 1).tolist(), len(first)]
        self.runs += len(cuts)
        if self.runs > self.MAX_RUNS:
            raise NotPlainError("vertices and faces alternate")
        for a, b in pairwise(cuts):
            keyword = chr(first[a])
            if keyword not in "vf":
                if keyword not in "#gos\n":
                    raise NotPlainError(f"lines that begin with {keyword!r}")
                continue
            low, high = starts[a], delimiters[ends[b - 1]] + 1
            run = slice(ends[a - 1] + 1 if a else 0, ends[b - 1] + 1)
            check = self.faces if keyword == "f" else self.numbers
            check(text[low:high], delimiters[run] - low, kinds[run], starts[a:b] - low)

    def repeated(self, text: np.ndarray, delimiters: np.ndarray, kinds: np.ndarray) -> bool:
        """Check a block of faces that all look like the first; False if it is no such block."""
        line = int(np.argmax(kinds == 10)) + 1
        gaps = np.diff(delimiters)
        touching = gaps == 1
        if (
            len(kinds) % line
            or (kinds[line:] != kinds[:-line]).any()
            or (touching[line:] != touching[:-line]).any()
        ):
            return False
        starts = np.concatenate(([0], delimiters[line - 1 : -1 : line] + 1))
        if (text[starts] != ord("f")).any():
            return False
        leading = self.indices(text, delimiters, gaps, starts)
        form = kinds[:line].tobytes() + touching[:line].tobytes()
        if form != self.repeated_form:
            self.corners(gaps[: line - 1], kinds[:line])
            self.repeated_form = form
        if not self.surely_known(leading, gaps):
            lines = delimiters.reshape(-1, line)
            for k, token in enumerate(np.flatnonzero(~touching[: line - 1])):
                name = self.form[k % len(self.form)]
                self.known(text, lines[:, token], lines[:, token + 1], name)
        return True

    def faces(
        self, text: np.ndarray, delimiters: np.ndarray, kinds: np.ndarray, starts: np.ndarray
    ) -> None:
        """Check a run of ``f`` lines, which begin at `starts`."""
        gaps = np.diff(delimiters)
        leading = self.indices(text, delimiters, gaps, starts)
        self.corners(gaps, kinds)
        if self.surely_known(leading, gaps):
            return
        tokens = np.flatnonzero((gaps > 1) & (kinds[:-1] != 10))
        for k, name in enumerate(self.form):
            column = tokens[k :: len(self.form)]
            self.known(text, delimiters[column], delimiters[column + 1], name)

    @staticmethod
    def indices(
        text: np.ndarray, delimiters: np.ndarray, gaps: np.ndarray, starts: np.ndarray
    ) -> np.ndarray:
        """Check that faces hold nothing but indices.

        Returns:
            The byte behind each delimiter but the last.
        """
        if np.count_nonzero(text > 57) != len(starts) or not _blank(text[starts + 1]).all():
            raise NotPlainError("faces with other characters than digits and slashes")
        leading = text[1:].take(delimiters[:-1])
        if (leading == 48).any():
            raise NotPlainError("indices that begin with 0")
        if gaps.max(initial=0) > 10:
            raise NotPlainError("indices above a thousand million")
        return leading

    def surely_known(self, leading: np.ndarray, gaps: np.ndarray) -> bool:
        """Whether lengths and first digits alone tell that indices name lines above these faces.

        Args:
            leading: first byte behind each delimiter, of an index if the gap is longer than 1.
            gaps: distances to the next delimiters.
        """
        least = str(min(self.counts[name] for name in self.form))
        longest = int(gaps.max(initial=0)) - 1
        if longest < len(least):
            return True
        top = (leading * (gaps == longest + 1)).max()
        return longest == len(least) and bool(top < ord(least[0]))

    def known(self, text: np.ndarray, begin: np.ndarray, end: np.ndarray, name: str) -> None:
        """Check that indices name lines above these faces.

        Numbers of fewer digits than the largest index are below it; of as many digits, those whose
        leading digits are smaller. Only the others are looked at further.

        Args:
            text: bytes of the faces.
            begin: offsets of the delimiters before the indices.
            end: offsets of those behind them.
            name: attribute that they name.
        """
        largest = str(self.counts[name]).encode()
        length = end - begin - 1
        longest = length.max(initial=0)
        if longest > len(largest):
            raise NotPlainError("indices of lines that are not above the face")
        if longest < len(largest):
            return
        rest = begin[length == longest] + 1
        for digit in largest:
            found = text[rest]
            if (found > digit).any():
                raise NotPlainError("indices of lines that are not above the face")
            rest = rest[found == digit] + 1
            if not len(rest):
                return

    def corners(self, gaps: np.ndarray, kinds: np.ndarray) -> None:
        """Check the delimiters of whole ``f`` lines: equal forms, three corners."""
        if not (_blank(kinds) | (kinds == 47)).all():
            raise NotPlainError("indices with a sign")
        slash = kinds == 47
        touching = gaps == 1
        if (touching & (slash[1:] != slash[:-1])).any():
            raise NotPlainError("slashes without an index")
        double = np.concatenate(([0], np.cumsum(touching & slash[1:] & slash[:-1])))
        blank = np.flatnonzero(~slash)
        slashes, doubles = np.diff(blank) - 1, np.diff(double[blank])
        place = np.concatenate(([0], np.cumsum(gaps)))
        corner = (np.diff(place[blank]) > 1) & (kinds[blank[:-1]] != 10)
        forms = np.where(doubles == 0, slashes, -slashes)[corner]
        count = np.concatenate(([0], np.cumsum(corner)))[np.flatnonzero(kinds[blank] == 10)]
        count = np.diff(count, prepend=0)
        if count.min() < 3 or count.max() > 3:
            raise NotPlainError("faces that are no triangles")
        form = _FORMS.get(int(forms[0]))
        if form is None or (forms != forms[0]).any() or self.form not in ("", form):
            raise NotPlainError("corners that name different attributes")
        self.form = form

    def numbers(
        self, text: np.ndarray, delimiters: np.ndarray, kinds: np.ndarray, starts: np.ndarray
    ) -> None:
        """Check a run of ``v``, ``vt`` and ``vn`` lines, which begin at `starts`."""
        second = text[starts + 1]
        vertex, normal, texture = _blank(second), second == ord("n"), second == ord("t")
        if not (vertex | normal | texture).all():
            raise NotPlainError("lines that begin with 'v' and have no such keyword")
        if vertex.any():
            last = starts[vertex][-1]
            self.last_vertex = text[last : last + 1024].tobytes().split(b"\n", 1)[0]
        for name, lines in (("v", vertex), ("t", texture), ("n", normal)):
            self.counts[name] += np.count_nonzero(lines)
        if normal.any():
            self.directions(text, starts[normal])
        if np.diff(delimiters).max(initial=0) > _DIGITS:
            raise NotPlainError("numbers of very many digits")
        letters = np.count_nonzero(text > 57) - len(starts) - np.count_nonzero(~vertex)
        point, sign = kinds == 46, (kinds == 43) | (kinds == 45)
        if not (_blank(kinds) | point | sign).all():
            raise NotPlainError("characters that belong to no number")
        before = text[delimiters[sign] - 1]
        exponent = (before | 32) == 101
        if (point[1:] & point[:-1]).any() or not ((before <= 32) | exponent).all():
            raise NotPlainError("malformed numbers")
        if letters:
            self.exponents(text, delimiters, kinds, letters)

    @staticmethod
    def directions(text: np.ndarray, starts: np.ndarray) -> None:
        """Check that each ``vn`` line has a digit that is not 0."""
        digit = (text - np.uint8(ord("1")) < 9).view(np.uint8)
        if not np.maximum.reduceat(digit, starts).all():
            raise NotPlainError("normals of length 0")

    def exponents(
        self, text: np.ndarray, delimiters: np.ndarray, kinds: np.ndarray, letters: int
    ) -> None:
        """Check that all letters are the e of a well-formed exponent."""
        e = np.flatnonzero((text | 32) == 101)
        after = np.searchsorted(delimiters, e)
        signed = (delimiters[after] == e + 1) & (kinds[after] != 10) & (kinds[after] != 32)
        end = after + signed
        if (
            letters != len(e)
            or (text[e - 1] < 46).any()
            or (np.diff(after) == 0).any()
            or (kinds[end] > 32).any()
            or (delimiters[end] == e + 1 + signed).any()
        ):
            raise NotPlainError("malformed numbers")
        digits = delimiters[end] - (e + 1 + signed)
        tens = text[delimiters[end] - 2]
        if (digits > 2).any() or ((digits == 2) & (tens > ord("2"))).any():
            raise NotPlainError("numbers with exponents above 29")


def stock_obstacle(path: str | Path, *, flat: bool = False) -> str:
    """Scan an OBJ file for what Mitsuba's stock plugin ignores, misreads or refuses.

    Plain files consist of ``v``, ``vt``, ``vn``, ``f``, comments and grouping lines; their faces
    are triangles with positive indices of lines above them that all name the same attributes; the
    last vertex has no colour, no normal is 0, and all numbers lie in the range of single precision.

    Args:
        path: OBJ file.
        flat: whether normals are not interpolated; the plugin has no use for them then, though they
            shade the faces (row flat-vn).

    Returns:
        Why the plugin does not read the file as `obj.read_obj` does; empty where it does.

    Raises:
        MeshError: the file cannot be opened or is too large.
    """
    keep_freed_memory()
    try:
        with open_mesh(path) as file:
            (scan := PlainScan()).read(file)
        if flat and scan.counts["n"]:
            return "normals that shade flat faces"
    except NotPlainError as reason:
        return str(reason)
    return ""
