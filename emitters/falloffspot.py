r"""Spot light with an inner cone, an exponent and polynomial attenuation (``falloffspot``)
=======================================================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``position``
     - point
     - Place of the light. Default: 0, 0, 0. Exposed.
   * - ``direction``
     - vector
     - Axis of the cone, of any length above 0. Default: 0, -1, 0. Differentiable.
   * - ``intensity``
     - spectrum
     - Radiant intensity :math:`I` on the axis. Default: 1. Differentiable.
   * - ``cutoff_angle``
     - float
     - Half angle :math:`w` of the cone, in (0, 180] [degrees]. Default: 30. Differentiable.
   * - ``falloff_angle``
     - float
     - Width :math:`f` of the rim, in [0, w] [degrees]. Default: 5. Differentiable.
   * - ``falloff_exponent``
     - float
     - Exponent :math:`p \ge 0` of the rim's ramp. Default: 2. Differentiable.
   * - ``attenuation``
     - vector
     - :math:`a, b, c \ge 0` of the attenuation. Default: 0, 0, 1. Differentiable.
   * - ``to_world``
     - transform
     - Applied to ``position`` and ``direction``. Default: none.

A surface that faces the light at the distance :math:`d` and at the angle :math:`\vartheta` from
the axis receives the irradiance

.. math::
    E = I \, \frac{r(\vartheta)}{t}, \qquad t = a + b\,d + c\,d^2, \qquad
    r(\vartheta) = \left(\frac{\cos\vartheta - \cos w}{\cos(w - f) - \cos w}\right)^p

with :math:`r = 1` inside :math:`w - f` and :math:`r = 0` outside :math:`w`. Where :math:`t` falls
below :math:`10^{-3}` there is no attenuation (:math:`t = 1`); 0, 0, 0 thus switches it off. The
ramp has a hard edge at :math:`w` when :math:`p = 0` or :math:`f = 0`. With 0, 0, 1 the plugin is
an ordinary point source of intensity :math:`I\,r`. The ramp is linear in the cosine, that of the
stock ``spot`` in the angle.

Particles (``sample_ray``, as ``ptracer`` uses it) carry a power that does not depend on how far
they will fly. They can thus only follow the inverse square law: unless ``attenuation`` is 0, 0, c
with :math:`c > 0`, the light emits no particles and a warning says so. (No exception: Dr.Jit
traces every light that is alive, also those of other scenes.)

**Source.** Legacy manual, "Spot light source", where :math:`I` is :math:`\pi` times the emission
of the object.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'falloffspot', 'position': [0, 5, 0], 'direction': [0, -1, 0],
     'cutoff_angle': 20.0, 'falloff_angle': 10.0, 'falloff_exponent': 0.0,
     'attenuation': [0, 1, 0], 'intensity': {'type': 'rgb', 'value': [30, 28, 25]}}

.. code-block:: xml

    <emitter type="falloffspot">
        <point name="position" x="0" y="5" z="0"/>
        <vector name="direction" x="0" y="-1" z="0"/>
        <float name="cutoff_angle" value="20"/>
        <vector name="attenuation" x="0" y="1" z="0"/>
        <rgb name="intensity" value="30, 28, 25"/>
    </emitter>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.emitters.common import delta_sample, sample_spectrum, spectrum_lookup, unit
from relume.parameters import ANY, NOT_NEGATIVE, Range, check, number, plain, vector

RUNS_UNDER = ("polarized",)

NO_ATTENUATION_BELOW = 1e-3

NARROW = 1e-3
"""Width of a rim, in cosines, below which it is told in double precision."""

RANGES = {
    "position": ANY,
    "direction": ANY,
    "cutoff_angle": Range(0.0, 180.0, above=True),
    "falloff_exponent": NOT_NEGATIVE,
    "attenuation": NOT_NEGATIVE,
}


def define() -> type[mi.Emitter]:
    """Return the plugin's class for the variant in use."""

    class FalloffSpot(mi.Emitter):
        def __init__(self, props):
            mi.Emitter.__init__(self, props)
            self.m_flags = mi.EmitterFlags.DeltaPosition
            to_world = np.array(props.get("to_world", mi.ScalarTransform4d()).matrix)
            position = to_world @ np.append(vector(props, "position", (0, 0, 0)), 1.0)
            direction = to_world[:3, :3] @ vector(props, "direction", (0, -1, 0))
            self.position = mi.Point3f(*position[:3].tolist())
            self.direction = mi.Vector3f(*unit(direction, "direction").tolist())
            self.intensity = props.get_emissive_texture("intensity", 1.0)
            self.cutoff_angle = mi.Float(number(props, "cutoff_angle", 30.0))
            self.falloff_angle = mi.Float(number(props, "falloff_angle", 5.0))
            self.falloff_exponent = mi.Float(number(props, "falloff_exponent", 2.0))
            self.attenuation = mi.Vector3f(*vector(props, "attenuation", (0, 0, 1)).tolist())
            self._check()
            self._derive()

        def _check(self):
            check(self, RANGES)
            Range(0.0, float(self.cutoff_angle[0])).check("falloff_angle", self.falloff_angle[0])
            if self.intensity.is_spatially_varying():
                raise ValueError("intensity must not vary over a surface")

        def _derive(self):
            angles = (self.cutoff_angle, self.falloff_angle)
            w, f = (dr.deg2rad(mi.Float64(angle)) for angle in angles)
            # Cosines near 1 have few digits left in float32: 1 - cos(w) and cos(w - f) - cos(w).
            self.exact_versine_w = 2.0 * dr.square(dr.sin(0.5 * w))
            self.versine_w = mi.Float(self.exact_versine_w)
            rim = mi.Float(2.0 * dr.sin(w - 0.5 * f) * dr.sin(0.5 * f))
            self.narrow = 0.0 < plain(rim) < NARROW
            self.inverse_rim = dr.rcp(dr.maximum(rim, 1e-20))  # f = 0: steeper than float32 tells
            dr.make_opaque(
                self.position, self.direction, self.falloff_exponent, self.attenuation,
                self.versine_w, self.exact_versine_w, self.inverse_rim,
            )  # fmt: skip

        def _ramp(self, inside):
            """The factor r of a direction of which cos(theta) - cos(w) is `inside`."""
            # above 0, so that x^p and its derivative stay finite outside the cone
            x = dr.clip(inside * self.inverse_rim, 1e-7, 1.0)
            return dr.select(inside > 0.0, dr.power(x, self.falloff_exponent), 0.0)

        def _inside(self, p, d):
            """cos(theta) - cos(w) of the point `p`, which is lit from the direction `d`.

            A direction in float32 leaves it an error of 3e-8, too much for a narrow rim.
            """
            if not self.narrow:
                return self.versine_w - 0.5 * dr.squared_norm(d + self.direction)
            d = dr.normalize(mi.Vector3d(self.position) - mi.Vector3d(p))
            direction = dr.normalize(mi.Vector3d(self.direction))
            return mi.Float(self.exact_versine_w - 0.5 * dr.squared_norm(d + direction))

        def _irradiance(self, it, d, dist, active):
            """Irradiance at `it` perpendicular to `d`, the direction towards the light."""
            a, b, c = self.attenuation
            t = dr.fma(dr.fma(c, dist, b), dist, a)
            t = dr.select(t < NO_ATTENUATION_BELOW, 1.0, t)
            weight = self._ramp(self._inside(it.p, d)) / t
            si = spectrum_lookup(self.position, mi.Point2f(0.5), it.time, it.wavelengths)
            value = self.intensity.eval(si, active) * dr.select(active, weight, 0.0)
            return mi.depolarizer(value)

        def sample_direction(self, it, sample, active=True):
            d = self.position - it.p
            dist = dr.norm(d)
            d *= dr.rcp(dist)
            ds = delta_sample(
                self, it, self.position, mi.Normal3f(self.direction), mi.Point2f(0.5), d, dist
            )
            return ds, self._irradiance(it, d, dist, active)

        def eval_direction(self, it, ds, active=True):
            return self._irradiance(it, ds.d, ds.dist, active)

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0.0)

        def sample_ray(self, time, sample1, sample2, sample3, active=True):
            a, b, c = (float(x[0]) for x in self.attenuation)
            if a != 0.0 or b != 0.0 or c == 0.0:
                mi.Log(
                    mi.LogLevel.Warn,
                    "falloffspot: particles can only follow attenuation 0 0 c with c > 0, not "
                    f"{a:g} {b:g} {c:g}; use an integrator that starts at the camera",
                )
                return dr.zeros(mi.Ray3f), mi.Spectrum(0.0)
            versine = sample3.x * self.versine_w  # uniform in the cone
            sine, (s, c_phi) = dr.sqrt(versine * (2.0 - versine)), dr.sincos(dr.two_pi * sample3.y)
            local = mi.Vector3f(sine * c_phi, sine * s, 1.0 - versine)
            si = spectrum_lookup(self.position, mi.Point2f(0.5), time)
            wavelengths, weight = sample_spectrum(self.intensity, si, sample1, active)
            weight *= self._ramp(self.versine_w - versine) * (dr.two_pi * self.versine_w / c)
            d = mi.Frame3f(self.direction).to_world(local)
            return mi.Ray3f(self.position, d, time, wavelengths), mi.depolarizer(weight)

        def sample_position(self, time, sample, active=True):
            ps = dr.zeros(mi.PositionSample3f)
            ps.p, ps.n, ps.uv = self.position, mi.Normal3f(self.direction), mi.Point2f(0.5)
            ps.time, ps.pdf, ps.delta = time, 1.0, True
            return ps, mi.Float(1.0)

        def sample_wavelengths(self, si, sample, active=True):
            return sample_spectrum(self.intensity, si, sample, active)

        def eval(self, si, active=True):
            return mi.Spectrum(0.0)

        def bbox(self):
            p = mi.ScalarPoint3f(*(x[0] for x in self.position))
            return mi.ScalarBoundingBox3f(p, p)

        def traverse(self, cb):
            super().traverse(cb)
            # stock integrators detach the sampled point, so a gradient would be incomplete
            cb.put("position", self.position, mi.ParamFlags.NonDifferentiable)
            for name in ("direction", "cutoff_angle", "falloff_angle", "falloff_exponent",
                         "attenuation"):  # fmt: skip
                cb.put(name, getattr(self, name), mi.ParamFlags.Differentiable)
            cb.put("intensity", self.intensity, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys):
            self._check()
            unit(np.array(dr.detach(self.direction), np.float64).ravel(), "direction")
            self.direction[:] = dr.normalize(self.direction)
            self._derive()

        def to_string(self):
            return (
                f"FalloffSpot[position = {self.position}, direction = {self.direction}, "
                f"cutoff_angle = {self.cutoff_angle}, falloff_angle = {self.falloff_angle}, "
                f"falloff_exponent = {self.falloff_exponent}, attenuation = {self.attenuation}, "
                f"intensity = {self.intensity}]"
            )

    return FalloffSpot
