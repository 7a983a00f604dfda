"""What tests of integrators share."""

import pytest


@pytest.fixture
def radiance(chance, level):
    """Function from a scene to the `Level` of its mean radiance, (3,)."""

    def measure(scene, spp=4096, runs=8, **options):
        return level(chance.runs(scene, spp, runs, **options).mean(axis=(1, 2)))

    return measure
