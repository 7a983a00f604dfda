"""Mean cosines of phase functions (section 10.1)."""

from tests.translator.reading import ball, error, outcomes, scene


def test_phase_in_both_forms_and_spellings():
    """One number below for all channels, or three beside; beyond -1 to 1 a channel is isotropic."""
    assert scene("PAHASE\n0.5\n").phase == (0.5, 0.5, 0.5)
    assert scene("PAHASE 0.1 0.2 0.3\n").phase == (0.1, 0.2, 0.3)
    assert ball("PAHASE\n-0.5\n").phase == (-0.5, -0.5, -0.5)
    assert ball("PHASE 0.1 0.2 0.3\n").phase == (0.1, 0.2, 0.3)
    assert scene("PAHASE 0.1 2 0.3\n").phase == (0.1, 0, 0.3)
    assert outcomes("PHASE\n0\n")[1][2] == "read as PAHASE"
    assert error("PAHASE 0.1 0.2\n")[:2] == (1, 15)
    assert error("PAHASE\n0.1 0.2\n")[0] == 2
