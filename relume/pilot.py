"""Which of a scene's candidates renders it: short renders of each, variance times cost compared.

The plan tells the candidates (`relume.translator.candidates`), of whom a pilot renders small
pictures, in independent parts. It is deterministic in scene and seed: the numbers of samples are
fixed and the cost of a sample is a constant, so all parts of a render choose alike, wherever they
run.

The few brightest samples, which a short render meets by chance or misses, must not decide: the
error of a pixel counts at most `CUT` times what is usual in the picture. What is rare for one
candidate alone makes its picture noisy all over in parts that it does see; what is rare for all of
them, such as caustics seen in mirrors, is cut off for all.
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
from relume.translator.plan import RenderPlan
from relume.translator.scene_values import Entry, to_mitsuba

COST = {"surfacepath": 1.0, "bdpt": 2.2}
"""Cost of a sample, relative; measured in docs/efficiency.md."""

SAMPLES = {"surfacepath": 16, "bdpt": 8}
"""Samples of a pixel in each part of a pilot: parts of all candidates take about as long."""

PARTS = 4
"""Independent parts of a pilot."""

PIXELS, BLOCK = 64 * 48, 8
"""Pixels of a pilot, about, and sides of the blocks in which the picture is known by then."""

CUT = 20.0
"""Largest error of a pixel that counts, over the median of the blocks'."""

PURPOSE = 1
"""What sets the seeds of pilots apart from those of renders."""

LEAST = 2**21
"""Samples of a render from which a pilot pays: it has a tenth of them or less."""


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
        path = options.integrator not in (None, "bdpt")
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
        errors = measured(scene, translation, options)
    name, why = decided(errors, plan.candidates)
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


def decided(errors: dict[str, float], candidates: Sequence[str]) -> tuple[str, str]:
    """The candidate to render with, and why.

    Args:
        errors: of a sample, by candidate.
        candidates: the first is taken unless another one is better.
    """
    times = {name: errors[name] * COST[name] for name in candidates}
    best = min(candidates, key=times.__getitem__)
    other = min((name for name in candidates if name != best), key=times.__getitem__)
    if times[other] == times[best]:
        return best, f"{best}: a pilot found no difference"
    gain = times[other] / times[best] if times[best] else math.inf
    return best, f"{best}: in a pilot {other} needs {gain:.2g} times its time for the same noise"


def measured(scene: Scene, translation: Translation, options: RenderOptions) -> dict[str, float]:
    """The error of a sample by each candidate; the variant must be set.

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
            session = Session(
                scene, spp, seed, integrator, sampler=options.sampler, sensor=sensor
            )
            for _ in session.run():
                pass
            parts.append(session.image())
        pictures[name] = np.array(parts, float)
    return errors_of(pictures)


def small_sensor(sensor: Entry, plan: RenderPlan) -> Entry:
    """The dictionary of a sensor with a film of about `PIXELS` pixels, in whole blocks."""
    shape = math.sqrt(plan.width / plan.height)
    sides = (math.sqrt(PIXELS) * shape, math.sqrt(PIXELS) / shape)
    width, height = (BLOCK * max(1, round(side / BLOCK)) for side in sides)
    return sensor | {"film": sensor["film"] | {"width": width, "height": height}}


def errors_of(pictures: dict[str, np.ndarray]) -> dict[str, float]:
    """relMSE of a sample by each candidate, without the brightest pixels.

    Args:
        pictures: by candidate, (parts, height, width, 3), with `SAMPLES` samples of a pixel.
    """
    R = spread(reference(pictures))
    weight = 1 / (R**2 + 0.01 * R.mean() ** 2)
    found = {}
    for name, parts in pictures.items():
        errors = (parts.var(0, ddof=1) * weight).mean(-1)
        usual = np.median(blocks(errors[..., None]))
        found[name] = float(np.minimum(errors, CUT * usual).mean()) * SAMPLES[name]
    return found


def reference(pictures: dict[str, np.ndarray]) -> np.ndarray:
    """The mean picture in blocks, of all candidates, weighted by how steady they are."""
    means = {name: blocks(parts) for name, parts in pictures.items()}
    noise = {name: found.var(0, ddof=1).mean() for name, found in means.items()}
    # Without any noise they are equal.
    weights = {name: 1 / max(value, 1e-30) for name, value in noise.items()}
    total = sum(weights.values())
    return np.sum([weights[name] / total * means[name].mean(0) for name in means], axis=0)


def blocks(pictures: np.ndarray) -> np.ndarray:
    """Means of the blocks of pictures (..., height, width, channels)."""
    *before, height, width, channels = pictures.shape
    shape = (*before, height // BLOCK, BLOCK, width // BLOCK, BLOCK, channels)
    found: np.ndarray = pictures.reshape(shape).mean((-4, -2))
    return found


def spread(means: np.ndarray) -> np.ndarray:
    """The picture of blocks with these means."""
    return means.repeat(BLOCK, axis=-3).repeat(BLOCK, axis=-2)
