r"""Colours in the sight of a moving camera (``dopplershift``)
==========================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``velocity``
     - vector
     - Velocity v of the camera in the world, of a length below 1 [speed of light]. Default:
       0, 0, 0. Exposed.
   * - ``share``
     - float
     - Share s of the shift of colours in variants that render RGB, in [0, 1]; the rest is beaming.
       Default: 1. Exposed.
   * - (nested)
     - integrator
     - Sampling integrator that renders the scene. Required.

A camera that moves with v sees the frequencies of light that comes from the direction d' of the
world multiplied by

.. math:: D = \gamma (1 + d' \cdot v), \qquad \gamma = 1 / \sqrt{1 - v^2}.

In spectral variants the radiance at the wavelength :math:`\lambda` is then
:math:`D^5 L(D \lambda)`, exactly. In those that render RGB it is

.. math:: s\,S(L) + (1 - s)\,D^4 L,

in which S takes the channels for lines of 700, 546.1 and 435.8 nm, moves them, by the share s of D,
and gives them to the primaries by Gauss functions of 100 nm, which mixes channels even at rest.
Monochromatic ones have the second part alone. Directions are left to ``relativisticcamera``, whose
velocity is to be the same.

**Source.** G. Rybicki and A. Lightman, "Radiative Processes in Astrophysics", 1979, section 4.9.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'dopplershift', 'velocity': [0.5, 0.0, 0.0], 'nested': {'type': 'path'}}
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.integrators.common import nesting
from relume.parameters import Range, check, expose, number, vector
from relume.sensors.doppler import check_velocity, doppler_factor, shifted

SHARE = Range(0, 1)


def define() -> type[mi.SamplingIntegrator]:
    """Return the plugin's class for the variant in use."""
    Nesting: Any = nesting()

    class DopplerShift(Nesting):
        def __init__(self, props):
            super().__init__(props)
            self.velocity = mi.Vector3f(*vector(props, "velocity", (0, 0, 0)).tolist())
            self.share = mi.Float(number(props, "share", 1.0))
            self.parameters_changed([])

        def parameters_changed(self, keys):
            check_velocity(self.velocity)
            check(self, {"share": SHARE}, keys)
            dr.make_opaque(self.velocity, self.share)

        def traverse(self, cb):
            super().traverse(cb)
            expose(self, cb, ("velocity", "share"))

        def sample(self, scene, sampler, ray, medium=None, active=True):
            D = doppler_factor(ray.d, self.velocity)
            beaming = dr.square(dr.square(D))
            if mi.is_spectral:
                ray = mi.RayDifferential3f(ray)
                ray.wavelengths *= D
                beaming *= D
            L, valid, aovs = self.nested.sample(scene, sampler, ray, medium, active)
            L = shifted(mi.Color3f(L), D, self.share) if mi.is_rgb else L * beaming
            return L, valid, aovs

        def to_string(self):
            return (
                f"DopplerShift[velocity={self.velocity}, share={self.share}, nested={self.nested}]"
            )

    return DopplerShift
