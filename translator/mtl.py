"""Wavefront MTL materials with the renderer's extensions, which are written as comments.

The values are kept as they are written; nothing here decides on a BSDF. Three rules of the
language need several keys at once and are properties of `Material`: `color` and `specular` (where
``#COLOR`` and ``Kd`` are two names of one thing), `opacity` (``d`` and ``Tr``), and
`diffuse_weight` (``#ROUGHNESS``).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import files_read
from .mtl_names import spellings, without_comment
from .outcome_rows import Note
from .outcomes import make_note

MAX_BYTES = 16 << 20
"""Largest MTL file that is read (16 MiB)."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_STARTS_NUMBER = re.compile(r"[+-]?[\d.]|[+-]?(nan|inf)", re.IGNORECASE)


class MtlError(Exception):
    """An MTL file that cannot be read.

    Attributes:
        path: the file, as it was given.
        line: line number from 1, or None where the whole file is meant.
        column: column in characters from 1, or None.
        message: what is wrong, without the place.
    """

    def __init__(
        self, path: str | Path, line: int | None, column: int | None, message: str
    ) -> None:
        self.path, self.line, self.column, self.message = path, line, column, message
        place = [str(path)] + [str(n) for n in (line, column) if n is not None]
        super().__init__(f"{':'.join(place)}: {message}")


@dataclass(frozen=True)
class TextureMap:
    """A picture named by ``map_Kd`` or ``map_Bump``.

    Attributes:
        file: name as written, without options.
        scale: factors (u, v, w) of ``-s``.
        offset: shifts (u, v, w) of ``-o``.
        base, gain: ``-mm``: a texel x is used as base + gain x.
        clamp: ``-clamp on``: outside [0, 1] in u and v the texels at the edge go on.
    """

    file: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    base: float = 0.0
    gain: float = 1.0
    clamp: bool = False


RGB = tuple[float, float, float]


@dataclass
class Material:
    """One ``newmtl`` block; a key that the file does not give is None.

    Attributes:
        name: name in its own spelling.
        line: line of ``newmtl``.
        kd, ks, ka: ``Kd``, ``Ks``, ``Ka``, linear RGB.
        ni: ``Ni``, index of refraction.
        ns: ``Ns``, Phong exponent.
        d, tr: ``d`` (opacity) and ``Tr`` (transparency), 0 to 1.
        map_kd, map_bump: pictures.
        reflection: ``#REFLECTION``, kind of surface: 0 diffuse, 1 mirror, 2 glass, 3 Ward, 4 Phong;
            5 to 8 are the original program's own.
        emission: ``#EMISSION``, linear RGB radiance.
        extra_color, extra_specular: ``#COLOR`` and ``#SPECULAR``, linear RGB.
        ward: ``#WARD``, (alpha_x, alpha_y).
        roughness: ``#ROUGHNESS``, share of the Lambertian part, 0 to 1.
        smooth, repeat: ``#SMOOTH`` and ``#REPEAT``.
        lines: line of each given attribute, by attribute name.
    """

    name: str
    line: int
    kd: RGB | None = None
    ks: RGB | None = None
    ka: RGB | None = None
    ni: float | None = None
    ns: float | None = None
    d: float | None = None
    tr: float | None = None
    map_kd: TextureMap | None = None
    map_bump: TextureMap | None = None
    reflection: int | None = None
    emission: RGB | None = None
    extra_color: RGB | None = None
    extra_specular: RGB | None = None
    ward: tuple[float, float] | None = None
    roughness: float | None = None
    smooth: int | None = None
    repeat: int | None = None
    lines: dict[str, int] = field(default_factory=dict)

    def _is_later(self, name: str, other: str) -> bool:
        return self.lines.get(name, 0) > self.lines.get(other, 0)

    @property
    def color(self) -> RGB | None:
        """The later of ``Kd`` and ``#COLOR``, or None."""
        return self.extra_color if self._is_later("extra_color", "kd") else self.kd

    @property
    def specular(self) -> RGB | None:
        """The later of ``Ks`` and ``#SPECULAR``, or None."""
        return self.extra_specular if self._is_later("extra_specular", "ks") else self.ks

    @property
    def opacity(self) -> float | None:
        """The later of ``d`` and 1 - ``Tr``, or None."""
        return 1 - self.tr if self.tr is not None and self._is_later("tr", "d") else self.d

    @property
    def diffuse_weight(self) -> float | None:
        """Share r of the Lambertian part for these faces, None without ``#REFLECTION``.

        r is the last ``#ROUGHNESS``; for the kinds 0 and 1 one that precedes ``#REFLECTION`` is
        lost. Where r is then 0 and colour and specular colour are both non-black,
        r = \\|Kd\\|² / (\\|Kd\\|² + \\|Ks\\|²). A diffuse surface (kind 0) with a black specular
        colour is diffuse, r = 1, as the manual says (the original program makes it a mirror).
        """
        if self.reflection is None:
            return None
        lost = self.reflection <= 1 and self.lines.get("roughness", 0) < self.lines["reflection"]
        if self.roughness and not lost:
            return self.roughness
        kd2 = sum(c * c for c in self.color or (0.0,))
        ks2 = sum(c * c for c in self.specular or (0.0,))
        if kd2 > 0 and ks2 > 0:
            return kd2 / (kd2 + ks2)
        return 1.0 if self.reflection == 0 else 0.0


