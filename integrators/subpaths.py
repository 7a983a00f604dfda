"""What subpaths from the lamps and from the camera share."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from relume.bsdfs.dispersion import HERO_WAVELENGTH
from relume.integrators.lightstarts import Emission
from relume.integrators.seethrough import Surfaces
from relume.integrators.sensorconnections import PinholeOnDevice
from relume.integrators.translucentmaterials import nested

MAPS = ("BumpMap", "NormalMap")
"""Classes of BSDFs that need derivatives of the surface."""


class Transport:
    """What is rendered, and how: the same for all subpaths of a pass.

    No dataclass, whose fields Dr.Jit would take for state of the loops that use it.

    Args:
        scene: `mi.Scene`.
        pinhole: `PinholeOnDevice`, or None where light subpaths cannot be connected to the camera.
        integrator: whose ``min_depth``, ``max_depth``, ``rr_depth`` and ``hide_emitters`` count,
            and ``only``, the one way (s, t) that a test wants to see alone, or None.

    Attributes:
        partials: whether light vertices keep derivatives of the surface.
        r: light subpaths for each path of the camera.
        κ: connections of a vertex with each light subpath.
        ν: merges of a vertex with each light subpath, times area; None where none are merged.
    """

    def __init__(self, scene: mi.Scene, pinhole: PinholeOnDevice | None, integrator: Any) -> None:
        self.scene, self.pinhole = scene, pinhole
        self.surfaces, self.emission = Surfaces(scene), Emission(scene)
        self.min_depth, self.max_depth = integrator.min_depth, integrator.max_depth
        self.rr_depth, self.hide_emitters = integrator.rr_depth, integrator.hide_emitters
        self.only = integrator.only
        self.partials = needs_partials(scene)
        self.radiance = mi.BSDFContext(mi.TransportMode.Radiance)
        self.importance = mi.BSDFContext(mi.TransportMode.Importance)
        if self.surfaces.disperse:
            self.radiance.type_mask |= HERO_WAVELENGTH
            self.importance.type_mask |= HERO_WAVELENGTH
        self.r = self.κ = mi.Float(1)
        self.ν = mi.Float(1) if integrator.merge_radius > 0 else None

    def set_ratios(self, r: float, κ: float, ν: float) -> None:
        """Set `r`, `κ` and, where vertices are merged, `ν`.

        Args:
            r: light subpaths for each path of the camera.
            κ: connections of a vertex with each light subpath.
            ν: merges of a vertex with each light subpath, times area.
        """
        self.r, self.κ = dr.opaque(mi.Float, r), dr.opaque(mi.Float, κ)
        if self.ν is not None:
            self.ν = dr.opaque(mi.Float, ν)

    def no_merges(self) -> mi.Float | None:
        """dVM at the beginning of a subpath."""
        return None if self.ν is None else mi.Float(0)

    def alone(self, weight: Any, s: Any, t: Any) -> Any:
        """The weight of a way; that of the one to be seen alone is 1."""
        if self.only is None:
            return weight
        return dr.select((s == self.only[0]) & (t == self.only[1]), mi.Float(1), 0)


def unoccluded(
    t: Transport,
    si: mi.SurfaceInteraction3f,
    p: mi.Point3f,
    active: mi.Bool,
    passes_lamps: bool = False,
) -> mi.Spectrum:
    """What of the light between two points arrives: 0 or 1, or what surfaces let through.

    Args:
        t: `Transport`.
        si: one point.
        p: the other.
        active: lanes.
        passes_lamps: whether shapes that shine are no obstacle.
    """
    if passes_lamps:
        return past_lamps(t, si, p, active)
    if t.surfaces.see_through:
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = p
        return t.surfaces.transmittance(t.scene, si, ds, active)
    hit = t.scene.ray_test(si.spawn_ray_to(p), coherent=False, active=active)
    return dr.select(hit, 0, mi.Spectrum(1))


@dr.syntax
def past_lamps(t: Transport, si: Any, p: Any, active: Any) -> Any:
    """`unoccluded` where shapes that shine are not there."""
    T = mi.Spectrum(1)
    active = mi.Bool(active)
    ray = si.spawn_ray_to(p)
    towards = mi.Vector3f(ray.d)
    while dr.hint(active, label="Past lamps"):
        si = t.scene.ray_intersect(ray, ray_flags=mi.RayFlags.All, coherent=False, active=active)
        active &= si.is_valid()
        lamp = si.shape.emitter() != None  # noqa: E711
        T_here = si.bsdf().eval_null_transmission(si, active)
        T *= dr.select(active & ~lamp, T_here, 1)
        ray = si.spawn_ray_to(p)  # aimed anew, as in `Surfaces.transmittance`
        active &= dr.any(T != 0) & (dr.dot(ray.d, towards) > 0)
    return T


def needs_partials(scene: mi.Scene) -> bool:
    """Whether a BSDF of a scene may ask for derivatives of the surface.

    True where shapes are instanced: those that are written inside an instance cannot be reached.
    """
    shapes = scene.shapes()
    if any(shape.class_name() == "Instance" for shape in shapes):
        return True
    return any(shape.bsdf() is not None and has_map(shape.bsdf()) for shape in shapes)


def has_map(bsdf: mi.BSDF) -> bool:
    """Whether a BSDF, or one nested in it, moves normals; its flags do not tell."""
    return bsdf.class_name() in MAPS or any(map(has_map, nested(bsdf, mi.BSDF)))
