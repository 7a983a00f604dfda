"""What `relume compare` finds: the verdict, its figures and intervals, as JSON values."""

from __future__ import annotations

import importlib.metadata
import math
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relume import llvm
from relume.doctor import PACKAGES
from relume.workbench import estimates, measures, statistics

FALSE_ALARMS = 0.01
"""How often two methods of the same expectation are found to differ."""

CONFIDENCE = 0.95
"""Of all intervals."""

CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class Side:
    """One of the two that are compared.

    Attributes:
        name: plugin id of the integrator, or the picture's path.
        estimate: `estimates.Estimate`.
        runs: number of independent renders; 0 for a picture.
        seconds: duration of each render [s].
        not_finite: values that were NaN or infinite.
        negative: values below 0.
    """

    name: str
    estimate: estimates.Estimate
    runs: int
    seconds: tuple[float, ...]
    not_finite: int
    negative: int

    @property
    def variance(self) -> str:
        """Where its variance is from: `runs`, `stored` in its file, `estimated` from its pixels."""
        if self.runs:
            return "runs"
        return "estimated" if self.estimate.lone else "stored"

    @property
    def time(self) -> float:
        """Time of all renders [s]: their number times the median, for the first one compiles."""
        return self.runs * float(np.median(self.seconds)) if self.runs else 0.0


