r"""Picture on a sphere by a map of image-based lights (``spheremap``)
==================================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - (nested)
     - texture
     - The picture, as a texture over :math:`(u, v)`. Required.
   * - ``map``
     - string
     - How the picture covers the sphere: ``transposed``, ``panoramic``, ``angular``,
       ``angular_mirrored``, ``equirectangular`` or ``hemisphere``; see
       `relume.emitters.dome_sampling`. Default: ``transposed``.
   * - ``center``
     - point
     - Centre :math:`c` of the sphere [scene unit]. Default: 0, 0, 0.
   * - ``to_sphere``
     - transform
     - Linear map :math:`A` from the world to a sphere, for ellipsoids. Default: none.

The value at the point :math:`p` is that of the nested texture at

.. math::
    (u, v) = \mathrm{map}\left(\frac{A\,(p - c)}{|A\,(p - c)|}\right)

whatever the coordinates of the shape are: exact on any sphere, part of a sphere, or mesh of one.
Where the shape turns, the picture does not.

**Source.** Scene language sections 11.3 and 11.5.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'sphere', 'center': [0, 1, 0],
     'bsdf': {'type': 'diffuse',
              'reflectance': {'type': 'spheremap', 'map': 'panoramic', 'center': [0, 1, 0],
                              'picture': {'type': 'bitmap', 'filename': 'probe.hdr'}}}}
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.emitters.dome_sampling import find_map
from relume.parameters import text, vector, wrong_type


def define() -> type[mi.Texture]:
    """Return the plugin's class for the variant in use."""

    class SphereMap(mi.Texture):
        def __init__(self, props):
            mi.Texture.__init__(self, props)
            self.map_name = text(props, "map", "transposed")
            self.map = find_map(self.map_name)
            self.center = mi.Point3f(*vector(props, "center", (0, 0, 0)).tolist())
            to_sphere = props.get("to_sphere", mi.ScalarTransform4d())
            if not hasattr(to_sphere, "matrix"):
                raise wrong_type("to_sphere", "a transform", to_sphere)
            self.to_sphere = mi.Matrix3f(np.array(to_sphere.matrix)[:3, :3].tolist())
            nested = [value for _, value in props.objects() if isinstance(value, mi.Texture)]
            if len(nested) != 1:
                raise ValueError("spheremap takes one nested texture")
            self.nested = nested[0]
            dr.make_opaque(self.center, self.to_sphere)

        def traverse(self, cb):
            cb.put("nested", self.nested, mi.ParamFlags.Differentiable)

        def mapped(self, si):
            """The interaction with the coordinates of the map."""
            n = dr.normalize(self.to_sphere @ mi.Vector3f(si.p - self.center))
            result = mi.SurfaceInteraction3f(si)
            result.uv = self.map.to_uv(n)
            return result

        def eval(self, si, active=True):
            return self.nested.eval(self.mapped(si), active)

        def eval_1(self, si, active=True):
            return self.nested.eval_1(self.mapped(si), active)

        def eval_3(self, si, active=True):
            return self.nested.eval_3(self.mapped(si), active)

        def mean(self):
            return self.nested.mean()

        def max(self):
            return self.nested.max()

        def resolution(self):
            return self.nested.resolution()

        def is_spatially_varying(self):
            return True

        def to_string(self):
            return (
                f"SphereMap[map = {self.map_name}, center = {self.center}, "
                f"to_sphere = {self.to_sphere}, nested = {self.nested}]"
            )

    return SphereMap
