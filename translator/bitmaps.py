"""Windows bitmaps that libraries read wrongly or refuse: bit fields, opacity, run-length codes.

The formats are those of Microsoft's BITMAPINFOHEADER and its descendants. A bitmap of 1 to 24 bits
without compression is none of these: `special` says so, and a library reads it.
"""

import struct

import numpy as np

RGB, RLE8, RLE4, BIT_FIELDS, ALPHA_BIT_FIELDS = 0, 1, 2, 3, 6
"""Kinds of compression; 4 and 5 hold a JPEG or PNG for printers."""

_CORE_HEADER = 12  # of OS/2: 16-bit sizes, palettes of three bytes, no compression


class Header:
    """The headers of a bitmap.

    Args:
        data: the file.

    Attributes:
        offset: where the pixels begin.
        size: bytes of the second header.
        width, height: in pixels; rows stand bottom up unless `top_down`.
        bits: of a pixel.
        compression: kind, see above.

    Raises:
        ValueError: incomplete, or a compression that is not supported.
    """

    def __init__(self, data):
        if len(data) < 26:
            raise ValueError("the bitmap's header is incomplete")
        self.offset, self.size = struct.unpack_from("<II", data, 10)
        self.compression, self.colors = RGB, 0
        if self.size == _CORE_HEADER:
            self.width, height, _, self.bits = struct.unpack_from("<HHHH", data, 18)
        elif self.size < 40 or len(data) < 54:
            raise ValueError(f"the bitmap's header has {self.size} bytes: expected 12 or 40 to 124")
        else:
            fields = struct.unpack_from("<iiHHIIiiI", data, 18)
            self.width, height, _, self.bits, self.compression = fields[:5]
            self.colors = fields[8]
        self.top_down, self.height = height < 0, abs(height)
        known = (RGB, RLE8, RLE4, BIT_FIELDS, ALPHA_BIT_FIELDS)
        if self.compression not in known or (self.size == 64 and self.compression == BIT_FIELDS):
            raise ValueError(f"bitmaps of compression {self.compression} are not supported")
        run_bits = {RLE8: 8, RLE4: 4}.get(self.compression)
        if run_bits not in (None, self.bits):
            raise ValueError(f"runs of {run_bits} bits in a bitmap of {self.bits}")

    @property
    def stride(self):
        """Bytes of a row that is not compressed."""
        return (self.width * self.bits + 31) // 32 * 4

    @property
    def special(self):
        """Whether `read` is the reader of choice."""
        return self.compression != RGB or self.bits in (16, 32)


def check_complete(data, header):
    """Check that pixels without compression are all there.

    Raises:
        ValueError: they are not.
    """
    if header.compression in (RLE8, RLE4):
        return
    have, need = max(len(data) - header.offset, 0), header.stride * header.height
    if have < need:
        raise ValueError(f"the pixels are incomplete: {have} of {need} bytes")


def read(data, header):
    """Colours and opacity of a `special` bitmap.

    Args:
        data: the file.
        header: its `Header`, of acceptable size.

    Returns:
        Linear RGB, float32 (H, W, 3), top row first, and opacity (H, W) or None.

    Raises:
        ValueError: damaged or incomplete.
    """
    if header.compression in (RLE8, RLE4):
        indices = _runs(memoryview(data)[header.offset :], header)[::-1]
        return _palette(data, header)[indices], None
    rgb, alpha = _bit_fields(data, header)
    step = 1 if header.top_down else -1
    return rgb[::step], None if alpha is None else alpha[::step]


def _palette(data, header):
    """Colours of all indices, float32 (256, 3); black where the file has none."""
    count = min(header.colors or 1 << header.bits, 256)
    stored = np.frombuffer(data, np.uint8, -1, 14 + header.size)[: 4 * count]
    entries = stored[: len(stored) // 4 * 4].reshape(-1, 4)
    colors = np.zeros((256, 3), np.float32)
    colors[: len(entries)] = entries[:, 2::-1] / np.float32(255)
    return colors


def _runs(code, header):
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


def _bit_fields(data, header):
    """Colours and opacity of 16 or 32 bits, rows in the order of the file."""
    kind = np.dtype(f"<u{header.bits // 8}")
    count = header.stride // kind.itemsize * header.height
    stored = np.frombuffer(data, kind, count, header.offset)
    stored = stored.reshape(header.height, -1)[:, : header.width]
    masks = _masks(data, header)
    red, green, blue, alpha = (_bit_field(stored, mask) for mask in masks)
    if not masks[3] or (header.compression == RGB and not alpha.any()):
        alpha = None
    return np.stack([red, green, blue], axis=2), alpha


def _masks(data, header):
    """Bit masks of red, green, blue and opacity."""
    if header.compression == RGB:
        rgb = (0x7C00, 0x3E0, 0x1F) if header.bits == 16 else (0xFF0000, 0xFF00, 0xFF)
        return *rgb, 0 if header.bits == 16 else 0xFF000000
    if len(data) < 70:
        raise ValueError("the bitmap's bit masks are missing")
    masks = struct.unpack_from("<4I", data, 54)
    has_alpha = header.size >= 56 or header.compression == ALPHA_BIT_FIELDS
    return masks if has_alpha else (*masks[:3], 0)


def _bit_field(stored, mask):
    """The bits of a mask as a fraction of their maximum; 0 for an empty mask."""
    shift = (mask & -mask).bit_length() - 1 if mask else 0
    return ((stored & mask) >> shift).astype(np.float32) / max(mask >> shift, 1)
