"""Picture files: their names, where a scene may put them, and writing them without loss.

A scene is a stranger's file. What it names as ``OUTPUT`` goes through `safe_path` and stays below a
directory that the user chose. Pictures are written to a temporary file beside the final one and
renamed, so that a reader sees the old picture or the new one and never half of it.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import unicodedata
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from relume.picture_formats import WRITERS, Contents
from relume.tone import AS_IT_IS, DISPLAY_EXPONENT, Look

LONGEST_NAME = 200  # bytes; file systems end at 255, and a temporary name must fit as well
LONGEST_PATH = 1000
RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d|conin\$|conout\$)\s*(\.|$)", re.IGNORECASE)
EXTENSION = re.compile(r"(?<=.)\.[A-Za-z][A-Za-z0-9]{0,4}$")


class OutputError(Exception):
    """A picture cannot be written; the message names the file and the cause."""


@dataclass(frozen=True)
class Written:
    """What was written.

    Attributes:
        paths: the files, the asked-for one first.
        repaired: number of pixels with a NaN, infinite or negative channel, written as 0 or 1.
    """

    paths: tuple[Path, ...]
    repaired: int


@dataclass(frozen=True)
class Finish:
    """What a picture file gets besides its pixels.

    Attributes:
        look: exposure and tone curve of formats that are encoded for display.
        metadata: texts by name, for `.exr` and `.png`.
        layers: further channels by name, (height, width), for `.exr`.
    """

    look: Look = AS_IT_IS
    metadata: Mapping[str, str] = field(default_factory=dict)
    layers: Mapping[str, np.ndarray] = field(default_factory=dict)


PLAIN = Finish()


def output_name(
    stem: str,
    ext: str,
    n: int,
    m: int,
    seconds: float,
    spp: int,
    *,
    method: str = "",
    nes: bool = False,
    spectrum: bool = False,
    suffix: str = "",
) -> str:
    """Compose the name of the final picture as the original program does.

    Args:
        stem: ``OUTPUT`` without its extension, directories included.
        ext: extension with its dot.
        n: ``SAMPLING``.
        m: ``SUPERSAMPLING``; of a Metropolis render ``mutation``.
        seconds: time the render took.
        spp: samples per pixel that the picture holds.
        method: `pssmlt`, `erpt`, or empty.
        nes: whether next event estimation is on.
        spectrum: whether wavelengths were rendered.
        suffix: value of the environment variable ``SUFFIX_SYMBOL``.

    Returns:
        ``<stem>_<n>x<m>[_mlt][_nes]_<seconds>(<spp>spp)[_spectrum]<suffix><ext>``; with ERPT
        ``_erpt``, and without ``(<spp>spp)``.

    Source: manual, OUTPUT; the program's own names.
    """
    marks = {"pssmlt": "_mlt", "erpt": "_erpt"}.get(method, "") + ("_nes" if nes else "")
    samples = "" if method == "erpt" else f"({spp}spp)"
    colors = "_spectrum" if spectrum else ""
    return f"{stem}_{n}x{m}{marks}_{seconds:.1f}{samples}{colors}{suffix}{ext}"


def split_extension(name: str) -> tuple[str, str]:
    """Split a file name into stem and extension; a tail such as ``.5(400spp)`` is no extension."""
    match = EXTENSION.search(name)
    return (name[: match.start()], match[0]) if match else (name, "")


def safe_path(name: str, base: str | Path) -> tuple[Path, str]:
    """Find the place below a directory for a file that a scene names, and make its directories.

    Drives, leading slashes and ``..`` are dropped; characters that a file system refuses or that
    mislead a reader become ``_``; names reserved on Windows get a leading ``_``; a directory that
    is a link out of `base`, or no directory, is avoided by appending ``_``.

    Args:
        name: what the scene wrote.
        base: directory below which the file must lie.

    Returns:
        The path (a link at that path itself is for `write_image` to replace), and a note that says
        what was changed, empty if nothing was.

    Raises:
        OutputError: a directory cannot be made.
    """
    parts = [clean for part in re.split(r"[/\\]", name) if (clean := _clean_part(part))]
    parts = parts or ["output.ppm"]
    if sum(len(os.fsencode(part)) + 1 for part in parts) > LONGEST_PATH:
        parts = parts[-1:]
    directory = Path(base)
    inside = directory.resolve()
    for part in parts[:-1]:
        directory = _subdirectory(directory / part, inside)
    path = directory / parts[-1]
    while path.is_dir() and not path.is_symlink():
        stem, ext = split_extension(path.name)
        path = directory / f"{stem}_{ext}"
    asked = re.sub(r"^(\./)+", "", name.replace("\\", "/"))
    written = path.relative_to(base).as_posix()
    if written == asked:
        return path, ""
    shown = name if len(name) <= 80 else name[:77] + "..."
    return path, f"{shown!a} is written as {written!r}, below {str(base)!r}"


def _clean_part(part: str) -> str:
    """Make one part of a path safe; empty if nothing is left of it."""
    if re.fullmatch(r"\s*[A-Za-z]:", part):
        return ""
    part = "".join("_" if _misleading(character) else character for character in part)
    part = part.strip().rstrip(". ")
    if RESERVED.match(part):
        part = "_" + part
    stem, ext = split_extension(part)
    room = LONGEST_NAME - len(ext)
    return stem.encode()[:room].decode(errors="ignore") + ext


def _misleading(character: str) -> bool:
    """Tell whether a character is refused by some file system, invisible, or not encodable."""
    return character in '<>:"|?*' or unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl")


def _subdirectory(path: Path, inside: Path) -> Path:
    """Make a directory, under a longer name where that one is taken or leads out of `inside`."""
    while True:
        try:
            path.mkdir(exist_ok=True)
            if path.resolve().is_relative_to(inside):
                return path
        except FileExistsError:
            pass
        except (OSError, RuntimeError) as error:
            raise OutputError(f"cannot make the directory {path}: {_cause(error)}") from None
        path = path.with_name(path.name + "_")


def check_writable(path: str | Path) -> None:
    """Check that a picture can be written, before hours are spent on rendering it.

    Args:
        path: the picture's file; its directory is made.

    Raises:
        OutputError: its directory cannot be made or written to.
    """
    with replacing(Path(path), rename=False):
        pass


def check_format(path: str | Path) -> None:
    """Check that a picture's file has the extension of a format that can be written.

    Raises:
        OutputError: it has not; the message lists the formats.
    """
    extension = split_extension(Path(path).name)[1]
    if extension.lower() not in WRITERS:
        found = f"'{extension}' is no format" if extension else "no extension tells the format"
        raise OutputError(f"cannot write {path}: {found}, expected one of {' '.join(WRITERS)}")


def is_linear(path: str | Path) -> bool:
    """Whether a picture's file holds linear radiance; its extension is that of a format."""
    return WRITERS[split_extension(Path(path).name)[1].lower()][1]


