"""Windows bitmaps of all headers: palettes, bit fields, opacity, run-length codes.

The formats are those of Microsoft's BITMAPINFOHEADER and its descendants, and of OS/2. Libraries
read parts of them: Pillow replaces palettes of two colours by black and white, OpenImageIO refuses
the headers of OS/2 2 and palettes beside 24 bits, and both refuse 2 bits.
"""

from __future__ import annotations

import struct

import numpy as np

RGB, RLE8, RLE4, BIT_FIELDS, ALPHA_BIT_FIELDS = 0, 1, 2, 3, 6
"""Kinds of compression; 4 and 5 hold a JPEG or PNG for printers."""

_CORE_HEADER = 12  # of OS/2: 16-bit sizes, palettes of three bytes, no compression
_OS2_HEADER = 64  # its compressions from 3 on are others; the end of the header may be left out
_BITS = {
    RGB: (1, 2, 4, 8, 16, 24, 32),
    RLE8: (8,),
    RLE4: (4,),
    BIT_FIELDS: (16, 32),
    ALPHA_BIT_FIELDS: (16, 32),
}


class Header:
    """The headers of a bitmap.

    Args:
        data: the file.

    Attributes:
        size: bytes of the second header.
        width, height: in pixels; rows stand bottom up unless `top_down`.
        bits: of a pixel.
        compression: kind, see above.
        palette: where the palette begins.
        colors: entries of the palette, at most 256.
        offset: where the pixels begin.

    Raises:
        ValueError: incomplete, or a compression or number of bits that is not supported.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < 26:
            raise ValueError("the bitmap's header is incomplete")
        self.offset, self.size = struct.unpack_from("<II", data, 10)
        self.compression, colors = RGB, 0
        if self.size == _CORE_HEADER:
            self.width, height, _, self.bits = struct.unpack_from("<HHHH", data, 18)
        elif not 16 <= self.size <= 124 or len(data) < 14 + self.size:
            raise ValueError(f"the bitmap's header has {self.size} bytes: expected 12 or 16 to 124")
        else:
            fields = struct.unpack(
                "<iiHHI12xI", data[18 : 14 + min(self.size, 36)].ljust(32, b"\0")
            )
            self.width, height, _, self.bits, self.compression, colors = fields
        self.top_down, self.height = height < 0, abs(height)
        os2 = (self.size < 40 or self.size == _OS2_HEADER) and self.compression > RLE4
        if self.compression not in _BITS or os2:
            raise ValueError(f"bitmaps of compression {self.compression} are not supported")
        if self.bits not in _BITS[self.compression]:
            kind = f"compression {self.compression} and " if self.compression else ""
            raise ValueError(f"bitmaps of {kind}{self.bits} bits are not supported")
        self._place(len(data), colors)

    def _place(self, length: int, colors: int) -> None:
        """Set where palette and pixels are."""
        masks = {BIT_FIELDS: 12, ALPHA_BIT_FIELDS: 16}.get(self.compression, 0)
        self.palette = 14 + self.size + (masks if self.size == 40 else 0)
        self.colors = min(colors or 1 << self.bits, 256) if self.bits <= 8 else 0
        entry = 3 if self.size == _CORE_HEADER else 4
        if self.offset < self.palette:  # not given
            self.offset = min(self.palette + entry * self.colors, length)
        self.colors = min(self.colors, (min(self.offset, length) - self.palette) // entry)

    @property
    def stride(self) -> int:
        """Bytes of a row that is not compressed."""
        return (self.width * self.bits + 31) // 32 * 4


def check_complete(data: bytes, header: Header) -> None:
    """Check that pixels without compression are all there.

    Raises:
        ValueError: they are not.
    """
    if header.compression in (RLE8, RLE4):
        return
    have, need = max(len(data) - header.offset, 0), header.stride * header.height
    if have < need:
        raise ValueError(f"the pixels are incomplete: {have} of {need} bytes")


def read(data: bytes, header: Header) -> tuple[np.ndarray, np.ndarray | None]:
    """Colours and opacity of a bitmap.

    Args:
        data: the file.
        header: its `Header`, of acceptable size.

    Returns:
        Linear RGB, float32 (H, W, 3), top row first, and opacity (H, W) or None.

    Raises:
        ValueError: damaged or incomplete.
    """
    step = 1 if header.top_down else -1
    if header.compression in (RLE8, RLE4):
        indices = _runs(memoryview(data)[header.offset :], header)
        return _palette(data, header).take(indices[::step], axis=0), None
    stored = _rows(data, header)[::step]
    if header.bits <= 8:
        return _palette(data, header).take(_indices(stored, header), axis=0), None
    if header.bits == 24:
        colors = stored[:, : 3 * header.width].reshape(header.height, -1, 3)
        return colors[..., ::-1] / np.float32(255), None
    return _bit_fields(data, stored, header)


def _rows(data: bytes, header: Header) -> np.ndarray:
    """Stored bytes without compression, uint8 (H, stride)."""
    stored = np.frombuffer(data, np.uint8, header.stride * header.height, header.offset)
    return stored.reshape(header.height, header.stride)


def _indices(rows: np.ndarray, header: Header) -> np.ndarray:
    """Palette indices (H, W) of 1, 2, 4 or 8 bits, the first pixel in the highest bits."""
    if header.bits == 8:
        return rows[:, : header.width]
    shifts = np.arange(8 - header.bits, -1, -header.bits, dtype=np.uint8)
    pixels = rows[..., None] >> shifts & np.uint8((1 << header.bits) - 1)
    return pixels.reshape(len(rows), -1)[:, : header.width]


def _palette(data: bytes, header: Header) -> np.ndarray:
    """Colours of all indices, float32 (256, 3); black where the file has none."""
    entry = 3 if header.size == _CORE_HEADER else 4
    stored = np.frombuffer(data, np.uint8, header.colors * entry, header.palette)
    colors = np.zeros((256, 3), np.float32)
    colors[: header.colors] = stored.reshape(-1, entry)[:, 2::-1] / np.float32(255)
    return colors


def _runs(code: memoryview, header: Header) -> np.ndarray:
    """Palette indices of run-length codes, uint8 (H, W), bottom row first; 0 where none is set."""
    width, height = header.width, header.height
    out = np.zeros((height, width), np.uint8)
    packed = header.compression == RLE4
    x = y = at = 0
    while at + 1 < len(code):
        count, value = code[at], code[at + 1]
        at += 2
        if count == 0 and value == 0:  # end of line
            x, y = 0, y + 1
        elif count == 0 and value == 1:
            return out
        elif count == 0 and value == 2:
            if at + 1 >= len(code):
                break
            x, y, at = x + code[at], y + code[at + 1], at + 2
        else:
            if count:
                indices = np.array([value], np.uint8)
            else:
                count, size = value, (value + 1) // 2 if packed else value
                indices = np.frombuffer(code[at : at + size], np.uint8)
                at += size + size % 2  # to a multiple of two bytes
                if len(indices) < size:
                    break
            if packed:
                indices = np.stack([indices >> 4, indices & 15], axis=1).ravel()
            if y >= height:
                raise ValueError("a run above the top row")
            fits = max(min(count, width - x), 0)
            out[y, x : x + fits] = np.resize(indices, count)[:fits]
            x += count
    if (y, x) < (height - 1, width):
        raise ValueError(f"the pixels are incomplete: {y} of {height} rows")
    return out


def _bit_fields(
    data: bytes, rows: np.ndarray, header: Header
) -> tuple[np.ndarray, np.ndarray | None]:
    """Colours and opacity of 16 or 32 bits."""
    pixels = rows.view(f"<u{header.bits // 8}")[:, : header.width]
    masks = _masks(data, header)
    red, green, blue, alpha = (_bit_field(pixels, mask) for mask in masks)
    opaque = not masks[3] or (header.compression == RGB and not alpha.any())
    return np.stack([red, green, blue], axis=2), None if opaque else alpha


def _masks(data: bytes, header: Header) -> tuple[int, int, int, int]:
    """Bit masks of red, green, blue and opacity."""
    if header.compression == RGB:
        if header.bits == 16:
            return 0x7C00, 0x3E0, 0x1F, 0
        return 0xFF0000, 0xFF00, 0xFF, 0xFF000000
    if len(data) < 70:
        raise ValueError("the bitmap's bit masks are missing")
    red, green, blue, alpha = struct.unpack_from("<4I", data, 54)
    has_alpha = header.size >= 56 or header.compression == ALPHA_BIT_FIELDS
    return red, green, blue, alpha if has_alpha else 0


def _bit_field(pixels: np.ndarray, mask: int) -> np.ndarray:
    """The bits of a mask as a fraction of their maximum; 0 for an empty mask."""
    shift = (mask & -mask).bit_length() - 1 if mask else 0
    return ((pixels & mask) >> shift).astype(np.float32) / max(mask >> shift, 1)
