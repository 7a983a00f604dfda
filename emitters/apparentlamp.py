r"""Lamp that looks otherwise than it shines (``apparentlamp``)
===========================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``radiance``
     - spectrum or texture
     - :math:`L_e`, 0 or more. Default: 1. Differentiable.
   * - ``origin``
     - point
     - A corner :math:`o` of the parallelogram that gives light [scene unit]. Default: 0, 0, 0.
   * - ``edge_u``, ``edge_v``
     - vector
     - Its edges :math:`U, V` [scene unit]; light leaves on the side of :math:`U \times V`. Without
       them nothing is lit. Default: 0, 0, 0.
   * - ``two_sided``
     - boolean
     - Whether the shape is seen to shine on both sides instead of that of its normal.
       Default: false.
   * - ``backdrop``
     - boolean
     - Whether ``surfacepath`` takes the shape for one that is not lit where it is seen. Default:
       false.

Attached to a shape, the emitter makes it shine for the camera and for what is seen in perfect
mirrors and in glass. Other surfaces get no light from the shape, but from the parallelogram, which
is not seen and hides nothing:

.. math::
    E = \int_0^1\!\!\int_0^1 L_e\,
        \frac{\cos\vartheta\,\cos\vartheta'}{|o + s U + t V - x|^2}\,|U \times V|\,ds\,dt

with the cosines at the lit point :math:`x` and at the lamp. So lamps were in the original renderer
under next event estimation, where a lamp's edges were squared for the eye alone. Its density per
solid angle is too large to compare: hits of a shape by BSDF sampling then weigh nothing against
emitter samples, as multiple importance sampling weighs them.

**Source.** Scene language sections 6.2 and 9.2.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'rectangle',
     'light': {'type': 'apparentlamp', 'origin': [-1, -1, 0], 'edge_u': [1, 0, 0],
               'edge_v': [0, 1, 0], 'radiance': {'type': 'rgb', 'value': [5, 4, 3]}}}

.. code-block:: xml

    <shape type="rectangle">
        <emitter type="apparentlamp">
            <vector name="edge_u" x="1" y="0" z="0"/>
            <vector name="edge_v" x="0" y="1" z="0"/>
            <rgb name="radiance" value="5, 4, 3"/>
        </emitter>
    </shape>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.emitters.common import (
    delta_sample,
    sample_spectrum,
    sample_surface_ray,
    spectrum_lookup,
)
from relume.parameters import flag, vector

RUNS_UNDER = ("polarized",)

INCOMPARABLE = 1e15
"""Density that any other is small against, and whose square is finite."""


def define() -> type[mi.Emitter]:
    """Return the plugin's class for the variant in use."""

    class ApparentLamp(mi.Emitter):
        def __init__(self, props):
            mi.Emitter.__init__(self, props)
            if "to_world" in props:
                raise ValueError("apparentlamp: the shape has the transform, not the light")
            self.m_flags = mi.EmitterFlags.Surface
            self.radiance = props.get_emissive_texture("radiance", 1.0)
            self.two_sided = flag(props, "two_sided", False)
            self.backdrop = flag(props, "backdrop", False)
            u, v = vector(props, "edge_u", (0, 0, 0)), vector(props, "edge_v", (0, 0, 0))
            across = np.cross(u, v)
            area = float(np.linalg.norm(across))
            self.lights = area > 0
            if self.lights and self.radiance.is_spatially_varying():
                raise ValueError("apparentlamp: the radiance of what gives light must not vary")
            n = across / area if self.lights else np.array([0.0, 0.0, 1.0])
            self.origin = mi.Point3f(*vector(props, "origin", (0, 0, 0)).tolist())
            self.u, self.v, self.n = (mi.Vector3f(*x.tolist()) for x in (u, v, n))
            self.area = mi.Float(area)
            dr.make_opaque(self.origin, self.u, self.v, self.n, self.area)

        def _point(self, sample):
            return self.origin + self.u * sample.x + self.v * sample.y

        def _irradiance(self, it, p, d, dist, active):
            """What a point of the parallelogram gives, times its area."""
            cos = dr.maximum(-dr.dot(d, self.n), 0.0)
            si = spectrum_lookup(p, mi.Point2f(0.5), it.time, it.wavelengths)
            weight = cos * self.area / dr.square(dist)
            value = self.radiance.eval(si, active) * dr.select(active & (dist > 0), weight, 0.0)
            return mi.depolarizer(value)

        def sample_direction(self, it, sample, active=True):
            if not self.lights:
                return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0.0)
            p = self._point(mi.Point2f(sample))
            d = p - it.p
            dist = dr.norm(d)
            d *= dr.rcp(dist)
            ds = delta_sample(self, it, p, mi.Normal3f(self.n), mi.Point2f(sample), d, dist)
            return ds, self._irradiance(it, p, d, dist, mi.Mask(active))

        def eval_direction(self, it, ds, active=True):
            if not self.lights:
                return mi.Spectrum(0.0)
            return self._irradiance(it, ds.p, ds.d, ds.dist, mi.Mask(active))

        def pdf_direction(self, it, ds, active=True):
            return dr.select(active, mi.Float(INCOMPARABLE), 0.0)

        def eval(self, si, active=True):
            shows = active if self.two_sided else active & (si.wi.z > 0.0)
            return mi.depolarizer(dr.select(shows, self.radiance.eval(si, shows), 0.0))

        def sample_position(self, time, sample, active=True):
            ps = dr.zeros(mi.PositionSample3f)
            ps.p, ps.n, ps.uv = self._point(sample), mi.Normal3f(self.n), mi.Point2f(sample)
            ps.time, ps.pdf = time, dr.select(self.area > 0, dr.rcp(self.area), 0.0)
            return ps, self.area

        def sample_wavelengths(self, si, sample, active=True):
            return sample_spectrum(self.radiance, si, sample, active)

        def sample_ray(self, time, sample1, sample2, sample3, active=True):
            return sample_surface_ray(self, time, sample1, sample2, sample3, active)

        def bbox(self):
            return self.get_shape().bbox()

        def traverse(self, cb):
            super().traverse(cb)
            cb.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self):
            return (
                f"ApparentLamp[radiance = {self.radiance}, origin = {self.origin}, "
                f"edge_u = {self.u}, edge_v = {self.v}, two_sided = {self.two_sided}, "
                f"backdrop = {self.backdrop}]"
            )

    return ApparentLamp
