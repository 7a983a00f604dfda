r"""Surface that shows nothing but shadows of the sky (``shadowcatcher``)
=====================================================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``reflectance``
     - spectrum or texture
     - :math:`\rho`, colour of the surface in shadow. Default: 0.2. Differentiable.

A direction o above the surface is open if a ray along it reaches the sky: an environment emitter,
or a shape that shines with a picture, such as a dome of ``ibldome``. With V the share of open
directions, weighted by their cosine,

.. math::
    f(i, o) = V \delta(o + i) + \frac{\rho}{\pi} \quad \text{for directions } o
    \text{ that are not open}

on both sides. So the surface is invisible where nothing stands between it and the sky; elsewhere
it hides what is behind it as far as it is shaded. One cosine-distributed direction decides: where
it is open the path goes straight on, else it follows that direction with the weight :math:`\rho`.

The surface has to trace rays. It knows the scene only inside the integrator ``shadowcatching``; in
any other, also in ``bdpt``, it is an ordinary diffuse surface: :math:`f(i, o)` is not
:math:`f(o, i)`, and V, a density of paths from the lamps, is not known.

**Source.** Legacy manual, `shadow`; scene language section 11.7.

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``, without the polarized ones.

**Usage.**

.. code-block:: python

    {'type': 'rectangle', 'bsdf': {'type': 'shadowcatcher', 'reflectance': 0.2}}

.. code-block:: xml

    <shape type="rectangle">
        <bsdf type="shadowcatcher">
            <rgb name="reflectance" value="0.2"/>
        </bsdf>
    </shape>
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi


def shining_pictures(scene: mi.Scene) -> list[mi.Shape]:
    """The shapes of a scene that shine with a picture."""
    varying = mi.EmitterFlags.SpatiallyVarying
    lights = [shape for shape in scene.shapes() if shape.is_emitter()]
    return [shape for shape in lights if mi.has_flag(shape.emitter().flags(), varying)]


def reaches_sky(
    scene: mi.Scene, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: mi.Bool
) -> mi.Bool:
    """Whether rays from `si` along `wo` (local) reach an environment or a shining picture."""
    ray = si.spawn_ray(si.to_world(wo))
    hit = scene.ray_intersect_preliminary(ray, active=active)
    # Pointers are compared: asking the emitters for their flags would be a call in a call.
    sky = mi.Bool(scene.environment() is not None) & ~hit.is_valid()
    for shape in shining_pictures(scene):
        sky |= hit.shape == mi.ShapePtr(shape)
    return active & sky


def define() -> type[mi.BSDF]:
    """Return the plugin's class for the variant in use."""

    class ShadowCatcher(mi.BSDF):
        catches_shadows = True

        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.reflectance = props.get_texture("reflectance", 0.2)
            self.scene = None
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [mi.BSDFFlags.DiffuseReflection | sides, mi.BSDFFlags.Null | sides]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def traverse(self, cb):
            cb.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

        def open(self, si, wo, active):
            """Whether the direction `wo` is open; nowhere while the scene is unknown."""
            if self.scene is None:
                return mi.Bool(False)
            return reaches_sky(self.scene, si, wo, active)

        def sample(self, ctx, si, sample1, sample2, active=True):
            bs = dr.zeros(mi.BSDFSample3f)
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            wo.z = dr.mulsign(wo.z, si.wi.z)
            passes = self.open(si, wo, active)
            bs.wo = dr.select(passes, -si.wi, wo)
            # The share V is not known: the density of going straight on counts as that of a delta.
            bs.pdf = dr.select(passes, 1, mi.warp.square_to_cosine_hemisphere_pdf(dr.abs(wo)))
            bs.eta = 1.0
            bs.sampled_component = dr.select(passes, mi.UInt32(1), mi.UInt32(0))
            bs.sampled_type = dr.select(
                passes,
                mi.UInt32(+mi.BSDFFlags.Null),
                mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
            )
            rho = self.reflectance.eval(si, active & ~passes)
            return bs, dr.select(active, dr.select(passes, 1, rho), 0)

        def _density(self, si, wo, active):
            """cos / pi on the viewer's side, 0 where `wo` is open."""
            same_side = active & (si.wi.z * wo.z > 0)
            density = mi.warp.square_to_cosine_hemisphere_pdf(mi.Vector3f(wo.x, wo.y, dr.abs(wo.z)))
            return dr.select(same_side & ~self.open(si, wo, same_side), density, 0)

        def eval(self, ctx, si, wo, active=True):
            return self.reflectance.eval(si, active) * self._density(si, wo, active)

        def pdf(self, ctx, si, wo, active=True):
            return self._density(si, wo, active)

        def eval_pdf(self, ctx, si, wo, active=True):
            density = self._density(si, wo, active)
            return self.reflectance.eval(si, active) * density, density

        def eval_diffuse_reflectance(self, si, active=True):
            return self.reflectance.eval(si, active)

        def to_string(self):
            return f"ShadowCatcher[reflectance={self.reflectance}]"

    return ShadowCatcher
