"""Coefficients of media (sections 10.1 and 10.2)."""

from tests.translator.reading import ball, error, outcomes


def test_scattering_has_a_mean_that_is_not_used():
    """Two lines below `SCATTERING`; the first is a dummy."""
    assert ball("SCATTERING\n99\n1 2 3\n").scattering == (1, 2, 3)
    assert outcomes("SCATTERING\n99\n1 2 3\n")[2][1] == "ignored"
    assert error("SCATTERING\n1 2 3\n\n")[0] == 2
