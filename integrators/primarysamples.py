"""Primary sample space: paths as functions of a row of numbers in [0, 1).

A path tracer draws numbers and finds radiance; a path is the row of numbers drawn, and its measure
is uniform (Kelemen et al., "A Simple and Robust Mutation Strategy for the Metropolis Light
Transport Algorithm", 2002). The first two numbers are the position on the film, then come those of
the lens and of the wavelength where there are any, then those that the integrator draws.

Random numbers are a hash of a key (64 bits) and the dimension: whoever knows the key can compute
any of them again, in any order, and nothing need be stored.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from relume.hashes import half_hash, hash_u32
from relume.sensors.colors import absolute_luminance
from relume.sensors.pixelsamples import PixelFilter, PixelSample, trace_pixels

BELOW_ONE = 1 - 2.0**-24
"""The largest number that a sampler may return in single precision."""

Key = tuple[Any, Any]
"""Two words, ``mi.UInt32``, from which a row of random numbers follows."""

Numbers = Callable[[Any], Any]
"""A row of numbers: from a dimension, ``mi.UInt32``, to the number in [0, 1), ``mi.Float``."""


def key(index: mi.UInt32, seed: mi.UInt32) -> Key:
    """Keys of independent rows of random numbers.

    Args:
        index: `mi.UInt32`, which row.
        seed: `mi.UInt32`.

    Returns:
        Two words, `mi.UInt32`.
    """
    first = hash_u32(index ^ hash_u32(seed))
    return first, hash_u32(first ^ 0x51ED270B)


def uniform(key: Key, dimension: mi.UInt32) -> mi.Float:
    """The random number in [0, 1) of a key and a dimension (`mi.UInt32`)."""
    x = half_hash(key[0] + dimension * 0x9E3779B9) ^ key[1]
    x = x * 0x846CA68B
    return mi.Float((x ^ (x >> 16)) >> 8) * 2.0**-24


def kelemen(r: mi.Float, _: mi.Float, s1: float, s2: float) -> mi.Float:
    """Offset of size between `s1` and `s2`, its logarithm uniform (Kelemen et al., section 4)."""
    size = s2 * dr.exp(-math.log(s2 / s1) * dr.abs(2 * r - 1))
    return dr.select(r < 0.5, -size, size)


def mixed_sizes(r: mi.Float, q: mi.Float, s1: float, s2: float) -> mi.Float:
    """`kelemen`, or with probability 1/2 an offset up to a size that is the same for all numbers.

    Some bright paths survive only small changes: all of their numbers have to move little at once.
    """
    size = s2 * dr.exp(-math.log(s2 / s1) * 2 * q)
    return dr.select(q < 0.5, (2 * r - 1) * size, kelemen(r, q, s1, s2))


def lux(r: mi.Float, _: mi.Float, s1: float, s2: float) -> mi.Float:
    """Offset x of density proportional to ``1 / (|x| + c)²``, as in LuxRender (language 13.6)."""
    size = s1 / (s1 / s2 + dr.abs(2 * r - 1)) - s1 / (s1 / s2 + 1)
    return dr.select(r < 0.5, -size, size)


def gaussian(r: mi.Float, _: mi.Float, __: float, s2: float) -> mi.Float:
    """Offset of the normal distribution with standard deviation `s2`."""
    return s2 * math.sqrt(2) * dr.erfinv(dr.clip(2 * r - 1, -BELOW_ONE, BELOW_ONE))


MUTATIONS = {
    "mixed": (mixed_sizes, 1 / 2048, 1 / 32),
    "kelemen": (kelemen, 1 / 1024, 1 / 64),
    "lux": (lux, 1 / 512, 1 / 16),
    "gaussian": (gaussian, 1 / 1024, 1 / 64),
}
"""By name: the offset of a random number, symmetric about 0, and the default sizes `s1`, `s2`. The
offset follows from a number in [0, 1) of its own and one of the whole step."""


def perturb(u: mi.Float, offset: mi.Float) -> mi.Float:
    """Move a number by an offset on the circle of circumference 1."""
    u = u + offset
    return dr.minimum(u - dr.floor(u), BELOW_ONE)


@functools.cache
def sampler_class(_variant: str) -> type[mi.Sampler]:
    """The class of samplers that hand out the numbers of a function, under the variant in use."""

    class PrimarySampler(mi.Sampler):
        unordered = True  # neighbouring rays go where they like, from the camera on

        # The function is no part of the state that a loop carries, only the dimension is.
        def __init__(self, number, dimension):
            mi.Sampler.__init__(self, mi.Properties())
            self._number = number
            self.dimension = mi.UInt32(dimension)

        def next_1d(self, active=True):
            dimension = mi.UInt32(self.dimension)
            self.dimension += 1
            return self._number(dimension)

        def next_2d(self, active=True):
            x = self.next_1d()
            return mi.Point2f(x, self.next_1d())

    return PrimarySampler


class PathSampler:
    """Traces the paths that an integrator finds through a sensor.

    Args:
        scene: `mi.Scene`.
        sensor: `mi.Sensor`.
        integrator: `mi.SamplingIntegrator`.

    Attributes:
        spread: whether paths are seen where they begin, so that the film gets its share of them.
        held: the numbers, after the first two, that small steps leave as they are.
    """

    spread = True
    held = range(2, 2)

    def __init__(
        self, scene: mi.Scene, sensor: mi.Sensor, integrator: mi.SamplingIntegrator
    ) -> None:
        self.scene = scene
        self.sensor = sensor
        self.integrator = integrator
        self.width, self.height = (int(x) for x in sensor.film().crop_size())
        self.pixels = self.width * self.height
        # Opaque: films of all sizes share a kernel.
        self.size = mi.Vector2f(self.width, self.height)
        self.columns, self.pixel_count = mi.UInt32(self.width), mi.UInt32(self.pixels)
        dr.make_opaque(self.size, self.columns, self.pixel_count)
        self.filter = PixelFilter(sensor.film())

    def film_position(
        self, i: mi.UInt32, n: mi.UInt32, jitter: mi.Float, u: mi.Point2f
    ) -> mi.Point2f:
        """Film position of sample `i` of `n` that are spread evenly over the pixels.

        Args:
            i: `mi.UInt32`.
            n: `mi.UInt32`.
            jitter: number in [0, 1) that chooses among the pixels of a stratum.
            u: `mi.Point2f` in [0, 1)², the position in the pixel.

        Returns:
            `mi.Point2f` in [0, 1)².
        """
        place = (mi.Float64(i) + mi.Float64(jitter)) * mi.Float64(self.pixel_count) / mi.Float64(n)
        pixel = dr.minimum(mi.UInt32(place), self.pixel_count - 1)
        y = pixel // self.columns
        x = pixel - y * self.columns
        return dr.minimum((mi.Point2f(x, y) + u) / self.size, BELOW_ONE)

    def trace(self, number: Numbers) -> tuple[mi.Color3f, mi.UInt32, mi.UInt32]:
        """Trace the path of a row of numbers.

        Args:
            number: from a dimension (`mi.UInt32`) to the number in [0, 1).

        Returns:
            Colour of the path, 0 where it is not finite (`mi.Color3f`, linear RGB); index of its
            pixel; count of the numbers it drew.
        """
        found, weight, pixel, drawn = self._trace(number)
        f = found.color * weight
        f = dr.select(dr.isfinite(absolute_luminance(f)), f, 0)
        return f, pixel, drawn

    def cover(self, number: Numbers) -> mi.Float:
        """Trace the path of a row of numbers: 1 if it shows something, else 0, by the filter."""
        found, weight, _, _ = self._trace(number)
        return dr.select(found.valid, weight, 0)

    def place(self, number: Numbers) -> tuple[mi.Point2u, mi.Point2f, mi.Float]:
        """A row of numbers' pixel, the position that it sees, [0, 1] inside, and its weight."""
        on_film = mi.Point2f(number(mi.UInt32(0)), number(mi.UInt32(1))) * self.size
        corner = mi.Point2u(on_film)
        in_pixel = on_film - mi.Point2f(corner)
        place, weight = self.filter.place(mi.Point2f(corner), in_pixel, self.size)
        return corner, (mi.Point2f(corner) + place) / self.size, weight

    def _trace(self, number: Numbers) -> tuple[PixelSample, mi.Float, mi.UInt32, mi.UInt32]:
        """What a path finds, the weight of its place, its pixel, and how many numbers it drew."""
        corner, position, weight = self.place(number)
        sampler = sampler_class(mi.variant())(number, 2)
        found = trace_pixels(self.scene, self.sensor, self.integrator, sampler, position)
        pixel = corner.y * self.columns + corner.x
        return found, weight, pixel, mi.UInt32(sampler.dimension)
