"""Pictures, each written byte by byte or by Pillow, with the values its format defines."""

import os
import struct
import warnings
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PillowImage

from relume.translator import images
from relume.translator.images import ImageError, as_texture, bump_height, read_image


def _read(tmp_path, data, name="picture"):
    path = tmp_path / name
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read_image(path)


def _bytes(image):
    """The values of a picture in 255ths, as nested lists."""
    return np.rint(image.rgb * 255).astype(int).tolist()


def _bmp(width, height, bits, pixels, compression=0, palette=b"", masks=b"", header=40):
    offset = 14 + 40 + len(masks) + len(palette)
    colours = len(palette) // 4
    return (
        b"BM" + struct.pack("<IHHI", offset + len(pixels), 0, 0, offset)
        + struct.pack("<IiiHHIIiiII", header, width, height, 1, bits, compression,
                      len(pixels), 0, 0, colours, 0)
        + masks + palette + pixels
    )


PALETTE = bytes([30, 20, 10, 0, 60, 50, 40, 0, 90, 80, 70, 0])  # blue, green, red, unused
A, B, C = [10, 20, 30], [40, 50, 60], [70, 80, 90]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        # rows are padded to four bytes and stand bottom up, pixels are blue, green, red
        (_bmp(1, 2, 24, bytes([30, 20, 10, 0, 60, 50, 40, 0])), [[B], [A]]),
        (_bmp(1, -2, 24, bytes([30, 20, 10, 0, 60, 50, 40, 0])), [[A], [B]]),
        (_bmp(3, 1, 8, bytes([0, 1, 2, 0]), palette=PALETTE), [[A, B, C]]),
        (_bmp(3, 1, 4, bytes([0x01, 0x20, 0, 0]), palette=PALETTE), [[A, B, C]]),
        (_bmp(3, 1, 1, bytes([0x40, 0, 0, 0]), palette=PALETTE[:8]), [[A, B, A]]),
        # run, end of line, absolute run (padded to two bytes), end of picture
        (_bmp(3, 2, 8, bytes([2, 1, 1, 2, 0, 0, 0, 3, 0, 1, 2, 0, 0, 1]), 1, PALETTE),
         [[A, B, C], [B, B, C]]),
        # a delta moves 1 right and 1 up, what it leaves out is entry 0
        (_bmp(3, 2, 8, bytes([1, 1, 0, 2, 1, 1, 1, 2, 0, 1]), 1, PALETTE), [[A, A, C], [B, A, A]]),
        (_bmp(3, 1, 4, bytes([3, 0x12, 0, 0, 0, 1]), 2, PALETTE), [[B, C, B]]),
        # 32 bits whose fourth byte is 0 everywhere are opaque
        (_bmp(1, 1, 32, bytes([30, 20, 10, 0])), [[A]]),
    ],
)
def test_bmp_variants(tmp_path, data, expected):
    """Proves: depths 1 to 32, both row orders, padding and both run-length codes."""
    image = _read(tmp_path, data)
    assert _bytes(image) == expected
    assert image.rgb.dtype == np.float32
    assert (image.alpha, image.hdr) == (None, False)


@pytest.mark.parametrize(
    ("data", "rgb", "alpha"),
    [
        (_bmp(2, 1, 16, struct.pack("<HH", 31 << 10 | 16 << 5 | 1, 0)), [1, 16 / 31, 1 / 31], None),
        (_bmp(2, 1, 16, struct.pack("<HH", 31 << 11 | 32 << 5 | 1, 0), 3,
              masks=struct.pack("<3I", 0xF800, 0x7E0, 0x1F)), [1, 32 / 63, 1 / 31], None),
        (_bmp(1, 1, 32, bytes([30, 20, 10, 51])), [10 / 255, 20 / 255, 30 / 255], 0.2),
        (_bmp(1, 1, 32, struct.pack("<I", 1023 << 20 | 512 << 10 | 5), 3,
              masks=struct.pack("<3I", 1023 << 20, 1023 << 10, 1023)),
         [1, 512 / 1023, 5 / 1023], None),
        (_bmp(1, 1, 32, bytes([30, 20, 10, 0]), 3, header=56,
              masks=struct.pack("<4I", 0xFF0000, 0xFF00, 0xFF, 0xFF000000)),
         [10 / 255, 20 / 255, 30 / 255], 0.0),
    ],
)
def test_bmp_bit_fields_and_opacity(tmp_path, data, rgb, alpha):
    """Proves: k bits are value / (2^k - 1) under any masks; the fourth byte is the opacity."""
    image = _read(tmp_path, data)
    np.testing.assert_allclose(image.rgb[0, 0], rgb, rtol=1e-6)
    assert alpha == (None if image.alpha is None else pytest.approx(image.alpha[0, 0], abs=1e-6))


