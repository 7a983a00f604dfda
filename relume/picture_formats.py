"""Formats of picture files: what is written for each extension.

Linear formats take radiance, the others what is encoded for display already. OpenEXR and PNG take
metadata, too, and OpenEXR further layers.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from PIL.PngImagePlugin import PngInfo


COMMENT = "Comment"
"""Name of the text that all formats but BMP have a place for; OpenEXR calls it `comments`."""


@dataclass(frozen=True)
class Contents:
    """What a picture file holds.

    Attributes:
        pixels: (height, width, 3): float32 where the format is linear, else uint8.
        metadata: texts by name, for formats that have a place for them.
        layers: further channels by name, such as `normal.X`: (height, width) float32, for OpenEXR.
    """

    pixels: np.ndarray
    metadata: Mapping[str, str] = field(default_factory=dict)
    layers: Mapping[str, np.ndarray] = field(default_factory=dict)


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


def _write_hdr(path: Path, contents: Contents) -> None:
    height, width, _ = contents.pixels.shape
    rgbe = encode_rgbe(contents.pixels)
    size = f"-Y {height} +X {width}\n"
    header = f"#?RADIANCE\n{_comment(contents)}FORMAT=32-bit_rle_rgbe\n\n{size}".encode()
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


def _write_exr(path: Path, contents: Contents) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    planes = {name: contents.pixels[..., i] for i, name in enumerate("RGB")}
    planes |= contents.layers
    channels = {name: np.ascontiguousarray(plane, np.float32) for name, plane in planes.items()}
    names = {COMMENT: "comments"}
    texts = {names.get(name, name): text for name, text in contents.metadata.items()}
    OpenEXR.File({**header, **texts}, channels).write(str(path))


def _write_ppm(path: Path, contents: Contents) -> None:
    pixels = contents.pixels
    height, width, _ = pixels.shape
    digits = np.array([list(f"{value:3d} ".encode()) for value in range(256)], np.uint8)
    text = digits[pixels]
    text[:, :, 2, 3] = ord("\n")
    path.write_bytes(f"P3\n{_comment(contents)}{width} {height}\n255\n".encode() + text.tobytes())


def _comment(contents: Contents) -> str:
    """The comment as lines of the head of a text-like format."""
    lines = contents.metadata.get(COMMENT, "").splitlines()
    return "".join(f"# {line}\n" for line in lines)


def _write_png(path: Path, contents: Contents) -> None:
    from PIL.PngImagePlugin import PngInfo

    texts = PngInfo()
    for name, text in contents.metadata.items():
        texts.add_itxt(name, text)
    path.write_bytes(_pillow(contents.pixels, "PNG", pnginfo=texts))


def _write_bmp(path: Path, contents: Contents) -> None:
    path.write_bytes(_pillow(contents.pixels, "BMP"))


def _pillow(pixels: np.ndarray, format: str, **settings: PngInfo) -> bytes:
    """Encode in memory: written to a file directly, Pillow's BMP is silently cut on a full disk."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format=format, **settings)
    return buffer.getvalue()


# extension: writer, whether it takes linear values
WRITERS: dict[str, tuple[Callable[[Path, Contents], None], bool]] = {
    ".hdr": (_write_hdr, True),
    ".exr": (_write_exr, True),
    ".png": (_write_png, False),
    ".bmp": (_write_bmp, False),
    ".ppm": (_write_ppm, False),
}
