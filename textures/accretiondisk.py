r"""Disk of glowing gas around a black hole (``accretiondisk``)
===========================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``picture``
     - texture
     - Colours c of the disk over :math:`(u, v)`. Required. Differentiable.
   * - ``alpha``
     - texture
     - Opacity of the picture over :math:`(u, v)`, in [0, 1]. Default: 1.
   * - ``quantity``
     - string
     - What the texture gives: ``radiance``, ``reflectance`` or ``opacity``. Default: radiance.
   * - ``scale``
     - spectrum
     - Radiance of a white picture at rest. Default: 1.
   * - ``center``
     - point
     - Centre of the black hole and of the disk [scene unit]. Default: 0, 0, 0.
   * - ``mass``
     - float
     - Mass M of the black hole as a length, above 0 [scene unit]. Default: 1.
   * - ``spin``
     - float
     - Spin a of the black hole about +Z, within -1 and 1 [M]. Default: 0.
   * - ``normal``
     - vector
     - Normal of the disk, whose picture turns with it. Default: 0, 0, 1.
   * - ``outer_radius``
     - float
     - Radius R to which the picture is stretched, above that of the innermost stable orbit
       [scene unit]. Required.
   * - ``hole_radius``
     - float
     - Distance from the centre below which the disk has a hole, 0 or more [scene unit].
       Default: 0.
   * - ``motion``
     - string
     - ``gravity``, light of orbiting gas with its red shift, or ``doppler``, that without the
       hole's share, and no channel above 1. Default: gravity.
   * - ``seen_from``
     - point
     - For ``doppler``, the point from which a straight line to the disk is taken for the ray
       [scene unit]. Default: the ray itself.
   * - ``shift``
     - float
     - Share s of the shift of colours, in [0, 1]; the rest is beaming. Default: 0.
   * - ``temperature``
     - float
     - Highest temperature of the gas, 0 or more [K]; 0 for the colours of the picture.
       Default: 0.

The gas moves on circular orbits about +Z between the innermost stable one, of radius
:math:`r_i`, and R. At Boyer and Lindquist's radius r and at the angle :math:`\vartheta` in the
plane of the disk the picture is looked up at

.. math::
    (u, v) = \tfrac12 + \frac{r - r_i}{R - r_i} (\cos\vartheta, -\sin\vartheta), \qquad v
    \text{ from the top,}

so that its middle is the inner edge and its sides are half-way to R, where the disk ends. (For a
disk around +Z the picture's right is +X and its top -Y.) The opacity is :math:`\min(\alpha,
|c|/3)`, and all from 0.99 on. Frequencies are multiplied by

.. math::
    g = \frac{\sqrt{1 - 3/r + 2 a r^{-3/2}}}{1 + a r^{-3/2} - r^{-3/2} L}

for an observer at rest at infinity, with L the angular momentum over the energy of the light that
meets the eye, which follows from the direction of the ray at the disk. With ``doppler`` they are by
:math:`D = \sqrt{1 - \beta^2} / (1 - \beta \cos\psi)`, from the speed :math:`\beta` of the
orbit against an observer without angular momentum. The radiance is
:math:`s\,S(c) + (1 - s)\,g^4 c`, in which S moves the lines 700, 546.1 and 435.8 nm and gives them
to the primaries.

Gas of a temperature has the colour of a black body of :math:`g\,T` with

.. math::
    T(r) \propto [r^{-3} (1 - \sqrt{r_i / r})]^{1/4}

and :math:`g^4` times the luminance of the picture.

**Source.** J. Bardeen, W. Press and S. Teukolsky, "Rotating Black Holes: Locally Nonrotating
Frames", Astrophysical Journal 178 (1972); O. James et al., Classical and Quantum Gravity 32 (2015).

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones. Colours are shifted in
those that render RGB.

**Usage.**

.. code-block:: python

    {'type': 'disk', 'to_world': mi.ScalarTransform4f().scale(20),
     'bsdf': {'type': 'mask',
              'opacity': {'type': 'accretiondisk', 'quantity': 'opacity', 'outer_radius': 20.0,
                          'picture': {'type': 'bitmap', 'filename': 'probe.hdr'}},
              'nested': {'type': 'diffuse', 'reflectance': 0.0}},
     'light': {'type': 'twosidedarea',
               'radiance': {'type': 'accretiondisk', 'outer_radius': 20.0,
                            'picture': {'type': 'bitmap', 'filename': 'probe.hdr'}}}}
"""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.black_holes import MOST_SPIN, innermost_orbit
from relume.parameters import NOT_NEGATIVE, POSITIVE, Range, choice, number, vector
from relume.sensors.doppler import shifted
from relume.textures.blackbodies import BlackBodies

SPIN = Range(-MOST_SPIN, MOST_SPIN)
"""As that of ``curvedspace``."""

