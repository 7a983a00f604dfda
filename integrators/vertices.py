"""What a path does at its vertices in a scene with translucent objects: one `Vertex` for each kind.

A path meets surfaces; below those of the material `subsurface` it goes on from points where light
enters by diffusion, scatters inside the medium, and crosses the boundary on its way out.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from relume.bsdfs.subsurface import SubsurfaceMedium
from relume.integrators.diffusion import ExitPoint, Standard
from relume.integrators.seethrough import Surfaces
from relume.integrators.singlescattering import (
    leave_straight,
    no_medium,
    phase,
    phase_mixture,
    sample_distance,
    sample_phase,
)
from relume.integrators.translucentmaterials import TranslucentMaterials
from relume.integrators.translucentobjects import ObjectId


@dataclass
class Interior:
    """The medium that a path is in, and how it came there, seen from the camera.

    Attributes:
        medium: `SubsurfaceMedium`.
        boundary: `ObjectId` of the object that it fills.
        exit: `ExitPoint`, where the path has come in, which is where light leaves.
        before: ``mi.Vector3f``, direction of travel before the path scattered.
    """

    medium: SubsurfaceMedium
    boundary: ObjectId
    exit: ExitPoint
    before: mi.Vector3f

    @classmethod
    def none(cls) -> Interior:
        """That of paths that are outside."""
        exit = ExitPoint(mi.Point3f(0), mi.Normal3f(0))
        return cls(no_medium(), ObjectId.none(), exit, mi.Vector3f(0))


@dataclass
class Vertex:
    """What a path does at a vertex.

    Attributes:
        f: ``mi.Spectrum``, the share of the light from a sampled emitter that goes on along the
            path [1/sr], times the cosine on surfaces.
        pdf: ``mi.Float``, density at which the vertex itself draws that direction [1/sr].
        w: ``mi.Vector3f``, direction of travel that it draws, in world space.
        pdf_w: ``mi.Float``, its density [1/sr].
        weight: ``mi.Spectrum``, factor of the throughput.
        eta: ``mi.Float``, relative index of refraction along `w`.
        sampled_type: ``mi.UInt32``, ``mi.BSDFFlags`` of the sample; 0 inside media.
    """

    f: mi.Spectrum
    pdf: mi.Float
    w: mi.Vector3f
    pdf_w: mi.Float
    weight: mi.Spectrum
    eta: mi.Float
    sampled_type: mi.UInt32


def at_surface(
    bsdf: mi.BSDFPtr,
    ctx: mi.BSDFContext,
    si: mi.SurfaceInteraction3f,
    d: mi.Vector3f,
    sample1: mi.Float,
    sample2: mi.Point2f,
    active: mi.Bool,
) -> Vertex:
    """Scatter by the BSDF of a surface.

    Args:
        bsdf: ``mi.BSDFPtr``.
        ctx: ``mi.BSDFContext``.
        si: ``mi.SurfaceInteraction3f``.
        d: direction to a sampled emitter, in world space.
        sample1: uniform variate for the component.
        sample2: ``mi.Point2f``, uniform variates for the direction.
        active: lanes.
    """
    f, pdf, bs, weight = bsdf.eval_pdf_sample(ctx, si, si.to_local(d), sample1, sample2, active)
    return Vertex(f, pdf, si.to_world(bs.wo), bs.pdf, weight, bs.eta, bs.sampled_type)


def at_entry(
    profile: type[Standard],
    interior: Interior,
    si: mi.SurfaceInteraction3f,
    d: mi.Vector3f,
    sample: mi.Point2f,
) -> Vertex:
    """Go on from where light enters by diffusion, with a cosine distribution.

    Args:
        profile: class of `relume.integrators.diffusion`.
        interior: the medium.
        si: where light enters.
        d: direction to a sampled emitter, in world space.
        sample: ``mi.Point2f``, uniform variates for the direction.
    """
    medium, leaves = interior.medium, interior.exit
    to_light, wo = si.to_local(d), mi.warp.square_to_cosine_hemisphere(sample)
    above = to_light.z > 0
    return Vertex(
        f=dr.select(above, profile.entering(medium, leaves, si, to_light) * to_light.z, 0),
        pdf=dr.select(above, to_light.z * dr.inv_pi, 0),
        w=si.to_world(wo),
        pdf_w=wo.z * dr.inv_pi,
        weight=profile.entering(medium, leaves, si, wo) * dr.pi,
        eta=mi.Float(1),
        sampled_type=mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
    )


def at_scattering(
    medium: SubsurfaceMedium,
    throughput: mi.Spectrum,
    before: mi.Vector3f,
    d: mi.Vector3f,
    arrives: mi.Spectrum,
    sample1: mi.Float,
    sample2: mi.Point2f,
) -> Vertex:
    """Scatter by the phase function of a medium.

    Args:
        medium: `SubsurfaceMedium`.
        throughput: ``mi.Spectrum`` of the path, which the choice of the channel follows.
        before: direction of travel before.
        d: direction to a sampled emitter, in world space.
        arrives: ``mi.Spectrum``, what `leave_straight` says of the way to the emitter.
        sample1: uniform variate for the channel.
        sample2: ``mi.Point2f``, uniform variates for the direction.
    """
    w = sample_phase(medium, throughput, before, sample1, sample2)
    pdf_w = phase_mixture(medium, throughput, before, w)
    return Vertex(
        f=arrives,
        pdf=phase_mixture(medium, throughput, before, d),
        w=w,
        pdf_w=pdf_w,
        weight=phase(medium, before, w) / pdf_w,
        eta=mi.Float(1),
        sampled_type=mi.UInt32(0),
    )


def at_crossing(medium: SubsurfaceMedium, d: mi.Vector3f) -> Vertex:
    """Leave a medium straight on along `d`, as `leave_straight` has it, which has the weight."""
    zero, one = mi.Spectrum(0), mi.Spectrum(1)
    return Vertex(
        zero, mi.Float(0), mi.Vector3f(d), mi.Float(0), one, dr.rcp(medium.eta), mi.UInt32(0)
    )


def through_medium(
    interior: Interior,
    throughput: mi.Spectrum,
    ray: mi.Ray3f,
    si: mi.SurfaceInteraction3f,
    met: ObjectId,
    sample: mi.Point2f,
    inside: mi.Bool,
    crossing: mi.Bool,
) -> tuple[mi.Bool, mi.Float, mi.Spectrum]:
    """Follow a path through a medium to the surface that its ray meets.

    Args:
        interior: the medium.
        throughput: ``mi.Spectrum`` of the path.
        ray: of the path.
        si: what the ray meets.
        met: the object that it meets.
        sample: ``mi.Point2f``, uniform variates for the distance.
        inside: lanes that run on from the boundary, and may scatter on the way.
        crossing: lanes that have scattered, and leave straight.

    Returns:
        (whether it scatters, distance to the point, factor of the throughput).
    """
    medium, valid = interior.medium, si.is_valid()
    far = dr.select(valid, si.t, 1e30)
    scatters, distance, weight = sample_distance(medium, throughput, far, sample)
    # Of the way from the last scattering the weight so far is that of the phase function.
    leaves = leave_straight(medium, si, ray.d, interior.before)
    leaves /= phase(medium, interior.before, ray.d)
    leaves = dr.select(valid & met.is_same(interior.boundary), leaves, 0)
    weight = dr.select(inside, weight, dr.select(crossing, leaves, 1))
    return scatters & inside, distance, weight


@dataclass
class EmitterSample:
    """A point of an emitter that a vertex sees.

    Attributes:
        ds: ``mi.DirectionSample3f``.
        weight: ``mi.Spectrum``, radiance over density.
        arrives: ``mi.Spectrum``, what `leave_straight` says of the way from inside a medium.
        active: lanes that see it.
    """

    ds: mi.DirectionSample3f
    weight: mi.Spectrum
    arrives: mi.Spectrum
    active: mi.Bool


@dr.syntax
def sample_emitter(
    scene: mi.Scene,
    interior: Interior,
    vertex: mi.SurfaceInteraction3f,
    before: mi.Vector3f,
    sample: mi.Point2f,
    active: mi.Bool,
    scatters: mi.Bool,
    materials: TranslucentMaterials,
    surfaces: Surfaces,
) -> EmitterSample:
    """Draw a point of an emitter and look whether it is seen.

    Args:
        scene: ``mi.Scene``.
        interior: `Interior` of the vertices inside a medium.
        vertex: ``mi.SurfaceInteraction3f``; its normal is 0 inside a medium.
        before: direction of travel.
        sample: ``mi.Point2f``, uniform variates.
        active: lanes.
        scatters: lanes inside a medium.
        materials: the translucent ones; whether they refract says whether there can be any.
        surfaces: those that light crosses straight on.

    Returns:
        `EmitterSample`.
    """
    ds, weight = scene.sample_emitter_direction(vertex, sample, False, active)
    active = active & (ds.pdf != 0)
    if dr.hint(surfaces.spheres, mode="scalar"):
        active &= ~surfaces.light_themselves(vertex, ds)
    shadow = vertex.spawn_ray_to(ds.p)
    arrives, inside = mi.Spectrum(0), mi.Bool(False)
    left = dr.zeros(mi.SurfaceInteraction3f)
    if dr.hint(materials.refract, mode="scalar"):
        inside = active & scatters
        if inside:
            si = scene.ray_intersect(shadow, mi.RayFlags.All, coherent=False, active=inside)
            arrives = leave_straight(interior.medium, si, ds.d, before)
            inside &= si.is_valid() & materials.objects.at(si, inside).is_same(interior.boundary)
            arrives = dr.select(inside, arrives, 0)
            shadow = dr.select(inside, si.spawn_ray_to(ds.p), shadow)
            left = si
        active &= ~scatters | dr.any(arrives > 0)
    if dr.hint(surfaces.see_through, mode="scalar"):
        start = mi.SurfaceInteraction3f(vertex)
        if dr.hint(materials.refract, mode="scalar"):
            start = dr.select(inside, left, start)
        weight = weight * surfaces.transmittance(scene, start, ds, active)
    else:
        active &= ~scene.ray_test(shadow, active)
    return EmitterSample(ds, weight, arrives, active)
