"""Which of a scene's candidates renders it: short renders of each, variance times cost compared.

The plan tells the candidates (`relume.translator.candidates`), of whom a pilot renders small
pictures, in independent parts. It is deterministic in scene and seed: the numbers of samples are
fixed and the cost of a sample is a constant, so all parts of a render choose alike, wherever they
run.

Rare bright samples, which a short render meets by chance or misses, must not decide. Pixels of the
parts are therefore clipped at T above what their surroundings have, and two things make the error
of a candidate: the variance of its clipped parts, and, if another one has more light by D, both
clipped at the larger T, at least D T besides. For light that comes in values X above T only has
E[X²] ≥ T E[X]: what `bdpt` finds evenly and `surfacepath` as single bright pixels counts against
the latter, whether the pilot meets such a pixel or not. Light that is rare for all of them, such as
caustics seen in mirrors, is cut off for all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from relume.loading import load_integrator, load_scene, usable_variant, variant_and_threads
from relume.options import RenderOptions
from relume.session import Scene, Session
from relume.translator import Translation
from relume.translator.candidates import has_points
from relume.translator.plan import RenderPlan
from relume.translator.scene_values import Entry, to_mitsuba

COST = {"surfacepath": 1.0, "samplescale": 1.0, "bdpt": 2.0}
"""Cost of a sample, relative; measured in docs/efficiency.md. `samplescale` has the factor of the
radiance for `surfacepath`; that of `bdpt` costs nothing."""

COST_WITH_POINTS = 3.2
"""That of `bdpt` where lamps have no size: it traces four times as many light subpaths."""

SAMPLES = {"surfacepath": 16, "samplescale": 16, "bdpt": 8}
"""Samples of a pixel in each part of a pilot: parts of all candidates take about as long."""

BOTH_ENDS = ("bdpt", "bdpt-merging")
"""Integrators that find the light of lamps without size behind glass."""

PARTS = 4
"""Independent parts of a pilot."""

PIXELS, BLOCK = 64 * 48, 8
"""Pixels of a pilot, about, and sides of the blocks in which the picture is known by then."""

CUT = 50.0
"""T² over the usual variance of a pixel, the median of the blocks'. Of the thirteen scenes of
docs/efficiency.md all are chosen rightly from 20 to 100, by each of ten seeds."""

SIGMAS = 4.54
"""Standard errors of the light D that are taken off, or chance would count as missing light: the
parts exceed them once in a hundred times (Student's t of three degrees of freedom)."""

TINY = 1e-30
"""What keeps black pictures, and such without noise, from dividing by 0."""

PURPOSE = 1
"""What sets the seeds of pilots apart from those of renders."""

LEAST = 2**20
"""Samples of a render from which a pilot pays: see docs/efficiency.md."""


@dataclass(frozen=True)
class Choice:
    """How a scene is rendered.

    Attributes:
        translation: the scene, with notes on what is not rendered as written that way.
        options: with the integrator that renders it, where that is not the one in the scene.
        why: which integrator that is and why, in words; empty where there was no choice.
        scene: the scene as the pilot has loaded it, or None.
    """

    translation: Translation
    options: RenderOptions
    why: str = ""
    scene: Scene | None = None


def choice(
    translation: Translation, options: RenderOptions, before: tuple[str, str] | None = None
) -> Choice:
    """Choose among the candidates of a scene.

    Args:
        translation: the translated scene.
        options: with the seed; an integrator there is taken as it is.
        before: integrator of what there is of the render already, and why it was chosen: a
            candidate is kept.

    Raises:
        CannotRender: the variant does not work here, or Mitsuba refuses the scene.
    """
    plan = translation.plan
    if options.integrator or plan.candidates == (plan.integrator,):
        path = options.integrator not in (None, *BOTH_ENDS)
        return Choice(translation.path_traced() if path else translation, options)
    variant = usable_variant(plan, options.variant)
    if "scalar" in variant or "polarized" in variant:
        why = f"{plan.integrator}: others do not run under {variant}"
        return Choice(translation.path_traced(), options, why)
    if before is not None and before[0] in plan.candidates:
        return chosen(translation, options, *before)
    if len(plan.candidates) == 1:
        (name,) = plan.candidates
        return chosen(translation, options, name, f"{name}: {plan.reasons['candidates']}")
    if plan.width * plan.height * plan.spp < LEAST:
        return Choice(translation, options)
    with variant_and_threads(translation, variant):
        scene = load_scene(translation)
        times = measured(scene, translation, options)
    name, why = decided(times, plan.candidates)
    return chosen(translation, options, name, why, scene)


def chosen(
    translation: Translation,
    options: RenderOptions,
    name: str,
    why: str,
    scene: Scene | None = None,
) -> Choice:
    """The choice of a candidate; arguments as those of `Choice`."""
    if name != translation.plan.integrator:
        options = RenderOptions.of(options, integrator=name)
    return Choice(translation, options, why, scene)


def decided(times: dict[str, float], candidates: Sequence[str]) -> tuple[str, str]:
    """The candidate to render with, and why.

    Args:
        times: for the same noise, relative, by candidate.
        candidates: the first is taken unless another one is better.
    """
    best, other = sorted(candidates, key=times.__getitem__)[:2]
    if times[other] == times[best]:
        return best, f"{best}: a pilot found no difference"
    gain = times[other] / times[best] if times[best] else math.inf
    return best, f"{best}: by a pilot {other} takes {gain:.2g} times as long for the same noise"


def measured(scene: Scene, translation: Translation, options: RenderOptions) -> dict[str, float]:
    """The time for the same noise by each candidate, relative; the variant must be set.

    Args:
        scene: the loaded scene.
        translation: what it is made of.
        options: with the seed and the sampler.
    """
    plan, planned = translation.plan, translation.scene["integrator"]
    sensor = mi.load_dict(to_mitsuba(small_sensor(translation.scene["sensor"], plan)))
    pictures = {}
    for name in plan.candidates:
        integrator, spp = load_integrator(name, planned), SAMPLES[name]
        parts = []
        for part in range(PARTS):
            own = np.random.SeedSequence(options.seed, spawn_key=(PURPOSE, part))
            seed = int(own.generate_state(1, np.uint64)[0])
            session = Session(scene, spp, seed, integrator, sampler=options.sampler, sensor=sensor)
            for _ in session.run():
                pass
            parts.append(session.image())
        pictures[name] = np.array(parts, float)
    cost = costs(translation)
    return {name: error * cost[name] for name, error in errors_of(pictures).items()}


def costs(translation: Translation) -> dict[str, float]:
    """The cost of a sample by each candidate for a scene, relative."""
    points = has_points(x for x in translation.scene.values() if isinstance(x, dict))
    return COST | {"bdpt": COST_WITH_POINTS} if points else COST


def small_sensor(sensor: Entry, plan: RenderPlan) -> Entry:
    """The dictionary of a sensor with a film of about `PIXELS` pixels, in whole blocks."""
    shape = math.sqrt(plan.width / plan.height)
    sides = (math.sqrt(PIXELS) * shape, math.sqrt(PIXELS) / shape)
    width, height = (BLOCK * max(1, round(side / BLOCK)) for side in sides)
    return sensor | {"film": sensor["film"] | {"width": width, "height": height}}


def errors_of(pictures: dict[str, np.ndarray]) -> dict[str, float]:
    """relMSE of a sample by each candidate, as far as a pilot can tell it (see above).

    Args:
        pictures: by candidate, (parts, height, width, 3), with `SAMPLES` samples of a pixel.
    """
    R = spread(reference(pictures))
    weight = 1 / (R**2 + 0.01 * R.mean() ** 2 + TINY)
    T = {}
    for name, parts in pictures.items():
        errors = (parts.var(0, ddof=1) * weight).mean(-1, keepdims=True)
        T[name] = np.sqrt(CUT * np.median(blocks(errors)) / weight)
    # Light is compared at one limit, or what surfaces show within blocks would count as light.
    largest = np.max(list(T.values()), axis=0)
    light = {name: np.minimum(parts, R + largest) for name, parts in pictures.items()}
    found = {}
    for name, parts in pictures.items():
        error = (np.minimum(parts, R + T[name]).var(0, ddof=1) * weight).mean()
        lacks = [((x - light[name]) * largest * weight).mean((1, 2, 3)) for x in light.values()]
        error += max(0.0, *(x.mean() - SIGMAS * x.std(ddof=1) / PARTS**0.5 for x in lacks))
        found[name] = float(error) * SAMPLES[name]
    return found


def reference(pictures: dict[str, np.ndarray]) -> np.ndarray:
    """What blocks of the picture have, by the candidate that finds most light evenly."""
    medians = [np.median(blocks(parts), axis=0) for parts in pictures.values()]
    found: np.ndarray = np.max(medians, axis=0)
    return found


def blocks(pictures: np.ndarray) -> np.ndarray:
    """Means of the blocks of pictures (..., height, width, channels)."""
    *before, height, width, channels = pictures.shape
    shape = (*before, height // BLOCK, BLOCK, width // BLOCK, BLOCK, channels)
    found: np.ndarray = pictures.reshape(shape).mean((-4, -2))
    return found


def spread(means: np.ndarray) -> np.ndarray:
    """The picture of blocks with these means."""
    return means.repeat(BLOCK, axis=-3).repeat(BLOCK, axis=-2)
