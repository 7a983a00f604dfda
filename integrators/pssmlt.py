r"""Metropolis light transport in primary sample space (``pssmlt``)
===============================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - (nested)
     - integrator
     - Sampling integrator that traces the paths, or ``bdpt``, which finds them from both ends.
       Required.
   * - ``bootstrap``
     - float
     - Uniform samples per mutation, from which chains start; above 0. They go to the picture, too.
       With few, single bright paths stand for much light. Default: 0.25.
   * - ``resampling``
     - boolean
     - Draw them anew for each render, instead of the same ones for all. Default: true.
   * - ``large_step_probability``
     - float
     - Probability of a proposal that is independent of the current path, in [0, 1]. Default: 0.3.
   * - ``mutation``
     - string
     - Small steps: ``kelemen``, where each number moves by a size of its own whose logarithm is
       uniform; ``mixed``, half of whose steps have one such size for all numbers; ``lux``, as in
       LuxRender; or ``gaussian``. Default: ``mixed``.
   * - ``mutation_size_min``, ``mutation_size_max``
     - float
     - Sizes of small steps in primary sample space, rising from above 0 to 0.5; ``gaussian`` has
       the standard deviation ``mutation_size_max``. Default: 1/2048 and 1/32 for ``mixed``, 1/1024
       and 1/64 for ``kelemen`` and ``gaussian``, 1/512 and 1/16 for ``lux``.
   * - ``chains``
     - integer
     - Number of Markov chains, 2 or more; fewer if a render has few mutations. Few long chains
       carry light further from where it was found than many short ones, but keep less of a machine
       busy. Default: 256, on a GPU 16384.
   * - ``direct_samples``
     - float
     - Independent samples per mutation, at least one per pixel, that find emitters and direct
       light; with 0 the chains do. The nested integrator must be able to render paths of a range
       of depths, as ``surfacepath`` and ``bdpt`` are. Default: 0.
   * - ``fallback``
     - boolean
     - Render scenes whose paths are all about equally bright by independent samples, or by
       ``bdpt`` itself. Default: true.

The nested integrator traces its paths from the numbers of Markov chains instead of independent
ones, so every material, light and medium that it knows is rendered. Paths that are hard to find
are explored once found. The samples of a pixel are its mutations.

Paths of ``bdpt`` are found in one way at a time, s vertices from the lamp and t from the camera,
drawn by a number of the chain (multiplexed Metropolis light transport); lamps that are seen
directly are left to independent samples.

The target is :math:`I = Y / m`: the luminance of a path over a blurred picture, which makes the
error relative to the brightness even over the picture (Veach's two-stage Metropolis). The blurred
picture and the first guess :math:`\hat b` of :math:`b = \int I` come from a pilot of uniform
samples, always the same; they change the error, never the mean.

**Estimate.** Uniform samples (the bootstrap and the large steps) have the weight
:math:`w_1 = c/(c + I)`, states of chains :math:`w_2 = I/(c + I)`, :math:`c = \hat b n_u / n_c` for
:math:`n_u` uniform samples and :math:`n_c` states: the balance heuristic, Kelemen's weights. A
picture of uniform samples needs no b. A picture of chains, B, is to be multiplied by it.

**No bias from b.** There are two halves h = 1, 2 with bootstrap and chains of their own. Seeds are
resampled from the bootstrap with probability in proportion to I. Then
:math:`E[b_h B_h] = \int w_2 f` exactly, after any number of steps, for the mean :math:`b_h` of I
over that very bootstrap: each bootstrap sample x adds :math:`I(x)\,g(x)/n`, where g(x) is what a
chain from x finds, and x is uniform; by stationarity :math:`\int I g = \int w_2 f`. A better
estimate, the mean over bootstrap and large steps, is not independent of :math:`B_h`, but it is of
:math:`B_{3-h}`. So a difference that has mean 0 is added: that of the mean :math:`t'_h` of
:math:`\min(I, T_h)` over bootstrap and large steps to the mean :math:`t_h` over the bootstrap.

.. math:: \tfrac12 \sum_h b_h B_h + (t'_h - t_h)\, B_{3-h}

has the mean of the first term, and as :math:`B_1 \approx B_2` almost the error that the better
estimate of b would give. Every render is unbiased by itself, and renders may be averaged in any
number.

Without the cap :math:`T_h`, pixels would be below 0 where the bootstrap of half h finds a path
that outshines all that the other found, for the factor of :math:`B_{3-h}` is
:math:`b_{3-h} + t'_h - t_h`. :math:`T_h = n\, b_{3-h} / 16`, n the samples of a bootstrap, knows
nothing of half h, so that the mean stays 0, and lets no single sample take more than a sixteenth
of that factor. It binds where a bootstrap has less than some 16 effective seeds.

**Limits.** Paths that bootstrap and large steps miss are missing, for all the chains: the picture
has the right mean over many renders, but one render can lack a caustic. Chains that stick to a
very bright path show as bright pixels.

**Source.** C. Kelemen, L. Szirmay-Kalos, G. Antal and F. Csonka, "A Simple and Robust Mutation
Strategy for the Metropolis Light Transport Algorithm", Computer Graphics Forum 2002; E. Veach and
L. Guibas, "Metropolis Light Transport", SIGGRAPH 1997 (two stages); T. Hachisuka, A. Kaplanyan and
C. Dachsbacher, "Multiplexed Metropolis Light Transport", ACM Transactions on Graphics 2014.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'pssmlt', 'large_step_probability': 0.3, 'nested': {'type': 'path'}}
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from relume.integrators.markovchains import ChainParameters, run_chains
from relume.integrators.metropolis import effective_seeds, metropolis_class, systematic_resampling
from relume.parameters import Range, flag, number, whole

RUNS_UNDER = ("polarized",)

MIN_CHAIN_LENGTH = 64
"""Least steps of a chain; short renders have fewer chains."""

MIN_SECOND_MOMENT = 12.0
"""Below this mean square of I over b², independent samples do better than chains."""

MAX_SHARE = 1 / 16
"""Most that one sample corrects b by, in units of b, so that 4 standard deviations stay above 0."""


def define() -> type[mi.AdjointIntegrator]:
    """Return the plugin's class for the variant in use."""

    Base: Any = metropolis_class(mi.variant())

    class PSSMLT(Base):
        def __init__(self, props):
            super().__init__(props)
            self.p_large = number(props, "large_step_probability", 0.3, Range(0.0, 1.0))
            self.chains = whole(props, "chains", 16384 if "cuda" in mi.variant() else 256, Range(2))
            self.fallback = flag(props, "fallback", True)

        def fallback_reason(self, pilot):
            reason = super().fallback_reason(pilot)
            if not reason and self.fallback and pilot.second_moment < MIN_SECOND_MOMENT:
                reason = "paths are about equally bright"
            return reason

        def render_chains(self, paths, pilot, rng, spp):
            """Render what the chains find: mean colours (pixels, 3)."""
            seeds = self.seeds(rng)
            mutations = spp * paths.pixels
            chains = min(self.chains, max(2, mutations // MIN_CHAIN_LENGTH)) // 2 * 2
            steps = max(1, round(mutations / chains))
            n_c = chains * steps
            samples, I = self.bootstrap_samples(paths, pilot, seeds[0], spp)
            count = I.shape[1]
            c = pilot.b * (I.size + self.p_large * n_c) / n_c

            # -------------------------- chains --------------------------

            index = [systematic_resampling(half, chains // 2, rng.random()) for half in I]
            which = np.repeat([0, 1], chains // 2)
            b = I.mean(1)
            caps = count * b[::-1] * MAX_SHARE
            kind = self.mutation, self.s1, self.s2
            parameters = ChainParameters(steps, self.p_large, *kind, c, tuple(caps))
            start = np.concatenate(index)
            found = run_chains(paths, pilot.importance, start, which, count, seeds, parameters)
            self.statistics.add_chains(found, n_c)
            self.statistics.seeds += sum(effective_seeds(half, chains // 2) for half in I)

            # -------------------------- picture --------------------------

            n_u = I.size + found.large_steps.sum()
            uniform = samples.film(c / (c + I.ravel()), paths.pixels) + found.film[0]
            B = found.film[1:] * (paths.pixels / (n_c / 2))
            large, target = (x.reshape(2, -1).sum(1) for x in (found.large_steps, found.target))
            capped = np.minimum(I, caps[:, None]).sum(1)
            correction = (capped + target) / (count + large) - capped / count
            chained = sum((b[h] + correction[1 - h]) * B[h] for h in (0, 1)) / 2
            return uniform * (paths.pixels / n_u) + chained

        def to_string(self):
            return (
                f"PSSMLT[{self.settings()}, large_step_probability={self.p_large}, "
                f"chains={self.chains}, fallback={self.fallback}, {self.nested}]"
            )

    return PSSMLT
