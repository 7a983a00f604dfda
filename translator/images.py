"""Pictures: every format of the language, as linear floats with the top row first.

The original renderer uses a byte b as the linear value b/255, with no sRGB decoding, and so does
`read_image`. The content of a file decides on its format, not its name; a value of n bits is
divided by 2^n - 1. OpenImageIO reads PNG, TGA and plain BMP, Pillow JPEG and PPM, OpenEXR its own
format; what none of them reads rightly is read here (`bitmaps`, `radiance`).
"""

import re
import struct
import tempfile
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image as PillowImage
from PIL import UnidentifiedImageError

from . import bitmaps, radiance

MAX_PIXELS = 1 << 26
"""Largest picture that is read (8192 x 8192 pixels)."""

MAX_BYTES = 1 << 30
"""Largest picture file that is read (1 GiB)."""

FORMATS = "BMP, JPEG, PNG, TGA, PPM, Radiance HDR, PFM, OpenEXR"
"""What is read."""

_TGA_TYPES = (1, 2, 3, 9, 10, 11)
_PFM = re.compile(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s")


class ImageError(Exception):
    """A picture that cannot be read.

    Attributes:
        path: the file, as it was given.
        message: what is wrong.
    """

    def __init__(self, path, message):
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


def read_image(path):
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


def as_texture(image):
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
    encoded = np.maximum(image.rgb, 0) ** np.float32(1 / 2.2)
    rgb = np.floor(np.clip(encoded * 255 + 0.5, 0, 255)) / np.float32(255)
    alpha = image.alpha
    if alpha is not None:
        alpha = np.floor(np.clip(alpha * 255 + 0.5, 0, 255)) / np.float32(255)
    return replace(image, rgb=rgb.astype(np.float32), alpha=alpha, hdr=False)


def bump_height(image):
    """Height for bump mapping, Y = 0.299 R + 0.587 G + 0.114 B.

    Args:
        image: `Image`.

    Returns:
        float32 (H, W), in units of the picture's white: the manual's gradients are in bytes, that
        is 255 times those of this height.
    """
    return image.rgb @ np.array([0.299, 0.587, 0.114], np.float32)


def _read_bytes(path):
    if not Path(path).is_file():
        what = "is not a regular file" if Path(path).exists() else "does not exist"
        raise ImageError(path, what)
    if Path(path).stat().st_size > MAX_BYTES:
        raise ImageError(path, f"is larger than {MAX_BYTES >> 20} MiB")
    return Path(path).read_bytes()


def _decoder(data):
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


def _check_size(width, height):
    if width < 1 or height < 1:
        raise ValueError(f"no pixels: {width} x {height}")
    if width * height > MAX_PIXELS:
        raise ValueError(f"{width} x {height} pixels: at most {MAX_PIXELS} are read")


def _pillow(data, kind):
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


def _jpeg(data, _path):
    return _pillow(data, "JPEG")


def _ppm(data, _path):
    return _pillow(data, "PPM")


def _openimageio(data, path, kind):
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
def _named(data, path, kind):
    """A name of the file that ends as its format should."""
    if str(path).lower().endswith(f".{kind}"):
        yield str(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / f"picture.{kind}"
        copy.write_bytes(data)
        yield str(copy)


def _plain(text):
    """A library's message as part of ours: one line, without the file's name."""
    lines = [line.strip() for line in (text or "").splitlines() if line.strip()]
    return re.sub(r"\"[^\"]*\"|'[^']*'", "the file", lines[0]).rstrip(".") if lines else "damaged"


def _colors(samples, has_alpha):
    """Linear RGB and opacity of samples; grey is replicated."""
    alpha = samples[..., -1] if has_alpha else None
    color = samples[..., : samples.shape[2] - has_alpha]
    return np.repeat(color, 3, axis=2) if color.shape[2] == 1 else color[..., :3], alpha


def _png(data, path):
    rgb, alpha = _colors(*_openimageio(data, path, "png"))
    return rgb, alpha, False


def _tga(data, path):
    """Targa; 16-bit pixels, palettes and pixels without attribute bits have no opacity."""
    kind, bits, attributes = data[2], data[16], data[17] & 15
    _check_size(*struct.unpack_from("<HH", data, 12))
    samples, has_alpha = _openimageio(data, path, "tga")
    grey = kind in (3, 11)
    rgb, alpha = _colors(samples, has_alpha or (grey and samples.shape[2] == 2))
    opaque = attributes == 0 or (bits == 16 and not grey)
    return rgb, None if opaque else alpha, False


def _bmp(data, path):
    header = bitmaps.Header(data)
    _check_size(header.width, header.height)
    bitmaps.check_complete(data, header)
    if header.special:
        return *bitmaps.read(data, header), False
    rgb, _ = _colors(*_openimageio(data, path, "bmp"))
    return rgb, None, False


def _radiance(data, _path):
    width, height, _, _ = radiance.read_header(data)
    _check_size(width, height)
    return radiance.read_pixels(data), None, True


def _pfm(data, _path):
    """Portable float maps: rows from the bottom, a negative scale means little endian."""
    header = _PFM.match(data)
    if not header:
        raise ValueError("malformed PFM header")
    width, height, channels = int(header[2]), int(header[3]), 3 if header[1] == b"PF" else 1
    _check_size(width, height)
    need = width * height * channels * 4
    if len(data) - header.end() < need:
        raise ValueError(f"the pixels are incomplete: {len(data) - header.end()} of {need} bytes")
    kind = "<f4" if float(header[4]) < 0 else ">f4"
    pixels = np.frombuffer(data, kind, need // 4, header.end()).reshape(height, width, channels)
    return np.broadcast_to(pixels[::-1], (height, width, 3)), None, True


def _exr(_data, path):
    """OpenEXR: R, G, B (or Y) and A of the first part."""
    import OpenEXR

    with OpenEXR.File(str(path), header_only=True) as file:
        low, high = file.header()["dataWindow"]
        _check_size(*(int(b) - int(a) + 1 for a, b in zip(low, high, strict=True)))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        if not file.parts:
            raise ValueError("the pixels are damaged or incomplete")
        channels = {name: np.float32(channel.pixels) for name, channel in file.channels().items()}
    names = ("R", "G", "B") if "R" in channels else ("Y", "Y", "Y")
    if not set(names) <= set(channels):
        raise ValueError(f"no colour among the channels {', '.join(sorted(channels))}")
    return np.stack([channels[name] for name in names], axis=2), channels.get("A"), True