def write_outputs(
    path: str | Path, image: np.ndarray, gamma: float = 0.0, finish: Finish = PLAIN
) -> Written:
    """Write a picture and, as the original program does, a BMP beside it.

    Args:
        path: the file; the extension chooses its format as for `write_image`.
        image: linear RGB, shape (height, width, 3), row 0 at the top.
        gamma: the scene's ``gamma_offset``.
        finish: what the files get besides.

    Returns:
        The picture and the BMP (once, if it is the BMP).

    Raises:
        OutputError: a file cannot be written.
    """
    written = write_image(path, image, gamma, finish)
    picture = written.paths[0]
    if picture.suffix.lower() == ".bmp":
        return written
    beside = write_image(bmp_beside(picture), image, gamma, finish)
    return Written(written.paths + beside.paths, written.repaired)


def bmp_beside(path: Path) -> Path:
    """The BMP beside a picture: its name with another extension."""
    return path.with_name(split_extension(path.name)[0] + ".bmp")


def write_image(
    path: str | Path, image: np.ndarray, gamma: float = 0.0, finish: Finish = PLAIN
) -> Written:
    """Write a picture in the format of its extension (in any case).

    ``.hdr`` (Radiance RGBE) and ``.exr`` (float32 R, G, B) are linear; ``.png``, ``.bmp`` (24 bit)
    and ``.ppm`` (ASCII P3) are encoded for display as ``floor(255 clamp(L)^e + 1/2)``. A file or
    link of that name is replaced; directories are made.

    Args:
        path: the file.
        image: linear RGB, shape (height, width, 3), row 0 at the top.
        gamma: the scene's ``gamma_offset``: the exponent e where its magnitude is above
            0.01, else e = 1/2.2; without effect on linear formats.
        finish: what the file gets besides.

    Returns:
        The file's path, and the number of pixels that had to be repaired.

    Raises:
        OutputError: its extension is another one, or the file cannot be written; one that existed
            is as it was.
        ValueError: the image has another shape.

    Source: manual, OUTPUT and gamma_offset.
    """
    image = np.asarray(image, dtype=np.float32)
    if image.ndim != 3 or image.shape[2] != 3 or 0 in image.shape:
        raise ValueError(f"a picture has the shape (height, width, 3), not {image.shape}")
    path = Path(path)
    check_format(path)
    write, linear = WRITERS[path.suffix.lower()]
    image, repaired = repair(image)
    contents = Contents(image, finish.metadata, finish.layers)
    if not linear:
        shown, texts = finish.look.applied(image), finish.look.metadata(image)
        contents = Contents(encode_display(shown, gamma), {**finish.metadata, **texts})
    with replacing(path) as temporary:
        write(temporary, contents)
    return Written((path,), repaired)


