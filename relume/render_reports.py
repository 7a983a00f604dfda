"""What a render tells its user: what is not as written, how noisy it is, and what else to know."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.markup import escape

from relume import noise, output
from relume.accumulator import Accumulator
from relume.session import Scene, sees_nothing
from relume.tone import AUTO, Look, advice
from relume.translator import Translation
from relume.translator.darkness import NOTHING_ARRIVES, NOTHING_SEEN, NOTHING_SHINES

if TYPE_CHECKING:
    from rich.console import Console


def report_losses(translation: Translation, console: Console) -> None:
    """Say what of the scene is not rendered as written."""
    for outcome, style in (("unsupported", "red"), ("approximated", "yellow")):
        lines = [r for r in translation.document.lines.all if r.outcome == outcome and r.note]
        for line in lines[:12]:
            console.print(
                f"[{style}]{outcome}[/] line {line.line}, {escape(f'{line.keyword}: {line.note}')}",
                highlight=False,
            )
        if len(lines) > 12:
            console.print(f"[{style}]{outcome}[/] {len(lines) - 12} more (see: relume check)")
    for note in translation.picture_notes():
        console.print(f"[yellow]{escape(note.text)}[/]", highlight=False)


def report_emptiness(scene: Scene, console: Console) -> None:
    """Say what a loaded scene tells of a picture that stays empty."""
    if not scene.emitters():
        console.print(f"[yellow]{NOTHING_SHINES.text}[/]", highlight=False)
    elif sees_nothing(scene):
        console.print(f"[yellow]{NOTHING_SEEN.text}[/]", highlight=False)


def report_darkness(image: np.ndarray, console: Console) -> None:
    """Say that a picture, linear RGB of shape (height, width, 3), has no light in it."""
    if not image.any():
        console.print(f"[yellow]{NOTHING_ARRIVES.text}[/]", highlight=False)


def report_noise(
    accumulator: Accumulator, seconds: float, goal: float | None, console: Console
) -> float:
    """Say how noisy a picture is and what less would cost.

    Args:
        accumulator: what was rendered.
        seconds: that it took.
        goal: noise that was asked for, or None.
        console: where to say it.

    Returns:
        The noise relative to the mean; NaN where it is unknown.
    """
    if math.isfinite(found := accumulator.noise()):
        console.print(noise.advice(found, seconds), highlight=False)
        if goal is not None and found > goal:
            console.print(f"[yellow]{noise.in_words(goal)} was not reached[/]", highlight=False)
    return found


def report_end(spp: int, why: str, asked: int | None, console: Console) -> None:
    """Say where a picture has fewer samples of a pixel than were asked for.

    Args:
        spp: that it has.
        why: the render ended early; empty if it did not.
        asked: that it was to have; None for no certain number.
        console: where to say it.
    """
    if why:
        of = f" of {asked}" if asked is not None else ""
        console.print(f"[yellow]{why}[/] after {spp}{of} samples a pixel; --resume goes on")


def report_look(
    written: output.Written, image: np.ndarray, look: Look, gamma: float, console: Console
) -> None:
    """Say which exposure was chosen, and which would show a picture that shows little."""
    if all(output.is_linear(path) for path in written.paths):
        if not look.plain:
            kept = f"{written.paths[0].name} stays linear: relume develop gives it its exposure"
            console.print(f"[yellow]{escape(kept)}[/]", highlight=False)
        return
    image = output.repair(image)[0]
    shown = output.encode_display(look.applied(image), gamma)
    if look.exposure == AUTO:
        console.print(look.described(image), highlight=False)
    if hint := advice(image, shown):
        console.print(f"[yellow]{hint}[/]", highlight=False)


def report_repairs(written: output.Written, spectral: bool, console: Console) -> None:
    """Say how many pixels could not be written as they are."""
    if written.repaired:
        why = "colours that RGB cannot hold, or noise" if spectral else "this should not happen"
        console.print(f"[yellow]{written.repaired} pixels below 0 or not finite: {why}[/]")