@dataclass(frozen=True)
class Comparison:
    """What was found.

    Attributes:
        sides: the second is the reference.
        scores: by `whole`, `blocks` and `pixels`.
        flip: map and mean of HDR-FLIP, or None.
        settings: what was rendered and how, as JSON values.
    """

    sides: tuple[Side, Side]
    scores: dict[str, statistics.Scores]
    flip: tuple[np.ndarray, float] | None
    settings: dict[str, Any]

    @property
    def agree(self) -> bool:
        """Whether no difference was found."""
        finite = not any(side.not_finite for side in self.sides)
        return finite and not any(level.differ for level in self.scores.values())

    def energy(self) -> list[dict[str, Any]]:
        """Difference of the means of each channel, with intervals: a list of JSON values."""
        a, b = (side.estimate.whole for side in self.sides)
        d = statistics.difference(a, b)
        bias = statistics.half_width(d.variance, d.dof, CONFIDENCE)
        ratio, half = statistics.ratio(a, b, CONFIDENCE)
        return [
            {
                "channel": name,
                "ratio": _number(ratio[0, 0, c]),
                "ratio_plus_minus": _number(half[0, 0, c]),
                "bias": _number(d.mean[0, 0, c]),
                "bias_plus_minus": _number(bias[0, 0, c]),
                "z": _number(self.scores["whole"].z[0, 0, c]),
            }
            for c, name in enumerate(CHANNELS)
        ]

    def worst_place(self) -> dict[str, Any]:
        """Where the difference is largest: a block, or a pixel if single pixels alone differ.

        Of those whose score is above the threshold; if none is, where the score is largest.
        """
        blocks, pixels = self.scores["blocks"], self.scores["pixels"]
        level = "pixels" if pixels.differ and not blocks.differ else "blocks"
        a, b = (getattr(side.estimate, level) for side in self.sides)
        place = tuple(int(i) for i in self.scores[level].place(np.abs(a.mean - b.mean)))
        a, b = (estimates.Level(l.mean[place], l.variance[place], l.dof[place]) for l in (a, b))
        ratio, half = statistics.ratio(a, b, CONFIDENCE)
        y, x, c = place
        side = 1
        if level == "blocks":
            height, width = self.sides[0].estimate.pixels.mean.shape[:2]
            side = estimates.block_side(height, width)
            y, x = (
                (i * side + min((i + 1) * side, n) - 1) // 2 for i, n in ((y, height), (x, width))
            )
        return {
            "x": x,
            "y": y,
            "pixels_across": side,
            "channel": CHANNELS[c],
            "ratio": _number(ratio),
            "ratio_plus_minus": _number(half),
            "z": _number(self.scores[level].z[place]),
        }

    def verdict(self) -> str:
        """The verdict in words, for people."""
        broken = [side for side in self.sides if side.not_finite]
        if broken:
            said = (
                f"{side.name} has {side.not_finite} values that are no numbers" for side in broken
            )
            return "differ: " + " and ".join(said)
        whole = max(self.energy(), key=lambda channel: abs(channel["z"]))
        mean = f"{_percent(whole)} in the mean of {whole['channel']}"
        if self.agree:
            return f"agree: {mean}, no more than chance"
        place = self.worst_place()
        spot = "pixel" if place["pixels_across"] == 1 else "block"
        where = f"the {spot} at ({place['x']}, {place['y']})"
        there = f"{_percent(place)} of {place['channel']}"
        if self.scores["whole"].differ:
            return f"differ by {mean}, most in {where}: {there}"
        return f"differ in {where} by {there}; the means agree: {mean}"

    def report(self) -> dict[str, Any]:
        """All of it as JSON values."""
        a, b = self.sides
        error, debiased = measures.rel_mse(a.estimate, b.estimate)
        return {
            "verdict": "agree" if self.agree else "differ",
            "text": self.verdict(),
            **self.settings,
            "false_alarms": FALSE_ALARMS,
            "confidence": CONFIDENCE,
            "sides": [self._side(side) for side in self.sides],
            "energy": self.energy(),
            "rel_mse": error,
            "rel_mse_debiased": debiased,
            "flip": self.flip and self.flip[1],
            "tests": [
                {
                    "level": name,
                    "tests": level.z.size,
                    "threshold": level.threshold,
                    "largest": _number(np.abs(level.z).max()),
                    "rejected": level.rejected,
                    "counts": level.counts,
                }
                for name, level in self.scores.items()
            ],
            "most": self.worst_place(),
            "versions": versions(),
        }

    def __repr__(self) -> str:
        first, second = (side.name for side in self.sides)
        scene = self.settings.get("scene", "a scene")
        return f"<Comparison of {scene}, {first} with {second}: {self.verdict()}>"

    def _repr_png_(self) -> bytes:
        from relume.workbench import compare_figure, pages

        return pages.png(compare_figure.compare_figure(self))

    def _repr_html_(self) -> str:
        from relume.workbench import compare_table, pages

        report = self.report()
        first, second = (side.name for side in self.sides)
        return pages.summary(
            f"{report['scene']}: {first} against {second}",
            self.verdict(),
            self.agree,
            self._repr_png_(),
            compare_table.tables(report),
            report["notes"],
        )

    def _side(self, side: Side) -> dict[str, Any]:
        both = np.mean([other.estimate.pixels.mean for other in self.sides], axis=0)
        noise = measures.noise(side.estimate, both)
        return {
            "name": side.name,
            "runs": side.runs,
            "variance": side.variance,
            "spp": self.settings["spp"] // side.runs if side.runs else None,
            "mean": side.estimate.whole.mean.ravel().tolist(),
            "mean_plus_minus": statistics.half_width(
                side.estimate.whole.variance, side.estimate.whole.dof, CONFIDENCE
            )
            .ravel()
            .tolist(),
            "rel_mse_of_noise": noise,
            "seconds": side.time if side.runs else None,
            "efficiency": measures.efficiency(noise, side.time),
            "not_finite": side.not_finite,
            "negative": side.negative,
        }


def versions() -> dict[str, str]:
    """Versions of what took part, by name."""
    found = {"python": platform.python_version(), "system": platform.platform()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found | {"LLVM": Path(llvm.install().path or "none").name}


def _number(x: Any) -> float | None:
    """A JSON number; None for what JSON does not know."""
    return float(x) if math.isfinite(x) else None


def _percent(entry: dict[str, Any]) -> str:
    """A ratio's distance from 1 with its half-width, in as many digits as mean something."""
    if entry["ratio"] is None:
        return "all, for the reference is black,"
    deviation, half = 100 * (entry["ratio"] - 1), 100 * entry["ratio_plus_minus"]
    digits = min(3, decimals(half))
    return f"{deviation:+.{digits}f} % ± {half:.{digits}f} %"


def decimals(half_width: float) -> int:
    """Decimals that show a half-width of 0.2 as 0.2 and of 0.19 as 0.19; at most 9."""
    return min(9, max(0, math.ceil(-math.log10(half_width / 2)))) if half_width > 0 else 4