OPAQUE = 0.99
"""Opacity from which the disk lets nothing through."""


def axes_of(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions in the disk's plane: up in the picture, and to the right."""
    n = normal / np.linalg.norm(normal)
    across = np.array([0.0, 1.0, 0.0] if abs(n[0]) > 1e-6 else [1.0, 0.0, 0.0])
    up = np.cross(across, n)
    up /= np.linalg.norm(up)
    return up, np.cross(n, up)


def define() -> type[mi.Texture]:
    """Return the plugin's class for the variant in use."""

    class AccretionDisk(mi.Texture):
        def __init__(self, props):
            mi.Texture.__init__(self, props)
            self.picture = props.get_texture("picture")
            self.alpha = props.get_texture("alpha", 1.0)
            self.scale = props.get_emissive_texture("scale", 1.0)
            self.quantity = choice(props, "quantity", ("radiance", "reflectance", "opacity"))
            self.motion = choice(props, "motion", ("gravity", "doppler"))
            mass = number(props, "mass", 1.0, POSITIVE)
            spin = number(props, "spin", 0.0, SPIN)
            R = number(props, "outer_radius", None) / mass
            r_in = innermost_orbit(spin)
            if not r_in < R:
                raise ValueError(
                    f"outer_radius is {R * mass:g}, but must be above that of the innermost stable "
                    f"orbit, {r_in * mass:g}"
                )
            self.normal = vector(props, "normal", (0, 0, 1))
            if not self.normal.any():
                raise ValueError("normal is 0, but must have a direction")
            up, right = axes_of(self.normal)
            self.straight = "seen_from" in props
            self.seen_from = mi.Point3f(*vector(props, "seen_from", (0, 0, 0)).tolist())
            self.center = mi.Point3f(*vector(props, "center", (0, 0, 0)).tolist())
            self.up, self.right = mi.Vector3f(*up.tolist()), mi.Vector3f(*right.tolist())
            self.mass, self.a, self.R = mi.Float(mass), mi.Float(spin), mi.Float(R)
            self.hole = mi.Float(number(props, "hole_radius", 0.0, NOT_NEGATIVE) / mass)
            self.inner = mi.Float(r_in)
            self.share = mi.Float(number(props, "shift", 0.0, Range(0, 1)))
            self.turn = mi.Float(-1 if spin < 0 and self.motion == "gravity" else 1)
            temperature = number(props, "temperature", 0.0, NOT_NEGATIVE)
            self.black_bodies = BlackBodies() if temperature else None
            self.temperature = mi.Float(temperature)
            dr.make_opaque(
                self.seen_from, self.center, self.up, self.right, self.mass, self.a, self.R,
                self.hole, self.inner, self.share, self.turn, self.temperature,
            )  # fmt: skip

        def traverse(self, cb):
            cb.put("picture", self.picture, mi.ParamFlags.Differentiable)

        def layout(self, si):
            """The interaction with coordinates of the picture, r, x, and whether there is gas."""
            x = mi.Vector3f((si.p - self.center) / self.mass)
            q2, a2 = dr.squared_norm(x), dr.square(self.a)
            u = q2 - a2
            r = dr.sqrt(0.5 * (u + dr.sqrt(u * u + 4 * a2 * dr.square(x.z))))
            up, right = dr.dot(x, self.up), dr.dot(x, self.right)
            out = (r - self.inner) / (self.R - self.inner)
            out *= dr.rcp(dr.maximum(dr.hypot(up, right), 1e-6))
            result = mi.SurfaceInteraction3f(si)
            result.uv = mi.Point2f(dr.fma(out, right, 0.5), dr.fma(-out, up, 0.5))
            inside = (r >= self.inner) & (r <= self.R) & (q2 >= dr.square(self.hole))
            inside &= dr.all((result.uv >= 0) & (result.uv < 1))
            return result, x, r, inside

        def frequency(self, si, x, r):
            """Frequency that is seen over that of the gas."""
            photon = si.to_world(si.wi)
            if self.motion == "gravity":
                return self.red_shift(x, photon, r)
            if self.straight:
                photon = dr.normalize(self.seen_from - si.p)
            q, a = dr.norm(x), self.a
            A = dr.square(dr.square(q)) + dr.square(a * q) + 2 * dr.square(a) * q
            rate = dr.rcp(q * dr.sqrt(q) + a) - 2 * a * q / A
            delta = dr.square(q) - 2 * q + dr.square(a)
            beta = rate * A / (dr.square(q) * dr.safe_sqrt(delta))
            beta = dr.minimum(beta, 0.999999)
            towards = dr.dot(dr.normalize(mi.Vector3f(-x.y, x.x, 0)), photon)
            return dr.safe_sqrt(1 - dr.square(beta)) / (1 - beta * towards)

        def red_shift(self, x, photon, r):
            """g of gas on a circular orbit, for light that leaves it in a direction."""
            a, r2 = self.a, dr.square(r)
            q, delta = r2 + dr.square(a), r2 - 2 * r + dr.square(a)
            sigma = r2 + dr.square(a * x.z / r)
            rho2 = dr.square(x.x) + dr.square(x.y)
            sin2 = rho2 / q
            r_dot = (r * (x.x * photon.x + x.y * photon.y) + x.z * photon.z * q / r) / sigma
            phi_dot = (x.x * photon.y - x.y * photon.x) / dr.maximum(rho2, 1e-12)
            theta2 = dr.maximum(1 - sigma / q * dr.square(r_dot) - rho2 * dr.square(phi_dot), 0)
            # g_tt dt² + 2 g_tφ dt dφ + C = 0 for light.
            g_tphi = -2 * a * r * sin2 / sigma
            g_phi = sin2 * (dr.square(q) - dr.square(a) * delta * sin2) / sigma
            C = g_phi * dr.square(phi_dot) + sigma * dr.square(r_dot) / delta + theta2
            G, B = 1 - 2 * r / sigma, g_tphi * phi_dot
            E = dr.sqrt(dr.maximum(dr.square(B) + G * C, 1e-12))
            t_dot = dr.select(B < 0, C / (E - B), (B + E) / G)
            L = self.turn * (g_phi * phi_dot + g_tphi * t_dot) / E
            a = self.turn * a
            w = dr.rcp(r * dr.sqrt(r))
            # Close to the last orbits of light L is all but 1 / w + a.
            rest = dr.maximum(1 + a * w - w * L, 1e-3)
            return dr.safe_sqrt(1 - 3 / r + 2 * a * w) / rest

        def gas_temperature(self, r):
            """T at a radius [K]."""
            f = 1 - dr.sqrt(self.inner / r)
            peak = 49 / 36 * self.inner
            most = (1 - dr.sqrt(self.inner / peak)) / (peak * dr.square(peak))
            share = dr.maximum(f, 0) / (r * dr.square(r)) / most
            return self.temperature * dr.sqrt(dr.sqrt(share))

        def shown(self, si, x, r, at, active):
            """Colour of the gas, moving."""
            c = self.picture.eval(at, active)
            if self.quantity == "reflectance" and self.motion == "gravity":
                return c
            D = self.frequency(si, x, r)
            beaming = dr.square(dr.square(D))
            if self.black_bodies is not None:
                light = self.black_bodies.eval(self.gas_temperature(r) * D, si.wavelengths)
                return light * (self.luminance(at, active) * beaming)
            if self.quantity == "radiance":
                c = c * self.scale.eval(si, active)
            if not mi.is_rgb:
                return c * beaming
            limit = 1 if self.motion == "doppler" else dr.inf
            return shifted(mi.Color3f(c), D, self.share, limit)

        def luminance(self, at, active):
            if mi.is_rgb:
                return mi.luminance(mi.Color3f(self.picture.eval(at, active)))
            return self.picture.eval_1(at, active)

        def eval(self, si, active=True):
            at, x, r, inside = self.layout(si)
            c = self.shown(si, x, r, at, active)
            if self.quantity == "reflectance":
                c = dr.clip(c, 0, 1)
            elif self.black_bodies is not None:
                c = c * self.scale.eval(si, active)
            return dr.select(inside, c, 0)

        def eval_1(self, si, active=True):
            at, _, _, inside = self.layout(si)
            c = self.picture.eval(at, active)
            # |c|₂ / 3 of what is white is 1 / √3.
            size = dr.norm(mi.Color3f(c)) if mi.is_rgb else math.sqrt(3) * dr.mean(c)
            opacity = dr.minimum(self.alpha.eval_1(at, active), size / 3)
            opacity = dr.select(opacity >= OPAQUE, 1, opacity)
            return dr.select(inside, dr.maximum(opacity, 0), 0)

        def eval_3(self, si, active=True):
            return mi.Color3f(self.eval(si, active))

        def sample_position(self, sample, active=True):
            return sample, mi.Float(1)

        def pdf_position(self, p, active=True):
            return mi.Float(1)

        def mean(self):
            return self.picture.mean()

        def max(self):
            return 1.0

        def is_spatially_varying(self):
            return True

        def to_string(self):
            return (
                f"AccretionDisk[quantity={self.quantity}, picture={self.picture}, "
                f"alpha={self.alpha}, scale={self.scale}, center={self.center}, mass={self.mass}, "
                f"spin={self.a}, normal={self.normal}, outer_radius={self.R * self.mass}, "
                f"hole_radius={self.hole * self.mass}, motion={self.motion}, "
                f"seen_from={self.seen_from if self.straight else None}, shift={self.share}, "
                f"temperature={self.temperature}]"
            )

    return AccretionDisk
