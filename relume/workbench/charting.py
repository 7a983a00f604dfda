"""`relume chart`: error over time for every method that can render a scene.

Each method renders independent pictures at 1, 2, 4, ... samples of a pixel, the methods in turn, up
to the number that fits its share of the time. Climbing to that number once is the warm-up: kernels
are compiled then, and it is no part of the curves.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from relume.loading import (
    SceneSource,
    resized,
    source_of,
    translation_of,
    variant_and_threads,
)
from relume.options import RenderOptions
from relume.session import CannotRender, reason
from relume.translator import Translation
from relume.workbench import chart_table, curves, pages, references, renders
from relume.workbench.comparison import versions
from relume.workbench.curves import Curve
from relume.workbench.estimates import Estimate
from relume.workbench.methods import Method, Stage, chosen, find, methods_for, obstacle, planned
from relume.workbench.scenes import (
    name_of,
    notes,
    option_words,
    reduced,
    refuse,
    repeated,
)

RUNS = 8
FEWEST_RUNS = 4
"""Below, intervals say nothing."""

SECONDS = 60.0
REFERENCE_SHARE = 16
"""Samples of the reference for each of the longest render of its method."""

MOST_LEVELS = 20


NOT_TAKEN = {
    "spp": "the samples of a chart follow from its time",
    "integrator": "the integrators of a chart are its methods",
}
"""Options that a chart does not take, with the reason."""

ChartProgress: TypeAlias = Callable[[str, int, int], Any]
"""Called with a word for what is done, the renders done and all renders; True stops."""


@dataclass(frozen=True)
class Chart:
    """What was measured of a scene.

    Attributes:
        name: of the scene.
        curves: one for each method.
        skipped: why the other methods asked for have none, by name.
        reference: what errors are measured against.
        settings: what was rendered and how, as JSON values.
    """

    name: str
    curves: tuple[Curve, ...]
    skipped: dict[str, str]
    reference: references.Reference
    settings: dict[str, Any]

    def verdict(self) -> str:
        """Which method is the first at the largest of `chart_table.TARGETS`, in words."""
        target = chart_table.TARGETS[0]
        times = {curve.name: curve.time_to(target**2)[0] for curve in self.curves}
        first = min(times, key=lambda name: times[name])
        if math.isinf(times[first]):
            return f"no method reaches {100 * target:g} % noise"
        seconds = chart_table.short(times[first], 3)
        return f"{first} is the first at {100 * target:g} % noise, after {seconds} s"

    def __repr__(self) -> str:
        names = ", ".join(curve.name for curve in self.curves)
        return f"<Chart of {self.name}, {names}: {self.verdict()}>"

    def _repr_png_(self) -> bytes:
        from relume.workbench import chart_figure

        return pages.png(chart_figure.chart_figure(self))

    def _repr_html_(self) -> str:
        rows = [chart_table.cells(row) for row in chart_table.summary(self)]
        head = [name for name, _ in rows[0]]
        table = (head, [[text for _, text in row] for row in rows])
        notes = [*chart_table.left_out(self), *self.settings["notes"]]
        return pages.summary(self.name, self.verdict(), True, self._repr_png_(), [table], notes)

    def on_front(self, curve: Curve) -> np.ndarray:
        """Whether each point of a curve lies on the Pareto front over wall time: (levels,)."""
        others = [other for other in self.curves if other is not curve]
        return curves.on_front(curve, others) if others else np.ones(len(curve.spp), bool)


def chart(
    scene: SceneSource,
    options: RenderOptions | None = None,
    *,
    methods: Sequence[str] = (),
    seconds: float = SECONDS,
    runs: int = RUNS,
    reference: str | None = None,
    cache: str | Path | None = None,
    progress: ChartProgress | None = None,
    **changes: Any,
) -> Chart:
    """Measure the error of methods over time.

    Args:
        scene: a scene file or Mitsuba scene (.xml), or what `relume.read` returned.
        options: how it is rendered; by default the picture's longer side is at most `SIDE`. What
            renders and how many samples of a pixel follows from `methods` and `seconds`.
        methods: names of methods (see the module `methods`) or plugin ids of integrators; by
            default all that can render the scene.
        seconds: time of all measured renders together, about; the warm-up and the reference, which
            is kept for the next time, take about as long again for one or two methods.
        runs: independent renders at each number of samples, `FEWEST_RUNS` or more.
        reference: the method of the reference; by default an unbiased one, the planned one first.
        cache: folder of references instead of the user's.
        progress: called with a word for what is done, the renders done and all renders; rendering
            stops if it returns True, and the rounds that are complete are kept.
        changes: fields of `options` by name.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: no method works here, or too few runs were done.
        ValueError: a number out of range, or `spp` or `integrator` among the options.

    Warns:
        RuntimeWarning: the cache cannot be written.
    """
    options = RenderOptions.of(options, **changes)
    refuse(options, NOT_TAKEN)
    seed = options.seed
    if runs < FEWEST_RUNS:
        raise ValueError(f"runs {runs}: expected {FEWEST_RUNS} or more")
    if not seconds > 0 or seed < 0:
        raise ValueError("expected a time above 0 and a seed of 0 or more")
    document = source_of(scene, options)
    document = resized(document, options.size or reduced(document.image))
    translation = translation_of(document, options)
    wanted = [row for row in chosen(translation, methods) if methods or row.charted]
    with variant_and_threads(translation, options.variant):
        stage = Stage(document, translation, options)
        share = seconds / (runs * max(len(wanted), 1))
        racers, skipped = warmed_up(stage, wanted, share)
        if not racers:
            raise CannotRender("; ".join(f"{name}: {why}" for name, why in skipped.items()))
        by = find(reference) if reference else unbiased(translation)
        known = {racer.name: racer for racer in racers}
        most = (known.get(by.name) or warmed_up_for(stage, by, share)).spp[-1]
        found = references.reference(
            stage,
            by,
            REFERENCE_SHARE * most,
            cache or references.cache_folder(),
            seed=seed,
            progress=progress and (lambda done, of: progress("reference", done, of)),
        )
        race(racers, runs, seed, progress)
    settings = {
        "scene": name_of(translation.document),
        "size": [translation.plan.width, translation.plan.height],
        "runs": racers[0].runs,
        "seconds": seconds,
        "seed": seed,
        "dialect": options.dialect,
        "variant": options.variant or translation.plan.variant,
        "versions": versions(),
        "notes": notes(translation.document),
    }
    settings["command"] = command_line(settings, options, methods, reference)
    made = tuple(racer.curve(found.estimate) for racer in racers)
    return Chart(Path(name_of(translation.document)).stem, made, skipped, found, settings)


def unbiased(translation: Translation) -> Method:
    """The method for references: the planned one if it is unbiased, or the first that is."""
    rows = [planned(translation), *methods_for(translation)]
    for row in rows:
        if row.unbiased and not obstacle(row, translation):
            return row
    raise CannotRender("no unbiased method renders the scene: name one for the reference")


class Racer:
    """A method, loaded, and its renders so far.

    Attributes:
        name: of the method.
        spp: numbers of samples of a pixel.
        first: as `curves.Curve`.
    """

    def __init__(self, method: Method, stage: Stage) -> None:
        self.name = method.name
        self.scene, self.integrator = stage.load(method)
        self.sampler = stage.options.sampler
        self.spp = [1]
        self.first = 0.0
        self.rounds: list[list[renders.Render]] = []

    @property
    def runs(self) -> int:
        """Whole rounds so far."""
        return len(self.rounds)

    def warm_up(self, share: float) -> None:
        """Compile, and find the numbers of samples whose renders take `share` together [s]."""
        cold = self.render(1, 0).wall
        warm = self.render(1, 0).wall
        self.first = max(cold - warm, 0.0)
        # All levels up to a top of t seconds take 2 t; the next one would take t more than this.
        while len(self.spp) < MOST_LEVELS and (
            len(self.spp) < curves.LEAST_LEVELS or 4 * warm <= share
        ):
            self.spp.append(2 * self.spp[-1])
            warm = self.render(self.spp[-1], 0).wall

    def render(self, spp: int, seed: int) -> renders.Render:
        """Render a picture."""
        return renders.render(self.scene, self.integrator, spp, seed, self.sampler)

    def curve(self, reference: Estimate) -> Curve:
        """The curve of the whole rounds."""
        table = list(zip(*self.rounds, strict=True))  # by level
        finite = [[np.isfinite(r.picture) for r in row] for row in table]
        grams = [
            curves.gram(np.where(f, [r.picture for r in row], 0), reference)
            for f, row in zip(finite, table, strict=True)
        ]
        return Curve(
            name=self.name,
            spp=np.array(self.spp),
            gram=np.array([g for g, _ in grams]),
            shared=np.array([s for _, s in grams]),
            wall=np.array([[r.wall for r in row] for row in table]),
            cpu=np.array([[r.cpu for r in row] for row in table]),
            first=self.first,
            not_finite=sum(int((~f).sum()) for row in finite for f in row),
        )


def warmed_up_for(stage: Stage, method: Method, share: float) -> Racer:
    """The warm `Racer` of a method."""
    racer = Racer(method, stage)
    racer.warm_up(share)
    return racer


def warmed_up(
    stage: Stage, wanted: Sequence[Method], share: float
) -> tuple[list[Racer], dict[str, str]]:
    """The warm `Racer` of each method that works, and why the others do not, by name."""
    racers: list[Racer] = []
    skipped: dict[str, str] = {}
    for method in wanted:
        try:
            racers.append(warmed_up_for(stage, method, share))
        except RuntimeError as error:
            skipped[method.name] = reason(error)
    return racers, skipped


def race(
    racers: Sequence[Racer], runs: int, seed: int, progress: ChartProgress | None = None
) -> None:
    """Render in rounds: every method once at each of its numbers of samples.

    Args:
        racers: each `Racer`; their rounds grow.
        runs: rounds.
        seed: as `chart`.
        progress: as `chart`.

    Raises:
        CannotRender: it was stopped before `FEWEST_RUNS` rounds.
    """
    places = [
        (level, index, racer)
        for index, racer in enumerate(racers)
        for level in range(len(racer.spp))
    ]
    places.sort(key=lambda place: place[:2])  # methods in turn, level by level
    for run in range(runs):
        done: dict[Racer, list[renders.Render]] = {racer: [] for racer in racers}
        for count, (level, index, racer) in enumerate(places, run * len(places)):
            if progress and progress("render", count, runs * len(places)):
                break
            own = renders.own_seed(seed, renders.CHART, index, level, run)
            done[racer].append(racer.render(racer.spp[level], own))
        else:
            for racer, row in done.items():
                racer.rounds.append(row)
            continue
        break
    if racers[0].runs < FEWEST_RUNS:
        raise CannotRender(
            f"stopped after {racers[0].runs} rounds of renders; {FEWEST_RUNS} are needed"
        )


def command_line(
    settings: dict[str, Any], options: RenderOptions, methods: Sequence[str], reference: str | None
) -> str:
    """The command that gives this chart."""
    words = ["relume", "chart", settings["scene"], *repeated("--method", methods)]
    words += ["--reference", reference] if reference else []
    words += ["--size", "{}x{}".format(*settings["size"])]
    words += ["--seconds", f"{settings['seconds']:g}"]
    for name in ("runs", "seed"):
        words += [f"--{name}", str(settings[name])]
    return shlex.join([*words, *option_words(options, "variant", "sampler", "dialect")])
