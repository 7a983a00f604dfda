"""`relume chart`: error over time for every method that can render a scene.

Each method renders independent pictures at 1, 2, 4, ... samples of a pixel, the methods in turn, up
to the number that fits its share of the time. Climbing to that number once is the warm-up: kernels
are compiled then, and it is no part of the curves.
"""

import shlex
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relume import translator
from relume.application import read
from relume.loading import resized, variant_and_threads
from relume.session import CannotRender, reason
from relume.workbench import curves, methods, references, renders
from relume.workbench.comparing import notes
from relume.workbench.comparison import versions

RUNS = 8
FEWEST_RUNS = 4
"""Below, intervals say nothing."""

SECONDS = 60.0
SIDE = 160
"""Longest side of the picture, unless a size is given [pixel]: errors need no large pictures."""

REFERENCE_SHARE = 16
"""Samples of the reference for each of the longest render of its method."""

MOST_LEVELS = 20


@dataclass(frozen=True)
class Chart:
    """What was measured of a scene.

    Attributes:
        name: of the scene.
        curves: a `curves.Curve` for each method.
        skipped: why the other methods asked for have none, by name.
        reference: `references.Reference`.
        settings: what was rendered and how, as JSON values.
    """

    name: str
    curves: tuple
    skipped: dict
    reference: references.Reference
    settings: dict

    def on_front(self, curve):
        """Whether each point of a curve lies on the Pareto front over wall time: (levels,)."""
        others = [other for other in self.curves if other is not curve]
        return curves.on_front(curve, others) if others else np.ones(len(curve.spp), bool)


def chart(
    scene,
    *,
    method=(),
    seconds=SECONDS,
    runs=RUNS,
    size=None,
    seed=0,
    reference=None,
    cache=None,
    dialect="manual",
    asset_path=(),
    watch=None,
):
    """Measure the error of methods over time.

    Args:
        scene: the scene file.
        method: names of methods (see `methods`) or plugin ids of integrators; by default all that
            can render the scene.
        seconds: time of all measured renders together, about; the warm-up and the reference, which
            is kept for the next time, take about as long again for one or two methods.
        runs: independent renders at each number of samples, `FEWEST_RUNS` or more.
        size: (width, height) instead of the scene's, whose longer side is reduced to `SIDE`.
        seed: non-negative integer.
        reference: the method of the reference; by default an unbiased one, the planned one first.
        cache: folder of references instead of the user's.
        dialect: `manual` or `prender`.
        asset_path: folders in which files that the scene names are looked for.
        watch: called with a word for what is done, the renders done and all renders; rendering
            stops if it returns True, and what is whole by then is kept.

    Returns:
        `Chart`.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: no method works here, or too few runs were done.
        ValueError: a number out of range.
        OutputError: the cache cannot be written.
    """
    if runs < FEWEST_RUNS:
        raise ValueError(f"runs {runs}: expected {FEWEST_RUNS} or more")
    if not seconds > 0 or seed < 0:
        raise ValueError("expected a time above 0 and a seed of 0 or more")
    document = read(scene)
    document = resized(document, size or reduced(document.image))
    translation = translator.translate(document, dialect, asset_path)
    wanted = chosen(translation, method)
    with variant_and_threads(translation):
        stage = methods.Stage(document, translation, dialect, asset_path)
        share = seconds / (runs * max(len(wanted), 1))
        racers, skipped = warmed_up(stage, wanted, share)
        if not racers:
            raise CannotRender("; ".join(f"{name}: {why}" for name, why in skipped.items()))
        by = methods.find(reference) if reference else unbiased(translation)
        known = {racer.name: racer for racer in racers}
        most = (known.get(by.name) or warmed_up_for(stage, by, share)).spp[-1]
        found = references.reference(
            stage,
            by,
            REFERENCE_SHARE * most,
            cache or references.cache_folder(),
            seed=seed,
            watch=watch and (lambda done, of: watch("reference", done, of)),
        )
        race(racers, runs, seed, watch)
    settings = {
        "scene": str(scene),
        "size": [translation.plan.width, translation.plan.height],
        "runs": racers[0].runs,
        "seconds": seconds,
        "seed": seed,
        "dialect": dialect,
        "variant": translation.plan.variant,
        "versions": versions(),
        "notes": notes(translation.document),
    }
    settings["command"] = command_line(settings, method, reference, asset_path)
    made = tuple(racer.curve(found.estimate) for racer in racers)
    return Chart(Path(scene).stem, made, skipped, found, settings)


