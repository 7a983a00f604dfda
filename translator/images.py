"""Pictures: every format of the language, as linear floats with the top row first.

The original renderer uses a byte b as the linear value b/255, with no sRGB decoding, and so does
`read_image`. The content of a file decides on its format, not its name; a value of n bits is
divided by 2^n - 1. OpenImageIO reads PNG and TGA, Pillow JPEG and bits or words in PPM, OpenEXR its
own format; what none of them reads rightly is read here, and in `bitmaps` and `radiance`.
"""

from __future__ import annotations

import re
import struct
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import TypeAlias

import numpy as np
from PIL import Image as PillowImage
from PIL import UnidentifiedImageError

from . import bitmaps, files_read, radiance

MAX_PIXELS = 1 << 26
"""Largest picture that is read (8192 x 8192 pixels)."""

MAX_BYTES = 1 << 30
"""Largest picture file that is read (1 GiB)."""

FORMATS = "BMP, JPEG, PNG, TGA, PPM, Radiance HDR, PFM, OpenEXR"
"""What is read."""

_TGA_TYPES = (1, 2, 3, 9, 10, 11)
_TGA_MAPPED = (1, 9)
_TGA_GREY = (3, 11)
_PNM = re.compile(rb"P([56])" + 3 * rb"(?:\s|#[^\n]*\n)+(\d{1,9})" + rb"\s")
_PFM = re.compile(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s")


class ImageError(Exception):
    """A picture that cannot be read.

    Attributes:
        path: the file, as it was given.
        message: what is wrong.
    """

    def __init__(self, path: str | Path, message: str) -> None:
        self.path, self.message = path, message
        super().__init__(f"{path}: {message}")


@dataclass(frozen=True)
class Image:
    """A decoded picture.

    Attributes:
        rgb: linear RGB, float32 (H, W, 3), top row first; grey is replicated.
        alpha: opacity, float32 (H, W), 0 to 1; None where the picture is opaque everywhere.
        hdr: the file holds floating-point values, which may exceed 1.
    """

    rgb: np.ndarray
    alpha: np.ndarray | None
    hdr: bool


_Decoded: TypeAlias = tuple[np.ndarray, np.ndarray | None, bool]
"""Linear RGB (H, W, 3), opacity (H, W) or None, and whether the values are floating-point ones."""


def read_image(path: str | Path) -> Image:
    """Decode a picture: BMP, JPEG, PNG, TGA, PPM, Radiance, PFM or OpenEXR.

    Args:
        path: the file.

    Returns:
        `Image`.

    Raises:
        ImageError: no regular file, unknown format, more than `MAX_PIXELS` pixels, damaged or
            incomplete data, non-finite values.
    """
    try:
        data = _read_bytes(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rgb, alpha, hdr = _decoder(data)(data, path)
    except ImageError:
        raise
    except MemoryError as error:
        raise ImageError(path, "not enough memory") from error
    except PillowImage.DecompressionBombError as error:
        raise ImageError(path, f"too many pixels: at most {MAX_PIXELS} are read") from error
    except Exception as error:  # decoders raise anything on damaged input
        raise ImageError(path, str(error) or type(error).__name__) from error
    rgb = np.ascontiguousarray(rgb, np.float32)
    wrong = sum(np.count_nonzero(~np.isfinite(a)) for a in (rgb, alpha) if hdr and a is not None)
    if wrong:
        raise ImageError(path, f"{wrong} values are not finite")
    if alpha is not None:
        alpha = None if (alpha >= 1).all() else np.ascontiguousarray(alpha, np.float32)
    return Image(rgb, alpha, hdr)


def as_texture(image: Image) -> Image:
    """A picture as the original program uses it for ``texture``: 8 bits a channel.

    The program loads textures through an 8-bit reader, which turns floating-point pictures into
    bytes as floor(255 x^(1/2.2) + 1/2), limited to 0 to 255, and the bytes are then used as linear
    values. Values above 1 are lost and dark ones lifted; ``ibl_texture`` does not do this.

    Args:
        image: `Image`.

    Returns:
        `Image` with values k/255; the picture itself unless it is `hdr`.
    """
    if not image.hdr:
        return image
    encoded = np.maximum(image.rgb, 0)
    encoded **= np.float32(1 / 2.2)
    alpha = None if image.alpha is None else _in_bytes(image.alpha.copy())
    return replace(image, rgb=_in_bytes(encoded), alpha=alpha, hdr=False)


def _in_bytes(values: np.ndarray) -> np.ndarray:
    """Values x, overwritten by floor(255 x + 1/2) / 255, limited to 0 to 1."""
    values *= 255
    values += 0.5
    np.clip(values, 0, 255, out=values)
    np.floor(values, out=values)
    values /= np.float32(255)
    return values


def bump_height(image: Image) -> np.ndarray:
    """Height for bump mapping, Y = 0.299 R + 0.587 G + 0.114 B.

    Args:
        image: `Image`.

    Returns:
        float32 (H, W), in units of the picture's white: the manual's gradients are in bytes, that
        is 255 times those of this height.
    """
    return image.rgb @ np.array([0.299, 0.587, 0.114], np.float32)


def _read_bytes(path: str | Path) -> bytes:
    if not Path(path).is_file():
        what = "is not a regular file" if Path(path).exists() else "does not exist"
        raise ImageError(path, what)
    if Path(path).stat().st_size > MAX_BYTES:
        raise ImageError(path, f"is larger than {MAX_BYTES >> 20} MiB")
    files_read.record(path)
    return Path(path).read_bytes()


def _decoder(data: bytes) -> Callable[[bytes, str | Path], _Decoded]:
    """The decoder for the content of a file."""
    for magic, decoder in (
        (b"BM", _bmp),
        (b"\x89PNG", _png),
        (b"\xff\xd8\xff", _jpeg),
        (b"#?", _radiance),
        (b"v/1\x01", _exr),
        (b"PF", _pfm),
        (b"Pf", _pfm),
    ):
        if data.startswith(magic):
            return decoder
    if re.match(rb"P[1-6]\s", data):
        return _ppm
    if len(data) > 18 and data[1] < 2 and data[2] in _TGA_TYPES:
        return _tga
    if not data:
        raise ValueError("the file is empty")
    raise ValueError(f"no picture of a known format ({FORMATS})")


def _check_size(width: int, height: int) -> None:
    if width < 1 or height < 1:
        raise ValueError(f"no pixels: {width} x {height}")
    if width * height > MAX_PIXELS:
        raise ValueError(f"{width} x {height} pixels: at most {MAX_PIXELS} are read")


def _pillow(data: bytes, kind: str) -> _Decoded:
    """Colours by Pillow; grey is replicated."""
    try:
        opened = PillowImage.open(BytesIO(data), formats=[kind])
    except UnidentifiedImageError:
        raise ValueError(f"damaged, or no {kind}") from None
    with opened as picture:
        _check_size(*picture.size)
        picture.load()
        if picture.mode.startswith("I"):
            grey = np.asarray(picture).astype(np.float32) / 65535
            return np.repeat(grey[..., None], 3, axis=2), None, False
        return np.asarray(picture.convert("RGB"), np.float32) / 255, None, False


def _jpeg(data: bytes, _path: str | Path) -> _Decoded:
    return _pillow(data, "JPEG")


def _ppm(data: bytes, _path: str | Path) -> _Decoded:
    """Portable grey and colour maps of bytes; Pillow reads the others, and of these loses bits."""
    header = _PNM.match(data)
    if not header:
        return _pillow(data, "PPM")
    width, height, top = (int(header[k]) for k in (2, 3, 4))
    _check_size(width, height)
    if not 0 < top < 65536:
        raise ValueError(f"a largest value of {top}: expected 1 to 65535")
    kind, channels = np.dtype("u1" if top < 256 else ">u2"), 3 if header[1] == b"6" else 1
    stored = _samples(data, header.end(), kind, (height, width, channels))
    return np.broadcast_to(stored / np.float32(top), (height, width, 3)), None, False


def _samples(data: bytes, at: int, kind: np.dtype, shape: tuple[int, int, int]) -> np.ndarray:
    """Samples of a kind, one behind the other from an offset, (H, W, C)."""
    count = shape[0] * shape[1] * shape[2]
    have, need = len(data) - at, count * kind.itemsize
    if have < need:
        raise ValueError(f"the pixels are incomplete: {have} of {need} bytes")
    return np.frombuffer(data, kind, count, at).reshape(shape)


def _openimageio(data: bytes, path: str | Path, kind: str) -> tuple[np.ndarray, bool]:
    """Samples (H, W, C), float32 from 0 to 1, whether the last is opacity, by OpenImageIO.

    It looks at the ending of a name before the content: a file of another name is copied.
    """
    import OpenImageIO as oiio

    with _named(data, path, kind) as name:
        raw = oiio.ImageSpec()
        for option in ("oiio:UnassociatedAlpha", "oiio:RawColor"):
            raw.attribute(option, 1)
        file = oiio.ImageInput.open(name, raw)
        if file is None:
            raise ValueError(f"damaged or not supported: {_plain(oiio.geterror())}")
        try:
            spec = file.spec()
            _check_size(spec.width, spec.height)
            if spec.format == oiio.UINT8:
                samples = file.read_image("uint8")
            else:
                samples = file.read_image("float")
            if samples is None:
                why = _plain(file.geterror())
                raise ValueError(f"the pixels are damaged or incomplete ({why})")
            has_alpha = spec.channelnames[-1] == "A"
        finally:
            file.close()
    if samples.dtype == np.uint8:
        samples = samples / np.float32(255)
    return samples, has_alpha


@contextmanager
def _named(data: bytes, path: str | Path, kind: str) -> Iterator[str]:
    """A name of the file that ends as its format should."""
    if str(path).lower().endswith(f".{kind}"):
        yield str(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / f"picture.{kind}"
        copy.write_bytes(data)
        yield str(copy)


def _plain(text: str | None) -> str:
    """A library's message as part of ours: one line, without the file's name."""
    lines = [line.strip() for line in (text or "").splitlines() if line.strip()]
    return re.sub(r"\"[^\"]*\"|'[^']*'", "the file", lines[0]).rstrip(".") if lines else "damaged"


def _colors(samples: np.ndarray, has_alpha: bool) -> tuple[np.ndarray, np.ndarray | None]:
    """Linear RGB and opacity of samples; grey is replicated."""
    alpha = samples[..., -1] if has_alpha else None
    color = samples[..., : samples.shape[2] - has_alpha]
    return np.repeat(color, 3, axis=2) if color.shape[2] == 1 else color[..., :3], alpha


def _png(data: bytes, path: str | Path) -> _Decoded:
    rgb, alpha = _colors(*_openimageio(data, path, "png"))
    return rgb, alpha, False


def _tga(data: bytes, path: str | Path) -> _Decoded:
    """Targa; 16-bit pixels, palettes and pixels without attribute bits have no opacity."""
    kind, bits, attributes = data[2], data[16], data[17] & 15
    _check_size(*struct.unpack_from("<HH", data, 12))
    if data[1] and kind not in _TGA_MAPPED:
        data, path = _without_map(data), ""
    samples, has_alpha = _openimageio(data, path, "tga")
    grey = kind in _TGA_GREY
    rgb, alpha = _colors(samples, has_alpha or (grey and samples.shape[2] == 2))
    opaque = attributes == 0 or (bits == 16 and not grey)
    return rgb, None if opaque else alpha, False


def _without_map(data: bytes) -> bytes:
    """A Targa file without its colour map, which its pixels do not use."""
    entries, depth = struct.unpack_from("<HB", data, 5)
    pixels = 18 + data[0]
    behind = pixels + entries * ((depth + 7) // 8)
    return data[:1] + b"\0" + data[2:3] + bytes(5) + data[8:pixels] + data[behind:]


def _bmp(data: bytes, _path: str | Path) -> _Decoded:
    header = bitmaps.Header(data)
    _check_size(header.width, header.height)
    bitmaps.check_complete(data, header)
    return *bitmaps.read(data, header), False


def _radiance(data: bytes, _path: str | Path) -> _Decoded:
    width, height, _, _ = radiance.read_header(data)
    _check_size(width, height)
    return radiance.read_pixels(data), None, True


def _pfm(data: bytes, _path: str | Path) -> _Decoded:
    """Portable float maps: rows from the bottom, a negative scale means little endian."""
    header = _PFM.match(data)
    if not header:
        raise ValueError("malformed PFM header")
    width, height, channels = int(header[2]), int(header[3]), 3 if header[1] == b"PF" else 1
    _check_size(width, height)
    kind = np.dtype("<f4" if float(header[4]) < 0 else ">f4")
    pixels = _samples(data, header.end(), kind, (height, width, channels))
    return np.broadcast_to(pixels[::-1], (height, width, 3)), None, True


def _exr(_data: bytes, path: str | Path) -> _Decoded:
    """OpenEXR: R, G, B (or Y) and A of the first part."""
    import OpenEXR

    with OpenEXR.File(str(path), header_only=True) as file:
        low, high = file.header()["dataWindow"]
        _check_size(*(int(b) - int(a) + 1 for a, b in zip(low, high, strict=True)))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        if not file.parts:
            raise ValueError("the pixels are damaged or incomplete")
        found = file.channels().items()
        channels = {name: np.asarray(channel.pixels, np.float32) for name, channel in found}
    names = ("R", "G", "B") if "R" in channels else ("Y", "Y", "Y")
    if not set(names) <= set(channels):
        raise ValueError(f"no colour among the channels {', '.join(sorted(channels))}")
    rgb = np.stack([channels[name] for name in names], axis=2)
    return rgb, channels.get("A"), True
