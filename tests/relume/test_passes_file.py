"""Files of passes: what is read is what was written, viewers see the picture, damage is told."""

import json

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest

from relume import passes_file
from relume.accumulator import Accumulator
from relume.passes import Pass
from relume.passes_file import Header, NoPasses

HEADER = Header(render={"scene": "abc", "seed": 3}, spp=30, seconds=1.5, gamma=0.4)


@pytest.fixture
def accumulator():
    """Passes with values of all magnitudes, an infinite one and a NaN."""
    random = np.random.default_rng(0)
    made = Accumulator(5, 4)
    for index in (0, 1, 4):
        values = random.integers(0, 2**32, (2, 3, 20), np.uint32).view(np.float32)
        values[~np.isfinite(values)] = 1
        values[:, 1, index] = (np.inf, np.nan)
        made.add(Pass(index, 2, *values))
    return made


@pytest.fixture
def path(tmp_path, accumulator):
    passes_file.write(tmp_path / "a.exr", accumulator, HEADER)
    return tmp_path / "a.exr"


def test_everything_comes_back_and_goes_on(path, accumulator):
    """Also what is added afterwards gives the same bits."""
    read, header = passes_file.read(path), passes_file.read_header(path)
    assert (header.render, header.spp, header.seconds) == (HEADER.render, 30, 1.5)
    assert header.done == read.done == accumulator.done and header.size == [5, 4]
    for each in (read, accumulator):
        each.add(Pass(2, 1, *np.full((2, 3, 20), 0.1, np.float32)))
    assert read.observations == accumulator.observations == 7
    assert np.array_equal(read.image(), accumulator.image(), equal_nan=True)
    assert np.array_equal(read.variance(), accumulator.variance(), equal_nan=True)


def test_the_difference_of_two_sequences_comes_back(tmp_path):
    random = np.random.default_rng(1)
    made = Accumulator(5, 4)
    for index in (0, 3):
        sums = random.random((2, 3, 20), np.float32)
        made.add(Pass(index, 3, sums[0], difference=sums[1], lead=1))
    passes_file.write(tmp_path / "a.exr", made, HEADER)
    read = passes_file.read(tmp_path / "a.exr")
    assert (read.lead, read.observations) == (2, 2)
    assert np.array_equal(read.variance(), made.variance()) and made.variance().min() > 0


def test_the_same_passes_give_the_same_file(path, accumulator, tmp_path):
    passes_file.write(tmp_path / "b.exr", passes_file.read(path), HEADER)
    assert (tmp_path / "b.exr").read_bytes() == path.read_bytes()


def test_other_programs_see_the_picture(path, accumulator):
    seen = np.array(dict(mi.Bitmap(str(path)).split())["<root>"])
    assert np.array_equal(seen, accumulator.image(), equal_nan=True)


def altered(path, **changes):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header, channels = dict(file.header()), {n: c.pixels for n, c in file.channels().items()}
    told = json.loads(header[passes_file.ATTRIBUTE]) | changes
    kept = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(kept | {passes_file.ATTRIBUTE: json.dumps(told)}, channels).write(str(path))


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"format": 1}, "format 1, expected 2"),
        ({"size": [4, 5]}, "damaged or incomplete"),
        ({"checksum": 1}, "damaged or incomplete"),
        ({"size": [0, 5]}, "damaged header"),
        ({"passes": "0:2x1 1:3x1"}, "damaged header: pass 1 is there twice"),
        ({"passes": ""}, "damaged header"),
        ({"observations": None}, "damaged header"),
        ({"lead": 7}, "damaged header"),
        ({"seconds": "long"}, "damaged header"),
        ({"render": 3}, "damaged header"),
        ({"extra": 3}, "damaged header"),
    ],
)
def test_damaged_headers_are_told(path, changes, message):
    altered(path, **changes)
    with pytest.raises(NoPasses, match=message):
        passes_file.read(path)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.999])
def test_files_that_end_early_are_told(path, share, capfd):
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(NoPasses, match=r"a\.exr: "):
        passes_file.read(path)


def test_changed_bits_are_told(path):
    data = bytearray(path.read_bytes())
    data[-40] ^= 4
    path.write_bytes(data)
    with pytest.raises(NoPasses, match="damaged"):
        passes_file.read(path)


def test_other_files_hold_no_passes(tmp_path, accumulator):
    mi.Bitmap(np.zeros((2, 2, 3), np.float32)).write(str(tmp_path / "plain.exr"))
    for name, message in (("plain.exr", "without passes"), ("none.exr", "no such file")):
        with pytest.raises(NoPasses, match=message):
            passes_file.read_header(tmp_path / name)
