r"""Camera with a screen of any shape (``screencamera``)
====================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``width``, ``height``
     - float
     - Size of the screen at distance 1 from the camera, above 0. Where their ratio is not that of
       the film, pixels are not square. Required. Exposed.
   * - ``aperture_radius``
     - float
     - Radius of the lens, 0 or more [scene unit]; 0 is a pinhole. Default: 0. Exposed.
   * - ``focus_distance``
     - float
     - Distance of the plane of sharpness along the **world's** Z axis, above 0 [scene unit].
       Default: 1. Exposed.
   * - ``to_world``
     - transform
     - Rigid; the camera looks along +Z with +Y up and +X to the left. Default: none.

Film, sampler and medium are nested in it as in the stock sensors; of a film with a crop window only
that part is seen.

The ray through film position :math:`(p, q) \in [0,1]^2` from the top left corner has the direction
:math:`\hat d + W (p - 1/2) \hat r + H (1/2 - q) \hat u`, with :math:`\hat d, \hat r, \hat u` the
directions of view, to the right and up, W and H the size of the screen. With a lens of radius
:math:`a` its origin moves by a point of a disk of that radius in the world's XY plane, and it
still passes through :math:`c + \omega f / |\omega_z|`, c the camera and f the focus distance: the
lens of the original renderer, which is a thin lens only for a camera that looks along Z.

**Source.** Legacy manual, `SCREEN`; scene language sections 5.1 and 5.5.

**Variants.** All.

**Usage.**

.. code-block:: python

    {'type': 'screencamera', 'width': 1.0, 'height': 0.5,
     'to_world': mi.ScalarTransform4f().look_at([0, 1, 5], [0, 1, 0], [0, 1, 0]),
     'film': {'type': 'hdrfilm', 'width': 640, 'height': 480}}
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.parameters import NOT_NEGATIVE, POSITIVE, check, expose, number, plain

RUNS_UNDER = ("scalar", "polarized")
RANGES = {
    "width": POSITIVE,
    "height": POSITIVE,
    "aperture_radius": NOT_NEGATIVE,
    "focus_distance": POSITIVE,
}


def define() -> type[mi.Sensor]:
    """Return the plugin's class for the variant in use."""

    class ScreenCamera(mi.Sensor):
        def __init__(self, props):
            mi.Sensor.__init__(self, props)
            self.width = mi.Float(number(props, "width", None, POSITIVE))
            self.height = mi.Float(number(props, "height", None, POSITIVE))
            self.aperture_radius = mi.Float(number(props, "aperture_radius", 0.0, NOT_NEGATIVE))
            self.focus_distance = mi.Float(number(props, "focus_distance", 1.0, POSITIVE))
            self.m_needs_sample_2 = True
            self.parameters_changed([])

        def traverse(self, cb):
            mi.Sensor.traverse(self, cb)
            expose(self, cb, tuple(RANGES))

        def parameters_changed(self, keys):
            mi.Sensor.parameters_changed(self, keys)
            check(self, RANGES, keys)
            self.has_lens = plain(self.aperture_radius) > 0
            self.m_needs_sample_3 = self.has_lens
            film = self.film()
            size, crop = (np.array(x, float) for x in (film.size(), film.crop_size()))
            self.window = mi.Vector2f(*(crop / size).tolist())
            self.corner = mi.Point2f(*(np.array(film.crop_offset(), float) / size).tolist())
            dr.make_opaque(
                self.width, self.height, self.aperture_radius, self.focus_distance,
                self.window, self.corner,
            )  # fmt: skip

        def sample_ray(
            self, time, wavelength_sample, position_sample, aperture_sample, active=True
        ):
            si = dr.zeros(mi.SurfaceInteraction3f)
            wavelengths, weight = self.sample_wavelengths(si, wavelength_sample, active)
            p, q = dr.fma(position_sample, self.window, self.corner)
            local = mi.Vector3f((0.5 - p) * self.width, (0.5 - q) * self.height, 1)
            to_world = self.world_transform()
            o = to_world.translation()
            d = dr.normalize(to_world @ local)
            if self.has_lens:
                disk = mi.warp.square_to_uniform_disk_concentric(aperture_sample)
                offset = mi.Vector3f(disk.x, disk.y, 0) * self.aperture_radius
                o += offset
                # To c + d f / |d_z|, without numbers beyond single precision for d_z = 0.
                d = dr.normalize(d - offset * (dr.abs(d.z) / self.focus_distance))
            return mi.Ray3f(o, d, time, wavelengths), weight

        def sample_ray_differential(
            self, time, wavelength_sample, position_sample, aperture_sample, active=True
        ):
            ray, weight = self.sample_ray(
                time, wavelength_sample, position_sample, aperture_sample, active
            )
            return mi.RayDifferential3f(ray), weight

        def bbox(self):
            origin = self.world_transform().translation()
            return mi.ScalarBoundingBox3f([dr.slice(x) for x in origin])

        def to_string(self):
            numbers = ", ".join(f"{name}={getattr(self, name)}" for name in RANGES)
            return f"ScreenCamera[{numbers}, to_world={self.world_transform()}, {self.film()}]"

    return ScreenCamera
