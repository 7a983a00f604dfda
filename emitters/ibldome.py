r"""Image-based light on a sphere (``ibldome``)
===========================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``filename``
     - string
     - Image file that ``mi.Bitmap`` reads. Required, unless there is ``bitmap``.
   * - ``bitmap``
     - bitmap
     - A ``mi.Bitmap`` instead of the file. Required, unless there is ``filename``.
   * - ``raw``
     - boolean
     - Take 8-bit values as linear, without sRGB decoding. Default: false.
   * - ``scale``
     - float
     - Factor of the radiance, 0 or more. Default: 1. Differentiable.
   * - ``map``
     - string
     - How the image covers the sphere: ``transposed``, ``panoramic``, ``angular``,
       ``angular_mirrored``, ``equirectangular`` or ``hemisphere``; see
       `relume.dome_maps`. Default: ``transposed``.
   * - ``hemisphere``
     - boolean
     - Let only the upper half shine, y at or above the centre. Default: false.

In RGB variants ``mi.traverse`` also exposes the image, as ``data``, which is differentiable.

Attached to a ``sphere``, the emitter gives the point :math:`p` of it the radiance

.. math::
    L(p) = \mathrm{scale} \cdot \mathrm{texel}\left(\mathrm{map}\left(\frac{p - c}{R}\right)\right)

in all directions: inwards, as a surrounding with its parallax kept, and outwards. The texel is the
nearest one, and the formula of the map is evaluated where the ray hits, without any resampling.
The transform of the sphere moves and scales the dome but does not turn the image. Give the sphere
a black ``conductor`` as BSDF: paths end on it, and unlike on a black ``diffuse`` no emitter sample
is spent there, which saves a fifth of the time.

Emitter sampling picks a texel with the probability

.. math::
    P_{ij} \propto Y_{ij}\,\Omega_{ij}

(:math:`Y` its luminance, :math:`\Omega` its solid angle seen from the centre) and a point
uniformly in the texel's :math:`(u, v)`. With :math:`N` texels the density per solid angle from a
shading point :math:`x` is

.. math::
    p(\omega) = P_{ij}\,N\,\left|\frac{\partial(u, v)}{\partial\omega_c}\right|
                \frac{|x - p|^2}{R^2\,|\cos\vartheta_p|}

A single texel of extreme radiance, such as the sun, is thus found as often as it matters.

A stock sphere is intersected in single precision. For domes beyond about ten thousand times the
size of the scene use an ``envmap``, for which ``relume.translator.environment_maps.resample``
prepares the image.

**Source.** Scene language section 11.5; legacy manual, "IBL".

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'sphere', 'center': [0, 0, 0], 'radius': 600,
     'bsdf': {'type': 'conductor', 'specular_reflectance': 0},
     'light': {'type': 'ibldome', 'filename': 'probe.hdr', 'map': 'angular', 'scale': 2.0}}

.. code-block:: xml

    <shape type="sphere">
        <float name="radius" value="600"/>
        <bsdf type="conductor">
            <rgb name="specular_reflectance" value="0"/>
        </bsdf>
        <emitter type="ibldome">
            <string name="filename" value="probe.hdr"/>
            <string name="map" value="angular"/>
        </emitter>
    </shape>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.emitters.common import sample_side, sample_surface_ray, sphere_of
from relume.emitters.dome_sampling import cell_solid_angles, find_map, texel
from relume.parameters import NOT_NEGATIVE, check, flag, number, text
from relume.sensors.colors import LUMINANCE

RUNS_UNDER = ("polarized",)


def read_image(props: mi.Properties) -> np.ndarray:
    """RGB image, shape (h, w, 3), float32, from the parameters `filename` or `bitmap`."""
    if ("filename" in props) == ("bitmap" in props):
        raise ValueError("ibldome: give either filename or bitmap")
    if "filename" in props:
        bitmap = mi.Bitmap(str(mi.file_resolver().resolve(text(props, "filename"))))
    else:
        bitmap = mi.Bitmap(props["bitmap"])
    if flag(props, "raw", False):
        bitmap.set_srgb_gamma(False)
    rgb = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(rgb, dtype=np.float32)


def spectral_texels(image: np.ndarray) -> np.ndarray:
    """What the kernel gathers: RGB, or in spectral variants sRGB model coefficients and a scale.

    The conversion to coefficients is the stock envmap's.
    """
    if mi.is_rgb:
        return image
    if mi.is_monochromatic:
        return np.array(mi.luminance(mi.Color3f(image.reshape(-1, 3).T))).reshape(image.shape[:2])
    h, w = image.shape[:2]
    padded = np.pad(image, ((0, max(0, 3 - h)), (0, max(0, 2 - w)), (0, 0)), mode="edge")
    converted = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(padded)})
    return np.array(mi.traverse(converted)["data"])[:h, 1 : 1 + w]


def define() -> type[mi.Emitter]:
    """Return the plugin's class for the variant in use."""

    class IblDome(mi.Emitter):
        def __init__(self, props):
            mi.Emitter.__init__(self, props)
            if "to_world" in props:
                raise ValueError("ibldome: the shape has the transform, not the light")
            self.m_flags = int(mi.EmitterFlags.Surface) | int(mi.EmitterFlags.SpatiallyVarying)
            self.map_name = text(props, "map", "transposed")
            self.map = find_map(self.map_name)
            self.hemisphere = flag(props, "hemisphere", False)
            self.scale = mi.Float(number(props, "scale", 1.0, NOT_NEGATIVE))
            image = read_image(props)
            self.data = mi.TensorXf(np.atleast_3d(spectral_texels(image)))
            self.d65 = mi.load_dict({"type": "d65"})
            self.sphere = None
            self._prepare_sampling(image)

        def _prepare_sampling(self, image):
            """Distribution over the texels; `image` has shape (h, w, 3)."""
            if not np.all(np.isfinite(image) & (image >= 0.0)):
                raise ValueError("ibldome: the image has negative or undefined values")
            self.height, self.width = image.shape[:2]
            self.columns, self.rows = max(self.width - 1, 1), max(self.height - 1, 1)
            luminance = image.astype(np.float64) @ LUMINANCE
            weight = luminance[::-1][: self.rows, : self.columns] * cell_solid_angles(
                self.map, self.width, self.height, self.hemisphere
            )
            self.is_black = not weight.max() > 0.0
            if self.is_black:
                weight = np.ones_like(weight)
            weight /= weight.sum()
            self.texels = mi.DiscreteDistribution2D(weight.astype(np.float32))
            dr.make_opaque(self.scale)

        def _sphere(self):
            """Centre and radius of the shape, as opaque values; radius 0 where there is no sphere.

            Dr.Jit traces every living emitter, also those no scene uses, so this must not raise.
            """
            sphere = sphere_of(self)
            if sphere is None and self.get_shape() is not None:
                mi.Log(mi.LogLevel.Warn, "ibldome gives no light: it must be attached to a sphere")
            return sphere or (mi.Point3f(0.0), mi.Float(0.0))

        def _normal(self, p):
            return dr.normalize(p - self._sphere()[0])

        def _texel_radiance(self, n, column, row, wavelengths, active):
            if self.hemisphere:
                active = active & (n.y >= 0.0)
            index = row * self.width + column
            if mi.is_spectral:
                c = dr.gather(mi.Vector4f, self.data.array, index, active)
                si = dr.zeros(mi.SurfaceInteraction3f)
                si.wavelengths = wavelengths
                value = mi.srgb_model_eval(c.xyz, wavelengths) * c.w * self.d65.eval(si, active)
            else:
                value = dr.gather(mi.UnpolarizedSpectrum, self.data.array, index, active)
            return dr.select(active, value * self.scale, 0.0)

        def _radiance(self, p, wavelengths, active):
            n = self._normal(p)
            active = active & (self._sphere()[1] > 0.0)
            column, row = texel(self.map.to_uv(n), self.width, self.height)
            return self._texel_radiance(n, column, row, wavelengths, active)

        def _density(self, n, column, row, active):
            """Density of the sampled direction n from the centre, per solid angle."""
            cell = mi.Point2u(
                dr.minimum(column, self.columns - 1),
                dr.minimum(self.height - 1 - row, self.rows - 1),
            )
            pdf = self.texels.pdf(cell, active) * (self.rows * self.columns) * self.map.density(n)
            if self.hemisphere:
                return dr.select(n.y >= 0.0, pdf, 0.0)
            return 0.5 * pdf if self.map_name == "hemisphere" else pdf

        def _sample(self, sample, active):
            """Direction from the centre, its texel and its density per solid angle (0: none)."""
            if self.map_name == "hemisphere" and not self.hemisphere:
                sample, half = sample_side(sample)
            else:
                half = mi.Float(1.0)
            cell, _, offset = self.texels.sample(sample, active)
            uv = mi.Point2f(
                (mi.Float(cell.x) + offset.x) / self.columns,
                (mi.Float(cell.y) + offset.y) / self.rows,
            )
            n = self.map.to_direction(uv)
            n.y *= half
            column, row = cell.x, self.height - 1 - cell.y
            shown = active & dr.isfinite(n.x) & dr.isfinite(n.y)
            if self.is_black:
                shown &= False
            pdf = dr.select(shown, self._density(n, column, row, shown), 0.0)
            return dr.select(shown, n, mi.Vector3f(0, 1, 0)), column, row, pdf

        def sample_direction(self, it, sample, active=True):
            centre, radius = self._sphere()
            n, column, row, pdf = self._sample(mi.Point2f(sample), mi.Mask(active))
            ds = dr.zeros(mi.DirectionSample3f)
            ds.p = dr.fma(radius, n, centre)
            ds.n = mi.Normal3f(n)
            ds.time = it.time
            ds.d = ds.p - it.p
            ds.dist = dr.norm(ds.d)
            ds.d /= ds.dist
            ds.emitter = mi.EmitterPtr(self)
            projected = dr.square(radius) * dr.abs(dr.dot(ds.d, n))
            ds.pdf = dr.select(projected > 0.0, pdf * dr.square(ds.dist) / projected, 0.0)
            usable = active & (ds.pdf > 0.0)
            value = self._texel_radiance(n, column, row, it.wavelengths, usable) / ds.pdf
            return ds, mi.depolarizer(dr.select(usable, value, 0.0))

        def pdf_direction(self, it, ds, active=True):
            if self.is_black:
                return mi.Float(0.0)
            _, radius = self._sphere()
            n = self._normal(ds.p)
            column, row = texel(self.map.to_uv(n), self.width, self.height)
            pdf = self._density(n, column, row, active)
            projected = dr.square(radius) * dr.abs(dr.dot(ds.d, n))
            usable = active & (projected > 0.0)
            return dr.select(usable, pdf * dr.square(ds.dist) / projected, 0.0)

        def eval_direction(self, it, ds, active=True):
            return mi.depolarizer(self._radiance(ds.p, it.wavelengths, active))

        def eval(self, si, active=True):
            return mi.depolarizer(self._radiance(si.p, si.wavelengths, active))

        def sample_position(self, time, sample, active=True):
            centre, radius = self._sphere()
            sample, side = sample_side(sample)
            n, _, _, pdf = self._sample(sample, mi.Mask(active))
            ps = dr.zeros(mi.PositionSample3f)
            ps.p = dr.fma(radius, n, centre)
            ps.n = mi.Normal3f(side * n)
            ps.time = time
            ps.pdf = 0.5 * pdf / dr.square(radius)
            return ps, dr.select(ps.pdf > 0.0, dr.rcp(ps.pdf), 0.0)

        def sample_wavelengths(self, si, sample, active=True):
            if not mi.is_spectral:
                return dr.zeros(mi.Ray3f).wavelengths, self._radiance(si.p, si.wavelengths, active)
            wavelengths, weight = mi.sample_rgb_spectrum(mi.sample_shifted(sample))
            return wavelengths, weight * self._radiance(si.p, wavelengths, active)

        def sample_ray(self, time, sample1, sample2, sample3, active=True):
            return sample_surface_ray(self, time, sample1, sample2, sample3, active)

        def bbox(self):
            return self.get_shape().bbox()

        def traverse(self, cb):
            super().traverse(cb)
            cb.put("scale", self.scale, mi.ParamFlags.Differentiable)
            if mi.is_rgb:
                cb.put("data", self.data, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys):
            check(self, {"scale": NOT_NEGATIVE}, keys)
            dr.make_opaque(self.scale)
            if "data" in keys:
                self._prepare_sampling(np.array(self.data))

        def to_string(self):
            return (
                f"IblDome[{self.width} x {self.height}, map = {self.map_name}, "
                f"scale = {self.scale}, hemisphere = {self.hemisphere}]"
            )

    return IblDome
