"""A scene against its stored reference: has its picture changed?

The picture is small and rendered in many short independent runs. Its reference is the same picture
by far more samples with seeds of its own, stored with its variance (`estimate_files`): nothing
but noise separates the two unless the renderer has changed.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import special

from relume import translator
from relume.application import read
from relume.fingerprint import file_hash
from relume.loading import resized, variant_and_threads
from relume.workbench import estimate_files, methods, references, statistics
from relume.workbench.comparing import render_in_turn
from relume.workbench.comparison import Side
from relume.workbench.estimates import Estimate, Level

PIXELS = 48 * 36
"""About so many pixels has the picture, in the scene's own proportions."""

RUNS = 32
"""Independent renders of a check."""

SAMPLES = (4, 8, 16, 32, 64, 128)
"""Samples of a pixel in one of them: the fewest with which a check sees `AIM`, or else the most."""

REFERENCE_SPP = 256
"""Samples of a pixel in a run of a reference; more where checks take many."""

TRIAL_SEED = 10**6

FOUND_BY_HITS = ("wormhole", "cornell_hole")
"""Rooms in curved space, where no light can be aimed at: a check that sees 2 % takes minutes.

It is left to the goldens of translations and to the closed forms of `curvedspace`.
"""

RATE = 0.0004
"""How often a check of an unchanged scene fails: one of 25 scenes in a hundred times."""

POWER = 0.9
AIM = 0.02
"""An error of the whole picture's mean so large is found with probability `POWER`."""


@dataclass(frozen=True)
class Check:
    """A scene's picture beside its reference.

    Attributes:
        side: the picture.
        reference: what it is tested against.
        about: how the reference was made.
    """

    side: Side
    reference: Estimate
    about: dict

    def scores(self, rate: float = RATE) -> dict[str, statistics.Scores]:
        """Tests of the whole picture, its blocks and pixels.

        Args:
            rate: how often an unchanged scene may fail any of them.

        Returns:
            Dictionary of `statistics.Scores`.
        """
        return statistics.all_levels(self.side.estimate, self.reference, rate)

    def smallest_errors(self, rate: float = RATE) -> tuple[np.ndarray, np.ndarray]:
        """The relative errors of the means that are found with probability `POWER`.

        Args:
            rate: as `scores`.

        Returns:
            Two arrays: of the whole picture, (1, 1, 3), and of the blocks, (rows, columns, 3), each
            for an error in that channel and place alone; infinite where the reference is black.
        """
        scores = self.scores(rate)
        a, b = self.side.estimate, self.reference
        return (
            _smallest(a.whole, b.whole, scores["whole"].threshold),
            _smallest(statistics.pooled(a)[0], statistics.pooled(b)[0], scores["blocks"].threshold),
        )


def _smallest(a: Level, b: Level, threshold: float) -> np.ndarray:
    """Relative difference of two levels whose score is above `threshold` with power `POWER`."""
    d = statistics.difference(a, b)
    level = 2 * special.ndtr(-threshold)
    critical = statistics.half_width(d.variance, d.dof, 1 - level)
    margin = special.ndtri(POWER) * np.sqrt(d.variance)
    mean = np.abs(b.mean)
    return np.divide(critical + margin, mean, out=np.full_like(mean, np.inf), where=mean > 0)


@contextmanager
def staged(scene: str | Path) -> Iterator[tuple[methods.Stage, methods.Method]]:
    """Context in which the small picture of a scene can be rendered.

    Args:
        scene: the scene file; environment variables do not override it.

    Yields:
        `methods.Stage` and the planned `methods.Method`.
    """
    document = read(scene, {})
    document = resized(document, small(document.image))
    translation = translator.translate(document)
    with variant_and_threads(translation):
        yield methods.Stage(document, translation), methods.planned(translation)


def small(size: tuple[int, int]) -> tuple[int, int]:
    """A size of about `PIXELS` pixels with the proportions of `size`."""
    width, height = size
    factor = (PIXELS / (width * height)) ** 0.5
    return max(1, round(width * factor)), max(1, round(height * factor))


def make(scene: str | Path, path: str | Path, spp: int = REFERENCE_SPP) -> None:
    """Make the reference of a scene, and find how many samples its checks take.

    Args:
        scene: the scene file.
        path: where the reference goes, `.exr`.
        spp: samples of a pixel in a run; more where it would be less than 8 times those of a check.

    Raises:
        CannotRender: the method does not work here, or gives values that are no numbers.
    """
    with staged(scene) as (stage, method):
        trial = pictures(stage, method, SAMPLES[0], TRIAL_SEED)
        check_spp = samples(trial)
        made = references.rendered(stage, method, max(spp, 8 * check_spp), TRIAL_SEED)
    about = {"scene": Path(scene).name, "text": file_hash(scene), "check_spp": check_spp}
    estimate_files.write(path, made.estimate, references.RUNS, made.about | about)


def pictures(stage: methods.Stage, method: methods.Method, spp: int, seed: int) -> Side:
    """The `Side` of `RUNS` runs of a method."""
    # Numbers of the kind that the references and what the checks see were calibrated with.
    loaded = [(method.name, *stage.load(method))]
    return render_in_turn(loaded, spp, RUNS, seed, sampler="independent")[0]


def samples(trial: Side) -> int:
    """Samples of a pixel in a run with which a check sees `AIM`.

    Args:
        trial: `Side` of runs of `SAMPLES[0]`.
    """
    error = Check(trial, trial.estimate, {}).smallest_errors()[0].max()
    # The difference from a far better reference has half the variance of that from the trial's own.
    needed = SAMPLES[0] * error**2 / 2 / AIM**2
    return next((spp for spp in SAMPLES if spp >= needed), SAMPLES[-1])


def check(scene: str | Path, path: str | Path, seed: int = 0) -> Check:
    """Render a scene and put it beside its reference.

    Args:
        scene: the scene file.
        path: what `make` wrote.
        seed: non-negative integer.

    Returns:
        `Check`.

    Raises:
        ValueError: there is no reference, or it was made for another text of the scene.
    """
    stored, about = estimate_files.read(path)
    if about.get("text") != file_hash(scene):
        raise ValueError(f"{path}: made for another text of {scene}")
    with staged(scene) as (stage, method):
        side = pictures(stage, method, about["check_spp"], seed)
    return Check(side, stored, about)
