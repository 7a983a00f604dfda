"""Pictures of kinds that public test suites hold and that readers get wrong, byte by byte.

Each is written here by the format's own definition; the expected values stand beside it, in 255ths.
"""

import struct
import zlib

import numpy as np
import pytest

from relume.translator.images import ImageError, read_image

BLACK_WHITE = [(0, 0, 0), (255, 255, 255)]
RAMP = [(i, i, i) for i in range(256)]
COLORS = [(i, 255 - i, i * 7 % 256) for i in range(256)]


def bmp(width, height, bits, pixels, palette=(), compression=0, gap=0, size=40, offset=None):
    """A bitmap with a palette and a header of `size` bytes; `gap` bytes lie before the pixels."""
    entries = b"".join(bytes((b, g, r, 0)) for r, g, b in palette)
    behind = 14 + size + len(entries) + gap
    sizes = struct.pack("<IHHI", behind + len(pixels), 0, 0, behind if offset is None else offset)
    used = len(pixels), 0, 0, len(palette), 0
    info = struct.pack("<IiiHHIIiiII", size, width, height, 1, bits, compression, *used)
    return b"BM" + sizes + info.ljust(size, b"\0")[:size] + entries + bytes(gap) + pixels


def os2(width, height, bits, pixels, palette):
    """A bitmap with the header of OS/2, whose palette has three bytes an entry."""
    entries = b"".join(bytes((b, g, r)) for r, g, b in palette)
    offset = 26 + len(entries)
    sizes = struct.pack("<IHHI", offset + len(pixels), 0, 0, offset)
    return b"BM" + sizes + struct.pack("<IHHHH", 12, width, height, 1, bits) + entries + pixels


def chunk(kind, data, damage=0):
    check = zlib.crc32(kind + data) ^ damage
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)


