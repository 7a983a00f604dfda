r"""Parallel beam (``parallelbeam``)
================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``origin``
     - point
     - Corner of the parallelogram that the beam leaves. Default: 0, 0, 0. Exposed.
   * - ``edge_u``
     - vector
     - Its first edge :math:`U`. Default: 1, 0, 0. Exposed.
   * - ``edge_v``
     - vector
     - Its second edge :math:`V`. Default: 0, 1, 0. Exposed.
   * - ``direction``
     - vector
     - Where the light goes, of any length above 0. Default: :math:`U \times V`. Exposed.
   * - ``irradiance``
     - spectrum or texture
     - On a plane perpendicular to the beam. Default: 1. Differentiable.
   * - ``to_world``
     - transform
     - Applied to all of the above. Default: none.

Collimated light through the volume that the parallelogram sweeps along the direction :math:`D`. A
point :math:`x` is written in the frame of the beam,

.. math::
    x = o + s\,U + v\,V + \tau\,D, \qquad |D| = 1,

and is lit if :math:`s, v \in [0, 1]` and :math:`\tau > 0`: nothing beside or behind the
parallelogram is. There is no attenuation with distance. A texture given as ``irradiance`` is
spread over the parallelogram, u along :math:`U` and v along :math:`V`, as a slide projector would.

Whatever lies between the parallelogram and the point casts a shadow; what lies in its plane or
behind does not, so that a rectangle may be put at the same place to be seen. Points closer to the
plane than Mitsuba's own ray offset, :math:`(1 + \max|x_i|) \cdot 9 \cdot 10^{-5}`, count as lying
in it. The direction is a Dirac delta: emitter sampling (next event estimation) finds it, a
scattered ray never does.

**Source.** Legacy manual, "Directional light"; scenes of that language put ``irradiance`` to
:math:`\pi` times the emission of the rectangle.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'parallelbeam', 'origin': [-1, 4, -1], 'edge_u': [2, 0, 0], 'edge_v': [0, 0, 2],
     'direction': [0, -1, 0], 'irradiance': {'type': 'rgb', 'value': 3.0}}

.. code-block:: xml

    <emitter type="parallelbeam">
        <point name="origin" x="-1" y="4" z="-1"/>
        <vector name="edge_u" x="2" y="0" z="0"/>
        <vector name="edge_v" x="0" y="0" z="2"/>
        <vector name="direction" x="0" y="-1" z="0"/>
        <rgb name="irradiance" value="3"/>
    </emitter>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.emitters.common import delta_sample, sample_spectrum, spectrum_lookup, unit
from relume.parameters import ANY, vector

RUNS_UNDER = ("polarized",)


def define() -> type[mi.Emitter]:
    """Return the plugin's class for the variant in use."""

    class ParallelBeam(mi.Emitter):
        def __init__(self, props):
            mi.Emitter.__init__(self, props)
            self.m_flags = mi.EmitterFlags.DeltaDirection
            to_world = np.array(props.get("to_world", mi.ScalarTransform4d()).matrix)
            linear = to_world[:3, :3]
            origin = linear @ vector(props, "origin", (0, 0, 0)) + to_world[:3, 3]
            edge_u = linear @ vector(props, "edge_u", (1, 0, 0))
            edge_v = linear @ vector(props, "edge_v", (0, 1, 0))
            self.follows_normal = "direction" not in props
            direction = np.cross(edge_u, edge_v)
            if not self.follows_normal:
                direction = linear @ vector(props, "direction", (0, 0, 1))
            self.irradiance = props.get_emissive_texture("irradiance", 1.0)
            self.origin = mi.Point3f(*origin.tolist())
            self.edge_u = mi.Vector3f(*edge_u.tolist())
            self.edge_v = mi.Vector3f(*edge_v.tolist())
            self.direction = mi.Vector3f(*direction.tolist())
            self._derive(origin, edge_u, edge_v, direction)

        def _derive(self, origin, edge_u, edge_v, direction):
            """Precompute the frame of the beam in float64; all arguments have shape (3,)."""
            d = unit(direction, "the direction of the beam")
            cross = np.cross(edge_u, edge_v)
            across = abs(cross @ d)  # area of the beam's cross-section
            if across <= 1e-6 * np.linalg.norm(edge_u) * np.linalg.norm(edge_v):
                raise ValueError(
                    "parallelbeam: edge_u, edge_v and direction must span space, got "
                    f"{edge_u.tolist()}, {edge_v.tolist()}, {direction.tolist()}"
                )
            to_beam = np.linalg.inv(np.stack([edge_u, edge_v, d], axis=1))
            corners = [origin + s * edge_u + t * edge_v for s in (0, 1) for t in (0, 1)]
            # Mitsuba moves the start of a ray by this much
            self.margin = mi.Float(mi.math.RayEpsilon * (1.0 + np.abs(corners).max()))
            self.area = mi.Float(across)
            self.unit_direction = mi.Vector3f(*d.tolist())
            self.to_beam = mi.Matrix3f(to_beam.tolist())
            self.box = mi.ScalarBoundingBox3f(
                mi.ScalarPoint3f(*np.min(corners, axis=0).tolist()),
                mi.ScalarPoint3f(*np.max(corners, axis=0).tolist()),
            )
            dr.make_opaque(
                self.origin, self.edge_u, self.edge_v,
                self.margin, self.area, self.unit_direction, self.to_beam,
            )  # fmt: skip

        def _irradiance(self, it, s, v, tau, active):
            """Irradiance at `it` perpendicular to the beam; (s, v, tau) is `it.p` in its frame."""
            lit = active & (s >= 0.0) & (s <= 1.0) & (v >= 0.0) & (v <= 1.0) & (tau > self.margin)
            si = spectrum_lookup(it.p, mi.Point2f(s, v), it.time, it.wavelengths)
            return mi.depolarizer(dr.select(lit, self.irradiance.eval(si, lit), 0.0)), lit

        def sample_direction(self, it, sample, active=True):
            s, v, tau = self.to_beam @ (it.p - self.origin)
            d = self.unit_direction
            value, lit = self._irradiance(it, s, v, tau, active)
            p = dr.fma(-tau, d, it.p)
            ds = delta_sample(self, it, p, mi.Normal3f(d), mi.Point2f(s, v), -d, tau)
            ds.pdf = dr.select(lit, mi.Float(1.0), 0.0)
            return ds, value

        def eval_direction(self, it, ds, active=True):
            s, v, tau = self.to_beam @ (it.p - self.origin)
            return self._irradiance(it, s, v, tau, active)[0]

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0.0)

        def _point(self, sample):
            return self.origin + sample.x * self.edge_u + sample.y * self.edge_v

        def sample_ray(self, time, sample1, sample2, sample3, active=True):
            p = dr.fma(self.margin, self.unit_direction, self._point(sample2))
            si = spectrum_lookup(p, sample2, time)
            wavelengths, weight = sample_spectrum(self.irradiance, si, sample1, active)
            ray = mi.Ray3f(p, self.unit_direction, time, wavelengths)
            return ray, mi.depolarizer(weight * self.area)

        def sample_position(self, time, sample, active=True):
            ps = dr.zeros(mi.PositionSample3f)
            ps.p, ps.n, ps.uv = self._point(sample), mi.Normal3f(self.unit_direction), sample
            area = dr.norm(dr.cross(self.edge_u, self.edge_v))
            ps.time, ps.pdf = time, dr.rcp(area)
            return ps, area

        def sample_wavelengths(self, si, sample, active=True):
            return sample_spectrum(self.irradiance, si, sample, active)

        def eval(self, si, active=True):
            return mi.Spectrum(0.0)

        def bbox(self):
            return self.box

        def traverse(self, cb):
            super().traverse(cb)
            for name in ("origin", "edge_u", "edge_v", "direction"):
                cb.put(name, getattr(self, name), mi.ParamFlags.NonDifferentiable)
            cb.put("irradiance", self.irradiance, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys):
            def numbers(name):
                found = np.array(getattr(self, name), dtype=np.float64).reshape(3)
                ANY.check(name, *found)
                return found

            if "direction" in keys:
                self.follows_normal = False
            edge_u, edge_v, direction = (numbers(x) for x in ("edge_u", "edge_v", "direction"))
            if self.follows_normal:
                direction = np.cross(edge_u, edge_v)
                self.direction[:] = mi.Vector3f(*direction.tolist())
            self._derive(numbers("origin"), edge_u, edge_v, direction)

        def to_string(self):
            return (
                f"ParallelBeam[origin = {self.origin}, edge_u = {self.edge_u}, "
                f"edge_v = {self.edge_v}, direction = {self.direction}, "
                f"irradiance = {self.irradiance}]"
            )

    return ParallelBeam
