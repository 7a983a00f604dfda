"""Numbers and corners of OBJ text, converted in bulk."""

import numpy as np
import pytest

from relume.translator import obj_text
from relume.translator.obj import read_obj
from tests.translator.obj_files import group_of, write


def test_numbers_keep_double_precision(tmp_path):
    """Proves: numbers are the doubles that Python reads, exponents and bare points included."""
    words = ["0.1", "-1e-3", "+2.E5", ".5", "-.25e+2", "123456.789012345678", "7", "0", "1e-300"]
    text = "".join(f"v {' '.join(words[k : k + 3])}\n" for k in (0, 3, 6))
    group = group_of(tmp_path, text + "f 1 2 3\n")
    assert group.vertices.ravel().tolist() == [float(word) for word in words]


@pytest.mark.parametrize("form", ["{:.6f}", "{:g}", "{:e}", "{:.0f}.", "{:+.15g}", "{!r}"])
def test_conversion_agrees_with_python(tmp_path, form):
    """Proves: 3000 numbers in each usual form are bit for bit what Python's float makes of them."""
    values = np.random.default_rng(5).normal(0, 1, 3000)
    values *= 10.0 ** np.tile([-7, -2, 0, 1, 4, 9], 500)
    words = [form.format(float(value)) for value in values]
    text = "".join(f"v {' '.join(words[k : k + 3])}\n" for k in range(0, 3000, 3))
    found = read_obj(write(tmp_path, text + "f 1 2 3\n"))
    assert found.positions.ravel().tolist() == [float(word) for word in words]


def test_unify_against_a_dictionary():
    """Proves: on random corners the new vertices are exactly the distinct triples."""
    rng = np.random.default_rng(3)
    for size, top in ((300, 20), (30, 5000)):
        corners = rng.integers(0, (top, 3, 2), (size, 3))
        source, pairs, index = obj_text.unify(corners)
        assert np.array_equal(np.column_stack([source[index], pairs[index]]), corners)
        assert len(source) == len({tuple(corner) for corner in corners.tolist()})
