"""How light subpaths begin, and with which density, for all kinds of emitters.

Every density enters the weights as one ratio: R cos is the density with which light subpaths begin
by the edge from a point of a lamp to a surface (both ends), over that with which emitter sampling
finds the point from there, cos at the surface. E is the density of emission, over the cosine at the
lamp. With P the probability of the emitter, q that of emitter sampling, p its density per solid
angle, d the distance and A the area:

=================  ======================  ================  =====================
kind               emitted                 E                 R
=================  ======================  ================  =====================
``AREA``           uniform, cosine         P / (A π)         E / p
``PICTURE``        as emitter sampling     R p               P cos / (q π d²)
``POINT``          uniform in a cone Ω     (a delta)         P / (q Ω d²)
``FAR``            uniform in a section A  R p               P / (q A)
=================  ======================  ================  =====================

``PICTURE`` are lamps with textures, whose points are sampled by them, and `apparentlamp`; ``FAR``
are beams, and lights at infinity. Emitters that cannot emit have R = 0: their light is left to the
subpaths of the camera, by the weights of path tracing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

NONE, AREA, PICTURE, POINT, FAR = range(5)
"""Kinds of emission."""


@dataclass
class Row:
    """What the tables say of an emitter.

    Attributes:
        kind: of its emission.
        R: constant of the ratio R, without P/q.
        E: whether paths of the camera can hit it: 1 or 0.
        solid_angle: of the cone that it shines in [sr].
        position: of a ``POINT``; middle or corner of the section of something ``FAR``.
        axis: of the cone, or direction of the light.
        u, v: edges of the section, or two radii of a disk.
        disk: whether the section is a disk.
    """

    kind: int = NONE
    R: float = 0.0
    E: float = 1.0
    solid_angle: float = 4 * np.pi
    position: tuple = (0.0, 0.0, 0.0)
    axis: tuple = (0.0, 0.0, 1.0)
    u: tuple = (0.0, 0.0, 0.0)
    v: tuple = (0.0, 0.0, 0.0)
    disk: bool = False


def numbers(vector: Any) -> np.ndarray:
    """The numbers of a Dr.Jit vector: (3,) float64."""
    return np.array(vector, dtype=np.float64).reshape(3)


def class_of(emitter: Any) -> str:
    """The name of an emitter's class; of ours, Mitsuba tells that of the base alone."""
    own = type(emitter).__name__
    return own if own != "Emitter" else str(emitter.class_name())


def disk(axis: np.ndarray, radius: float) -> tuple[tuple, tuple]:
    """Two radii of the disk across an axis."""
    a = np.eye(3)[np.argmin(np.abs(axis))]
    u = np.cross(axis, a) / np.linalg.norm(np.cross(axis, a))
    return tuple(radius * u), tuple(radius * np.cross(axis, u))


def bounding_sphere(scene: mi.Scene) -> tuple[np.ndarray, float]:
    """Centre and radius of the sphere in which lights at infinity are looked for."""
    box = scene.bbox()
    low, high = numbers(box.min), numbers(box.max)
    if not np.all(low <= high):
        return np.zeros(3), 1.0
    return (low + high) / 2, float(np.linalg.norm(high - low) / 2) * 1.001 + 1e-6


def surface_row(emitter: Any) -> Row:
    """The row of a lamp on a shape, or of `apparentlamp`."""
    if mi.has_flag(emitter.flags(), mi.EmitterFlags.DeltaDirection):
        return Row()
    if hasattr(emitter, "backdrop"):  # what is seen is not what gives light
        return Row(PICTURE, R=1 / np.pi, E=0.0) if emitter.lights else Row()
    uv = np.random.default_rng(1).random((2, 64)).astype(np.float32)
    ps, _ = emitter.sample_position(0.0, mi.Point2f(*uv))
    density = np.broadcast_to(ps.pdf.numpy(), 64).astype(float)
    if not (np.isfinite(density).all() and density.max() > 0):
        return Row()
    if not mi.has_flag(emitter.flags(), mi.EmitterFlags.SpatiallyVarying):
        return Row(AREA, R=float(density.max()) / np.pi)
    # One side, or both: emitter sampling has that density in comparison.
    it, ds = dr.zeros(mi.Interaction3f), dr.zeros(mi.DirectionSample3f)
    it.p = ps.p + ps.n
    ds.p, ds.n, ds.uv, ds.d, ds.dist = ps.p, ps.n, ps.uv, -ps.n, mi.Float(1)
    sampled = np.broadcast_to(emitter.pdf_direction(it, ds).numpy(), 64).astype(float)
    known = (density > 0) & (sampled > 0)
    if not known.any():
        return Row()
    sides = float(np.median(density[known] / sampled[known]))
    return Row(PICTURE, R=round(2 * sides) / 2 / np.pi)


def point_row(emitter: Any) -> Row:
    """The row of a light at a point."""
    it = dr.zeros(mi.Interaction3f)
    position = numbers(emitter.sample_direction(it, mi.Point2f(0.5))[0].p)
    row = Row(POINT, position=tuple(position))
    kind = class_of(emitter)
    if kind == "FalloffSpot":
        row.axis, versine = tuple(numbers(emitter.direction)), float(emitter.versine_w[0])
    elif kind == "SpotLight":
        parameters = mi.traverse(emitter)
        to_world = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)
        axis = to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
        angle = np.deg2rad(float(np.array(parameters["cutoff_angle"]).ravel()[0]))
        row.axis, versine = tuple(axis), 2 * np.sin(angle / 2) ** 2
    else:
        versine = 2.0
    row.solid_angle = 2 * np.pi * min(versine * (1 + 1e-5), 2.0)
    row.R = 1 / row.solid_angle
    return row


def far_row(emitter: Any, scene: mi.Scene) -> Row:
    """The row of a beam, or of light from infinity."""
    kind = class_of(emitter)
    if kind == "ParallelBeam":
        u, v = numbers(emitter.edge_u), numbers(emitter.edge_v)
        axis = numbers(emitter.unit_direction)
        margin = 2 * float(emitter.margin[0])
        corner = numbers(emitter.origin) + margin * axis
        area = float(emitter.area[0])
        return Row(FAR, 1 / area, position=tuple(corner), axis=tuple(axis), u=tuple(u), v=tuple(v))
    center, radius = bounding_sphere(scene)
    if kind == "DomeSun":
        center, radius = numbers(emitter.center), float(emitter.radius[0])
    row = Row(FAR, 1 / (np.pi * radius**2), position=tuple(center), disk=True)
    if emitter.is_environment():
        row.u = (radius, 0.0, 0.0)
        return row
    it = dr.zeros(mi.Interaction3f)
    it.p = mi.Point3f(*center.tolist())
    axis = -numbers(emitter.sample_direction(it, mi.Point2f(0.5))[0].d)
    row.axis = tuple(axis)
    row.u, row.v = disk(axis, radius)
    return row


FAR_LIGHTS = ("ParallelBeam", "DomeSun", "DirectionalEmitter")
"""Classes of lights with one direction whose section is known."""


def row_of(emitter: Any, scene: mi.Scene) -> Row:
    """What is known of an emitter; one of kind `NONE` if it cannot emit."""
    flags = emitter.flags()
    if emitter.is_environment() or class_of(emitter) in FAR_LIGHTS:
        return far_row(emitter, scene)
    if mi.has_flag(flags, mi.EmitterFlags.DeltaPosition):
        return point_row(emitter)
    if mi.has_flag(flags, mi.EmitterFlags.Surface):
        try:
            return surface_row(emitter)
        except RuntimeError:  # a shape that cannot sample points of itself
            return Row()
    return Row()