class Materials(dict[str, Material]):
    """Materials of a file by lower-case name; the last of several equal names counts.

    Attributes:
        notes: (line, `Note`) of what was ignored or read otherwise than written.
    """

    def __init__(self) -> None:
        super().__init__()
        self.notes: list[tuple[int, Note]] = []

    def named(self, name: str) -> Material | None:
        """The material of a name as written after ``usemtl``, or None.

        What looks like a comment may be a part of the name, here and after ``newmtl``: the whole
        name is looked for first.
        """
        for spelling in spellings(name):
            if (found := self.get(spelling.casefold())) is not None:
                return found
        return None


def read_mtl(path: str | Path) -> Materials:
    """Read an MTL file.

    Args:
        path: MTL file, in UTF-8 or cp932.

    Returns:
        `Materials`.

    Raises:
        MtlError: no regular file, too large, not text, a malformed or non-finite number, too few
            numbers, an unknown kind of reflection.
    """
    return _Reader(path).read(_read_text(path))


def _read_text(path: str | Path) -> str:
    try:
        if not Path(path).is_file():
            what = "is not a regular file" if Path(path).exists() else "does not exist"
            raise MtlError(path, None, None, what)
        if Path(path).stat().st_size > MAX_BYTES:
            raise MtlError(path, None, None, f"is larger than {MAX_BYTES >> 20} MiB")
        files_read.record(path)
        raw = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise MtlError(path, None, None, f"cannot be read: {error}") from error
    if b"\0" in raw:
        line = raw.count(b"\n", 0, raw.index(b"\0")) + 1
        raise MtlError(path, line, None, "binary data: this is no MTL text file")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp932", errors="replace")


_COLORS = {
    "kd": "kd",
    "ks": "ks",
    "ka": "ka",
    "#EMISSION": "emission",
    "#COLOR": "extra_color",
    "#SPECULAR": "extra_specular",
}
_FLOATS = {"ni": "ni", "ns": "ns", "d": "d", "tr": "tr", "#ROUGHNESS": "roughness"}
_INTEGERS = {"#REFLECTION": "reflection", "#SMOOTH": "smooth", "#REPEAT": "repeat"}
_SHARES = {"d", "tr", "roughness"}
_MAP_OPTIONS = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2} | dict.fromkeys(
    ["-bm", "-clamp", "-blendu", "-blendv", "-boost", "-texres", "-cc", "-imfchan", "-type"], 1
)
"""Most values of each option."""


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