def _save(array, kind, mode=None, **options):
    out = BytesIO()
    PillowImage.fromarray(np.asarray(array)).convert(mode).save(out, kind, **options)
    return out.getvalue()


def test_png_kinds(tmp_path):
    """Proves: grey, grey with opacity, palette with transparency, 16-bit grey and 1 bit."""
    grey = np.array([[0, 51], [102, 255]], np.uint8)
    expected = np.repeat(grey[..., None], 3, axis=2).tolist()
    assert _bytes(_read(tmp_path, _save(grey, "PNG"))) == expected
    both = _read(tmp_path, _save(np.stack([grey, grey[::-1]], axis=2), "PNG"))
    np.testing.assert_allclose(both.alpha, [[0.4, 1], [0, 0.2]], rtol=1e-6)
    palette = _read(tmp_path, _save(grey, "PNG", "P", transparency=0))
    np.testing.assert_array_equal(palette.alpha, [[0, 1], [1, 1]])
    deep = _read(tmp_path, _save(np.array([[0, 12345], [65535, 1]], np.uint16), "PNG"))
    np.testing.assert_allclose(deep.rgb[0, 1], [12345 / 65535] * 3, rtol=1e-6)
    bit = _read(tmp_path, _save(grey > 60, "PNG"))
    assert _bytes(bit) == [[[0] * 3] * 2, [[255] * 3] * 2]


def test_opaque_alpha_is_none(tmp_path):
    """Proves: an opacity of 1 everywhere costs the caller no mask."""
    assert _read(tmp_path, _save(np.full((2, 2, 4), 255, np.uint8), "PNG")).alpha is None


def test_jpeg_within_its_loss(tmp_path):
    """Proves: JPEG bytes are used linearly (a smooth ramp is kept to 3 steps at quality 95)."""
    ramp = np.broadcast_to(np.arange(0, 256, 4, dtype=np.uint8)[None, :, None], (16, 64, 3))
    image = _read(tmp_path, _save(ramp, "JPEG", quality=95), "wrong.bmp")
    assert np.abs(image.rgb - ramp / 255).max() <= 3 / 255


def _tga(width, height, kind, depth, pixels, descriptor=0, palette=b""):
    entries, entry_bits = len(palette) // 3, 24 if palette else 0
    head = (0, bool(palette), kind, 0, entries, entry_bits, 0, 0, width, height, depth, descriptor)
    return struct.pack("<BBBHHBHHHHBB", *head) + palette + pixels


@pytest.mark.parametrize(
    ("data", "expected", "alpha"),
    [
        (_tga(1, 2, 2, 24, bytes([30, 20, 10, 60, 50, 40])), [[B], [A]], None),
        (_tga(1, 2, 2, 24, bytes([30, 20, 10, 60, 50, 40]), 0x20), [[A], [B]], None),
        (_tga(1, 1, 2, 32, bytes([30, 20, 10, 51]), 8), [[A]], 0.2),
        (_tga(1, 1, 2, 32, bytes([30, 20, 10, 0]), 0), [[A]], None),
        (_tga(3, 1, 10, 24, bytes([0x81, 30, 20, 10, 0, 60, 50, 40])), [[A, A, B]], None),
        (_tga(2, 1, 1, 8, bytes([1, 0]), 0, bytes([30, 20, 10, 60, 50, 40])), [[B, A]], None),
        (_tga(2, 1, 3, 8, bytes([7, 8])), [[[7] * 3, [8] * 3]], None),
    ],
)
def test_tga_without_footer(tmp_path, data, expected, alpha):
    """Proves: the first TGA version (no footer, no magic), plain, packed, palette, grey."""
    image = _read(tmp_path, data)
    assert _bytes(image) == expected
    assert alpha == (None if image.alpha is None else pytest.approx(image.alpha[0, 0], abs=1e-6))


# -- Radiance ------------------------------------------------------------------------------------

PIXELS = np.array([[[128, 64, 32, 129], [255, 0, 1, 120], [9, 9, 9, 0]],
                   [[1, 2, 3, 136], [200, 100, 50, 140], [10, 20, 30, 128]]], np.uint8)
