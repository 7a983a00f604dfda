r"""Moving camera, or one that sees the whole sphere (``relativisticcamera``)
=========================================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``projection``
     - string
     - ``screen``, as ``screencamera``, or ``mollweide``, all directions in the ellipse that fills
       the film. Default: screen.
   * - ``velocity``
     - vector
     - Velocity of the camera in the world, of a length below 1 [speed of light].
       Default: 0, 0, 0. Exposed.
   * - ``width``, ``height``
     - float
     - Size of the screen at distance 1 from the camera, above 0. ``mollweide`` has none. Default:
       1.
   * - ``aperture_radius``
     - float
     - Radius of the lens, 0 or more, as in ``screencamera`` [scene unit]. Default: 0.
   * - ``focus_distance``
     - float
     - Distance of the plane of sharpness along the **world's** Z axis [scene unit]. Default: 1.
   * - ``to_world``
     - transform
     - Rigid; the camera looks along +Z with +Y up and +X to the left. Default: none.

Film, sampler and medium are nested in it as in the stock sensors; of a film with a crop window only
that part is seen.

The projection gives the direction d in which the camera looks, in its own frame. In that of the
world, in which it moves with the velocity v,

.. math::
    d' \parallel d + \left(\frac{\gamma^2}{\gamma + 1} (d \cdot v) - \gamma\right) v, \qquad
    \gamma = 1 / \sqrt{1 - v^2},

is where the light comes from: what is ahead is drawn together. Colours stay; ``dopplershift``
changes them.

With ``mollweide`` and :math:`(p, q) \in [0,1]^2` from the top left corner of the film,

.. math::
    \sin\vartheta = 1 - 2 q, \qquad
    \sin(\mathrm{latitude}) = (2 \vartheta + \sin 2 \vartheta) / \pi, \qquad
    \mathrm{longitude} = \pi\, (2 p - 1) / \cos\vartheta

are the angles about the camera's up axis, with its direction of view in the middle. Beyond the
ellipse :math:`(2p - 1)^2 + (2q - 1)^2 = 1` the picture is black.

**Source.** A. Einstein, "Zur Elektrodynamik bewegter Körper", Annalen der Physik 17 (1905), §7.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'relativisticcamera', 'projection': 'mollweide', 'velocity': [0.5, 0.0, 0.0],
     'film': {'type': 'hdrfilm', 'width': 640, 'height': 320}}
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.parameters import NOT_NEGATIVE, POSITIVE, choice, expose, number, vector
from relume.sensors.doppler import aberrated, check_velocity
from relume.sensors.screencamera import behind_a_lens, window_of


def mollweide(position: mi.Point2f) -> tuple[mi.Vector3f, mi.Bool]:
    """Direction at a film position of a camera that looks along +Z, +Y up, +X to the left.

    Args:
        position: in [0, 1]², from the top left corner.

    Returns:
        The direction, and whether the position is within the ellipse.
    """
    p, q = 2 * position.x - 1, 1 - 2 * position.y
    inside = dr.square(p) + dr.square(q) < 1
    theta = dr.asin(dr.select(inside, q, 0))
    sine = (2 * theta + dr.sin(2 * theta)) / dr.pi
    cosine = dr.safe_sqrt(1 - dr.square(sine))
    s, c = dr.sincos(dr.pi * dr.select(inside, p, 0) / dr.cos(theta))
    return mi.Vector3f(-cosine * s, sine, cosine * c), inside


def define() -> type[mi.Sensor]:
    """Return the plugin's class for the variant in use."""
    BehindALens: Any = behind_a_lens()

    class RelativisticCamera(BehindALens):
        def __init__(self, props):
            mi.Sensor.__init__(self, props)
            self.projection = choice(props, "projection", ("screen", "mollweide"))
            self.velocity = mi.Vector3f(*vector(props, "velocity", (0, 0, 0)).tolist())
            radius = number(props, "aperture_radius", 0.0, NOT_NEGATIVE)
            self.aperture_radius = mi.Float(radius)
            self.focus_distance = mi.Float(number(props, "focus_distance", 1.0))
            self.width = number(props, "width", 1.0, POSITIVE)
            self.height = number(props, "height", 1.0, POSITIVE)
            self.size = mi.Vector2f(self.width, self.height)
            self.m_needs_sample_2 = True
            self.m_needs_sample_3 = self.has_lens = radius > 0
            self.parameters_changed([])

        def parameters_changed(self, keys):
            mi.Sensor.parameters_changed(self, keys)
            check_velocity(self.velocity)
            self.window, self.corner = window_of(self.film())
            dr.make_opaque(
                self.velocity, self.size, self.aperture_radius, self.focus_distance,
                self.window, self.corner,
            )  # fmt: skip

        def traverse(self, cb):
            mi.Sensor.traverse(self, cb)
            expose(self, cb, ("velocity",))

        def local(self, position):
            """Direction at a film position in the camera's axes, and whether there is one."""
            if self.projection == "mollweide":
                return mollweide(position)
            x, y = (0.5 - position) * self.size
            return mi.Vector3f(x, y, 1), mi.Bool(True)

        def sample_ray(
            self, time, wavelength_sample, position_sample, aperture_sample, active=True
        ):
            ray, weight = super().sample_ray(
                time, wavelength_sample, position_sample, aperture_sample, active
            )
            d = aberrated(ray.d, self.velocity)
            return mi.Ray3f(ray.o, d, time, ray.wavelengths), weight

        def to_string(self):
            return (
                f"RelativisticCamera[projection={self.projection}, velocity={self.velocity}, "
                f"width={self.width}, height={self.height}, "
                f"aperture_radius={self.aperture_radius}, focus_distance={self.focus_distance}, "
                f"to_world={self.world_transform()}, {self.film()}]"
            )

    return RelativisticCamera
