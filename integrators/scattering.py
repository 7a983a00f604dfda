"""What a surface does with directions, and with a new one that it draws, in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi


@dataclass
class Towards:
    """A given direction at a surface.

    Attributes:
        f: ``mi.Spectrum``, the BSDF times the cosine to the shading normal.
        pdf: density with which the surface draws it [1/sr].
        pdf_back: density of the direction of `si.wi`, were it followed the other way [1/sr].
    """

    f: mi.Spectrum
    pdf: mi.Float
    pdf_back: mi.Float


@dataclass
class Drawn:
    """A direction that a surface has drawn.

    Attributes:
        wo: ``mi.Vector3f``, local.
        weight: ``mi.Spectrum``.
        pdf: its density [1/sr].
        pdf_back: density of the direction of `si.wi`, were it followed the other way [1/sr].
        eta: ``mi.Float``, relative index.
        sampled_type: ``mi.UInt32``.
    """

    wo: mi.Vector3f
    weight: mi.Spectrum
    pdf: mi.Float
    pdf_back: mi.Float
    eta: mi.Float
    sampled_type: mi.UInt32


def pdf_back(
    bsdf: mi.BSDF,
    ctx: mi.BSDFContext,
    si: mi.SurfaceInteraction3f,
    wo: mi.Vector3f,
    active: mi.Bool,
) -> mi.Float:
    """Density of `si.wi` for light that comes by `wo`."""
    other = mi.SurfaceInteraction3f(si)
    other.wi = wo
    return bsdf.pdf(ctx, other, si.wi, active)


def towards(
    ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: mi.Bool
) -> Towards:
    """Evaluate a direction at a surface.

    Args:
        ctx: ``mi.BSDFContext``.
        si: ``mi.SurfaceInteraction3f``.
        wo: local direction.
        active: lanes.
    """

    def call(bsdf, si, wo, active):
        f, pdf = bsdf.eval_pdf(ctx, si, wo, active)
        return mi.Spectrum(f), pdf, pdf_back(bsdf, ctx, si, wo, active)

    return Towards(*dr.dispatch(si.bsdf(), call, si, wo, active))


def scatter(
    ctx: mi.BSDFContext,
    si: mi.SurfaceInteraction3f,
    directions: Sequence[mi.Vector3f],
    sample1: mi.Float,
    sample2: mi.Point2f,
    active: mi.Bool,
) -> tuple[list[Towards], Drawn]:
    """Evaluate directions at a surface, and draw another one.

    Args:
        ctx: ``mi.BSDFContext``.
        si: ``mi.SurfaceInteraction3f``.
        directions: local.
        sample1: uniform variate for the component.
        sample2: ``mi.Point2f``, uniform variates for the direction.
        active: lanes.
    """

    def call(bsdf, si, directions, sample1, sample2, active):
        first, *others = directions
        f, pdf, bs, weight = bsdf.eval_pdf_sample(ctx, si, first, sample1, sample2, active)
        values = [(f, pdf), *(bsdf.eval_pdf(ctx, si, wo, active) for wo in others)]
        backs = [pdf_back(bsdf, ctx, si, wo, active) for wo in (*directions, bs.wo)]
        values = [(mi.Spectrum(f), pdf) for f, pdf in values]  # some return plain arrays
        return values, backs, bs.wo, mi.Spectrum(weight), bs.pdf, bs.eta, bs.sampled_type

    found = dr.dispatch(si.bsdf(), call, si, list(directions), sample1, sample2, active)
    values, (*backs, back), wo, weight, pdf, eta, kind = found
    pairs = zip(values, backs, strict=True)
    evaluated = [Towards(f, pdf_o, pdf_b) for (f, pdf_o), pdf_b in pairs]
    return evaluated, Drawn(wo, weight, pdf, back, eta, kind)


def drawn(
    ctx: mi.BSDFContext,
    si: mi.SurfaceInteraction3f,
    sample1: mi.Float,
    sample2: mi.Point2f,
    active: mi.Bool,
) -> Drawn:
    """Draw a direction at a surface; arguments as `scatter`."""

    def call(bsdf, si, sample1, sample2, active):
        bs, weight = bsdf.sample(ctx, si, sample1, sample2, active)
        back = pdf_back(bsdf, ctx, si, bs.wo, active)
        return bs.wo, mi.Spectrum(weight), bs.pdf, back, bs.eta, bs.sampled_type

    return Drawn(*dr.dispatch(si.bsdf(), call, si, sample1, sample2, active))


def without_shading_normal(si: mi.SurfaceInteraction3f, d: mi.Vector3f) -> mi.Float:
    """The geometric over the shading cosine of a direction.

    Light that scatters along d has this factor besides the BSDF and its cosine, light that arrives
    from d its inverse (E. Veach 1997, eq. 5.17).

    Args:
        si: ``mi.SurfaceInteraction3f``.
        d: ``mi.Vector3f``, in world space.
    """
    shading = dr.abs(dr.dot(si.sh_frame.n, d))
    return dr.select(shading > 0, dr.abs(dr.dot(si.n, d)) / shading, 0)
