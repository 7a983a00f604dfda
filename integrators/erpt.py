r"""Energy redistribution path tracing (``erpt``)
=============================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - (nested)
     - integrator
     - Sampling integrator that traces the paths, or ``bdpt``, as in ``pssmlt``. Required.
   * - ``length``
     - integer
     - Mutations of each chain, 1 or more. Long chains carry light further. Default: 512.
   * - ``bootstrap``
     - float
     - Paths traced per mutation, whose energy is redistributed; above 0. Default: 0.25.
   * - ``resampling``
     - boolean
     - Draw them anew for each render, instead of the same ones for all. Default: true.
   * - ``mutation``
     - string
     - Small steps: ``mixed``, ``kelemen``, ``lux`` or ``gaussian``, as in ``pssmlt``. Default:
       ``mixed``.
   * - ``mutation_size_min``, ``mutation_size_max``
     - float
     - Sizes of small steps, as in ``pssmlt``. Default: those of the mutation.
   * - ``direct_samples``
     - float
     - Independent samples per mutation that find direct light, as in ``pssmlt``. Default: 0.

Paths are traced as by the nested integrator, and chains of small steps start from them, more of
them from brighter ones; each chain deposits the same energy along its way, and by detailed balance
as much flows into any path as out of it. Here this happens in primary sample space, as in
``pssmlt``. There are no large steps: light moves between similar paths alone. The samples of a
pixel are its mutations, so that K = samples x pixels / length chains walk in a render.

**Estimate.** Of n paths with targets :math:`I_j` as in ``pssmlt``, path j gets
:math:`\lfloor u_j + I_j / e_d \rfloor` chains of the energy :math:`e_d = \sum I_j / K`, so
:math:`I_j` on average. The :math:`u_j` are those of a comb (systematic resampling), which makes
the number of chains K exactly. Given the paths this is unbiased, so it is unbiased, although
:math:`e_d` depends on them. Each step deposits :math:`e_d / length`, in shares a for the proposal
and 1 - a for the current path.

**Limits.** A very bright path that is hard to leave makes a bright spot. Nothing is done about it:
a limit of consecutive rejections, as in the paper's filters, would darken the picture.

**Source.** D. Cline, J. Talbot and P. Egbert, "Energy Redistribution Path Tracing", SIGGRAPH 2005.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'erpt', 'length': 1024, 'nested': {'type': 'path'}}
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from relume.integrators.markovchains import ChainParameters, run_chains
from relume.integrators.metropolis import effective_seeds, metropolis_class, systematic_resampling
from relume.parameters import Range, whole

RUNS_UNDER = ("polarized",)


def define() -> type[mi.AdjointIntegrator]:
    """Return the plugin's class for the variant in use."""

    Base: Any = metropolis_class(mi.variant())

    class ERPT(Base):
        def __init__(self, props):
            super().__init__(props)
            self.length = whole(props, "length", 512, Range(1))

        def render_chains(self, paths, pilot, rng, spp):
            """Render what the chains find: mean colours (pixels, 3)."""
            seeds = self.seeds(rng)
            chains = max(1, round(spp * paths.pixels / self.length))
            _, I = self.bootstrap_samples(paths, pilot, seeds[0], spp)
            if not I.any():
                return np.zeros((paths.pixels, 3))
            count = I.shape[1]
            start = systematic_resampling(I.ravel(), chains, rng.random())
            half, index = np.divmod(start, count)
            parameters = ChainParameters(self.length, 0.0, self.mutation, self.s1, self.s2)
            found = run_chains(paths, pilot.importance, index, half, count, seeds, parameters)
            self.statistics.add_chains(found, chains * self.length)
            self.statistics.seeds += effective_seeds(I.ravel(), chains)
            return found.film.sum(0) * (I.mean() * paths.pixels / (chains * self.length))

        def to_string(self):
            return f"ERPT[length={self.length}, {self.settings()}, {self.nested}]"

    return ERPT
