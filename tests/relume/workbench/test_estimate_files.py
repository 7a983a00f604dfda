"""Estimates on disk: what is written is read again, and other files are refused with a reason."""

import numpy as np
import pytest

from relume import output
from relume.accumulator import Accumulator
from relume.passes import Pass
from relume.workbench import estimate_files
from relume.workbench.estimates import Runs

MADE = {"scene": "日本語.txt", "spp": 64}


@pytest.fixture
def estimate():
    rng = np.random.default_rng(3)
    taken = Runs()
    for _ in range(5):
        taken.add(rng.exponential(1, (10, 21, 3)))
    return taken.estimate()


def test_what_is_written_is_read_again(estimate, tmp_path):
    """To single precision, half a unit of 2^-23; degrees of freedom are those of the runs."""
    path = tmp_path / "stored.exr"
    path.write_bytes(b"an older file")
    estimate_files.write(path, estimate, 5, MADE)
    stored, made = estimate_files.read(path)
    assert made == {"runs": 5} | MADE
    for name in estimate_files.LEVELS:
        before, after = getattr(estimate, name), getattr(stored, name)
        np.testing.assert_allclose(after.mean, before.mean, rtol=2**-24)
        np.testing.assert_allclose(after.variance, before.variance, rtol=2**-24)
        np.testing.assert_array_equal(after.dof, before.dof)
    assert [file.name for file in tmp_path.iterdir()] == ["stored.exr"]


def test_the_same_estimate_gives_the_same_bytes(estimate, tmp_path):
    for name in ("a.exr", "b.exr"):
        estimate_files.write(tmp_path / name, estimate, 5, MADE)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_other_files_are_refused(tmp_path):
    output.write_image(tmp_path / "picture.exr", np.ones((6, 8, 3)))
    (tmp_path / "broken.exr").write_bytes(b"v/1\x01")
    for name in ("picture.exr", "broken.exr", "missing.exr"):
        with pytest.raises(ValueError, match=f"{name}: no estimate: "):
            estimate_files.read(tmp_path / name)


def test_passes_tell_the_variance_of_their_pixels_blocks_and_whole():
    """Of 300 pictures of exponential samples of variance 4, of 25 samples each: the estimated
    variances average to the true ones, 4 / 25 over the number of pixels of a region.

    The relative standard error of the mean of 300 x 72 of them is below 2 %; 8 % are allowed. The
    pictures' own scatter agrees.
    """
    made = [exponential(seed, 25) for seed in range(300)]
    estimates = [estimate_files.from_passes(each) for each in made]
    for name, pixels in (("pixels", 1), ("blocks", 12), ("whole", 24)):
        levels = [getattr(each, name) for each in estimates]
        assert np.mean([level.variance for level in levels]) == pytest.approx(
            4 / 25 / pixels, rel=0.08
        )
        scatter = np.var([level.mean for level in levels], axis=0, ddof=1)
        assert scatter.mean() == pytest.approx(4 / 25 / pixels, rel=0.15)
        assert (levels[0].dof == 24).all()


def exponential(seed, spp, whole=False):
    """An accumulator of one pass over 8x3 pixels."""
    samples = np.random.default_rng(seed).exponential(2, (spp, 3, 24)).astype(np.float32)
    accumulator = Accumulator(8, 3)
    squares = None if whole else (samples**2).sum(axis=0)
    accumulator.add(Pass(0, spp, samples.sum(axis=0), squares))
    return accumulator


def test_passes_whose_variance_is_unknown_make_no_estimate():
    assert estimate_files.from_passes(exponential(0, 1)) is None
    assert estimate_files.from_passes(exponential(0, 9, whole=True)) is None
    broken = exponential(0, 9)
    broken.add(Pass(1, 1, *np.full((2, 3, 24), np.nan, np.float32)))
    assert estimate_files.from_passes(broken) is None