def reduced(image):
    """A size with the shape of `image` and a longer side of at most `SIDE`."""
    scale = min(1.0, SIDE / max(image))
    return tuple(max(1, round(scale * side)) for side in image)


def chosen(translation, names):
    """The methods of these names; all that can render a scene if there are none."""
    if names:
        return [methods.find(name) for name in dict.fromkeys(names)]
    planned = methods.planned(translation)
    rows = methods.methods_for(translation)
    return rows if planned.name in {row.name for row in rows} else [planned, *rows]


def unbiased(translation):
    """The method for references: the planned one if it is unbiased, or the first that is."""
    rows = [methods.planned(translation), *methods.methods_for(translation)]
    for row in rows:
        if row.unbiased and not row.obstacle(translation):
            return row
    raise CannotRender("no unbiased method renders the scene: name one for the reference")


class Racer:
    """A method, loaded, and its renders so far.

    Attributes:
        name: of the method.
        spp: numbers of samples of a pixel.
        first: as `curves.Curve`.
    """

    def __init__(self, method, stage):
        self.name = method.name
        self.scene, self.integrator = stage.load(method)
        self.spp = [1]
        self.first = 0.0
        self.rounds = []
        self.not_finite = 0

    @property
    def runs(self):
        """Whole rounds so far."""
        return len(self.rounds)

    def warm_up(self, share):
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

    def render(self, spp, seed):
        """A `renders.Render`."""
        return renders.render(self.scene, self.integrator, spp, seed)

    def curve(self, reference):
        """The `curves.Curve` of the whole rounds."""
        table = list(zip(*self.rounds, strict=True))  # by level
        finite = [[np.isfinite(r.picture) for r in row] for row in table]
        grams = [
            curves.gram(np.where(f, [r.picture for r in row], 0), reference)
            for f, row in zip(finite, table, strict=True)
        ]
        return curves.Curve(
            name=self.name,
            spp=np.array(self.spp),
            gram=np.array([g for g, _ in grams]),
            shared=np.array([s for _, s in grams]),
            wall=np.array([[r.wall for r in row] for row in table]),
            cpu=np.array([[r.cpu for r in row] for row in table]),
            first=self.first,
            not_finite=sum(int((~f).sum()) for row in finite for f in row),
        )


def warmed_up_for(stage, method, share):
    """The warm `Racer` of a method."""
    racer = Racer(method, stage)
    racer.warm_up(share)
    return racer


def warmed_up(stage, wanted, share):
    """The warm `Racer` of each method that works, and why the others do not, by name."""
    racers, skipped = [], {}
    for method in wanted:
        try:
            racers.append(warmed_up_for(stage, method, share))
        except RuntimeError as error:
            skipped[method.name] = reason(error)
    return racers, skipped


def race(racers, runs, seed, watch=None):
    """Render in rounds: every method once at each of its numbers of samples.

    Args:
        racers: each `Racer`; their rounds grow.
        runs: rounds.
        seed: as `chart`.
        watch: as `chart`.

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
        done = {racer: [] for racer in racers}
        for count, (level, index, racer) in enumerate(places, run * len(places)):
            if watch and watch("render", count, runs * len(places)):
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


def command_line(settings, method, reference, asset_path):
    """The command that gives this chart."""
    words = ["relume", "chart", settings["scene"]]
    for name in method:
        words += ["--method", name]
    words += ["--reference", reference] if reference else []
    words += ["--size", "{}x{}".format(*settings["size"])]
    for name in ("seconds", "runs", "seed", "dialect"):
        words += [f"--{name}", f"{settings[name]:g}" if name == "seconds" else str(settings[name])]
    for folder in asset_path:
        words += ["--asset-path", str(folder)]
    return shlex.join(words)
