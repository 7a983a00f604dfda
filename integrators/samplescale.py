r"""Factor and limit of every sample (``samplescale``)
==================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - (nested)
     - integrator
     - Sampling integrator whose samples are changed, or ``bdpt``. Required.
   * - ``response``
     - float
     - Factor of the radiance :math:`k \ge 0`. Default: 1. Exposed.
   * - ``luminance_limit``
     - float
     - Largest luminance :math:`Y_{max}` of one sample before the factor; 0 for no limit. Default:
       0. Exposed.

A sample of radiance :math:`L` and luminance :math:`Y` becomes
:math:`k\,L\,\min(1, Y_{max} / Y)`. The limit removes fireflies and with them energy: the picture
is biased dark.

Of ``bdpt`` the whole picture is multiplied by :math:`k`, which is the same. It takes no limit:
light is found there as shares of several paths, and what light subpaths show falls on any pixel, so
that there is no sample that has all the light of a path of the camera and could be cut.

In spectral variants a sample knows its radiance at a few wavelengths :math:`\lambda_i` alone. Its
luminance is their mean, weighted by :math:`\bar y(\lambda_i) / p(\lambda_i)` for the density
:math:`p` of the wavelengths: that of an equal radiance at all wavelengths is exact, whatever they
are. A sample that carries its first wavelength alone, as dispersion leaves it, counts as white.

**Source.** Legacy manual, `luminance_cutoff`; scene language section 13.4, where a sample may add
at most `luminance_cutoff` to the average of a pixel, so :math:`Y_{max}` is that times the samples
per pixel.

**Variants.** All.

**Usage.**

.. code-block:: python

    {'type': 'samplescale', 'luminance_limit': 20.0, 'nested': {'type': 'path'}}
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.common import nesting, with_depth_range
from relume.parameters import NOT_NEGATIVE, check, expose, number, plain

RUNS_UNDER = ("scalar", "polarized")
NO_LIMIT_OF_PICTURES = "samplescale: luminance_limit bounds samples of rays, of which bdpt has none"
NO_SAMPLES = "samplescale: bdpt tells no radiance of single rays, and has no derivatives"
RANGES = {"response": NOT_NEGATIVE, "luminance_limit": NOT_NEGATIVE}


def luminance(L: mi.Spectrum, wavelengths: mi.Spectrum) -> mi.Float:
    """The luminance of samples.

    Args:
        L: their radiance.
        wavelengths: those of their rays [nm], in spectral variants.
    """
    L = mi.unpolarized_spectrum(L)
    if not mi.is_spectral:
        return mi.luminance(L, wavelengths)
    weight = dr.rcp(mi.pdf_rgb_spectrum(wavelengths))
    white = dr.maximum(mi.luminance(weight, wavelengths), 1e-30)
    known = mi.luminance(weight * L, wavelengths) / white
    others = dr.sum(dr.abs(L)) - dr.abs(L[0])
    return dr.select(others == 0, dr.mean(L), known)


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""
    Nesting: Any = nesting()

    class SampleScale(Nesting):
        capable = "takes_points"

        def __init__(self, props):
            super().__init__(props)
            self.response = mi.Float(number(props, "response", 1.0))
            self.luminance_limit = mi.Float(number(props, "luminance_limit", 0.0))
            self.takes_points = getattr(self.nested, "takes_points", False)
            self.parameters_changed([])

        def parameters_changed(self, keys):
            check(self, RANGES, keys)
            self.limited = plain(self.luminance_limit) > 0
            if self.limited and self.takes_points:
                raise ValueError(NO_LIMIT_OF_PICTURES)
            dr.make_opaque(self.response, self.luminance_limit)

        def with_depth_range(self, min_depth, max_depth):
            if self.limited:
                raise ValueError("samplescale: luminance_limit applies to all depths at once")
            nested = with_depth_range(self.nested, min_depth, max_depth)
            response = plain(self.response)
            return mi.load_dict({"type": "samplescale", "response": response, "nested": nested})

        @property
        def pass_index(self):
            return self.nested.pass_index

        @pass_index.setter
        def pass_index(self, index):
            self.nested.pass_index = index

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            if not self.takes_points:
                return super().render(scene, sensor, seed, spp, develop, evaluate)
            return self.nested.render_by(self.render_image, scene, sensor, seed, spp, develop)

        def render_image(self, *args, **kwargs):
            """Mean colours and alpha of a nested ``bdpt``, whose arguments these are."""
            picture = self.nested.render_image(*args, **kwargs)
            picture[:, :3] *= plain(self.response)
            return picture

        def traverse(self, cb):
            super().traverse(cb)
            expose(self, cb, tuple(RANGES))

        def sample(self, scene, sampler, ray, medium=None, active=True):
            if self.takes_points:
                raise ValueError(NO_SAMPLES)
            L, valid, aovs = self.nested.sample(scene, sampler, ray, medium, active)
            if self.limited:
                Y = luminance(L, ray.wavelengths)
                L *= dr.minimum(1, self.luminance_limit / dr.maximum(Y, 1e-30))
            return L * self.response, valid, aovs

        def to_string(self):
            return (
                f"SampleScale[response={self.response}, luminance_limit={self.luminance_limit}, "
                f"{self.nested}]"
            )

    return SampleScale
