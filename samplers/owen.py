r"""Scrambled net in every pixel (``owen``)
=======================================

.. list-table::
   :header-rows: 1

   * - Parameter
     - Type
     - Description
   * - ``sample_count``
     - integer
     - Samples of a pixel, 1 or more; no number is better than others. Default: 4.
   * - ``seed``
     - integer
     - Offset of the seed. Default: 0.

Each pixel has a sequence of its own of points :math:`x_i \in [0, 1)^{16}`. The first :math:`n` of
them fill the cube more evenly than independent ones, for every :math:`n`: a digital sequence in
base 2 whose pairs of dimensions are :math:`(0, 2)`-sequences,

.. math::

    x_{i,d} = \sigma_d\Bigl( \sum_{r \ge 1} 2^{-r} \, (C_d \, i)_r \Bigr),

with the bits of :math:`i` and matrices :math:`C_d` over GF(2). The nested uniform scrambling
:math:`\sigma_d` flips every digit by chance that depends on the digits before it, the pixel, the
dimension and the seed: each point is uniform by itself, so that no mean is biased, and the variance
falls faster than :math:`1/n` as far as the integrand is smooth (Owen 1997). After :math:`2^{16}`
points a pixel begins another sequence.

Two numbers that an integrator draws at once are a pair of dimensions; single ones share pairs. Past
dimension 16 the same points come again, their order shuffled anew each time. So the position in the
pixel, the lens and the first scatterings are stratified together, and what follows by themselves.

Renders that are continued, as by ``advance()``, go on with the sequences. An integrator that has
``samples_per_pass`` lets neighbouring pixels share sequences.

**Source.** Owen, Monte Carlo variance of scrambled net quadrature, SIAM J. Numer. Anal. 34, 1997;
Laine and Karras, Stratified sampling for stochastic transparency, EGSR 2011, and Burley, Practical
hash-based Owen scrambling, JCGT 9 (4), 2020, for scrambling by hashing. The matrices of each pair
are :math:`A` and :math:`PA` with Pascal's matrix :math:`P` (Sobol' 1967) and orders :math:`A` of
the points that a search found (``make study-samplers``).

**Variants.** ``llvm_ad_*`` and ``cuda_ad_*``.

**Usage.**

.. code-block:: python

    {'type': 'owen', 'sample_count': 64}
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from relume.hashes import half_hash, hash_u32
from relume.parameters import Range, whole
from relume.samplers import nets

RUNS_UNDER = ("polarized",)

GOLDEN = 0x9E3779B9
"""2^32 over the golden ratio: multiples of it are far from each other."""

PAIRS = nets.DIMENSIONS // 2


def scramble(digits: mi.UInt32, key: mi.UInt32) -> mi.UInt32:
    """Nested uniform scrambling of digits of base 2, the first of which is the lowest bit.

    Each bit of the result is that of `digits`, flipped or not as a hash of the bits below says.

    Args:
        digits: ``mi.UInt32``.
        key: ``mi.UInt32``, which of the scramblings.

    Source: Laine and Karras 2011, with the constants of Vegdahl, Owen scrambling based dithered
    blue-noise sampling, 2021.
    """
    x = digits ^ (digits * 0x3D20ADEA)
    x = (x + key) * ((key >> 16) | 1)
    x = x ^ (x * 0x05526C56)
    return x ^ (x * 0x53A22864)


def fraction(digits: mi.UInt32) -> mi.Float:
    """The number in [0, 1) with these digits of base 2, the first of which is the lowest bit."""
    return mi.Float(mi.Int32(dr.brev(digits) >> 8)) * 2.0**-24


def define() -> type[mi.Sampler]:
    """Return the plugin's class for the variant in use."""
    table = mi.UInt32(nets.table().ravel())

    class Owen(mi.Sampler):
        def __init__(self, props):
            whole(props, "sample_count", 4, Range(1))
            self.base_seed = whole(props, "seed", 0, Range(0, 2**32 - 1))
            mi.Sampler.__init__(self, props)
            self.per_wavefront = 0  # as many as there are samples of a pixel
            self.start(mi.UInt32(0), mi.UInt32(0), 0)

        def start(self, sequence, index, seed):
            """Begin with points of sequences.

            Args:
                sequence: ``mi.UInt32``, which of the independent sequences.
                index: ``mi.UInt32``, which of its points.
                seed: integer or ``mi.UInt32``; another seed gives other sequences.
            """
            own = hash_u32(mi.UInt32(seed) + GOLDEN) ^ hash_u32(mi.UInt32(self.base_seed))
            dr.make_opaque(own)  # the kernel is the same for all seeds
            self.own = hash_u32(sequence ^ own)
            self.index = mi.UInt32(index)
            self.restart()

        def restart(self):
            """Go back to the first dimension."""
            self.key = hash_u32(self.own + (self.index >> nets.BITS))
            self.digits = dr.brev(self.index)
            self.pair = mi.UInt32(0)
            self.half = mi.UInt32(0)  # 1 + the pair of which a dimension is left, or 0

        # ---------------- what integrators call ----------------

        def next_1d(self, active=True):
            left = self.half != 0
            pair = dr.select(left, self.half - 1, self.pair)
            self.half = dr.select(left, 0, pair + 1)
            self.pair = dr.select(left, self.pair, pair + 1)
            point, key = self.point(pair)
            digits = dr.select(left, point >> nets.BITS, point & 0xFFFF)
            return fraction(scramble(digits, dr.select(left, half_hash(key), key)))

        def next_2d(self, active=True):
            pair = mi.UInt32(self.pair)
            self.pair += 1
            point, key = self.point(pair)
            first = fraction(scramble(point & 0xFFFF, key))
            return mi.Point2f(first, fraction(scramble(point >> nets.BITS, half_hash(key))))

        def point(self, pair):
            """A point in a pair of dimensions, as in the table, and the key of its scrambling."""
            key = hash_u32(self.key + pair * GOLDEN)
            again = scramble(self.digits, self.key ^ (pair // PAIRS) * GOLDEN)
            i = dr.select(pair < PAIRS, self.digits, again)
            place = (pair % PAIRS) * 256
            low = dr.gather(mi.UInt32, table, place + (i >> 24))
            high = dr.gather(mi.UInt32, table, place + (256 * PAIRS) + ((i >> 16) & 0xFF))
            return low ^ high, key

        # ---------------- samples of a wavefront ----------------

        def set_samples_per_wavefront(self, samples_per_wavefront):
            mi.Sampler.set_samples_per_wavefront(self, samples_per_wavefront)
            self.per_wavefront = samples_per_wavefront

        def seed(self, seed, wavefront_size=0xFFFFFFFF):
            mi.Sampler.seed(self, seed, wavefront_size)
            lane = dr.arange(mi.UInt32, self.wavefront_size())
            count = dr.opaque(mi.UInt32, self.per_wavefront or self.sample_count())
            pixel = lane // count
            self.start(pixel, lane - pixel * count, seed)

        def advance(self):  # that of the base class would call this one
            self.index += self.per_wavefront or self.sample_count()
            self.restart()

        def schedule_state(self):
            mi.Sampler.schedule_state(self)
            dr.schedule(self.own, self.index, self.key, self.digits, self.pair, self.half)

        def fork(self):
            props = mi.Properties("owen")
            props["sample_count"] = self.sample_count()
            props["seed"] = self.base_seed
            other = Owen(props)
            other.per_wavefront = self.per_wavefront
            return other

        def clone(self):
            other = self.fork()
            if self.wavefront_size():
                mi.Sampler.seed(other, 0, self.wavefront_size())
            for name in ("own", "index", "key", "digits", "pair", "half"):
                setattr(other, name, mi.UInt32(getattr(self, name)))
            return other

        def to_string(self):
            return f"Owen[sample_count={self.sample_count()}, seed={self.base_seed}]"

    return Owen
