r"""Sun inside a dome (``domesun``)
================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``direction``
     - vector
     - Where the light goes, of any length above 0. Default: 0, 0, 1.
   * - ``irradiance``
     - spectrum or texture
     - On a plane perpendicular to the light. Default: 1. Differentiable.
   * - ``center``
     - point
     - Centre :math:`c` of the ball in which it shines. Default: 0, 0, 0.
   * - ``radius``
     - float
     - Radius :math:`R` of the ball, above 0. Default: 1.

The stock ``directional`` light, but with its source on the inside of a sphere: each point :math:`x`
within the ball sees it in the direction :math:`-D`, :math:`|D| = 1`, at the distance

.. math::
    \tau = \langle x - c, D \rangle + \sqrt{\langle x - c, D \rangle^2 + R^2 - |x - c|^2}

less a part in ten thousand of the radius. What lies on the sphere or beyond it casts no shadow, so
that the sun shines through an ``ibldome`` of the same centre and radius. Points outside the ball
are not lit.

**Source.** Scene language sections 9.4 and 11.5: an infinity light passes image-based lights.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'domesun', 'direction': [0, -1, 0], 'center': [0, 0, 0], 'radius': 600,
     'irradiance': {'type': 'rgb', 'value': 3.0}}

.. code-block:: xml

    <emitter type="domesun">
        <vector name="direction" x="0" y="-1" z="0"/>
        <point name="center" x="0" y="0" z="0"/>
        <float name="radius" value="600"/>
        <rgb name="irradiance" value="3"/>
    </emitter>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.emitters.common import delta_sample, sample_spectrum, spectrum_lookup, unit
from relume.parameters import POSITIVE, number, vector

RUNS_UNDER = ("polarized",)

MARGIN = 1e-4
"""How far inside the sphere the source lies, in units of the radius."""


def define() -> type[mi.Emitter]:
    """Return the plugin's class for the variant in use."""

    class DomeSun(mi.Emitter):
        def __init__(self, props):
            mi.Emitter.__init__(self, props)
            self.m_flags = mi.EmitterFlags.DeltaDirection
            direction = unit(vector(props, "direction", (0, 0, 1)), "direction")
            center = vector(props, "center", (0, 0, 0))
            radius = number(props, "radius", 1.0, POSITIVE)
            self.irradiance = props.get_emissive_texture("irradiance", 1.0)
            self.direction = mi.Vector3f(*direction.tolist())
            self.center = mi.Point3f(*center.tolist())
            self.radius = mi.Float(radius)
            low, high = (center - radius).tolist(), (center + radius).tolist()
            self.box = mi.ScalarBoundingBox3f(mi.ScalarPoint3f(*low), mi.ScalarPoint3f(*high))
            dr.make_opaque(self.direction, self.center, self.radius)

        def _irradiance(self, it, active):
            """Irradiance at `it` perpendicular to the light, and the distance of its source."""
            x = it.p - self.center
            b, c = dr.dot(x, self.direction), dr.square(self.radius) - dr.squared_norm(x)
            tau = b + dr.sqrt(dr.maximum(dr.fma(b, b, c), 0)) - MARGIN * self.radius
            lit = active & (c > 0) & (tau > 0)
            si = spectrum_lookup(it.p, mi.Point2f(0), it.time, it.wavelengths)
            return mi.depolarizer(dr.select(lit, self.irradiance.eval(si, lit), 0)), tau, lit

        def sample_direction(self, it, sample, active=True):
            value, tau, lit = self._irradiance(it, active)
            d = self.direction
            p = dr.fma(-tau, d, it.p)
            ds = delta_sample(self, it, p, mi.Normal3f(d), mi.Point2f(0), -d, tau)
            ds.pdf = dr.select(lit, mi.Float(1), 0)
            return ds, value

        def eval_direction(self, it, ds, active=True):
            return self._irradiance(it, active)[0]

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0)

        def _point(self, sample):
            """A point of the inside, whose projection along the light is uniform on a disk."""
            disk = mi.warp.square_to_uniform_disk_concentric(sample)
            height = dr.sqrt(dr.maximum(1 - dr.squared_norm(disk), 0))
            v = mi.Frame3f(self.direction).to_world(mi.Vector3f(disk.x, disk.y, -height))
            return dr.fma((1 - MARGIN) * self.radius, v, self.center)

        def sample_position(self, time, sample, active=True):
            ps = dr.zeros(mi.PositionSample3f)
            ps.p, ps.n, ps.time = self._point(sample), mi.Normal3f(self.direction), time
            area = dr.pi * dr.square(self.radius)
            ps.pdf = dr.rcp(area)
            return ps, area

        def sample_ray(self, time, sample1, sample2, sample3, active=True):
            p = self._point(sample2)
            si = spectrum_lookup(p, mi.Point2f(0), time)
            wavelengths, weight = sample_spectrum(self.irradiance, si, sample1, active)
            ray = mi.Ray3f(p, self.direction, time, wavelengths)
            return ray, mi.depolarizer(weight * dr.pi * dr.square(self.radius))

        def sample_wavelengths(self, si, sample, active=True):
            return sample_spectrum(self.irradiance, si, sample, active)

        def eval(self, si, active=True):
            return mi.Spectrum(0)

        def bbox(self):
            return self.box

        def traverse(self, cb):
            super().traverse(cb)
            cb.put("irradiance", self.irradiance, mi.ParamFlags.Differentiable)

        def to_string(self):
            return (
                f"DomeSun[direction = {self.direction}, center = {self.center}, "
                f"radius = {self.radius}, irradiance = {self.irradiance}]"
            )

    return DomeSun
