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

import functools
from typing import Any

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


def window_of(film: mi.Film) -> tuple[mi.Vector2f, mi.Point2f]:
    """Size and corner of a film's crop window, as shares of the film."""
    size, crop = (np.array(x, float) for x in (film.size(), film.crop_size()))
    corner = np.array(film.crop_offset(), float) / size
    return mi.Vector2f(*(crop / size).tolist()), mi.Point2f(*corner.tolist())


def through_lens(
    o: mi.Point3f, d: mi.Vector3f, radius: mi.Float, focus_distance: mi.Float, sample: mi.Point2f
) -> tuple[mi.Point3f, mi.Vector3f]:
    """Origin and direction of a ray through a sampled point of the lens.

    Args:
        o: centre of the lens.
        d: direction of the ray through it.
        radius: of the lens.
        focus_distance: along the world's Z axis.
        sample: uniform variates.
    """
    disk = mi.warp.square_to_uniform_disk_concentric(sample)
    offset = mi.Vector3f(disk.x, disk.y, 0) * radius
    # To o + d f / |d_z|, without numbers beyond single precision for d_z = 0.
    return o + offset, dr.normalize(d - offset * (dr.abs(d.z) / focus_distance))


@functools.cache
def _behind_a_lens(_variant: str) -> type[mi.Sensor]:
    class BehindALens(mi.Sensor):
        def sample_ray(
            self, time, wavelength_sample, position_sample, aperture_sample, active=True
        ):
            si = dr.zeros(mi.SurfaceInteraction3f)
            wavelengths, weight = self.sample_wavelengths(si, wavelength_sample, active)
            local, inside = self.local(dr.fma(position_sample, self.window, self.corner))
            to_world = self.world_transform()
            o = to_world.translation()
            d = dr.normalize(to_world @ local)
            if self.has_lens:
                o, d = through_lens(
                    o, d, self.aperture_radius, self.focus_distance, aperture_sample
                )
            return mi.Ray3f(o, d, time, wavelengths), dr.select(inside, weight, 0)

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

    return BehindALens


def behind_a_lens() -> type[mi.Sensor]:
    """The base class of sensors with a lens that focuses along the world's Z axis.

    Returns:
        The class for the variant in use. A subclass has what `through_lens` and `window_of` take
        and give, and `has_lens`; its `local(position)` returns the direction at a position on the
        film in the sensor's axes, and whether there is one.
    """
    return _behind_a_lens(mi.variant())


def define() -> type[mi.Sensor]:
    """Return the plugin's class for the variant in use."""
    BehindALens: Any = behind_a_lens()

    class ScreenCamera(BehindALens):
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
            self.window, self.corner = window_of(self.film())
            dr.make_opaque(
                self.width, self.height, self.aperture_radius, self.focus_distance,
                self.window, self.corner,
            )  # fmt: skip

        def local(self, position):
            p, q = position
            return mi.Vector3f((0.5 - p) * self.width, (0.5 - q) * self.height, 1), mi.Bool(True)

        def to_string(self):
            numbers = ", ".join(f"{name}={getattr(self, name)}" for name in RANGES)
            return f"ScreenCamera[{numbers}, to_world={self.world_transform()}, {self.film()}]"

    return ScreenCamera
