"""What the emitter tests share: the variant, measurements, domes and cameras."""

import mitsuba as mi
import numpy as np
import pytest

from relume import emitters  # noqa: F401  registers the plugins
from relume.workbench.statistics import Level


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def measure(chance, level):
    """Mean over the picture as a `Level` of its channels, from independent renders."""

    def run(scene, spp=64, runs=8, **options):
        return level(chance.runs(scene, spp, runs, **options).mean(axis=(1, 2)))

    return run


@pytest.fixture
def agrees(chance):
    """Judge whether a grey measurement is a closed form's value, its standard error below 0.3 %.

    Float32 and the finite size of a pixel are granted 2e-4.
    """

    def check(measured, expected):
        grey = Level(measured.mean[0], measured.variance[0], measured.dof[0])
        chance.equal(grey, expected, allowed=2e-4, precision=3e-3)

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
