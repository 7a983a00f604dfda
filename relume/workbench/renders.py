"""Short independent renders of a loaded scene, timed."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from relume.options import SAMPLERS
from relume.session import Session

COMPARE, CHART, REFERENCE = range(3)
"""Purposes: the same seed gives other random numbers to each."""

MitsubaScene: TypeAlias = Any
"""`mi.Scene` of the variant in use."""

MitsubaIntegrator: TypeAlias = Any
"""`mi.Integrator` of the variant in use."""


@dataclass(frozen=True)
class Render:
    """One picture and what it took.

    Attributes:
        picture: linear RGB, (height, width, 3) float32.
        wall: duration [s].
        cpu: processor time of the process, all threads together [s].
    """

    picture: np.ndarray
    wall: float
    cpu: float


def own_seed(seed: int, *place: int) -> int:
    """A seed of 64 bits that belongs to this place alone.

    Args:
        seed: non-negative integer, of the whole study.
        place: small non-negative integers, the purpose first.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=place)
    return int(sequence.generate_state(1, np.uint64)[0])


def render(
    scene: MitsubaScene,
    integrator: MitsubaIntegrator,
    spp: int,
    seed: int,
    sampler: str = SAMPLERS[0],
) -> Render:
    """Render a picture.

    Args:
        scene: `mi.Scene`.
        integrator: `mi.Integrator`.
        spp: samples of a pixel.
        seed: as `own_seed` gives it.
        sampler: as `Session`.

    Returns:
        `Render`.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    session = Session(scene, spp, seed, integrator, sampler=sampler)
    for _ in session.run():
        pass
    picture = session.image()
    return Render(picture, time.perf_counter() - wall, time.process_time() - cpu)
