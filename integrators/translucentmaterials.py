"""The translucent materials of a scene, and their media."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.bsdfs.subsurface import SubsurfaceMedium
from relume.integrators.singlescattering import no_medium
from relume.integrators.translucentobjects import TranslucentObjects


class TranslucentMaterials:
    """The translucent materials of a scene, as known before the kernel is traced.

    Attributes:
        inner: from the material of a shape to the `subsurface` in it.
        objects: `TranslucentObjects`, what the shapes of these materials make up.
        has_blends: whether some material has more than its `subsurface` in it.
        refract: whether paths run on inside some material, which those of level -2 do not allow.
    """

    def __init__(self, scene: mi.Scene) -> None:
        self.inner = {}
        self.has_blends = False
        shapes = list(shapes_below(scene))
        for outer in {shape.bsdf() for shape in shapes}:
            leaves = list(leaf_materials(outer))
            translucent = [leaf for leaf in leaves if hasattr(leaf, "medium")]
            if translucent:
                self.inner[outer] = translucent[0]
                self.has_blends |= len(leaves) > 1
        self.objects = TranslucentObjects(
            [(s, self.inner[s.bsdf()].object) for s in shapes if s.bsdf() in self.inner]
        )
        self.refract = any(bsdf.level == -1 for bsdf in self.inner.values())

    def __bool__(self):
        return bool(self.inner)

    def translucent(self, bsdf: mi.BSDFPtr) -> mi.BSDFPtr:
        """Return the ``mi.BSDFPtr`` of what is translucent in a mask, a bump map and the like."""
        pairs = [
            [dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(b))[0] for b in pair]
            for pair in self.inner.items()
        ]
        if all(outer == inner for outer, inner in pairs):
            return bsdf
        table = np.arange(max(outer for outer, _ in pairs) + 1, dtype=np.uint32)
        for outer, inner in pairs:
            table[outer] = inner
        index = dr.reinterpret_array(mi.UInt32, bsdf)
        index = dr.gather(mi.UInt32, mi.UInt32(table), index, index < len(table))
        return dr.reinterpret_array(mi.BSDFPtr, index)


def nested(parent: mi.Object, kind: type) -> list[Any]:
    """The objects of a kind directly below `parent`."""

    class Collector(mi.TraversalCallback):
        def __init__(self):
            mi.TraversalCallback.__init__(self)
            self.found = []

        def put(self, name, value, flags, cpptype=None):
            if isinstance(value, kind):
                self.found.append(value)

    collector = Collector()
    parent.traverse(collector)
    return collector.found


def shapes_below(parent: mi.Object) -> Iterator[mi.Shape]:
    """Yield all shapes with a material below `parent`, those of groups once."""
    seen = set()
    pending = nested(parent, mi.Shape)
    while pending:
        shape = pending.pop()
        if shape not in seen:
            seen.add(shape)
            pending += nested(shape, mi.Shape)
            if shape.bsdf() is not None:
                yield shape


def leaf_materials(bsdf: mi.BSDF) -> Iterator[mi.BSDF]:
    """Yield the BSDFs below `bsdf` that have none below them, itself if it has none."""
    children = nested(bsdf, mi.BSDF)
    if not children:
        yield bsdf
    for child in children:
        yield from leaf_materials(child)


def medium_of(bsdf: mi.BSDF, si: mi.SurfaceInteraction3f, active: mi.Bool) -> SubsurfaceMedium:
    """The `SubsurfaceMedium` of one BSDF, for ``dr.dispatch``."""
    return bsdf.medium(si, active) if hasattr(bsdf, "medium") else no_medium()
