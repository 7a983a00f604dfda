"""Black holes: what plugins and the translator know of them."""

import pytest

from relume.black_holes import innermost_orbit


def test_innermost_orbits():
    for a, r in ((0, 6), (0.5, 4.233003), (0.9, 2.320883), (0.99, 1.454498), (-0.9, 2.320883)):
        assert innermost_orbit(a) == pytest.approx(r, abs=1e-6)
