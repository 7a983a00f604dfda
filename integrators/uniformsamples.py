"""Independent samples of primary sample space, spread evenly over the film."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.primarysamples import Key, PathSampler, key, uniform
from relume.sensors.colors import absolute_luminance

DIM_STRATUM = 0xFFFFFFF2
"""Dimension of the random number that is no part of a path."""

SAMPLES_PER_LAUNCH = 2**23
"""Samples that are traced at a time at most."""


@dataclass(frozen=True)
class Samples:
    """Uniform samples of primary sample space, spread evenly over the pixels.

    Attributes:
        f: (n, 3) float32, colours.
        pixel: (n,) integers.
        luminance: (n,) float64.
    """

    f: np.ndarray
    pixel: np.ndarray
    luminance: np.ndarray

    def film(self, weight: np.ndarray, pixels: int) -> np.ndarray:
        """Sums of f times `weight` (n,): (pixels, 3)."""
        sums = [np.bincount(self.pixel, self.f[:, i] * weight, pixels) for i in range(3)]
        return np.stack(sums, axis=-1)


def stratified_rows(
    paths: PathSampler, index: mi.UInt32, half: mi.UInt32, count: mi.UInt32, seed: mi.UInt32
) -> tuple[Key, mi.Point2f]:
    """Keys and film positions of uniform samples, stratified over the pixels.

    Args:
        paths: `PathSampler`.
        index: `mi.UInt32`, which sample of its half.
        half: `mi.UInt32`, 0 or 1: each half covers the film by itself.
        count: `mi.UInt32`, samples of a half.
        seed: `mi.UInt32`.
    """
    own = key(index, seed + half)
    jitter = uniform(own, mi.UInt32(DIM_STRATUM))
    in_pixel = mi.Point2f(uniform(own, mi.UInt32(0)), uniform(own, mi.UInt32(1)))
    return own, paths.film_position(index, count, jitter, in_pixel)


def with_film_position(position: mi.Point2f, dimension: mi.UInt32, otherwise: mi.Float) -> mi.Float:
    """The number of a dimension of a path whose position on the film is given."""
    return dr.select(dimension < 2, dr.select(dimension == 0, position.x, position.y), otherwise)


def trace_uniform(
    paths: PathSampler, own: Key, position: mi.Point2f
) -> tuple[mi.Color3f, mi.UInt32]:
    """Colours and pixels of the paths from film positions whose other numbers follow from keys."""
    f, pixel, _ = paths.trace(lambda d: with_film_position(position, d, uniform(own, d)))
    # A value for each path, also where all are known beforehand to be the same.
    return f + dr.zeros(mi.Color3f, dr.width(own)), pixel


def uniform_samples(paths: PathSampler, count: int, seed: int) -> Samples:
    """Trace `count` paths for each of two halves, of independent random numbers.

    Args:
        paths: `PathSampler`.
        count: samples of a half.
        seed: integer.

    Returns:
        `Samples`: those of half 0, then those of half 1.
    """
    n, own_seed = dr.opaque(mi.UInt32, count), dr.opaque(mi.UInt32, seed)
    parts = []
    for first in range(0, 2 * count, SAMPLES_PER_LAUNCH):
        size = min(SAMPLES_PER_LAUNCH, 2 * count - first)
        lane = dr.arange(mi.UInt32, size) + dr.opaque(mi.UInt32, first)
        half = dr.select(lane < n, mi.UInt32(0), mi.UInt32(1))
        own, position = stratified_rows(paths, lane - half * n, half, n, own_seed)
        f, pixel = trace_uniform(paths, own, position)
        Y = absolute_luminance(f)
        dr.eval(f, pixel, Y)
        colours = np.stack([channel.numpy() for channel in f], axis=-1)
        parts.append((colours, pixel.numpy(), Y.numpy().astype(float)))
    return Samples(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def uniform_numbers(count: int, seed: int, dimension: int) -> mi.Float:
    """One number, not of the position on the film, of each path that `uniform_samples` traces."""
    lane, n = dr.arange(mi.UInt32, 2 * count), dr.opaque(mi.UInt32, count)
    half = dr.select(lane < n, mi.UInt32(0), mi.UInt32(1))
    own = key(lane - half * n, dr.opaque(mi.UInt32, seed) + half)
    return uniform(own, mi.UInt32(dimension))


def pixel_means(paths: PathSampler, spp: int, seed: int) -> tuple[np.ndarray, float, float]:
    """The picture by `spp` independent samples of each pixel.

    Args:
        paths: `PathSampler`.
        spp: 1 or more.
        seed: integer.

    Returns:
        Means of the colours (pixels, 3); sums of Y and of Y² over all samples.
    """
    per_launch = max(1, SAMPLES_PER_LAUNCH // paths.pixels)
    sums = np.zeros((5, paths.pixels))
    for first in range(0, spp, per_launch):
        count = min(per_launch, spp - first)
        size = count * paths.pixels
        n, own_seed = (dr.opaque(mi.UInt32, x) for x in (size, seed + first))
        own, position = stratified_rows(
            paths, dr.arange(mi.UInt32, size), mi.UInt32(0), n, own_seed
        )
        f, _ = trace_uniform(paths, own, position)
        Y = absolute_luminance(f)
        found = [*f, Y, Y * Y]
        dr.eval(found)
        for total, values in zip(sums, found, strict=True):
            total += dr.block_sum(values, count).numpy()
    return sums[:3].T / spp, sums[3].sum(), sums[4].sum()


def pixel_coverage(paths: PathSampler, spp: int, seed: int) -> np.ndarray:
    """The share of each pixel in which something is shown (pixels,); arguments as `pixel_means`."""
    n, own_seed = (dr.opaque(mi.UInt32, x) for x in (spp * paths.pixels, seed))
    lane = dr.arange(mi.UInt32, spp * paths.pixels)
    own, position = stratified_rows(paths, lane, mi.UInt32(0), n, own_seed)
    shown = paths.cover(lambda d: with_film_position(position, d, uniform(own, d)))
    return dr.block_sum(shown + dr.zeros(mi.Float, len(lane)), spp).numpy() / spp
