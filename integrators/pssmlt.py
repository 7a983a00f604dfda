r"""Metropolis light transport in primary sample space (`pssmlt`)
=============================================================

.. list-table::
   * - Parameter, type
     - Description
   * - (nested): integrator
     - Sampling integrator that traces the paths.
   * - bootstrap: float
     - Uniform samples of a pixel in each render, from which chains start; above 0. They go to the
       picture, too. (Default: 1)
   * - resampling: boolean
     - Draw them anew for each render, or the same ones for all. (Default: true)
   * - large_step_probability: float
     - Probability of a proposal that is independent of the current path, 0 to 1. (Default: 0.3)
   * - mutation: string
     - Small steps: ``kelemen``, whose size has a uniform logarithm; ``lux``, as in LuxRender; or
       ``gaussian``. (Default: ``kelemen``)
   * - mutation_size_min, mutation_size_max: float
     - Sizes of small steps in primary sample space; ``gaussian`` has the standard deviation
       ``mutation_size_max``. (Defaults: 1/1024 and 1/64; ``lux``: 1/512 and 1/16)
   * - chains: integer
     - Number of Markov chains, 2 or more; fewer if a render has few mutations. (Default: 8192)
   * - hand_over: boolean
     - Leave scenes whose paths are all about equally bright to plain sampling. (Default: true)

The nested integrator traces its paths from the numbers of Markov chains instead of independent ones
(Kelemen et al., "A Simple and Robust Mutation Strategy for the Metropolis Light Transport
Algorithm", 2002), so every material, light and medium that it knows is rendered. Paths that are hard
to find are explored once found. The samples of a pixel are its mutations.

The target is :math:`I = Y / m`: the luminance of a path over a blurred picture, which makes the error
relative to the brightness even over the picture (Veach's two-stage Metropolis). The blurred picture
and the first guess :math:`\hat b` of :math:`b = \int I` come from a pilot of uniform samples, always
the same; they change the error, never the mean.

**Estimate.** Uniform samples (the bootstrap and the large steps) have the weight
:math:`w_1 = c/(c + I)`, states of chains :math:`w_2 = I/(c + I)`, :math:`c = \hat b n_u / n_c` for
:math:`n_u` uniform samples and :math:`n_c` states: the balance heuristic, Kelemen's weights. A
picture of uniform samples needs no b. A picture of chains, :math:`B`, is to be multiplied by it.

**No bias from b.** There are two halves h = 1, 2 with bootstrap and chains of their own. Seeds are
resampled from the bootstrap with probability in proportion to I. Then :math:`E[b_h B_h] = \int w_2 f`
exactly, after any number of steps, for the mean :math:`b_h` of I over that very bootstrap: each
bootstrap sample x adds :math:`I(x)\,g(x)/n`, where g(x) is what a chain from x finds, and x is
uniform. A better estimate :math:`b'_h`, the mean over bootstrap and large steps, would be no longer
independent of :math:`B_h`; but it is of :math:`B_{3-h}`, and :math:`E[b'_h - b_h] = 0`, so

.. math:: \tfrac12 \sum_h b_h B_h + (b'_h - b_h)\, B_{3-h}

has the same mean, and as :math:`B_1 \approx B_2` almost the error of :math:`(b'_1 + b'_2)/2`. Every
render is unbiased by itself, and renders may be averaged in any number.

**Limits.** Paths that bootstrap and large steps miss are missing, for all the chains: the picture
has the right mean over many renders, but one render can lack a caustic. Chains that stick to a very
bright path show as bright pixels; `docs/metropolis.md` tells how many.

.. code-block:: python

    {"type": "pssmlt", "large_step_probability": 0.3, "nested": {"type": "path"}}
"""

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from integrators.common import nested_integrator
from integrators.metropolis import Walk, uniform_samples, walk_chains
from integrators.primarysamples import MUTATIONS, Paths
from registration import on_every_variant

PILOT = 2**15
"""Uniform samples of each half of the pilot."""

SHORTEST = 16
"""A chain walks at least as many steps, or there are fewer chains."""

CALM = 12.0
"""Below this mean square of I over b², plain sampling is left to do the work."""


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
        rough = blurred(picture.reshape(shape), sigma) / blurred(hits.reshape(shape), sigma)
        m = np.sqrt(rough**2 + 0.01 * mean**2)
        importance = (m.mean() / m).ravel().astype(np.float32)
        I = Y * importance[samples.pixel]
        return cls(importance, I.mean(), np.mean(I**2) / I.mean() ** 2)


