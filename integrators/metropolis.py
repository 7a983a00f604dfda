"""What the Metropolis integrators share: the pilot, the seeds, the figures and the frame."""

import functools
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from relume.integrators.common import NO_LIMIT, nested_integrator, with_depth_range
from relume.integrators.primarysamples import MUTATIONS, Paths
from relume.integrators.uniformsamples import pixel_means, uniform_samples

PILOT = 2**15
"""Uniform samples of each half of the pilot."""

FEWEST = 2**11
"""Uniform samples of each half of the bootstrap, at least: with few seeds small films are noisy."""

DIRECT = 2
"""Longest path of direct light."""


@dataclass(frozen=True)
class Pilot:
    """What is known of a scene before it is rendered.

    Attributes:
        importance: (pixels,) 1/m.
        b: guess of the mean of I; 0 if no light was found.
        spread: mean of I² over b².
    """

    importance: np.ndarray
    b: float
    spread: float

    @classmethod
    def of(cls, paths):
        """The pilot of the paths of a scene."""
        from scipy.ndimage import gaussian_filter

        samples = uniform_samples(paths, PILOT, seed=0)
        Y = samples.luminance
        mean = Y.mean()
        if mean == 0:
            return cls(np.ones(paths.pixels, np.float32), 0.0, 0.0)
        # Single bright paths would make islands.
        capped = np.minimum(Y, 50 * mean)
        picture = np.bincount(samples.pixel, capped, paths.pixels)
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
        return cls(importance, I.mean(), np.mean(I**2) / I.mean() ** 2)


def resampled(I, chains, u):
    """Indices of seeds of `chains` chains, each chosen with probability in proportion to I (n,).

    Args:
        I: (n,) targets of the samples.
        chains: how many.
        u: number in [0, 1) that shifts the comb (systematic resampling).
    """
    cumulated = np.cumsum(I)
    teeth = (np.arange(chains) + u) * (cumulated[-1] / chains)
    return np.minimum(np.searchsorted(cumulated, teeth, side="right"), len(I) - 1)


class Tally:
    """Figures of all renders so far."""

    def __init__(self):
        self.uniform = self.Y = self.YY = 0.0
        self.small = self.accepted_small = self.large = self.accepted_large = 0.0
        self.seeds = self.longest = 0.0
        self.handed_over = ""
        self.direct_samples = 0

    def add_uniform(self, n, Y, YY):
        self.uniform, self.Y, self.YY = self.uniform + n, self.Y + Y, self.YY + YY

    def add_samples(self, samples):
        Y = samples.luminance
        self.add_uniform(len(Y), Y.sum(), np.sum(Y * Y))

    def add_walked(self, walked, mutations):
        large = walked.large.sum()
        self.add_uniform(large, walked.luminance.sum(), walked.squared.sum())
        self.large += large
        self.small += mutations - large
        self.accepted_large += walked.accepted_large.sum()
        self.accepted_small += walked.accepted_small.sum()
        self.longest = max(self.longest, walked.longest.max())

    def lines(self):
        """The report, line by line."""
        if not self.uniform:
            return []
        b = self.Y / self.uniform
        error = np.sqrt(max(self.YY / self.uniform - b * b, 0) / self.uniform)
        lines = [f"mean luminance b = {b:.5g}, standard error {error:.2g}"]
        if self.handed_over:
            return [*lines, f"{self.handed_over}: rendered by plain sampling"]
        if self.direct_samples:
            lines[0] += ", without direct light"
            lines.append(f"direct light: {self.direct_samples} plain samples a pixel")
        small = self.accepted_small / max(self.small, 1)
        large = self.accepted_large / max(self.large, 1)
        return [
            *lines,
            f"accepted: {small:.1%} of small steps, {large:.1%} of large steps;"
            f" longest run of rejections {self.longest:.0f}",
            f"chains from {self.seeds:.0f} effective seeds",
        ]


def effective(I, chains):
    """Effective number of different seeds among `chains` resampled by I (n,)."""
    square = np.sum(I * I)
    return min(chains, np.sum(I) ** 2 / square) if square else 0.0


def mutation_sizes(name, props):
    """The sizes of a mutation.

    Raises:
        ValueError: unknown mutation, or sizes not in order.
    """
    if name not in MUTATIONS:
        raise ValueError(f"mutation is '{name}', but must be one of {', '.join(MUTATIONS)}")
    _, s1, s2 = MUTATIONS[name]
    s1, s2 = props.get("mutation_size_min", s1), props.get("mutation_size_max", s2)
    if not 0 < s1 < s2 <= 0.5:
        raise ValueError(f"mutation sizes are {s1} and {s2}, but must rise from above 0 to 0.5")
    return s1, s2