class _Reader:
    def __init__(self, path: str | Path) -> None:
        self.path = path
        self.found = Materials()
        self.material: Material | None = None
        self.unknown: set[str] = set()
        self.number = 0

    def read(self, text):
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        for self.number, line in enumerate(lines, 1):
            words = line.split(None, 1)
            if words:
                self.line(line, words[0], words[1].strip() if len(words) > 1 else "")
        return self.found

    def line(self, line, key, rest):
        if key.startswith("#"):
            if not self.is_extension(key, rest):
                return
        else:
            key = key.lower()
        if key == "newmtl":
            self.begin(line, rest)
        elif self.material is None:
            self.note("mtl-before-newmtl", key=repr(key))
        elif key.startswith("map_kd"):
            self.store("map_kd", self.texture(line, rest, ("-s", "-o", "-mm", "-clamp")))
        elif key in ("map_bump", "bump"):
            self.store("map_bump", self.texture(line, rest))
        elif key in _COLORS:
            self.color(line, key)
        elif key in _FLOATS:
            self.scalar(line, key)
        elif key in _INTEGERS:
            self.integer(line, key)
        elif key == "#WARD":
            self.store("ward", tuple(self.numbers(line, 2)))
        else:
            if key not in self.unknown:
                self.note("mtl-key-unknown", key=repr(key))
            self.unknown.add(key)

    def is_extension(self, key, rest):
        """A comment is an extension if its first word is one and a number follows."""
        if key not in {*_COLORS, *_FLOATS, *_INTEGERS, "#WARD"}:
            return False
        if _STARTS_NUMBER.match(rest):
            return True
        self.note("mtl-comment", key=repr(key))
        return False

    def begin(self, line, name):
        self.material = Material(name, self.number)
        if not name:
            self.note("newmtl-without-name")
            return
        if self.defined(name):
            self.note("mtl-defined-again", name=repr(name))
        self.found.pop(name.casefold(), None)
        self.found[name.casefold()] = self.material
        self.found.setdefault(without_comment(name).casefold(), self.material)

    def defined(self, name):
        """Whether there is a material of that very name, not only one with a comment behind it."""
        before = self.found.get(name.casefold())
        return before is not None and before.name.casefold() == name.casefold()

    def color(self, line, key):
        words = line.split("#")[0].split() if not key.startswith("#") else line.split()
        if words[1:2] in (["spectral"], ["xyz"]):
            self.note("mtl-color-unsupported", key=words[0], form=words[1])
        elif len(words) == 2:
            self.note("mtl-grey", key=words[0])
            self.store(_COLORS[key], tuple(self.numbers(line, 1)) * 3)
        else:
            self.store(_COLORS[key], tuple(self.numbers(line, 3)))

    def scalar(self, line, key):
        attribute = _FLOATS[key]
        if key == "d" and "-halo" in line.split():
            self.note("mtl-halo")
            line = line.replace("-halo", "     ")
        value = self.numbers(line, 1)[0]
        if attribute in _SHARES and not 0 <= value <= 1:
            self.note("mtl-clamped", key=key, value=value)
            value = min(max(value, 0.0), 1.0)
        self.store(attribute, value)

    def integer(self, line, key):
        value = self.numbers(line, 1)[0]
        if value != int(value):
            raise self.error(_indent(line), f"{key} takes a whole number")
        if key == "#REFLECTION" and not 0 <= value <= 8:
            raise self.error(_indent(line), "#REFLECTION takes 0 to 8")
        self.store(_INTEGERS[key], int(value))

    def texture(self, line: str, rest: str, used: tuple[str, ...] = ()) -> TextureMap:
        """A picture with the options that are of use; others are noted."""
        words = [(m.start(), m.group()) for m in re.finditer(r"\S+", rest)]
        shift = line.index(rest)
        given: dict[str, list[tuple[int, str]]] = {}
        at = 0
        while at < len(words) and words[at][1].lower() in _MAP_OPTIONS:
            option, at = words[at][1].lower(), at + 1
            values: list[tuple[int, str]] = []
            while at < len(words) - 1 and len(values) < _MAP_OPTIONS[option]:
                if values and not _NUMBER.fullmatch(words[at][1]):
                    break
                values.append((shift + words[at][0], words[at][1]))
                at += 1
            given[option] = values
        if at == len(words):
            raise self.error(_indent(line), "no file name")
        return TextureMap(rest[words[at][0] :], **self.options(given, used))

    def options(
        self, given: dict[str, list[tuple[int, str]]], used: tuple[str, ...]
    ) -> dict[str, Any]:
        """What options mean to `TextureMap`."""
        result: dict[str, Any] = {}
        for option, values in given.items():
            words = [word for _, word in values]
            if option not in used:
                self.note("mtl-option-ignored", option=repr(option))
            elif option in ("-s", "-o"):
                default = 1.0 if option == "-s" else 0.0
                numbers = [self.parse(*value) for value in values]
                numbers += [default] * (3 - len(numbers))
                result["scale" if option == "-s" else "offset"] = tuple(numbers)
            elif option == "-mm" and len(values) == 2:
                result["base"], result["gain"] = (self.parse(*value) for value in values)
            elif option == "-clamp" and words and words[0].lower() in ("on", "off"):
                result["clamp"] = words[0].lower() == "on"
            else:
                self.note("mtl-option-ignored", option=repr(" ".join([option, *words])))
        return result

    def numbers(self, line: str, count: int) -> list[float]:
        """The first numbers after the keyword; anything after them is noted."""
        words = [(m.start(), m.group()) for m in re.finditer(r"\S+", line)]
        if len(words) <= count:
            message = f"{words[0][1]} with {len(words) - 1} of {count} numbers"
            raise self.error(words[0][0], message)
        if len(words) > count + 1 and not words[count + 1][1].startswith("#"):
            text = " ".join(w for _, w in words[count + 1 :])
            self.note("mtl-extra-ignored", text=repr(text))
        return [self.parse(*word) for word in words[1 : count + 1]]

    def parse(self, offset: int, word: str) -> float:
        if not _NUMBER.fullmatch(word) or not math.isfinite(float(word)):
            raise self.error(offset, f"{word!r} is not a finite number")
        return float(word)

    def note(self, code: str, /, **values: Any) -> None:
        self.found.notes.append((self.number, make_note(code, **values)))

    def store(self, attribute: str, value: Any) -> None:
        assert self.material is not None
        setattr(self.material, attribute, value)
        self.material.lines[attribute] = self.number

    def error(self, offset: int, message: str) -> MtlError:
        return MtlError(self.path, self.number, offset + 1, message)
