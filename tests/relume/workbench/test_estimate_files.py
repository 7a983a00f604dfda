"""Estimates on disk: what is written is read again, and other files are refused with a reason."""

import numpy as np
import pytest

from relume import output
from relume.workbench import estimate_files
from relume.workbench.statistics import Runs

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
