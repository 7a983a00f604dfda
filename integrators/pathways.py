"""Ways to find a path, s vertices from the lamp and t from the camera, drawn one at a time."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

LONGEST_LISTED = 24
"""Edges of the longest paths whose ways have a probability of their own."""

TAIL = 32.0
"""Length t of the tail: paths are longer than the listed ones by j or more as (t / (t + j))²."""

TAIL_SHARE = 0.02
"""Draws of paths in the tail, over those of listed ones, before it is known what they show."""

GRAIN = 2**24
"""Probabilities are multiples of 1 / GRAIN, as numbers of a sampler are."""

LEAST = 0.25
"""Share of the draws that goes to ways whether they have shown light or not."""


class Ways:
    """Ways (s, t) to find paths of some lengths, and how probable they are.

    Those of longer paths than `LONGEST_LISTED` share the last entry. No dataclass, whose fields
    Dr.Jit would take for state of the loops that use it.

    Args:
        min_depth: edges of the shortest path.
        max_depth: edges of the longest one.
        emits: whether light subpaths can begin.
        connects: whether they can be connected to the camera.

    Attributes:
        listed: (n, 2) integers, s and t of each entry but the tail.
        tail: whether there are longer paths.
    """

    def __init__(self, min_depth: int, max_depth: int, emits: bool, connects: bool) -> None:
        lengths = range(min_depth, min(max_depth, LONGEST_LISTED) + 1)
        self.listed = np.array(
            [
                (s, k + 1 - s)
                for k in lengths
                for s in range(k + 1 if k > 1 else 1)
                if (s < 2 or emits) and (s < k or k == 1 or connects)
            ],
            dtype=np.uint32,
        ).reshape(-1, 2)
        self.tail = max_depth > LONGEST_LISTED
        self.first_of_tail = max(min_depth, LONGEST_LISTED + 1)
        self.max_depth = max_depth
        edges = self.listed.sum(1) - 1.0
        base = 1 / ((edges + 1) * (edges + 2)) / (1 + edges)
        if self.tail:
            base = np.append(base, TAIL_SHARE * base.sum() if len(base) else 1.0)
        self.base = base
        self.s = mi.UInt32(np.append(self.listed[:, 0], 0).astype(np.uint32))
        self.t = mi.UInt32(np.append(self.listed[:, 1], 0).astype(np.uint32))
        self.set_probabilities(self.base)

    def set_probabilities(self, p: np.ndarray) -> None:
        """Set the probabilities of the entries.

        Args:
            p: (n,) of any sum; with that of the tail, if there is one, at the end.
        """
        if not len(p):
            self.end, self.weight = mi.UInt32(GRAIN), mi.Float(0)
            return
        end = np.round(np.cumsum(p) / p.sum() * GRAIN).astype(np.int64)
        count = np.diff(end, prepend=0)
        weight = np.where(count > 0, GRAIN / np.maximum(count, 1), 0)
        self.end, self.weight = mi.UInt32(end.astype(np.uint32)), mi.Float(weight)

    def learn(self, entry: np.ndarray, light: np.ndarray) -> None:
        """Set the probabilities by what draws of each entry have shown.

        Args:
            entry: (m,) of each draw, as `pick` returns it.
            light: (m,) what it has shown, over its probability.
        """
        found = np.bincount(entry, light, len(self.base))
        share = found / max(found.sum(), 1e-300)
        self.set_probabilities(LEAST * self.base / self.base.sum() + (1 - LEAST) * share)

    def entry(self, u: mi.Float) -> mi.UInt32:
        """The entry that a uniform variate chooses."""
        r, last = mi.UInt32(u * float(GRAIN)), max(len(self.base) - 1, 0)
        return dr.binary_search(0, last, lambda i: dr.gather(mi.UInt32, self.end, i) <= r)

    def pick(
        self, u: mi.Float, u_length: mi.Float, u_s: mi.Float
    ) -> tuple[mi.UInt32, mi.UInt32, mi.Float]:
        """Draw a way.

        Args:
            u: uniform variate for the entry.
            u_length: another one for the length within the tail.
            u_s: another one for the way within the tail.

        Returns:
            (s, t, one over the probability).
        """
        entry = self.entry(u)
        s, t = dr.gather(mi.UInt32, self.s, entry), dr.gather(mi.UInt32, self.t, entry)
        weight = dr.gather(mi.Float, self.weight, entry)
        if self.tail:
            beyond = entry == len(self.listed)
            j = dr.floor(TAIL * (dr.rsqrt(u_length + 0.5 / GRAIN) - 1))
            edges = mi.UInt32(j) + self.first_of_tail
            here = dr.minimum(mi.UInt32(u_s * mi.Float(edges + 1)), edges)
            ends = (j + TAIL) * (j + (TAIL + 1))
            rarity = dr.square(ends / TAIL) / (2 * j + (2 * TAIL + 1)) * mi.Float(edges + 1)
            there = edges <= self.max_depth  # else nothing is traced
            rarity = dr.select(there, rarity, 0)
            t = dr.select(beyond, dr.select(there, edges + 1 - here, 1), t)
            s = dr.select(beyond, dr.select(there, here, 0), s)
            weight *= dr.select(beyond, rarity, 1)
        return s, t, weight
