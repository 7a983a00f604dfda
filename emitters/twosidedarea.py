r"""Area light that shines on both sides (``twosidedarea``)
=======================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``radiance``
     - spectrum or texture
     - Radiance :math:`L_e` of the surface, on either side. Default: 1. Differentiable.
   * - ``name``
     - string
     - Distinguishes lights that are otherwise equal: Mitsuba would merge them into one, which then
       hangs on two shapes. Default: empty.

Attached to any shape, it makes every point of it emit :math:`L_e` into the whole sphere of
directions, as the legacy language has it for hemispheres and infinite planes with emission, and
for images put on planes and meshes as light. A closed lamp needs no second side: ``area`` does
there, except for spheres that light their own inside or subtend less than a hundredth of a radian.
A lamp of area :math:`A` with constant radiance has the power :math:`2 \pi A L_e`.

Emitter sampling draws points on the shape as the shape itself does it, by solid angle where it
can. On a sphere of radius :math:`R` that is seen from the distance :math:`D` of its centre,
outside by more than :math:`10^{-3} R`, it is uniform in the cone of half angle :math:`\sigma`,

.. math::
    p = \frac{1}{2 \pi (1 - \cos\sigma)} = \frac{1 + \cos\sigma}{2 \pi \sin^2\sigma}, \qquad
    \sin\sigma = \frac{R}{D},

which single precision bears for any :math:`\sigma`; elsewhere, above all inside, it is uniform
over the area. (The stock sphere computes :math:`1 - \cos\sigma` as written: lamps that subtend
:math:`10^{-4}` rad are dark. On its inner surface it takes points that rounding has put outside
for points that see it from outside.)

Where ``radiance`` is a texture, shapes other than meshes are sampled by it: nine in ten points
follow the texture's own density over :math:`(u, v)`, one is uniform there, so that no part of the
shape is missed even if the texture is transformed. Meshes are sampled by area, since nothing
promises that their :math:`(u, v)` cover the image once.

**Source.** M. Pharr, W. Jakob and G. Humphreys, Physically Based Rendering, 4th edition, section
6.2.4.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'rectangle',
     'light': {'type': 'twosidedarea', 'radiance': {'type': 'rgb', 'value': [5, 4, 3]}}}

.. code-block:: xml

    <shape type="rectangle">
        <emitter type="twosidedarea">
            <rgb name="radiance" value="5, 4, 3"/>
        </emitter>
    </shape>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.emitters.common import sample_side, sample_spectrum, sample_surface_ray, sphere_of
from relume.parameters import text

RUNS_UNDER = ("polarized",)

BY_TEXTURE = 0.9
OUTSIDE = 1.001  # distance from a sphere's centre, in radii, from which it is sampled as a cone


def cone(distance: mi.Float, radius: mi.Float) -> tuple[mi.Float, mi.Float]:
    """Squared sine and cosine of the half angle of the cone that a sphere fills, seen from outside.

    Args:
        distance: of its centre.
        radius: its radius.
    """
    sine2 = dr.square(radius / distance)
    # (D - R) (D + R) keeps the digits of a cosine near 0.
    return sine2, dr.safe_sqrt((distance - radius) * (distance + radius)) / distance


def define() -> type[mi.Emitter]:
    """Return the plugin's class for the variant in use."""

    class TwoSidedArea(mi.Emitter):
        def __init__(self, props):
            mi.Emitter.__init__(self, props)
            if "to_world" in props:
                raise ValueError("twosidedarea: the shape has the transform, not the light")
            self.radiance = props.get_emissive_texture("radiance", 1.0)
            self.name = text(props, "name")
            self.sphere = None
            self._set_flags()

        def _set_flags(self):
            flags = int(mi.EmitterFlags.Surface)
            if self.radiance.is_spatially_varying():
                flags |= int(mi.EmitterFlags.SpatiallyVarying)
            self.m_flags = flags

        def _follows_texture(self):
            is_mesh = self.get_shape().shape_type() == mi.ShapeType.Mesh.value
            return self.radiance.is_spatially_varying() and not is_mesh

        def _uv_pdf(self, uv, active):
            return BY_TEXTURE * self.radiance.pdf_position(uv, active) + (1.0 - BY_TEXTURE)

        def _sample_uv(self, sample, active):
            """Point on the shape, sampled by the texture, with its density per area."""
            textured = sample.x < BY_TEXTURE
            x = dr.select(textured, sample.x, sample.x - BY_TEXTURE)
            x /= dr.select(textured, BY_TEXTURE, 1.0 - BY_TEXTURE)
            uv = mi.Point2f(x, sample.y)
            uv = dr.select(textured, self.radiance.sample_position(uv, active)[0], uv)
            si = self.get_shape().eval_parameterization(uv, mi.RayFlags.All, active)
            area = dr.norm(dr.cross(si.dp_du, si.dp_dv))
            pdf = self._uv_pdf(uv, active) / area
            return si, dr.select(active & si.is_valid() & (area > 0.0), pdf, 0.0)

        def _sample_sphere(self, it, sample, sphere, active):
            """Point on a sphere as seen from `it`."""
            centre, radius = sphere
            ps = self.get_shape().sample_position(it.time, sample, active)
            to_centre = centre - it.p
            distance = dr.norm(to_centre)
            outside = distance > OUTSIDE * radius
            sine2, cos_cone = cone(dr.select(outside, distance, 2.0 * radius), radius)
            # 1 - cos(theta) is uniform up to 1 - cos(sigma).
            versine = sample.x * sine2 / (1.0 + cos_cone)
            sin2 = versine * (2.0 - versine)
            share = dr.minimum(sin2 / sine2, 1.0)  # (sin(theta) / sin(sigma))^2
            s, c = dr.sincos(dr.two_pi * sample.y)
            sine, cosine = dr.sqrt(sin2), 1.0 - versine
            axes = mi.Frame3f(to_centre / distance)
            d = axes.to_world(mi.Vector3f(c * sine, s * sine, cosine))
            # The near point of the ray: its normal from the angle at the centre, its distance.
            root = dr.sqrt(1.0 - share)
            cos_a = -dr.fma(share, dr.sqrt(sine2), root * cosine)
            sin_a = dr.safe_sqrt(1.0 - cos_a * cos_a)
            n = axes.to_world(mi.Vector3f(c * sin_a, s * sin_a, cos_a))

            ds = dr.zeros(mi.DirectionSample3f)
            ds.n = mi.Normal3f(dr.select(outside, n, ps.n))
            ds.p = dr.select(outside, dr.fma(radius, n, centre), ps.p)
            offset = ps.p - it.p
            ds.dist = dr.select(outside, dr.fma(distance, cosine, -radius * root), dr.norm(offset))
            ds.d = dr.select(outside, d, offset / ds.dist)
            ds.uv, ds.time, ds.delta = ps.uv, it.time, False
            ds.pdf = self._sphere_pdf(it, ds, sphere)
            return ds

        def _sphere_pdf(self, it, ds, sphere):
            """Density of ``_sample_sphere`` per solid angle."""
            centre, radius = sphere
            distance = dr.norm(centre - it.p)
            outside = distance > OUTSIDE * radius
            sine2, cos_cone = cone(dr.select(outside, distance, 2.0 * radius), radius)
            cos = dr.abs(dr.dot(ds.d, ds.n))
            by_area = dr.square(ds.dist / radius) * (0.25 * dr.inv_pi) / cos
            by_area = dr.select(cos > 0.0, by_area, 0.0)
            return dr.select(outside, (1.0 + cos_cone) * dr.inv_two_pi / sine2, by_area)

        def sample_direction(self, it, sample, active=True):
            if self.get_shape() is None:  # Dr.Jit traces every living emitter, attached or not
                return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0.0)
            if self._follows_texture():
                si, pdf = self._sample_uv(sample, active)
                ds = dr.zeros(mi.DirectionSample3f)
                ds.p, ds.n, ds.uv, ds.time, ds.delta = si.p, si.n, si.uv, it.time, False
                ds.d = ds.p - it.p
                ds.dist = dr.norm(ds.d)
                ds.d /= ds.dist
                cos = dr.abs(dr.dot(ds.d, ds.n))
                ds.pdf = dr.select(cos > 0.0, pdf * dr.square(ds.dist) / cos, 0.0)
            elif sphere := sphere_of(self):
                ds = self._sample_sphere(it, sample, sphere, active)
            else:
                ds = self.get_shape().sample_direction(it, sample, active)
            ds.emitter = mi.EmitterPtr(self)
            usable = active & (ds.pdf > 0.0) & dr.isfinite(ds.pdf)
            ds.pdf = dr.select(usable, ds.pdf, 0.0)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            value = self.radiance.eval(si, usable) / ds.pdf
            return ds, mi.depolarizer(dr.select(usable, value, 0.0))

        def pdf_direction(self, it, ds, active=True):
            shape = self.get_shape()
            if shape is None:
                return mi.Float(0.0)
            if not self._follows_texture():
                sphere = sphere_of(self)
                if sphere is None:
                    return shape.pdf_direction(it, ds, active)
                return dr.select(active, self._sphere_pdf(it, ds, sphere), 0.0)
            si = shape.eval_parameterization(ds.uv, mi.RayFlags.dPdUV, active)
            projected = dr.norm(dr.cross(si.dp_du, si.dp_dv)) * dr.abs(dr.dot(ds.d, ds.n))
            pdf = self._uv_pdf(ds.uv, active) * dr.square(ds.dist) / projected
            return dr.select(active & si.is_valid() & (projected > 0.0), pdf, 0.0)

        def eval_direction(self, it, ds, active=True):
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            return mi.depolarizer(self.radiance.eval(si, active))

        def eval(self, si, active=True):
            return mi.depolarizer(self.radiance.eval(si, active))

        def sample_position(self, time, sample, active=True):
            if self.get_shape() is None:
                return dr.zeros(mi.PositionSample3f), mi.Float(0.0)
            sample, side = sample_side(sample)
            if self._follows_texture():
                si, pdf = self._sample_uv(sample, active)
                ps = dr.zeros(mi.PositionSample3f)
                ps.p, ps.n, ps.uv, ps.time, ps.pdf = si.p, si.n, si.uv, time, pdf
            else:
                ps = self.get_shape().sample_position(time, sample, active)
            ps.n *= side
            ps.pdf *= 0.5
            return ps, dr.select(active & (ps.pdf > 0.0), dr.rcp(ps.pdf), 0.0)

        def pdf_position(self, ps, active=True):
            if not self._follows_texture():
                return 0.5 * self.get_shape().pdf_position(ps, active)
            si = self.get_shape().eval_parameterization(ps.uv, mi.RayFlags.dPdUV, active)
            return 0.5 * self._uv_pdf(ps.uv, active) / dr.norm(dr.cross(si.dp_du, si.dp_dv))

        def sample_wavelengths(self, si, sample, active=True):
            return sample_spectrum(self.radiance, si, sample, active)

        def sample_ray(self, time, sample1, sample2, sample3, active=True):
            return sample_surface_ray(self, time, sample1, sample2, sample3, active)

        def bbox(self):
            return self.get_shape().bbox()

        def traverse(self, cb):
            super().traverse(cb)
            cb.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys):
            self._set_flags()

        def to_string(self):
            return f"TwoSidedArea[radiance = {self.radiance}, name = {self.name!r}]"

    return TwoSidedArea
