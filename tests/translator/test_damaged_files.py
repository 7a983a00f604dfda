"""Pictures, meshes and materials with random damage: read or refused with a place, never worse.

`RELUME_DAMAGED=100000` sets how many of each are tried; the seeds follow from the number alone.
"""

import os
import time
import warnings

import numpy as np
import pytest

from relume.translator.images import ImageError, read_image
from relume.translator.mtl import MtlError, read_mtl
from relume.translator.obj import read_obj
from relume.translator.obj_model import MeshError
from relume.translator.obj_scan import stock_obstacle

COUNT = int(os.environ.get("RELUME_DAMAGED", 650))
LONGEST = 8.0  # seconds of one file, such as one of 64 million pixels in 100 bytes

NOISE = np.random.default_rng(0).integers(0, 256, (13, 17, 4), np.uint8)
HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n"
OBJ = b"""mtllib a.mtl b\\ c.mtl
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 1 1 1
vt 0 0
vt 1 0.5
vn 0 0 1
vn 0 0.6 0.8
usemtl red # one
f 1/1/1 2/2/2 3/1/1
f -1 -2 -3 -4
f 1//1 2//2 \\
3//1
g a
s 1
f 1 2 3
"""
PLAIN = b"v 0 0 0\nv 1 0 0\nv 1 1e-3 0\nv 0 1 .5\nvn 0 0 1\n" + b"f 1//1 2//1 3//1\n" * 9
MTL = b"""newmtl red # one
Kd 1 0.5 0
Ks 0.1 0.2 0.3
Ns 30
d 0.5
map_Kd -s 2 2 -o 0.5 0.5 -clamp on -mm 0 1 my wood.png
#REFLECTION 3
#WARD 0.1 0.2
#EMISSION 1 2 3
newmtl b
Tr 0.25
"""


def pictures():
    from io import BytesIO

    from PIL import Image

    for kind, mode, options in (
        ("PNG", "RGBA", {}), ("PNG", "L", {}), ("PNG", "P", {"transparency": 3}),
        ("JPEG", "RGB", {}), ("JPEG", "L", {"progressive": True}), ("BMP", "RGB", {}),
        ("BMP", "P", {}), ("BMP", "1", {}), ("BMP", "RGBA", {}), ("TGA", "RGBA", {}),
        ("TGA", "P", {"compression": "tga_rle"}), ("TGA", "L", {"compression": "tga_rle"}),
        ("PPM", "RGB", {}), ("PPM", "L", {}),
    ):
        out = BytesIO()
        Image.fromarray(NOISE).convert(mode).save(out, kind, **options)
        yield out.getvalue()
    yield HDR + b"\2\2\0\x08" + b"\x88\x80" * 4 + bytes(range(32))
    yield HDR + bytes([128, 64, 32, 129, 1, 1, 1, 15])
    yield b"PF\n2 2\n-1.0\n" + np.arange(12, dtype="<f4").tobytes()
    runs = bytes([0, 5, 0x12, 0x34, 0x50, 0, 3, 0x67, 0, 0, 0, 2, 1, 0, 4, 1, 0, 1])
    head = bytes.fromhex("424d6e00000000000000760000002800000008000000020000000100040002000000")
    yield head + bytes(20) + bytes(range(64)) + runs


EXTREMES = b"\xff\xff\xff\xff", b"\0\0\0\0", b"\0\0\0\x80", b"9999", b"-1 1", b"1e39"


def damaged(rng, data):
    """A copy with one to six kinds of damage, most of them early, where headers stand."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 7)):
        if not data:
            break
        at = int(len(data) * rng.random() ** 2)
        what = rng.integers(6)
        if what == 0:
            data[at] = rng.integers(256)
        elif what == 1:
            data[at] ^= 1 << rng.integers(8)
        elif what == 2:
            del data[at : at + int(rng.integers(1, 9))]
        elif what == 3:
            data[at:at] = data[at : at + int(rng.integers(1, 40))]
        elif what == 4:
            data[at : at + 4] = EXTREMES[rng.integers(len(EXTREMES))]
        else:
            del data[int(len(data) * rng.random()) :]
    return bytes(data)


def survive(tmp_path, originals, name, readers, refusal):
    """Read damaged copies; every failure is a refusal that names the file."""
    rng = np.random.default_rng(COUNT)
    path = tmp_path / name
    read = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for k in range(COUNT):
            path.write_bytes(damaged(rng, originals[k % len(originals)]))
            start = time.process_time()
            for reader in readers:
                try:
                    reader(path)
                    read += 1
                except refusal as error:
                    assert str(error).startswith(str(path)), error
                    assert " object at 0x" not in str(error)
            assert time.process_time() - start < LONGEST, f"file {k}"
    assert 0.02 < read / (COUNT * len(readers)) < 0.99  # the damage is neither fatal nor harmless


def test_pictures(tmp_path):
    survive(tmp_path, list(pictures()), "a.bmp", [read_image], ImageError)


def test_meshes(tmp_path):
    survive(tmp_path, [OBJ, PLAIN], "a.obj", [read_obj, stock_obstacle], MeshError)


def test_materials(tmp_path):
    survive(tmp_path, [MTL], "a.mtl", [read_mtl], MtlError)


def test_bombs_are_refused_at_once(tmp_path):
    """Sizes are judged by headers: nothing of that size is allocated."""
    import struct
    import zlib

    head = struct.pack(">IIBBBBB", 60000, 60000, 8, 6, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n"
    for kind, data in ((b"IHDR", head), (b"IDAT", zlib.compress(bytes(10**6))), (b"IEND", b"")):
        check = struct.pack(">I", zlib.crc32(kind + data))
        png += struct.pack(">I", len(data)) + kind + data + check
    bmp = b"BM" + struct.pack("<IHHI", 99, 0, 0, 54)
    bmp += struct.pack("<IiiHHIIiiII", 40, 60000, 60000, 1, 8, 1, 9, 0, 0, 0, 0) + b"\xff\0" * 9
    tga = struct.pack("<BBBHHBHHHHBB", 0, 0, 10, 0, 0, 0, 0, 0, 60000, 60000, 24, 0)
    tga += b"\xff\1\2\3" * 9
    for data in (png, bmp, tga, b"P6 60000 60000 255 ", b"#?RADIANCE\n\n-Y 60000 +X 60000\n"):
        (tmp_path / "bomb").write_bytes(data)
        start = time.process_time()
        with pytest.raises(ImageError, match=r"60000 x 60000 pix|malicious header"):
            read_image(tmp_path / "bomb")
        assert time.process_time() - start < 1