def png(width, depth, kind, row, *chunks):
    """A PNG of one row: `kind` is 0 grey, 2 RGB, 3 palette, 4 grey and opacity, 6 RGBA."""
    head = struct.pack(">IIBBBBB", width, 1, depth, kind, 0, 0, 0)
    pixels = chunk(b"IDAT", zlib.compress(b"\0" + row))
    parts = [b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", head), *chunks, pixels, chunk(b"IEND", b"")]
    return b"".join(parts)


def transparent(*values):
    return chunk(b"tRNS", struct.pack(f">{len(values)}H", *values))


def tga(kind, width, height, bits, pixels, palette=b"", entries=0, depth=0, first=0, flags=0x20):
    """A Targa picture; `flags` tell the order of rows and how many bits are opacity."""
    head = (0, entries > 0, kind, first, entries, depth, 0, 0, width, height, bits, flags)
    return struct.pack("<BBBHHBHHHHBB", *head) + palette + pixels


def bgr(*colors):
    return b"".join(bytes((b, g, r)) for r, g, b in colors)


A, B = (1, 2, 3), (4, 5, 6)
RED_BLUE = struct.pack("<HH", 31 << 10, 31)
RED_BLUE_PIXELS = [(255, 0, 0), (0, 0, 255)]
ROW = bytes([0, 1, 0, 1])
RUNS = bytes([3, 5, 0, 3, 7, 8, 9, 0, 2, 1, 0, 0, 0, 1])  # 5 5 5, then 7 8 9 as such, then 1 1
RUNS_OF_4 = bytes([0, 5, 0x12, 0x34, 0x50, 0, 3, 0x67, 0, 0, 0, 1])  # 1 2 3 4 5 as such, then 6 7 6
EXPANDED = [COLORS[i] for i in (5, 5, 5, 7, 8, 9, 1, 1)]
GREY16 = struct.pack(">3H", 1000, 1001, 60000)
RGB16 = struct.pack(">6H", 1000, 2000, 3000, 1001, 2000, 3000)
RGB16_PIXELS = [(1000 / 257, 2000 / 257, 3000 / 257), (1001 / 257, 2000 / 257, 3000 / 257)]

PICTURES = {
    "8 bits, black and white": (bmp(4, 1, 8, ROW, BLACK_WHITE), [0, 255, 0, 255], None),
    "4 bits, black and white": (
        bmp(4, 1, 4, bytes([1, 1, 0, 0]), BLACK_WHITE), [0, 255, 0, 255], None,
    ),
    "1 bit, white and black": (
        bmp(4, 1, 1, bytes([0x50, 0, 0, 0]), BLACK_WHITE[::-1]), [255, 0, 255, 0], None,
    ),
    "8 bits, entry i is i": (bmp(4, 1, 8, bytes([0, 1, 2, 255]), RAMP), [0, 1, 2, 255], None),
    "8 bits, 16 entries i": (bmp(4, 1, 8, bytes([0, 1, 2, 3]), RAMP[:16]), [0, 1, 2, 3], None),
    "4 bits, 16 entries i": (bmp(4, 1, 4, bytes([1, 0x23, 0, 0]), RAMP[:16]), [0, 1, 2, 3], None),
    "two colours": (bmp(4, 1, 8, ROW, [A, B]), [A, B, A, B], None),
    "OS/2, black and white": (
        os2(4, 1, 8, ROW, BLACK_WHITE + [(9, 9, 9)] * 254), [0, 255, 0, 255], None,
    ),
    "RLE4, odd absolute run": (
        bmp(8, 1, 4, RUNS_OF_4, COLORS[:16], 2),
        [COLORS[i] for i in (1, 2, 3, 4, 5, 6, 7, 6)], None,
    ),
    **{f"RLE8, gap {k}": (bmp(8, 1, 8, RUNS, COLORS, 1, k), EXPANDED, None) for k in range(4)},
    "RLE8, no end of the last line": (bmp(8, 1, 8, RUNS[:-4] + b"\0\1", COLORS, 1), EXPANDED, None),
    "RLE8, black and white": (
        bmp(4, 1, 8, bytes([2, 0, 2, 1, 0, 1]), BLACK_WHITE, 1), [0, 0, 255, 255], None,
    ),
    "RLE8, a step aside": (
        bmp(4, 1, 8, bytes([1, 5, 0, 2, 2, 0, 1, 6, 0, 1]), COLORS, 1),
        [COLORS[i] for i in (5, 0, 0, 6)], None,
    ),
    "RLE8, rows from the top": (
        bmp(2, -2, 8, bytes([2, 5, 0, 0, 2, 6, 0, 1]), COLORS, 1),
        [COLORS[i] for i in (5, 5, 6, 6)], None,
    ),
    **{
        f"header of {size} bytes": (bmp(4, 1, 8, ROW, [A, B], size=size), [A, B, A, B], None)
        for size in (52, 56, 64, 108, 124)
    },
    "header of 16 bytes": (bmp(2, 1, 24, bgr(A, B) + b"\0\0", size=16), [A, B], None),
    "24 bits, a palette beside": (bmp(2, 1, 24, bgr(A, B) + b"\0\0", COLORS[:3]), [A, B], None),
    "24 bits, rows from the top": (
        bmp(1, -2, 24, bgr(A) + b"\0" + bgr(B) + b"\0"), [A, B], None,
    ),
    "2 bits": (bmp(4, 1, 2, bytes([0x1B, 0, 0, 0]), COLORS[:4]), COLORS[:4], None),
    "1 bit, rows from the top": (
        bmp(2, -2, 1, bytes([0x40, 0, 0, 0, 0x80, 0, 0, 0]), [A, B]), [A, B, B, A], None,
    ),
    "palette of 300": (bmp(4, 1, 8, ROW, [A, B] + [(9, 9, 9)] * 298), [A, B, A, B], None),
    "palette too short": (bmp(4, 1, 8, bytes([0, 1, 2, 255]), [A, B]), [A, B, 0, 0], None),
    "OS/2, palette too short": (os2(4, 1, 8, bytes([0, 1, 2, 255]), [A, B]), [A, B, 0, 0], None),
    "offset 0": (bmp(2, 1, 24, bgr(A, B) + b"\0\0", offset=0), [A, B], None),
    "1-bit grey, tRNS": (png(2, 1, 0, b"\x40", transparent(1)), [0, 255], [1, 0]),
    "2-bit grey, tRNS": (png(4, 2, 0, b"\x1b", transparent(2)), [0, 85, 170, 255], [1, 1, 0, 1]),
    "4-bit grey, tRNS": (png(2, 4, 0, b"\x1e", transparent(14)), [17, 238], [1, 0]),
    "8-bit grey, tRNS": (png(2, 8, 0, bytes([17, 99]), transparent(99)), [17, 99], [1, 0]),
    "16-bit grey, tRNS": (
        png(3, 16, 0, GREY16, transparent(1001)), [1000 / 257, 1001 / 257, 60000 / 257], [1, 0, 1],
    ),
    "16-bit RGB, tRNS": (png(2, 16, 2, RGB16, transparent(1000, 2000, 3000)), RGB16_PIXELS, [0, 1]),
    "8-bit RGB, tRNS": (png(2, 8, 2, bytes([*A, *B]), transparent(*A)), [A, B], [0, 1]),
    "palette, tRNS": (
        png(2, 8, 3, b"\0\1", chunk(b"PLTE", bytes([*A, *B])), chunk(b"tRNS", b"\x80")),
        [A, B], [128 / 255, 1],
    ),
    "16-bit RGB": (png(2, 16, 2, RGB16), RGB16_PIXELS, None),
    "16-bit grey and opacity": (
        png(1, 16, 4, struct.pack(">HH", 1000, 30000)), [1000 / 257], [30000 / 65535],
    ),
    "checksum of a text is wrong": (
        png(1, 8, 2, bytes(A), chunk(b"tEXt", b"Title\0hello", damage=1)), [A], None,
    ),
    "colours under opacity 0, gamma": (
        png(1, 8, 6, bytes([*A, 0]), chunk(b"gAMA", struct.pack(">I", 45455))), [A], [0],
    ),
    "TGA run over two rows": (
        tga(10, 2, 2, 24, b"\x82" + bgr(A) + b"\0" + bgr(B)), [A, A, A, B], None,
    ),
    "TGA map of 15 bits": (tga(1, 2, 1, 8, b"\0\1", RED_BLUE, 2, 15), RED_BLUE_PIXELS, None),
    "TGA map of 16 bits": (tga(1, 2, 1, 8, b"\0\1", RED_BLUE, 2, 16), RED_BLUE_PIXELS, None),
    "TGA map of 32 bits": (
        tga(1, 2, 1, 8, b"\0\1", bytes([3, 2, 1, 255, 6, 5, 4, 255]), 2, 32), [A, B], None,
    ),
    "TGA map that begins at 5": (
        tga(1, 2, 1, 8, bytes([5, 6]), bgr(A, B), 2, 24, first=5), [A, B], None,
    ),
    "TGA of 15 bits": (tga(2, 2, 1, 15, RED_BLUE), RED_BLUE_PIXELS, None),
    "TGA of 16 bits": (tga(2, 2, 1, 16, RED_BLUE), RED_BLUE_PIXELS, None),
    "TGA indices of 16 bits": (
        tga(1, 2, 1, 16, struct.pack("<HH", 0, 1), bgr(A, B), 2, 24), [A, B], None,
    ),
    "TGA true colour, a map beside": (
        tga(2, 2, 1, 24, bgr(A, B), bgr((9, 9, 9)), 1, 24), [A, B], None,
    ),
    "TGA grey, a map beside": (tga(3, 2, 1, 8, b"\7\x63", bgr((9, 9, 9)), 1, 24), [7, 99], None),
    "TGA with a name and a footer": (
        b"\4" + tga(2, 2, 1, 24, b"name" + bgr(A, B))[1:] + bytes(8) + b"TRUEVISION-XFILE.\0",
        [A, B], None,
    ),
    "TGA from the right": (tga(2, 2, 1, 24, bgr(A, B), flags=0x30), [B, A], None),
    "TGA grey and opacity": (tga(3, 1, 1, 16, bytes([7, 51]), flags=0x28), [7], [0.2]),
    "PPM of 16 bits": (
        b"P6\n2 # wide\n1\n65535\n" + RGB16, RGB16_PIXELS, None,
    ),
    "PPM up to 1000": (b"P6 1 1 1000\n\0\0\1\xf4\3\xe8", [(0, 127.5, 255)], None),
    "PGM up to 100": (b"P5 3 1 100 \0\x32\x64", [0, 127.5, 255], None),
    "PGM in words": (b"P2 2 1 15\n15\n3\n", [255, 51], None),
    "PBM": (b"P4 4 1\n\x50", [255, 0, 255, 0], None),
    "TGA packed grey": (tga(11, 4, 1, 8, bytes([0x82, 7, 0, 9])), [7, 7, 7, 9], None),
}


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("ending", [None, "txt"])
def test_picture(tmp_path, name, ending):
    """Proves: the values are those that the format defines, whatever the file is called."""
    data, pixels, alpha = PICTURES[name]
    kind = {b"BM": "bmp", b"\x89P": "png"}.get(data[:2], "ppm" if data[:1] == b"P" else "tga")
    path = tmp_path / f"picture.{ending or kind}"
    path.write_bytes(data)
    image = read_image(path)
    expected = np.array([x if isinstance(x, tuple) else (x,) * 3 for x in pixels]) / 255
    np.testing.assert_allclose(image.rgb.reshape(-1, 3), expected, atol=1e-6)
    if alpha is None:
        assert image.alpha is None
    else:
        np.testing.assert_allclose(image.alpha.ravel(), alpha, atol=1e-6)


PIXEL, LAST = bytes([128, 64, 32, 129]), bytes([10, 20, 30, 129])
FLAT = PIXEL * 7 + LAST
PACKED = b"\2\2\0\x08" + b"".join(bytes([136, byte]) for byte in PIXEL)


@pytest.mark.parametrize("rows", [(FLAT, PACKED), (PACKED, FLAT), (PACKED, FLAT, FLAT, PACKED)])
def test_each_radiance_row_has_a_code_of_its_own(tmp_path, rows):
    """Proves: flat and run-length rows may follow each other.

    By hand: (128, 64, 32) 2^(129-136) = (1, 1/2, 1/4); (10, 20, 30) / 128 ends a flat row.
    """
    path = tmp_path / "mixed.hdr"
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X 8\n" % len(rows)
    path.write_bytes(head + b"".join(rows))
    expected = np.broadcast_to([1, 0.5, 0.25], (len(rows), 8, 3)).copy()
    expected[[row is FLAT for row in rows], 7] = np.array([10, 20, 30]) / 128
    np.testing.assert_array_equal(read_image(path).rgb, expected.astype(np.float32))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (bmp(4, 1, 8, b"\0" * 4, BLACK_WHITE, 4), "bitmaps of compression 4 are not supported"),
        (bmp(4, 1, 24, b"\0" * 12, (), 1), "compression 1 and 24 bits are not"),
        (bmp(4, 2, 8, bytes([4, 1, 0, 0, 0, 0, 1, 1, 0, 1]), COLORS, 1), "a run above the top row"),
        (bmp(8, 1, 8, bytes([3, 5]), COLORS, 1), "incomplete: 0 of 1 rows"),
        (b"BM" + bytes(30), "header has 0 bytes: expected 12 or 16 to 124"),
        (bmp(4, 1, 24, b"\1" * 12, (), 4, size=64), "compression 4 are not supported"),
        (bmp(4, 1, 7, b"\0" * 4), "bitmaps of 7 bits are not supported"),
        (b"\xff\xd8\xff" + bytes(40), "damaged, or no JPEG"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "damaged or not supported"),
        (b"P6\n2 2\n255\n\1", "damaged, or no PPM|incomplete|truncated"),
    ],
)
def test_refusals_say_what_is_wrong(tmp_path, data, message):
    """Proves: no message speaks of objects of the program."""
    path = tmp_path / "bad.bmp"
    path.write_bytes(data)
    with pytest.raises(ImageError, match=message) as caught:
        read_image(path)
    assert "0x" not in str(caught.value)
    assert str(caught.value).startswith(str(path))
