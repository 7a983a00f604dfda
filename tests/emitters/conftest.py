"""What the emitter tests share: the variant and a measurement with its standard error."""

import mitsuba as mi
import numpy as np
import pytest

import emitters  # noqa: F401  registers the plugins


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def measure():
    """Mean over the picture, and its standard error, from independent renders."""

    def run(scene, spp=64, runs=8, integrator=None, seed=0):
        means = []
        for i in range(runs):
            image = mi.render(scene, spp=spp, seed=seed + i, integrator=integrator)
            means.append(np.array(image).mean(axis=(0, 1)))
        means = np.array(means)
        return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(runs)

    return run


@pytest.fixture
def agrees():
    """Assert that a measurement lies within 3 standard errors of a closed form.

    The standard error must be below 0.3 %. A correct renderer fails one such test in 370; seeds are
    fixed, so the outcome is too. Float32 and the finite size of a pixel are granted 2e-4.
    """

    def check(measured, expected):
        mean, error = (np.atleast_1d(x).mean() for x in measured)
        assert error < 3e-3 * expected
        assert abs(mean - expected) <= 3.0 * error + 2e-4 * expected, (mean, error, expected)

    return check


@pytest.fixture
def spot_meter():
    """Sensor dict that measures the radiance of the point `target` as seen from `origin`."""

    def sensor(origin, target, up=(0.0, 0.0, 1.0), fov=0.05, size=4):
        return {
            "type": "perspective",
            "fov": fov,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=list(origin), target=list(target), up=list(up)
            ),
            "film": {
                "type": "hdrfilm",
                "width": size,
                "height": size,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
            "sampler": {"type": "independent"},
        }

    return sensor
