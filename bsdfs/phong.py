r"""Phong's reflection, energy conserving (``phong``)
=================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``diffuse_reflectance``
     - spectrum or texture
     - :math:`\rho_d`, the Lambertian part. Default: 0.5. Differentiable.
   * - ``specular_reflectance``
     - spectrum or texture
     - :math:`\rho_s`, weight of the lobe. Default: 0.2. Differentiable.
   * - ``exponent``
     - float or texture
     - :math:`n`, 0 or more. Default: 30. Differentiable.

With :math:`\alpha` the angle between the mirror direction of the viewer and the direction to the
light, the BRDF is

.. math::
    f = \frac{\rho_d}{\pi} + \rho_s \frac{n + 2}{2 \pi} \max(0, \cos\alpha)^n

The lobe is reciprocal, and its albedo is at most 1 for :math:`\rho_s = 1`: 1 at normal incidence,
less towards grazing angles, where part of the lobe lies below the surface. The material is
one-sided; wrap it in ``twosided`` for surfaces that are seen from both sides.

The lobe is sampled about the mirror direction with :math:`\phi = 2 \pi \xi_1` and
:math:`\alpha = \arccos \xi_2^{1/(n+1)}`; the weights are
:math:`\rho_s \cos\theta_o (n + 2) / (n + 1)`.

**Source.** E. Lafortune and Y. Willems, "Using the Modified Phong Reflectance Model for Physically
Based Rendering", Leuven CW 197, 1994.

**Variants.** All; light is depolarized.

**Usage.**

.. code-block:: python

    {'type': 'phong', 'diffuse_reflectance': 0.3, 'specular_reflectance': 0.7, 'exponent': 5}

.. code-block:: xml

    <bsdf type="phong">
        <rgb name="diffuse_reflectance" value="0.3"/>
        <rgb name="specular_reflectance" value="0.7"/>
        <float name="exponent" value="5"/>
    </bsdf>
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.bsdfs.common import diffuse_plus_lobe, polar
from relume.parameters import NOT_NEGATIVE

RUNS_UNDER = ("scalar", "polarized")
RANGES = {"exponent": NOT_NEGATIVE}


def log1m(q: mi.Float) -> mi.Float:
    """Return ln(1 - q) for 0 <= q < 1 to the last bits, also where q is tiny.

    1 - q would round q away; for q < 1/4 the series of -2 artanh(q / (2 - q)) does not.
    """
    z = q / (2 - q)
    z2 = z * z
    series = -2 * z * dr.fma(z2, dr.fma(z2, dr.fma(z2, 1 / 7, 1 / 5), 1 / 3), 1)
    return dr.select(q < 0.25, series, dr.log(1 - q))


def define() -> type[mi.BSDF]:
    """Return the plugin's class for the variant in use."""

    Base: Any = diffuse_plus_lobe()

    class Phong(Base):
        ranges = RANGES

        def __init__(self, props):
            super().__init__(props)
            self.exponent = props.get_unbounded_texture("exponent", 30)
            self.set_lobes((self.exponent,))
            self.parameters_changed([])

        def shape(self, si, active):
            return dr.maximum(self.exponent.eval_1(si, active), 0)

        def lobe(self, n, wi, wo):
            # 1 - cos alpha = |o - r|^2 / 2 with r the mirror direction: free of the cancellation
            # that 1 - (o . r) suffers in float32, which the power n would multiply.
            d = mi.Vector3f(wo.x + wi.x, wo.y + wi.y, wo.z - wi.z)
            q = 0.5 * dr.squared_norm(d)
            inside = q < 1
            power = dr.exp(n * log1m(dr.select(inside, q, 0))) * dr.inv_two_pi
            power = dr.select(inside, power, 0)
            return (n + 2) * power * wo.z, (n + 1) * power

        def sample_lobe(self, n, wi, sample):
            # 1 - xi is as uniform as xi and, on a computer, never 0.
            cos_alpha = dr.power(1 - sample.y, dr.rcp(n + 1))
            x, y = polar(dr.safe_sqrt(1 - cos_alpha * cos_alpha), dr.two_pi * sample.x)
            mirror = mi.Frame3f(mi.Vector3f(-wi.x, -wi.y, wi.z))
            return mirror.to_world(mi.Vector3f(x, y, cos_alpha))

        def to_string(self):
            return (
                f"Phong[diffuse_reflectance={self.diffuse_reflectance}, "
                f"specular_reflectance={self.specular_reflectance}, exponent={self.exponent}]"
            )

    return Phong
