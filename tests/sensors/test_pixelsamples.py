"""Where samples lie in their pixels."""

import mitsuba as mi
import numpy as np
import pytest

from relume.sensors.pixelsamples import position_in_pixel

GRID = (np.arange(256) + 0.5) / 256


@pytest.mark.parametrize(("rfilter", "variance"), [("tent", 1 / 24), ("box", 1 / 12)])
def test_samples_follow_the_filter(rfilter, variance):
    """Positions lie in [0, 1]; a tent of half-width 1/2 has the variance 1/24, a box 1/12."""
    mi.set_variant("llvm_ad_rgb")
    film = {"type": "hdrfilm", "rfilter": {"type": rfilter}}
    sensor = mi.load_dict({"type": "perspective", "film": film})
    u = np.stack(np.meshgrid(GRID, GRID)).reshape(2, -1).astype(np.float32)
    position = np.array(position_in_pixel(sensor, mi.Point2f(u)))
    assert position.min() >= 0 and position.max() <= 1
    np.testing.assert_allclose(position.var(axis=1), variance, rtol=1e-3)