def repair(image: np.ndarray) -> tuple[np.ndarray, int]:
    """Replace what no picture can show: NaN and negative values by 0, infinity by 1.

    Args:
        image: float32, shape (height, width, 3).

    Returns:
        The image, and the number of pixels that were changed.
    """
    good = (image >= 0) & (image < np.inf)
    if good.all():
        return image, 0
    return np.where(good, image, image == np.inf), int((~good.all(axis=2)).sum())


def encode_display(image: np.ndarray, gamma: float = 0.0) -> np.ndarray:
    """Encode linear radiance for display: ``floor(255 clamp(L)^e + 1/2)``.

    Args:
        image: linear, not NaN.
        gamma: e where its magnitude is above 0.01, else e = 1/2.2.

    Returns:
        uint8, same shape.
    """
    exponent = gamma if abs(gamma) > 0.01 else DISPLAY_EXPONENT
    with np.errstate(divide="ignore"):  # black under a negative exponent is white
        encoded = np.clip(image, 0, 1).astype(np.float64) ** exponent
    return (255 * np.minimum(encoded, 1) + 0.5).astype(np.uint8)


@contextlib.contextmanager
def replacing(path: Path, *, rename: bool = True) -> Iterator[Path]:
    """Give a new temporary file beside `path`; if the block ends well, put it in its place."""
    temporary = path.with_name(f"{_temporary(path)}{secrets.token_hex(4)}.tmp")
    flags = os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(temporary, flags, 0o666)
        try:
            yield temporary
            os.fsync(handle)
        finally:
            os.close(handle)
        if rename:
            os.replace(temporary, path)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"cannot write {path}: {_cause(error)}") from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def clear_leftovers(path: Path) -> None:
    """Remove the temporary files of writers of `path` that were killed; none may be at work."""
    for left in path.parent.glob(f"{_temporary(path)}*.tmp"):
        with contextlib.suppress(OSError):
            left.unlink()


def _temporary(path: Path) -> str:
    """Beginning of the names of the temporary files of a path."""
    return f".relume-{zlib.crc32(os.fsencode(path.name)):08x}-"


def _cause(error: BaseException) -> str:
    return getattr(error, "strerror", None) or str(error)