EXPONENTS = PIXELS[..., 3:].astype(int)
VALUES = PIXELS[..., :3] * np.where(EXPONENTS > 0, 2.0 ** (EXPONENTS - 136), 0)


def _hdr(resolution, pixels, header=b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=4\n"):
    return header + b"\n" + resolution + b"\n" + pixels


def _new_rle(rows):
    """Scanlines in the new code: a run of two where a byte repeats, else literals."""
    out = b""
    for row in rows:
        out += b"\2\2" + struct.pack(">H", len(row))
        for channel in row.T:
            line = channel.tobytes()
            at = 0
            while at < len(line):
                if line[at : at + 2] == line[at : at + 1] * 2:
                    out, at = out + bytes([130, line[at]]), at + 2
                else:
                    out, at = out + bytes([1, line[at]]), at + 1
    return out


@pytest.mark.parametrize(
    ("resolution", "stored"),
    [
        (b"-Y 2 +X 3", PIXELS),
        (b"+Y 2 +X 3", PIXELS[::-1]),
        (b"-Y 2 -X 3", PIXELS[:, ::-1]),
        (b"+X 3 -Y 2", PIXELS.transpose(1, 0, 2)),
        (b"-X 3 +Y 2", PIXELS[::-1, ::-1].transpose(1, 0, 2)),
    ],
)
def test_hdr_orientations(tmp_path, resolution, stored):
    """Proves: value = mantissa 2^(e-136), 0 for e = 0, whatever the order; EXPOSURE is ignored."""
    image = _read(tmp_path, _hdr(resolution, stored.tobytes()))
    np.testing.assert_array_equal(image.rgb, VALUES.astype(np.float32))
    assert image.hdr


@pytest.mark.parametrize("signature", [b"#?RADIANCE\n", b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n"])
def test_hdr_run_lengths(tmp_path, signature):
    """Proves: the new code (scanlines of 8 and more) and the old one give the flat pixels."""
    rows = np.tile(PIXELS, (1, 4, 1))
    flat = _read(tmp_path, _hdr(b"-Y 2 +X 12", rows.tobytes(), signature)).rgb
    packed = _read(tmp_path, _hdr(b"-Y 2 +X 12", _new_rle(rows), signature)).rgb
    np.testing.assert_array_equal(flat, np.tile(VALUES, (1, 4, 1)).astype(np.float32))
    np.testing.assert_array_equal(packed, flat)
    # 300 = 1 + 43 + 256: the second mark in a row counts 256ths
    old = bytes([128, 64, 32, 129, 1, 1, 1, 43, 1, 1, 1, 1])
    long = _read(tmp_path, _hdr(b"-Y 3 +X 100", old, signature)).rgb
    np.testing.assert_array_equal(long, np.broadcast_to(VALUES[0, 0], (3, 100, 3)))


def test_hdr_as_texture_is_tone_mapped(tmp_path):
    """Proves: byte = floor(255 x^(1/2.2) + 1/2), limited, as the 8-bit reader makes it.

    By hand: x = 0.25: 255 * 0.25^0.4545 = 135.79 -> 136; x = 1: 255; x = 3: 255; x = 0.001: 11.04.
    """
    values = np.array([[[0.25, 1, 3], [0.001, 0, 0.001]]], np.float32)
    image = as_texture(images.Image(values, None, True))
    assert _bytes(image) == [[[136, 255, 255], [11, 0, 11]]]
    assert not image.hdr
    assert as_texture(image) is image


def test_pfm_and_exr(tmp_path):
    """Proves: PFM (rows from the bottom, both byte orders) and EXR with opacity."""
    values = np.arange(18, dtype=np.float32).reshape(2, 3, 3) / 7
    for scale, kind in ((b"-1.0", "<f4"), (b"1.0", ">f4")):
        data = b"PF\n3 2\n" + scale + b"\n" + values[::-1].astype(kind).tobytes()
        np.testing.assert_array_equal(_read(tmp_path, data).rgb, values)
    import OpenEXR

    alpha = np.full((2, 3), 0.5, np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {"RGBA": np.concatenate([values, alpha[..., None]], axis=2)}
    with OpenEXR.File(header, channels) as file:
        file.write(str(tmp_path / "a.exr"))
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(image.rgb, values)
    np.testing.assert_array_equal(image.alpha, alpha)


def test_bump_height():
    """Proves: Y = 0.299 R + 0.587 G + 0.114 B; the weights add up to 1."""
    rgb = np.array([[[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]], np.float32)
    height = bump_height(images.Image(rgb, None, False))
    np.testing.assert_allclose(height, [[0.299, 0.587, 0.114, 1]], rtol=1e-6)


# -- broken files --------------------------------------------------------------------------------


def _half(data):
    return data[: len(data) * 2 // 3]


NOISE = np.random.default_rng(0).integers(0, 256, (32, 32, 3), np.uint8)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "empty"),
        (b"hello, this is certainly not a picture", "no picture of a known format"),
        (_half(_save(NOISE, "PNG")), "truncated|incomplete|broken"),
        (_half(_save(NOISE, "JPEG")), "truncated"),
        (_bmp(4, 4, 24, bytes(40)), "incomplete: 40 of 48 bytes"),
        (_bmp(4, 4, 32, bytes(40)), "incomplete: 40 of 64 bytes"),
        (_bmp(3, 2, 8, bytes([2, 1]), 1, PALETTE), "incomplete: 0 of 2 rows"),
        (_bmp(100000, 100000, 24, b""), "at most 67108864"),
        (_bmp(0, 5, 24, b""), "no pixels"),
        (_tga(2, 2, 2, 24, bytes(6)), "damaged or not supported: TGA"),
        (_tga(65535, 65535, 10, 24, bytes(6)), "at most 67108864"),
        (_hdr(b"-Y 2 +X 3", bytes(20)), "a row ends after 2 of 3"),
        (_hdr(b"-Y 2 +X 12", b"\2\2\0\x0c\x84\1"), "incomplete"),
        (_hdr(b"-Y 1 +X 8", b"\2\2\0\x08\0\1\1\1"), "run of length 0"),
        (_hdr(b"-Y 1 +X 8", b"\2\2\0\x08\xff\1\1\1"), "over the end"),
        (_hdr(b"-Y 1 +X 3", bytes([1, 1, 1, 3])), "before the first pixel"),
        (_hdr(b"-Y 99999 +X 99999", b""), "at most 67108864"),
        (_hdr(b"size 3", b""), "no resolution line"),
        (b"PF\n3 2\n-1.0\n" + bytes(70), "incomplete: 70 of 72 bytes"),
        (b"Pf\n1 1\n-1.0\n" + struct.pack("<f", np.nan), "3 values are not finite"),
    ],
)
def test_broken_pictures(tmp_path, data, message):
    """Proves: damaged, incomplete, empty and huge pictures are errors that say what is wrong."""
    with pytest.raises(ImageError, match=message) as caught:
        _read(tmp_path, data)
    assert str(caught.value).startswith(str(tmp_path / "picture"))


def test_truncation_anywhere_is_an_error(tmp_path):
    """Proves: a picture cut off anywhere is an `ImageError`, never a crash."""
    rows = np.tile(PIXELS, (1, 4, 1))
    wholes = [_save(NOISE, "PNG"), _save(NOISE, "JPEG"), _save(NOISE, "TGA", compression="tga_rle"),
              _save(NOISE, "BMP"), _hdr(b"-Y 2 +X 12", _new_rle(rows))]
    for whole in wholes:
        for cut in range(0, len(whole) - 60, 41):
            with pytest.raises(ImageError):
                _read(tmp_path, whole[:cut])


def test_no_regular_file(tmp_path):
    """Proves: missing files, directories and pipes are errors, and none of them blocks."""
    with pytest.raises(ImageError, match="does not exist"):
        read_image(tmp_path / "absent.bmp")
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe"):
        with pytest.raises(ImageError, match="not a regular file"):
            read_image(path)


def _corpus():
    given = os.environ.get("RELUME_CORPUS")
    root = Path(given) if given else Path(__file__).parents[3] / "shared" / "assets"
    found = [p for p in sorted(root.rglob("*")) if p.suffix.lower() in (".bmp", ".hdr", ".png")]
    return found or [pytest.param(None, marks=pytest.mark.skip(reason=f"no pictures in {root}"))]


@pytest.mark.parametrize("path", _corpus(), ids=lambda p: p and p.name)
def test_pictures_of_the_corpus(path):
    """Proves: the pictures at hand read, with finite values."""
    image = read_image(path)
    assert np.isfinite(image.rgb).all()
    assert image.rgb.max() > 0
