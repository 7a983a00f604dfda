"""What the emitter plugins share: reading parameters and filling Mitsuba's records."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np


def unit(v: np.ndarray, what: str) -> np.ndarray:
    """Return `v` (float64, shape (3,)) at length 1.

    Raises:
        ValueError: `v` has no length; `what` names it in the message.
    """
    length = np.linalg.norm(v)
    if not np.isfinite(length) or length == 0.0:
        raise ValueError(f"{what} must be a finite vector that is not zero, got {v.tolist()}")
    return v / length


def delta_sample(
    emitter: mi.Emitter,
    it: mi.Interaction3f,
    p: mi.Point3f,
    n: mi.Normal3f,
    uv: mi.Point2f,
    d: mi.Vector3f,
    dist: mi.Float,
) -> mi.DirectionSample3f:
    """Direction sample towards the one point or direction a Dirac emitter has for `it`."""
    ds = dr.zeros(mi.DirectionSample3f)
    ds.p, ds.n, ds.uv, ds.d, ds.dist = p, n, uv, d, dist
    ds.time = it.time
    ds.pdf = 1.0
    ds.delta = True
    ds.emitter = mi.EmitterPtr(emitter)
    return ds


def spectrum_lookup(
    p: mi.Point3f, uv: mi.Point2f, time: mi.Float, wavelengths: mi.Spectrum | None = None
) -> mi.SurfaceInteraction3f:
    """Surface interaction that carries what a texture needs to be evaluated at (p, uv)."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p, si.uv, si.time = p, uv, time
    if wavelengths is not None:
        si.wavelengths = wavelengths
    return si


def sample_spectrum(
    texture: mi.Texture, si: mi.SurfaceInteraction3f, sample: mi.Float, active: mi.Bool
) -> tuple[mi.Spectrum, mi.Spectrum]:
    """Wavelengths and weight of an emitted particle; RGB variants have no wavelengths.

    Args:
        texture: emitted spectrum.
        si: where it is emitted.
        sample: uniform variate in [0, 1).
        active: lanes.
    """
    shifted = mi.sample_shifted(sample) if mi.is_spectral else dr.zeros(mi.Color0f)
    return texture.sample_spectrum(si, shifted, active)


def sample_side(sample: mi.Point2f) -> tuple[mi.Point2f, mi.Float]:
    """Spend a bit of the variate `sample.x` on a side; returns the renewed variate and ±1."""
    front = sample.x < 0.5
    x = dr.select(front, 2.0 * sample.x, 2.0 * sample.x - 1.0)
    return mi.Point2f(x, sample.y), dr.select(front, mi.Float(1.0), -1.0)


def spawn_ray(
    p: mi.Point3f, n: mi.Normal3f, d: mi.Vector3f, time: mi.Float, wavelengths: mi.Spectrum
) -> mi.Ray3f:
    """Ray that leaves the surface point `p` towards `d`, on the side of the normal `n`."""
    margin = mi.math.RayEpsilon * (1.0 + dr.max(dr.abs(p)))
    return mi.Ray3f(dr.fma(margin, n, p), d, time, wavelengths)


def sample_surface_ray(
    emitter: mi.Emitter,
    time: mi.Float,
    sample1: mi.Float,
    sample2: mi.Point2f,
    sample3: mi.Point2f,
    active: mi.Bool,
) -> tuple[mi.Ray3f, mi.Spectrum]:
    """Ray of a particle that leaves the surface of a Lambertian emitter, and its weight.

    Args:
        emitter: its `sample_position` tells points with the density 1 / area, and the area.
        time: of the ray.
        sample1: uniform variate of the wavelengths.
        sample2: uniform variates of the point.
        sample3: uniform variates of the direction, drawn in proportion to the cosine.
        active: lanes.
    """
    ps, area = emitter.sample_position(time, sample2, active)
    si = mi.SurfaceInteraction3f(ps, dr.zeros(mi.Ray3f).wavelengths)
    wavelengths, weight = emitter.sample_wavelengths(si, sample1, active)
    d = mi.Frame3f(ps.n).to_world(mi.warp.square_to_cosine_hemisphere(sample3))
    weight *= dr.pi * area
    return spawn_ray(ps.p, ps.n, d, time, wavelengths), mi.depolarizer(weight)


def sphere_of(emitter: mi.Emitter) -> tuple[mi.Point3f, mi.Float] | None:
    """Centre and radius of the sphere that an emitter hangs on; None if there is no sphere.

    The centre is opaque and kept in `emitter.sphere`, so that equal scenes share a kernel.
    """
    shape = emitter.get_shape()
    if shape is None or shape.shape_type() != mi.ShapeType.Sphere.value:
        return None
    box = shape.bbox()
    if emitter.sphere is None or emitter.sphere[0] != box:
        centre = 0.5 * (np.array(box.min, np.float64) + np.array(box.max, np.float64))
        emitter.sphere = box, mi.Point3f(*(dr.opaque(mi.Float, float(x)) for x in centre))
    # A box loses the digits of a small radius far from the origin; the area does not.
    return emitter.sphere[1], dr.sqrt(shape.surface_area() / (4.0 * dr.pi))
