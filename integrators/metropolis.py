"""What `pssmlt` and `erpt` share: the pilot, the seeds of the chains and the statistics."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.common import NO_LIMIT, nested_integrator, with_depth_range
from relume.integrators.markovchains import ChainResults
from relume.integrators.primarysamples import MUTATIONS, PathSampler
from relume.integrators.uniformsamples import (
    Samples,
    pixel_coverage,
    pixel_means,
    uniform_numbers,
    uniform_samples,
)
from relume.parameters import NOT_NEGATIVE, POSITIVE, choice, flag, number

PILOT_SAMPLES = 2**15
"""Uniform samples of each half of the pilot."""

MIN_BOOTSTRAP_SAMPLES = 2**11
"""Least uniform samples of each half of the bootstrap: with few seeds small films are noisy."""

MAX_ALPHA_SAMPLES = 64
"""Independent samples of a pixel, at most, for its alpha: chains go where light is."""

NO_GRADIENTS = "chains have no derivatives: differentiate by the nested integrator, or by prb"

MAX_DIRECT_DEPTH = 2
"""Longest path of direct light."""


@dataclass(frozen=True)
class Pilot:
    """What is known of a scene before it is rendered.

    Attributes:
        importance: (pixels,) 1/m.
        b: guess of the mean of I; 0 if no light was found.
        second_moment: mean of I² over b².
        target: (n,) I of its samples, no more than 50 b each.
    """

    importance: np.ndarray
    b: float
    second_moment: float
    target: np.ndarray

    @classmethod
    def of(cls, paths: PathSampler, seed: int = 0) -> Pilot:
        """Trace the pilot of a scene."""
        from scipy.ndimage import gaussian_filter

        samples = uniform_samples(paths, PILOT_SAMPLES, seed)
        Y = samples.luminance
        mean = Y.mean()
        if mean == 0:
            return cls(np.ones(paths.pixels, np.float32), 0.0, 0.0, Y)
        # Single bright paths would make islands.
        capped = np.minimum(Y, 50 * mean)
        picture = np.bincount(samples.pixel, capped, paths.pixels)
        hits: np.ndarray = np.full(paths.pixels, len(Y) / paths.pixels)
        if paths.spread:
            hits = np.bincount(samples.pixel, minlength=paths.pixels)
        shape = (paths.height, paths.width)
        sigma = max(shape) / 40
        light, count = (
            gaussian_filter(x.reshape(shape).astype(float), sigma, mode="nearest", truncate=3)
            for x in (picture, hits)
        )
        rough = light / count
        m = np.sqrt(rough**2 + 0.01 * mean**2)
        importance = (m.mean() / m).ravel().astype(np.float32)
        I = Y * importance[samples.pixel]
        b = I.mean()
        return cls(importance, b, np.mean(I**2) / b**2, np.minimum(I, 50 * b))

    @classmethod
    def learnt(cls, paths: PathSampler) -> Pilot:
        """That of paths, after one from which they learn which ways to take."""
        pilot = cls.of(paths)
        if not hasattr(paths, "ways") or not pilot.b:
            return pilot
        chosen = paths.ways.entry(uniform_numbers(PILOT_SAMPLES, 0, paths.held.start))
        paths.ways.learn(chosen.numpy(), pilot.target)
        return cls.of(paths, seed=PILOT_SAMPLES)


def systematic_resampling(I: np.ndarray, chains: int, u: float) -> np.ndarray:
    """Draw the samples that chains start from, with probability in proportion to I.

    Args:
        I: (n,) targets of the samples.
        chains: how many to draw.
        u: number in [0, 1), the offset of the comb.

    Returns:
        (chains,) indices.
    """
    cumulated = np.cumsum(I)
    teeth = (np.arange(chains) + u) * (cumulated[-1] / chains)
    return np.minimum(np.searchsorted(cumulated, teeth, side="right"), len(I) - 1)


class Statistics:
    """What the chains of all renders so far have done."""

    def __init__(self) -> None:
        self.uniform = self.sum_Y = self.sum_YY = 0.0
        self.small = self.accepted_small = self.large = self.accepted_large = 0.0
        self.seeds = self.longest_rejection = 0.0
        self.fallback_reason = ""
        self.direct_samples = 0

    def add_uniform(self, n: float, sum_Y: float, sum_YY: float) -> None:
        """Add n uniform samples by the sums of their luminance and of its square."""
        self.uniform += n
        self.sum_Y += sum_Y
        self.sum_YY += sum_YY

    def add_samples(self, samples: Samples) -> None:
        """Add `Samples`."""
        Y = samples.luminance
        self.add_uniform(len(Y), Y.sum(), np.sum(Y * Y))

    def add_chains(self, found: ChainResults, mutations: int) -> None:
        """Add `ChainResults` of so many mutations."""
        large = found.large_steps.sum()
        self.add_uniform(large, found.luminance.sum(), found.squared.sum())
        self.large += large
        self.small += mutations - large
        self.accepted_large += found.accepted_large.sum()
        self.accepted_small += found.accepted_small.sum()
        self.longest_rejection = max(self.longest_rejection, found.longest_rejection.max())

    def lines(self) -> list[str]:
        """Return the report, a string for each line."""
        if not self.uniform:
            why = self.fallback_reason
            return [f"{why}: rendered by independent samples"] if why else []
        b = self.sum_Y / self.uniform
        variance = max(self.sum_YY / self.uniform - b * b, 0)
        error = np.sqrt(variance / self.uniform)
        lines = [f"mean luminance b = {b:.5g}, standard error {error:.2g}"]
        if self.fallback_reason:
            return [*lines, f"{self.fallback_reason}: rendered by independent samples"]
        if self.direct_samples:
            lines[0] += ", without direct light"
            lines.append(f"direct light: {self.direct_samples} independent samples per pixel")
        small = self.accepted_small / max(self.small, 1)
        large = self.accepted_large / max(self.large, 1)
        return [
            *lines,
            f"accepted: {small:.1%} of small steps, {large:.1%} of large steps;"
            f" longest run of rejections {self.longest_rejection:.0f}",
            f"chains from {self.seeds:.0f} effective seeds",
        ]


def fill(film: mi.Film, channels: list[np.ndarray]) -> None:
    """Fill a film with a picture: colours (pixels, 3) and, if it has it, alpha (pixels,)."""
    film.prepare([])
    block = film.create_block()
    tensor = np.column_stack([*channels, np.ones(len(channels[0]))]).astype(np.float32)
    block.tensor()[:] = mi.TensorXf(tensor.ravel(), block.tensor().shape)
    film.put_block(block)


def effective_seeds(I: np.ndarray, chains: int) -> float:
    """Return the effective number of different seeds among `chains` resampled by I (n,)."""
    square = np.sum(I * I)
    return min(chains, np.sum(I) ** 2 / square) if square else 0.0


def mutation_sizes(name: str, props: mi.Properties) -> tuple[float, float]:
    """The sizes of a mutation.

    Raises:
        ValueError: sizes that are no numbers, or not in order.
    """
    _, s1, s2 = MUTATIONS[name]
    s1, s2 = number(props, "mutation_size_min", s1), number(props, "mutation_size_max", s2)
    if not 0 < s1 < s2 <= 0.5:
        raise ValueError(f"mutation sizes are {s1} and {s2}, but must rise from above 0 to 0.5")
    return s1, s2


def path_sampler(scene: mi.Scene, sensor: mi.Sensor, integrator: mi.Integrator) -> PathSampler:
    """What traces the paths of an integrator, by one of its own where it has one."""
    if hasattr(integrator, "path_sampler"):
        own: PathSampler = integrator.path_sampler(scene, sensor)
        return own
    return PathSampler(scene, sensor, integrator)


@functools.cache
def metropolis_class(_variant: str) -> type[mi.AdjointIntegrator]:
    """The base class of both integrators under the variant in use."""

    class Metropolis(mi.AdjointIntegrator):
        """The part of an integrator that both methods share; `render_chains` is theirs.

        Attributes:
            nested: the integrator that traces paths.
            bootstrap: uniform samples per mutation.
            resampling: whether each render draws them anew.
            mutation, s1, s2: kind of small steps and their sizes.
            direct_samples: independent samples per mutation for direct light; with 0 the chains
                render it.
            separate: edges of the longest paths that independent samples find: 2 with
                `direct_samples`, 1 over ``bdpt``, else 0.
            direct, chained: the integrators of these and of what the chains find.
            statistics: `Statistics` of all renders.
        """

        def __init__(self, props):
            mi.AdjointIntegrator.__init__(self, props)
            self.nested = nested_integrator(props, capable="path_sampler")
            if self.nested.aov_names():
                name = props.plugin_name()
                raise ValueError(f"{name} renders colours, no AOVs as {self.nested.class_name()}")
            self.bootstrap = number(props, "bootstrap", 0.25, POSITIVE)
            self.resampling = flag(props, "resampling", True)
            self.mutation = choice(props, "mutation", tuple(MUTATIONS))
            self.s1, self.s2 = mutation_sizes(self.mutation, props)
            self.direct_samples = number(props, "direct_samples", 0.0, NOT_NEGATIVE)
            self.chained = self.nested
            two_sided = hasattr(self.nested, "path_sampler")
            separate = MAX_DIRECT_DEPTH if self.direct_samples else int(two_sided)
            if separate:
                camera = self.nested.from_camera() if two_sided else self.nested
                self.direct = with_depth_range(camera, 1, separate)
                self.chained = with_depth_range(self.nested, separate + 1, NO_LIMIT)
            self.separate = separate
            self.pilots = {}
            self.statistics = Statistics()

        def aov_names(self):
            return []

        def render_forward(self, *args, **kwargs):
            raise ValueError(NO_GRADIENTS)

        def render_backward(self, *args, **kwargs):
            raise ValueError(NO_GRADIENTS)

        def traverse(self, cb):
            cb.put("paths", self.nested, mi.ParamFlags.NonDifferentiable)

        def settings(self):
            """Return the parameters that both methods share, as text."""
            return (
                f"bootstrap={self.bootstrap}, resampling={self.resampling}, "
                f"mutation={self.mutation}, mutation_size_min={self.s1}, "
                f"mutation_size_max={self.s2}, direct_samples={self.direct_samples}"
            )

        def report(self):
            """Return what the chains have done in all renders, as lines of text."""
            return self.statistics.lines()

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            spp = spp or sensor.sampler().sample_count()
            rng = np.random.default_rng(int(np.array(seed).ravel()[0]))
            paths = path_sampler(scene, sensor, self.chained)
            film = sensor.film()
            if film.flags() & +mi.FilmFlags.Special:
                raise ValueError(f"chains fill films of colours, no {film.class_name()}")
            with dr.suspend_grad():
                channels = [self.render_image(paths, rng, spp)]
                if film.flags() & +mi.FilmFlags.Alpha:
                    count = min(spp, MAX_ALPHA_SAMPLES)
                    channels.append(pixel_coverage(paths, count, int(rng.integers(2**31))))
            fill(film, channels)
            if develop:
                return film.develop()
            film.schedule_storage()
            return mi.TensorXf()

        def render_image(self, paths, rng, spp):
            """Render all light: mean colours (pixels, 3)."""
            pilot = self.pilot(paths)
            self.statistics.fallback_reason = self.fallback_reason(pilot)
            if self.statistics.fallback_reason:
                return self.independent_samples(paths, self.nested, rng, spp)
            picture = self.render_chains(paths, pilot, rng, spp)
            if self.separate:
                # Lamps that are seen take no more than a ray of the camera.
                count = max(1, round(self.direct_samples * spp)) if self.direct_samples else spp
                self.statistics.direct_samples += count
                picture += self.independent_samples(paths, self.direct, rng, count, False)
            return picture

        def fallback_reason(self, pilot):
            """Return why independent samples render instead of chains; empty if chains do."""
            return "" if pilot.b else "the pilot found no light"

        def pilot(self, paths):
            """The `Pilot`; one that no longer fits, as the scene has changed, is no error."""
            key = (paths.sensor.ptr, paths.width, paths.height)
            if key not in self.pilots:
                self.pilots[key] = Pilot.learnt(paths), getattr(paths, "ways", None)
            pilot, ways = self.pilots[key]
            if ways:
                paths.ways = ways
            return pilot

        def seeds(self, rng):
            """Seeds of the bootstrap and of the chains."""
            bootstrap, chains = (int(x) for x in rng.integers(2**31, size=2))
            return (bootstrap if self.resampling else 1), chains

        def bootstrap_samples(self, paths, pilot, seed, spp):
            """Trace the bootstrap: `Samples`, and I of each half (2, count)."""
            count = max(MIN_BOOTSTRAP_SAMPLES, round(self.bootstrap * spp * paths.pixels / 2))
            samples = uniform_samples(paths, count, seed)
            self.statistics.add_samples(samples)
            target = samples.luminance * pilot.importance[samples.pixel]
            return samples, target.reshape(2, count)

        def independent_samples(self, paths, integrator, rng, spp, counted=True):
            """Render with an integrator by independent samples: mean colours (pixels, 3)."""
            seed = int(rng.integers(2**31))
            if hasattr(integrator, "path_sampler"):
                return integrator.render_image(paths.scene, paths.sensor, seed, spp)[:, :3]
            paths = PathSampler(paths.scene, paths.sensor, integrator)
            mean, *sums = pixel_means(paths, spp, seed)
            if counted:
                self.statistics.add_uniform(spp * paths.pixels, *sums)
            return mean

    return Metropolis
