"""Where samples lie in their pixels."""

import mitsuba as mi
import numpy as np
import pytest

from relume.sensors.pixelsamples import position_in_pixel

GRID = (np.arange(256) + 0.5) / 256


@pytest.mark.parametrize(
    ("rfilter", "variance"),
    [
        ({"type": "tent", "radius": 0.5}, 1 / 24),
        ({"type": "tent"}, 1 / 6),
        ({"type": "box"}, 1 / 12),
        ({"type": "gaussian"}, 1 / 4),
        ({"type": "gaussian", "stddev": 0.3}, 0.09),
    ],
)
def test_samples_follow_the_filter(rfilter, variance):
    """A tent of half-width r has the variance r^2/6, a box 1/12, a Gaussian that of its stddev."""
    mi.set_variant("llvm_ad_rgb")
    film = {"type": "hdrfilm", "rfilter": rfilter}
    sensor = mi.load_dict({"type": "perspective", "film": film})
    u = np.stack(np.meshgrid(GRID, GRID)).reshape(2, -1).astype(np.float32)
    position = np.array(position_in_pixel(sensor, mi.Point2f(u)))
    np.testing.assert_allclose(position.mean(axis=1), 0.5, atol=1e-3)
    np.testing.assert_allclose(position.var(axis=1), variance, rtol=5e-3)
