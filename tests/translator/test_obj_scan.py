"""The scan: which files Mitsuba's own reader reads as ours does."""

import pytest

from relume.translator import obj_scan
from relume.translator.obj_scan import stock_obstacle
from tests.translator.obj_files import SQUARE, write


@pytest.mark.parametrize(
    "text",
    [
        SQUARE + "f 1 2 3\nf 1 3 4\n",
        "# made\n\n" + SQUARE + "g a\nf 1 2 3\ns 1\nf 2 3 4",
        (SQUARE + "f 1 2 3 \nf  1 2\t4\n").replace("\n", "\r\n"),
        SQUARE + "vt 0 0\nvt 1 1 0\nf 1/1 2/2 3/1\nf 1/1 2/1 4/1\n",
        SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\n" * 2,
        "v 1e-05 -1.5E+3 .5\nv 1 1 1\nv 2. 2 -0 1\nvt 0 0\nvn 0 1 0\nf 1/1/1 2/1/1 3/1/1\n",
        "v 0 0 0 1 0 0\n" + SQUARE + "f 1 2 3\n",
    ],
)
def test_plain_files(tmp_path, text):
    """Proves: files that Mitsuba's reader handles are told to be plain."""
    assert stock_obstacle(write(tmp_path, text)) == ""


@pytest.mark.parametrize(
    "text",
    [
        "usemtl a\n" + SQUARE + "f 1 2 3\n",
        "mtllib a\n" + SQUARE + "f 1 2 3\n",
        SQUARE + "v 0 0 0 1 0 0\nf 1 2 3\n",
        SQUARE + "f -1 -2 -3\n",
        SQUARE + "f 1 2 3 4 1\n",
        SQUARE + "f 1 2 3 4\n",
        "f 1 2 3\n" + SQUARE,
        SQUARE + "f 1 2 5\n" + SQUARE,
        SQUARE + "f 1 2 3\nf 1 2 9\n",
        SQUARE * 3 + "f 1 2 13\n",
        SQUARE * 3 + "f 1 2 12\nf 1 2 21\n",
        SQUARE + "vt 0 0\nf 1/1 2/2 3/1\n",
        SQUARE + "vn 0 0 1\nf 1//1 2//1 3//2\n",
        SQUARE + "vn 0 0 1\nvn 0 -0.0 0\nf 1//1 2//1 3//2\n",
        SQUARE + "v 1e39 0 0\nf 1 2 5\n",
        SQUARE + "v 1" + "0" * 40 + " 0 0\nf 1 2 5\n",
        SQUARE + "f 1 2 \\\n3\n",
        SQUARE + "f 1 2\nf 1 2 3\n",
        SQUARE + "f 1 2 0\n",
        SQUARE + "f 1 2 3\nf 1 2 0\n",
        SQUARE + "f 1 2 9999999999999\n",
        SQUARE + "f 1 2 3.0\n",
        SQUARE + "f 1 2 3x\n",
        SQUARE + "f1 2 3 4\nf 1 2 3\n",
        SQUARE + "v1 2 3 4\nf 1 2 3\n",
        SQUARE + "f\nf 1 2 3\n",
        SQUARE + "vn 0 0 1\nf 1 2 3\n",
        SQUARE + "vt 0 0\nf 1 2 3\n",
        SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 3\n",
        SQUARE + "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\nf 1//1 2//1 3//1\n",
        SQUARE + "vn 0 0 1\nf 1 2 3//1\n",
        SQUARE + "vt 0 0\nf 1/0 2/1 3/1\n",
        SQUARE + "vt 0 0\nf 1/ 2/ 3/\n",
        SQUARE + "v 1.2.3 0 0\nf 1 2 3\n",
        SQUARE + "v 1-2 0 0\nf 1 2 3\n",
        SQUARE + "v 1e5.3 0 0\nf 1 2 3\n",
        SQUARE + "v 1e5e5 0 0\nf 1 2 3\n",
        SQUARE + "v 1d5 0 0\nf 1 2 3\n",
        SQUARE + "v 1 0 0 e5\nf 1 2 3\n",
        SQUARE + "v 0 0 nan\nf 1 2 3\n",
        SQUARE + "l 1 2\nf 1 2 3\n",
        (SQUARE + "f 1 2 3\n").replace("\n", "\r"),
        SQUARE,
        "",
        SQUARE + "\0\nf 1 2 3\n",
        " " + SQUARE + "f 1 2 3\n",
    ],
)
def test_files_that_are_not_plain(tmp_path, text):
    """Proves: what Mitsuba's reader ignores, refuses or reads from stale memory is not plain."""
    assert stock_obstacle(write(tmp_path, text))


def test_plain_does_not_depend_on_blocks(tmp_path, monkeypatch):
    """Proves: mistakes are found at any offset, whatever block of the scan they fall into."""
    vertices, faces = SQUARE * 40, "f 1 2 3\n" * 60
    for block in (64, 1000):
        monkeypatch.setattr(obj_scan.PlainScan, "BLOCK", block)
        assert stock_obstacle(write(tmp_path, vertices + faces)) == ""
        for bad in ("f 1 2\n", "f 1 2 0\n", "f 1  2\n", "f 1 2 3 4\n", "f 1//1 2//1 3//1\n",
                    "usemtl a\n", "f 1 2 161\n"):
            for at in (0, 30, 60):
                cut = at * len("f 1 2 3\n")
                text = vertices + faces[:cut] + bad + faces[cut:]
                assert stock_obstacle(write(tmp_path, text))
