"""Picture files: their names, where a scene may put them, and writing them without loss.

A scene is a stranger's file. What it names as ``OUTPUT`` goes through `safe_path` and stays below a
directory that the user chose. Pictures are written to a temporary file beside the final one and
renamed, so that a reader sees the old picture or the new one and never half of it.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import secrets
import unicodedata
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

DISPLAY_EXPONENT = 1 / 2.2
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


def write_outputs(
    path: str | Path, image: np.ndarray, gamma: float = 0.0, comment: str = ""
) -> Written:
    """Write a picture and, as the original program does, a BMP beside it.

    Args:
        path: the file; the extension chooses its format as for `write_image`.
        image: linear RGB, shape (height, width, 3), row 0 at the top.
        gamma: the scene's ``gamma_offset``.
        comment: as `write_image`.

    Returns:
        The picture and the BMP (once, if it is the BMP).

    Raises:
        OutputError: a file cannot be written.
    """
    written = write_image(path, image, gamma, comment)
    picture = written.paths[0]
    if picture.suffix.lower() == ".bmp":
        return written
    beside = write_image(bmp_beside(picture), image, gamma)
    return Written(written.paths + beside.paths, written.repaired)


def bmp_beside(path: Path) -> Path:
    """The BMP beside a picture: its name with another extension."""
    return path.with_name(split_extension(path.name)[0] + ".bmp")


def write_image(
    path: str | Path, image: np.ndarray, gamma: float = 0.0, comment: str = ""
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
        comment: what the file's metadata say of the picture; BMP has none.

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
    pixels = image if linear else encode_display(image, gamma)
    with replacing(path) as temporary:
        write(temporary, pixels, comment)
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


def encode_rgbe(image: np.ndarray) -> np.ndarray:
    """Encode linear radiance as Radiance RGBE: value = mantissa · 2^(exponent - 136).

    Mantissas are rounded to nearest, as today's readers add no half step back.

    Args:
        image: finite, not negative, shape (height, width, 3).

    Returns:
        uint8, shape (height, width, 4).

    Source: Ward, Real Pixels, Graphics Gems II, 1991.
    """
    brightest = image.max(axis=2).astype(np.float64)
    _, exponent = np.frexp(brightest)
    # 255.5 / 256 would round up to 256: such a value belongs to the next exponent.
    exponent += brightest >= np.ldexp(255.5 / 256, exponent)
    exponent = np.clip(exponent, -127, 127)
    mantissa = np.ldexp(image.astype(np.float64), 8 - exponent[..., None])
    mantissa = np.minimum(np.floor(mantissa + 0.5), 255)
    rgbe = np.concatenate([mantissa, exponent[..., None] + 128], axis=2).astype(np.uint8)
    rgbe[(rgbe[..., :3] == 0).all(axis=2)] = 0
    return rgbe


def _write_hdr(path: Path, image: np.ndarray, comment: str) -> None:
    height, width, _ = image.shape
    rgbe = encode_rgbe(image)
    told = "".join(f"# {line}\n" for line in comment.splitlines())
    header = f"#?RADIANCE\n{told}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    # Run-length encoding exists for these widths only; other widths are stored flat.
    body = _pack_scanlines(rgbe) if 8 <= width < 32768 else rgbe.tobytes()
    path.write_bytes(header + body)


def _pack_scanlines(rgbe: np.ndarray) -> bytes:
    """Store scanlines channel by channel in literal runs: noise leaves nothing to repeat."""
    height, width, _ = rgbe.shape
    starts = range(0, width, 128)
    packed = np.empty((height, 4, width + len(starts)), np.uint8)
    for run, start in enumerate(starts):
        length = min(128, width - start)
        packed[:, :, start + run] = length
        packed[:, :, start + run + 1 : start + run + 1 + length] = rgbe[
            :, start : start + length
        ].transpose(0, 2, 1)
    marker = np.array([2, 2, width >> 8, width & 255], np.uint8)
    marker = np.broadcast_to(marker, (height, 4))
    return np.concatenate([marker, packed.reshape(height, -1)], axis=1).tobytes()


def _write_exr(path: Path, image: np.ndarray, comment: str) -> None:
    import OpenEXR

    header: dict[str, Any] = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
    }
    header |= {"comments": comment} if comment else {}
    channels = {name: np.ascontiguousarray(image[..., i]) for i, name in enumerate("RGB")}
    OpenEXR.File(header, channels).write(str(path))


def _write_ppm(path: Path, pixels: np.ndarray, comment: str) -> None:
    height, width, _ = pixels.shape
    digits = np.array([list(f"{value:3d} ".encode()) for value in range(256)], np.uint8)
    text = digits[pixels]
    text[:, :, 2, 3] = ord("\n")
    told = "".join(f"# {line}\n" for line in comment.splitlines())
    path.write_bytes(f"P3\n{told}{width} {height}\n255\n".encode() + text.tobytes())


def _write_png(path: Path, pixels: np.ndarray, comment: str) -> None:
    from PIL.PngImagePlugin import PngInfo

    told = PngInfo()
    if comment:
        told.add_itxt("Comment", comment)
    path.write_bytes(_pillow(pixels, "PNG", pnginfo=told))


def _write_bmp(path: Path, pixels: np.ndarray, _: str) -> None:
    path.write_bytes(_pillow(pixels, "BMP"))


def _pillow(pixels: np.ndarray, format: str, **options: Any) -> bytes:
    """Encode in memory: written to a file directly, Pillow's BMP is silently cut on a full disk."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format=format, **options)
    return buffer.getvalue()


# extension: writer, whether it takes linear values
WRITERS: dict[str, tuple[Callable[[Path, np.ndarray, str], None], bool]] = {
    ".hdr": (_write_hdr, True),
    ".exr": (_write_exr, True),
    ".png": (_write_png, False),
    ".bmp": (_write_bmp, False),
    ".ppm": (_write_ppm, False),
}


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
