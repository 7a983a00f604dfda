"""Surfaces that light crosses straight on: which scenes have them, and what they leave of light.

A surface with a ``Null`` lobe (``mask``, ``null``, ``thindielectric``, index-matched glass) passes
a share T of the light on in the same direction, which ``BSDF.eval_null_transmission`` tells.
"""

from __future__ import annotations

import functools
import operator
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH

SHADOW_EPSILON = 1500 * 2**-24 * 10
"""How much shorter than the distance to a lamp a shadow ray is: ``math::ShadowEpsilon``."""


@functools.cache
def collector(_variant: str | None) -> type:
    """The class of callbacks that collect shapes, under the variant in use."""

    class Collector(mi.TraversalCallback):
        def __init__(self) -> None:
            super().__init__()
            self.shapes: list[Any] = []

        def put(self, name: str, value: Any, flags: Any, cpptype: Any = None) -> None:
            if isinstance(value, mi.Shape):
                self.shapes.append(value)

    return Collector


def shapes_below(parent: Any) -> list[Any]:
    """The shapes that a scene or a group holds, groups that are not seen themselves among them."""
    found = collector(mi.variant())()
    parent.traverse(found)
    return found.shapes


def all_flags(scene: mi.Scene) -> int:
    """The flags of all BSDFs of a scene, those of instanced shapes among them."""
    shapes = list(scene.shapes())
    if any(shape.class_name() == "Instance" for shape in shapes):
        groups = [
            shape for shape in shapes_below(scene) if shape.class_name().startswith("ShapeGroup")
        ]
        if not groups:  # those that are written inside an instance cannot be reached
            return mi.BSDFFlags.Null | HERO_WAVELENGTH
        shapes += [shape for group in groups for shape in shapes_below(group)]
    return functools.reduce(operator.or_, (int(shape.bsdf().flags()) for shape in shapes), 0)


class Surfaces:
    """What a path tracer has to reckon with in a scene, as it is now.

    No dataclass, whose fields Dr.Jit would take for state of the loops that use it.

    Args:
        scene: `mi.Scene`.

    Attributes:
        see_through: whether light crosses some surface straight on.
        disperse: whether some surface parts the wavelengths (`relume.bsdfs.dispersion`).
        masked_lamps: whether some shape that shines has a ``mask``.
        solid_lamps: shapes that shine and let light pass, but whose light no mask holds back.
        backdrops: shapes that are not lit where they are seen.
        spheres: lamps that are spheres.
    """

    def __init__(self, scene: mi.Scene) -> None:
        flags = all_flags(scene)
        self.see_through = mi.has_flag(flags, mi.BSDFFlags.Null)
        self.disperse = mi.is_spectral and flags & HERO_WAVELENGTH != 0
        masked: list[Any] = []
        solid: list[Any] = []
        for shape in scene.shapes() if self.see_through else ():
            if shape.is_emitter() and mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.Null):
                (masked if shape.bsdf().class_name() == "MaskBSDF" else solid).append(shape)
        self.masked_lamps = bool(masked)
        self.solid_lamps = solid
        lamps = [shape for shape in scene.shapes() if shape.is_emitter()]
        self.spheres = [lamp for lamp in lamps if lamp.class_name() == "Sphere"]
        self.backdrops = [lamp for lamp in lamps if getattr(lamp.emitter(), "backdrop", False)]

    def unlit(self, shape: Any, seen: Any) -> Any:
        """Whether a surface that a ray meets is a backdrop.

        Args:
            shape: `mi.ShapePtr`.
            seen: `mi.Bool`, whether no emitter sample could have drawn the ray.
        """
        found = mi.Bool(False)
        for backdrop in self.backdrops:
            found |= shape == mi.ShapePtr(backdrop)
        return found & seen

    def light_themselves(self, si: Any, ds: Any) -> Any:
        """Whether a sphere's inner side is to be lit by the outer one.

        To single precision a point of a sphere is as often before it as within, and the stock
        sphere samples what would be seen from there: the outer side of the point itself.

        Args:
            si: `mi.SurfaceInteraction3f`, the point that is lit.
            ds: `mi.DirectionSample3f` of a lamp.
        """
        on_sphere = mi.Bool(False)
        for sphere in self.spheres:
            on_sphere |= si.shape == mi.ShapePtr(sphere)
        itself = on_sphere & (ds.emitter.get_shape() == si.shape)
        return itself & (dr.dot(si.n, ds.d) < 0) & (dr.dot(ds.n, ds.d) < 0)

    def shining(self, shape: Any, T: Any) -> Any:
        """The share of its emission with which a surface of null transmission `T` shines."""
        if not self.masked_lamps:
            return mi.Spectrum(1)
        solid = mi.Bool(False)
        for lamp in self.solid_lamps:
            solid |= shape == mi.ShapePtr(lamp)
        return dr.select(solid, 1, 1 - T)

    @dr.syntax
    def transmittance(self, scene: mi.Scene, si: Any, ds: Any, active: Any) -> Any:
        """What the surfaces between a point and a sampled point of a lamp leave of its light.

        Args:
            scene: the scene.
            si: `mi.SurfaceInteraction3f`, the point.
            ds: `mi.DirectionSample3f` of the lamp.
            active: `mi.Bool`, whose light is asked for.

        Returns:
            `mi.Spectrum`, times the share of its emission with which the lamp shines there.
        """
        T = mi.Spectrum(1)
        active = mi.Bool(active)
        ray = si.spawn_ray_to(ds.p)
        towards = mi.Vector3f(ray.d)
        lamp = ds.emitter.get_shape()
        while dr.hint(active, label="Shadow ray"):
            end = mi.Float(ray.maxt)
            ray.maxt = self.reach(lamp, end)
            si = scene.ray_intersect(ray, ray_flags=mi.RayFlags.All, coherent=False, active=active)
            T_here = si.bsdf().eval_null_transmission(si, active)
            active &= si.is_valid()
            at_lamp = active & (si.t >= end) & (si.shape == lamp)
            active &= si.t < end
            T *= dr.select(active, T_here, 1)
            T *= dr.select(at_lamp, self.shining(si.shape, T_here), 1)
            # Aimed anew, for rays start beside the line: some would meet the lamp before the point.
            ray = si.spawn_ray_to(ds.p)
            # Beyond the lamp they would come back, and might never end.
            active &= dr.any(T != 0) & (dr.dot(ray.d, towards) > 0)
        return T

    def reach(self, lamp: Any, end: Any) -> Any:
        """How far a shadow ray goes: onto the lamp itself where its surface matters."""
        if not self.masked_lamps:
            return end
        return dr.select(lamp != None, end * (1 + 2 * SHADOW_EPSILON), end)  # noqa: E711
