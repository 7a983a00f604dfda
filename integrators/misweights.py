"""Weights of bidirectional path tracing from two numbers a subpath.

A path of n edges can be found in n + 1 ways: by s vertices from the lamp and t from the camera,
s + t = n + 1. The balance heuristic weighs each way by its density p(s, t) times its number of
samples. Ratios of densities of neighbouring ways telescope, so that a subpath carries all of them
in two sums, dVCM and dVC (I. Georgiev, "Implementing Vertex Connection and Merging", Saarland
University 2012, section 4, without merging), whatever its length:

- dVCM is the density with which the last edge's two ends would be connected, over that with which
  the subpath has found its last vertex;
- dVC, times the density of going back, is the same for all ways that leave the subpath earlier.

Densities are those of solid angle turned into those of area by geometric normals. A delta vertex
cannot be connected: dVCM = 0 after it, and its two densities, which are equal, drop out.

Ways differ in their numbers of samples. A hit of a lamp and a sample of an emitter are one for each
path of the camera. There are r light subpaths for each of them, and κ connections of a vertex with
those of light subpaths (`g`: 1 at the first vertex of a subpath, whose dVCM already tells of the
other end, κ at the others).

A vertex between two edges that cannot be connected may be merged with light vertices near it. That
is another way, on which both subpaths have found the vertex: ν is the area of the disk of merges
times the number of light subpaths, over that of the camera's that share them, which are no
independent samples (P. Grittmann et al., "Correlation-Aware Multiple Importance Sampling for
Bidirectional Rendering Algorithms", Computer Graphics Forum 2021). A subpath that leaves such a
vertex carries ν in a third sum, dVM, until it knows at its next vertex whether that edge can be
connected.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi


@dataclass
class Subpath:
    """Both sums of a subpath.

    Attributes:
        dVCM: ``mi.Float``.
        dVC: ``mi.Float``.
        dVM: ``mi.Float``, or None where no vertices are merged.
    """

    dVCM: mi.Float
    dVC: mi.Float
    dVM: mi.Float | None = None


def arrived(subpath: Subpath, squared_distance: mi.Float, cos: mi.Float) -> Subpath:
    """The sums at the next vertex, in area measure (eq. 31 to 36).

    Args:
        subpath: where the last vertex has scattered.
        squared_distance: from there.
        cos: between the ray and the geometric normal where it arrives, above 0.
    """
    dVM = None if subpath.dVM is None else subpath.dVM / cos
    return Subpath(subpath.dVCM * squared_distance / cos, subpath.dVC / cos, dVM)


def scattered(
    subpath: Subpath,
    g: mi.Float,
    pdf: mi.Float,
    pdf_back: mi.Float,
    cos: mi.Float,
    delta: mi.Bool,
    ν: mi.Float | None = None,
) -> Subpath:
    """The sums of a subpath after it has scattered.

    Args:
        subpath: where it has arrived.
        g: relative number of connections of the edge that it came by.
        pdf: density of the sampled direction [1/sr].
        pdf_back: density of the direction that it came from, were it followed the other way.
        cos: between the sampled direction and the geometric normal.
        delta: whether the event was a delta one.
        ν: samples of merges here, if the next edge cannot be connected; needed where there is dVM.
    """
    p = dr.select(pdf > 0, dr.rcp(pdf), 0)
    smooth = cos * p * dr.fma(subpath.dVC, pdf_back, g * subpath.dVCM)
    dVC, dVM = subpath.dVC, None
    if ν is not None:
        dVC = dVC + subpath.dVM
        dVM = dr.select(delta, 0, cos * p * ν)
    return Subpath(dr.select(delta, 0, p), dr.select(delta, dVC * cos, smooth), dVM)


def other_ways(subpath: Subpath, g: mi.Float, pdf_back: mi.Float) -> mi.Float:
    """What the ways that leave a subpath before its last vertex weigh, over the density of it."""
    return dr.fma(subpath.dVC, pdf_back, g * subpath.dVCM)


def finite(weight: mi.Float) -> mi.Float:
    """The weight, 0 where nothing can be said."""
    return dr.select(dr.isfinite(weight), weight, 0)


def of_hit(subpath: Subpath, pdf_emitter: mi.Float, emission: mi.Float) -> mi.Float:
    """The weight of a lamp that a path of the camera has hit.

    Args:
        subpath: where the last vertex has scattered; distances and cosines at the lamp cancel.
        pdf_emitter: density with which that vertex samples the direction as one to an emitter.
        emission: density of what the lamp emits over the cosine there [1/(area sr)].
    """
    others = dr.fma(pdf_emitter, subpath.dVCM, emission * subpath.dVC)
    return finite(dr.rcp(1 + others))


def of_emitter_sample(pdf_ratio: mi.Float, emission_ratio: mi.Float, others: mi.Float) -> mi.Float:
    """The weight of a sampled point of an emitter.

    Args:
        pdf_ratio: density of the direction by the BSDF over that by emitter sampling.
        emission_ratio: density with which a light subpath begins by that very edge, over the
            density of the emitter sample.
        others: `other_ways` of the camera's subpath.
    """
    return finite(dr.rcp(1 + pdf_ratio + emission_ratio * others))


def of_sensor_connection(pdf_sensor: mi.Float, r: mi.Float, others: mi.Float) -> mi.Float:
    """The weight of a light vertex that is connected to the camera.

    Args:
        pdf_sensor: density with which a ray of the camera finds the vertex [1/area].
        r: light subpaths for each path of the camera.
        others: `other_ways` of the light subpath.
    """
    return finite(dr.rcp(1 + pdf_sensor / r * others))


def of_connection(
    κ: mi.Float, pdf_y: mi.Float, others_y: mi.Float, pdf_x: mi.Float, others_x: mi.Float
) -> mi.Float:
    """The weight of a vertex x of the camera connected with a vertex y of a light subpath.

    Args:
        κ: connections of x with each light subpath's vertices.
        pdf_y: density with which x finds y [1/area].
        others_y: `other_ways` of the light subpath.
        pdf_x: density with which y finds x [1/area].
        others_x: `other_ways` of the camera's subpath.
    """
    return finite(κ / (κ + dr.fma(pdf_y, others_y, pdf_x * others_x)))


def of_merge(ν: mi.Float, others_y: mi.Float, others_x: mi.Float) -> mi.Float:
    """The weight of a vertex of the camera merged with a vertex of a light subpath.

    Args:
        ν: merges of x with each light subpath, times area.
        others_y: `other_ways` of the light subpath.
        others_x: `other_ways` of the camera's subpath.
    """
    return finite(ν / (ν + others_y + others_x))