@functools.cache
def metropolis_class(_variant):
    """The base class of both integrators under the variant in use."""

    class Metropolis(mi.AdjointIntegrator):
        """The part of an integrator that both methods share; `picture` is theirs.

        Attributes:
            nested: the integrator that traces paths.
            bootstrap: uniform samples to each mutation.
            resampling: whether each render draws them anew.
            mutation, s1, s2: kind of small steps and their sizes.
            direct_samples: ordinary samples to each mutation for direct light; 0 leaves it to the
                chains.
            direct, chained: the integrators of direct light and of what the chains find.
            tally: `Tally` of all renders.
        """

        def __init__(self, props):
            mi.AdjointIntegrator.__init__(self, props)
            self.nested = nested_integrator(props)
            self.bootstrap = props.get("bootstrap", 0.25)
            self.resampling = props.get("resampling", True)
            self.mutation = props.get("mutation", "mixed")
            if self.bootstrap <= 0:
                raise ValueError(f"bootstrap is {self.bootstrap}, but must be above 0")
            self.s1, self.s2 = mutation_sizes(self.mutation, props)
            self.direct_samples = props.get("direct_samples", 0.0)
            if self.direct_samples < 0:
                raise ValueError(f"direct_samples is {self.direct_samples}, but must be 0 or more")
            self.chained = self.nested
            if self.direct_samples:
                self.direct = with_depth_range(self.nested, 1, DIRECT)
                self.chained = with_depth_range(self.nested, DIRECT + 1, NO_LIMIT)
            self.pilots = {}
            self.tally = Tally()

        def aov_names(self):
            return []

        def traverse(self, cb):
            cb.put("paths", self.nested, mi.ParamFlags.NonDifferentiable)

        def report(self):
            """What the chains did in all renders: lines of text."""
            return self.tally.lines()

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            spp = spp or sensor.sampler().sample_count()
            rng = np.random.default_rng(int(np.array(seed).ravel()[0]))
            paths = Paths(scene, sensor, self.chained)
            with dr.suspend_grad():
                picture = self.whole(paths, rng, spp)
            shape = (paths.height, paths.width, 3)
            return mi.TensorXf(picture.ravel().astype(np.float32), shape)

        def whole(self, paths, rng, spp):
            """The mean of a render, with all its light: (pixels, 3)."""
            pilot = self.pilot(paths)
            self.tally.handed_over = self.why_plain(pilot)
            if self.tally.handed_over:
                mean, *sums = self.plain(paths, self.nested, rng, spp)
                self.tally.add_uniform(spp * paths.pixels, *sums)
                return mean
            picture = self.picture(paths, pilot, rng, spp)
            if self.direct_samples:
                count = max(1, round(self.direct_samples * spp))
                self.tally.direct_samples += count
                picture += self.plain(paths, self.direct, rng, count)[0]
            return picture

        def why_plain(self, pilot):
            """Why a scene is left to plain sampling, in words; empty if it is not."""
            return "" if pilot.b else "the pilot found no light"

        def pilot(self, paths):
            # A pilot that no longer fits, as the scene has changed, is no error.
            name = (paths.sensor.ptr, paths.width, paths.height)
            if name not in self.pilots:
                self.pilots[name] = Pilot.of(paths)
            return self.pilots[name]

        def seeds(self, rng):
            """Seeds of the bootstrap and of the chains."""
            bootstrap, chains = (int(x) for x in rng.integers(2**31, size=2))
            return (bootstrap if self.resampling else 1), chains

        def boot(self, paths, pilot, seed, spp):
            """The bootstrap: `Samples`, and I of each half (2, count)."""
            count = max(FEWEST, round(self.bootstrap * spp * paths.pixels / 2))
            samples = uniform_samples(paths, count, seed)
            self.tally.add_samples(samples)
            target = samples.luminance * pilot.importance[samples.pixel]
            return samples, target.reshape(2, count)

        def plain(self, paths, integrator, rng, spp):
            """The picture of an integrator by plain sampling: see `pixel_means`."""
            paths = Paths(paths.scene, paths.sensor, integrator)
            return pixel_means(paths, spp, int(rng.integers(2**31)))

    return Metropolis
