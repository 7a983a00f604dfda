r"""Makes shadow catchers work (``shadowcatching``)
===============================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - (nested)
     - integrator
     - Sampling integrator that renders the scene. Required.

The surfaces of the BSDF ``shadowcatcher`` trace rays of their own. This integrator gives them
access to the scene while the nested one is traced into a kernel; it changes nothing in scenes that
have none.

**Source.** Legacy manual, `shadow`; scene language section 11.7.

**Variants.** All.

**Usage.**

.. code-block:: python

    {'type': 'shadowcatching', 'nested': {'type': 'path'}}
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi

from relume.integrators.common import nesting, with_depth_range

RUNS_UNDER = ("scalar", "polarized")


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""
    Nesting: Any = nesting()

    class ShadowCatching(Nesting):
        def with_depth_range(self, min_depth, max_depth):
            nested = with_depth_range(self.nested, min_depth, max_depth)
            return mi.load_dict({"type": "shadowcatching", "nested": nested})

        def sample(self, scene, sampler, ray, medium=None, active=True):
            surfaces = [shape.bsdf() for shape in scene.shapes()]
            catchers = [bsdf for bsdf in surfaces if getattr(bsdf, "catches_shadows", False)]
            # Known only while the kernel is traced: a scene must not hold itself alive.
            for bsdf in catchers:
                bsdf.scene = scene
            try:
                return self.nested.sample(scene, sampler, ray, medium, active)
            finally:
                for bsdf in catchers:
                    bsdf.scene = None

        def to_string(self):
            return f"ShadowCatching[{self.nested}]"

    return ShadowCatching