def blurred(picture, sigma):
    """A picture (height, width) under a Gaussian of `sigma` pixels, continued by its edges."""
    radius = int(np.ceil(3 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    for _ in range(2):
        wide = np.pad(picture, ((0, 0), (radius, radius)), mode="edge")
        rows = [np.convolve(row, kernel, "valid") for row in wide]
        picture = np.array(rows).T
    return picture


def resampled(I, chains, u):
    """Indices of seeds of `chains` chains, each chosen with probability in proportion to I (n,).

    Args:
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
        self.handed_over = False

    def add_uniform(self, n, Y, YY):
        self.uniform, self.Y, self.YY = self.uniform + n, self.Y + Y, self.YY + YY

    def lines(self):
        """The report, line by line."""
        if not self.uniform:
            return []
        b = self.Y / self.uniform
        error = np.sqrt(max(self.YY / self.uniform - b * b, 0) / self.uniform)
        lines = [f"mean luminance b = {b:.5g}, standard error {error:.2g}"]
        if self.handed_over:
            return [*lines, "paths are about equally bright: rendered by plain sampling"]
        small = self.accepted_small / max(self.small, 1)
        large = self.accepted_large / max(self.large, 1)
        return [
            *lines,
            f"accepted: {small:.1%} of small steps, {large:.1%} of large steps;"
            f" longest run of rejections {self.longest:.0f}",
            f"chains from {self.seeds:.0f} effective seeds",
        ]


def define():
    """Define and register the plugin under the variant in use."""

    class PSSMLT(mi.AdjointIntegrator):
        def __init__(self, props):
            mi.AdjointIntegrator.__init__(self, props)
            self.nested = nested_integrator(props)
            self.bootstrap = props.get("bootstrap", 1.0)
            self.resampling = props.get("resampling", True)
            self.p_large = props.get("large_step_probability", 0.3)
            self.mutation = props.get("mutation", "kelemen")
            self.chains = props.get("chains", 8192)
            self.hand_over = props.get("hand_over", True)
            if self.bootstrap <= 0:
                raise ValueError(f"bootstrap is {self.bootstrap}, but must be above 0")
            if not 0 <= self.p_large <= 1:
                raise ValueError(f"large_step_probability is {self.p_large}, not from 0 to 1")
            if self.chains < 2:
                raise ValueError(f"chains is {self.chains}, but must be 2 or more")
            self.s1, self.s2 = mutation_sizes(self.mutation, props)
            self.pilots = {}
            self.tally = Tally()

        def aov_names(self):
            return []

        def traverse(self, cb):
            cb.put("nested", self.nested, mi.ParamFlags.NonDifferentiable)

        def report(self):
            return self.tally.lines()

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            spp = spp or sensor.sampler().sample_count()
            seed = int(np.array(seed).ravel()[0])
            with dr.suspend_grad():
                paths = Paths(scene, sensor, self.nested)
                picture = self.picture(paths, self.pilot(paths), seed, spp)
            shape = (paths.height, paths.width, 3)
            return mi.TensorXf(picture.ravel().astype(np.float32), shape)

        def pilot(self, paths):
            # A pilot that no longer fits, as the scene has changed, is no error.
            name = (paths.sensor.ptr, paths.width, paths.height)
            if name not in self.pilots:
                self.pilots[name] = Pilot.of(paths)
            return self.pilots[name]

        def picture(self, paths, pilot, seed, spp):
            """The mean of a render: (pixels, 3)."""
            rng = np.random.default_rng(seed)
            seeds = [int(x) for x in rng.integers(2**31, size=2)]
            if pilot.b == 0 or (self.hand_over and pilot.spread < CALM):
                return self.plain(paths, seeds[0], spp)
            chains = min(self.chains, max(2, spp * paths.pixels // SHORTEST)) // 2 * 2
            steps = max(1, round(spp * paths.pixels / chains))
            count = max(1, round(self.bootstrap * paths.pixels / 2))
            if not self.resampling:
                seeds[0] = 1
            n_c = chains * steps
            c = pilot.b * (2 * count + self.p_large * n_c) / n_c

            # -------------------------- bootstrap --------------------------

            samples = uniform_samples(paths, count, seeds[0])
            Y = samples.luminance
            I = Y * pilot.importance[samples.pixel]
            self.tally.add_uniform(len(Y), Y.sum(), np.sum(Y * Y))
            halves = I.reshape(2, count)
            b = halves.mean(1)
            index = [resampled(half, chains // 2, rng.random()) for half in halves]
            self.tally.seeds += sum(effective(half, chains // 2) for half in halves)

            # -------------------------- chains --------------------------

            walk = Walk(steps, self.p_large, self.mutation, self.s1, self.s2, c)
            which = np.repeat([0, 1], chains // 2)
            walked = walk_chains(
                paths, pilot.importance, np.concatenate(index), which, count, seeds, walk
            )
            self.account(walked, n_c)

            # -------------------------- picture --------------------------

            n_u = len(Y) + walked.large.sum()
            A = (samples.film(c / (c + I), paths.pixels) + walked.film[0]) * (paths.pixels / n_u)
            B = walked.film[1:] * (paths.pixels / (n_c / 2))
            large, target = (x.reshape(2, -1).sum(1) for x in (walked.large, walked.target))
            better = (b * count + target) / (count + large)
            return A + 0.5 * sum(b[h] * B[h] + (better[h] - b[h]) * B[1 - h] for h in (0, 1))

        def plain(self, paths, seed, spp):
            """The mean of plain samples: (pixels, 3)."""
            count = max(1, spp * paths.pixels // 2)
            samples = uniform_samples(paths, count, seed)
            Y = samples.luminance
            self.tally.add_uniform(len(Y), Y.sum(), np.sum(Y * Y))
            self.tally.handed_over = True
            return samples.film(np.ones(len(Y)), paths.pixels) * (paths.pixels / len(Y))

        def account(self, walked, mutations):
            t, large = self.tally, walked.large.sum()
            t.add_uniform(large, walked.luminance.sum(), walked.squared.sum())
            t.large += large
            t.small += mutations - large
            t.accepted_large += walked.accepted_large.sum()
            t.accepted_small += walked.accepted_small.sum()
            t.longest = max(t.longest, walked.longest.max())

        def to_string(self):
            return f"PSSMLT[{self.mutation}, {self.nested}]"

    mi.register_integrator("pssmlt", PSSMLT)


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


on_every_variant(define)
