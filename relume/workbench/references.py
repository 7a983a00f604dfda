"""Reference pictures with the variance of their pixels, kept in a cache by what they show.

A reference is the mean of independent renders with seeds of their own, kept by `estimate_files`.
Its name in the cache is a hash of the translated scene with the contents of its files, the method,
and the versions of what renders it: what is found under that name is the picture of that scene.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relume import cache, plugins
from relume.fingerprint import content_hash, file_hash, versions
from relume.output import OutputError
from relume.session import CannotRender
from relume.translator import Translation
from relume.workbench import estimate_files, estimates, measures, methods, renders
from relume.workbench.scenes import Progress

RUNS = 32
"""Independent renders of a reference."""

FEWEST_RUNS = 8


@dataclass(frozen=True)
class Reference:
    """What is known of the picture that a scene should give.

    Attributes:
        estimate: `estimates.Estimate`.
        about: `key`, `method`, `spp` of each run, `runs`, `seed`, `seconds`, `versions`.
    """

    estimate: estimates.Estimate
    about: dict[str, Any]

    @property
    def noise(self) -> float:
        """Relative mean squared error of the reference itself: below it nothing can be seen."""
        return measures.noise(self.estimate, self.estimate.pixels.mean)


def reference(
    stage: methods.Stage,
    method: methods.Method,
    spp: int,
    folder: str | Path,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> Reference:
    """The reference of a scene: from the cache, or rendered and put there.

    Args:
        stage: `methods.Stage`.
        method: the `methods.Method` that renders it.
        spp: samples of a pixel, in all runs together, that it has at least.
        folder: of the cache.
        seed: non-negative integer; a cached reference of any seed will do.
        progress: called with the number of runs done and of all runs; rendering stops if it
            returns True. What was rendered then is used but not kept.

    Returns:
        `Reference`.

    Raises:
        CannotRender: the method does not work here, or it was stopped too early.

    Warns:
        RuntimeWarning: the cache cannot be written.
    """
    key = content_key(stage.translated(method))
    path = Path(folder) / f"{key}.exr"
    found = cached(path, key)
    if found and found.about["spp"] * found.about["runs"] >= spp:
        return found
    made = rendered(stage, method, -(-spp // RUNS), seed, progress)
    made.about["key"] = key
    if made.about["runs"] == RUNS:
        try:
            estimate_files.write(path, made.estimate, RUNS, made.about)
        except OutputError as error:
            warnings.warn(f"the reference is not kept: {error}", RuntimeWarning, stacklevel=2)
    return made


def rendered(
    stage: methods.Stage,
    method: methods.Method,
    spp: int,
    seed: int,
    progress: Progress | None = None,
) -> Reference:
    """Render a reference of `RUNS` runs of `spp` samples of a pixel; as `reference`."""
    scene, integrator = stage.load(method)
    runs, seconds = estimates.Runs(), 0.0
    for run in range(RUNS):
        own = renders.own_seed(seed, renders.REFERENCE, run)
        done = renders.render(scene, integrator, spp, own)
        runs.add(done.picture)
        seconds += done.wall
        if progress and progress(run + 1, RUNS):
            break
    if runs.count < FEWEST_RUNS:
        raise CannotRender(f"stopped after {runs.count} of {RUNS} runs of the reference")
    if runs.not_finite:
        raise CannotRender(f"{method.name} gives {runs.not_finite} values that are no numbers")
    about = {"method": method.name, "spp": spp, "runs": runs.count, "seed": seed}
    return Reference(runs.estimate(), about | {"seconds": seconds, "versions": versions()})


def cached(path: Path, key: str) -> Reference | None:
    """The reference in a file of the cache; None if there is none or it is not sound."""
    if not path.is_file():
        return None
    try:
        estimate, about = estimate_files.read(path)
    except ValueError:
        return None
    return Reference(estimate, about) if about.get("key") == key else None


def cache_folder() -> Path:
    """The user's folder for references; it may be deleted at any time."""
    return cache.folder() / "references"


def content_key(translation: Translation) -> str:
    """The name of the picture of a translated scene: 32 hexadecimal digits."""
    made_by = [versions(), plugin_sources(), translation.plan.variant]
    return content_hash([*made_by, translation.scene])


def plugin_sources() -> dict[str, str]:
    """Hashes of the source files of relume's plugins, by name."""
    folders = [Path(package.__path__[0]) for package in plugins.PACKAGES]
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    return {f"{file.parent.name}/{file.name}": file_hash(file) for file in files}
