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


@pytest.fixture
def dome():
    """Dict of a sphere with an ibldome."""

    def make(image, centre=(0.3, 0.4, 0.5), radius=5.0, **parameters):
        return {
            "type": "sphere",
            "center": list(centre),
            "radius": radius,
            "bsdf": {"type": "conductor", "specular_reflectance": 0.0},
            "light": {
                "type": "ibldome",
                "bitmap": mi.Bitmap(np.asarray(image, dtype=np.float32)),
                **parameters,
            },
        }

    return make


@pytest.fixture
def camera():
    """Dict of a perspective sensor that looks at `target`."""

    def make(origin, target, fov=90.0, size=8, up=(0.01, 1.0, 0.02)):
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
        }

    return make


@pytest.fixture
def random_image():
    """Image of uniform random texels."""

    def make(seed=1, shape=(17, 33, 3)):
        return np.random.default_rng(seed).random(shape).astype(np.float32)

    return make


@pytest.fixture
def random_directions():
    """Unit vectors, shape (3, count), uniform over the sphere."""

    def make(count, seed=2):
        n = np.random.default_rng(seed).normal(size=(3, count))
        return n / np.linalg.norm(n, axis=0)

    return make
