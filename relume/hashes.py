"""Hashes of 32-bit integers, from which random numbers follow that need no state."""

from __future__ import annotations

import mitsuba as mi


def half_hash(x: mi.UInt32) -> mi.UInt32:
    """The first of the two rounds of `hash_u32`."""
    x = x ^ (x >> 16)
    x = x * 0x7FEB352D
    return x ^ (x >> 15)


def hash_u32(x: mi.UInt32) -> mi.UInt32:
    """A permutation of the 32-bit integers: every bit of the result depends on every bit of `x`.

    Source: C. Wellons, "Prospecting for Hash Functions", 2018, lowbias32.
    """
    x = half_hash(x) * 0x846CA68B
    return x ^ (x >> 16)
