"""Passes: what they are, which a render needs and which are done.

A pass is known by its index and its number of samples per pixel; with the content of the scene,
the integrator and the seed it says which samples those are. The first passes of a render have as
many samples each as `PassPlan` gives a pass, the last one has the rest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

Run = tuple[int, int, int]
"""Passes start ... stop - 1 of `spp` samples per pixel, as (start, stop, spp)."""

SAMPLES_PER_PASS = 2**20
"""Samples of one pass, rounded down to whole samples per pixel."""


@dataclass(frozen=True, eq=False)
class Pass:
    """The result of one pass.

    Attributes:
        index: which pass.
        spp: samples per pixel.
        sum: sums of linear RGB over the samples: float32, (3, pixels), rows from the top.
        squares: sums of the squares of the samples, where these are independent.
        difference: where they are of two independent sequences, the sum over those of one less the
            sum over those of the other. Without either the pass is one observation, such as that of
            a Metropolis render, whose samples all depend on each other.
        lead: how many more of the samples are of the first sequence than of the second.
    """

    index: int
    spp: int
    sum: np.ndarray
    squares: np.ndarray | None = None
    difference: np.ndarray | None = None
    lead: int = 0

    @property
    def arrays(self) -> list[np.ndarray]:
        """All sums that there are."""
        return [a for a in (self.sum, self.squares, self.difference) if a is not None]


@dataclass(frozen=True)
class PassPlan:
    """How many samples per pixel are taken, and by how many at a time."""

    spp: int
    per_pass: int

    @staticmethod
    def of(width: int, height: int, spp: int, per_pass: int | None = None) -> PassPlan:
        """The plan of a picture.

        Args:
            width: of the picture [pixel].
            height: of the picture [pixel].
            spp: samples per pixel.
            per_pass: those of a pass; None for as many as make `SAMPLES_PER_PASS`.
        """
        return PassPlan(int(spp), per_pass or max(1, SAMPLES_PER_PASS // (width * height)))

    def passes(self) -> PassSet:
        """The `PassSet` of the whole render."""
        whole, rest = divmod(self.spp, self.per_pass)
        last = [(whole, whole + 1, rest)] if rest else []
        return PassSet([(0, whole, self.per_pass), *last])

    def to_do(self, done: PassSet) -> PassSet:
        """The passes that are left when some are done, possibly of a plan with fewer samples.

        Args:
            done: `PassSet`.

        Returns:
            `PassSet` with new indices, the lowest first.
        """
        whole, rest = divmod(max(0, self.spp - done.spp), self.per_pass)
        runs: list[Run] = []
        for start, stop in done.gaps(whole + bool(rest)):
            count = min(stop - start, whole)
            runs.append((start, start + count, self.per_pass))
            whole -= count
            if start + count < stop:
                runs.append((start + count, stop, rest))
        return PassSet(runs)


class PassSet:
    """A set of passes: their indices and samples.

    Args:
        runs: of passes, in any order.

    Raises:
        ValueError: a pass is in two of them.
    """

    def __init__(self, runs: Iterable[Run] = ()) -> None:
        self.runs: list[Run] = []
        for start, stop, spp in sorted(run for run in runs if run[0] < run[1]):
            last = self.runs[-1] if self.runs else (0, 0, 0)
            if start < last[1]:
                raise ValueError(f"pass {start} is there twice")
            if start == last[1] and spp == last[2]:
                self.runs[-1] = (last[0], stop, spp)
            else:
                self.runs.append((start, stop, spp))

    @staticmethod
    def parse(text: str) -> PassSet:
        """The set that `str` wrote.

        Raises:
            ValueError: the text is no such set.
        """
        runs = []
        for word in text.split():
            match = re.fullmatch(r"(\d{1,18}):(\d{1,18})x([1-9]\d{0,17})", word)
            if not match:
                raise ValueError(f"expected passes such as 0:10x4, found '{word[:40]}'")
            start, stop, spp = map(int, match.groups())
            runs.append((start, stop, spp))
        return PassSet(runs)

    def __str__(self) -> str:
        return " ".join(f"{start}:{stop}x{spp}" for start, stop, spp in self.runs)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PassSet) and self.runs == other.runs

    __hash__ = None  # type: ignore[assignment]

    def __len__(self) -> int:
        return sum(stop - start for start, stop, _ in self.runs)

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Pairs of index and samples per pixel, the lowest index first."""
        return ((index, spp) for start, stop, spp in self.runs for index in range(start, stop))

    def __contains__(self, index: int) -> bool:
        return any(start <= index < stop for start, stop, _ in self.runs)

    @property
    def spp(self) -> int:
        """Samples of a pixel of all passes together."""
        return sum((stop - start) * spp for start, stop, spp in self.runs)

    def union(self, other: PassSet) -> PassSet:
        """Both sets together.

        Raises:
            ValueError: a pass is in both.
        """
        return PassSet(self.runs + other.runs)

    def with_pass(self, index: int, spp: int) -> PassSet:
        """This set and one pass more.

        Raises:
            ValueError: it is there already.
        """
        return self.union(PassSet([(index, index + 1, spp)]))

    def between(self, start: int, stop: int) -> PassSet:
        """The passes of the set with indices from `start` to before `stop`."""
        return PassSet([(max(a, start), min(b, stop), spp) for a, b, spp in self.runs])

    def without(self, other: PassSet) -> PassSet:
        """The passes of the set whose indices are not in another."""
        gaps = other.gaps(self.runs[-1][1] if self.runs else 0)
        return PassSet([run for gap in gaps for run in self.between(*gap).runs])

    def gaps(self, count: int) -> list[tuple[int, int]]:
        """The first `count` indices that are not in the set, as pairs (start, stop)."""
        result, start = [], 0
        for first, stop, _ in self.runs:
            free = min(first - start, count)
            if free > 0:
                result.append((start, start + free))
                count -= free
            start = stop
        return [*result, (start, start + count)] if count > 0 else result

    def ranges(self) -> str:
        """The indices for a reader, such as `0:10, 12:13`."""
        joined: list[tuple[int, int]] = []
        for start, stop, _ in self.runs:
            if joined and joined[-1][1] == start:
                start = joined.pop()[0]
            joined.append((start, stop))
        return ", ".join(f"{start}:{stop}" for start, stop in joined)
