"""What a render tells its user: what is not as written, how noisy it is, and what else to know."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from rich.markup import escape

from relume import noise, output
from relume.accumulator import Accumulator
from relume.session import Scene, Session, sees_nothing
from relume.tone import AUTO, Look, advice
from relume.translator import Translation
from relume.translator.darkness import NOTHING_ARRIVES, NOTHING_SEEN, NOTHING_SHINES
from relume.translator.media import BOUNDARY
from relume.translator.plan import plugin_types
from relume.translator.precision import ray_offset

if TYPE_CHECKING:
    from rich.console import Console

    from relume.pilot import Choice


STOCK_VOLUMES = ("VolumetricPathIntegrator", "VolpathMisIntegratorImpl")
"""Classes of Mitsuba's integrators for media, which start rays off surfaces: ``volpath(mis)``."""

DEEP = 0.02
"""Mean free paths below the surface from which on a note tells where walks begin. With an albedo of
0.9, 3, 10 and 29 % of the light are lost where it is 0.06, 0.18 and 0.6."""


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


def report_choice(choice: Choice, console: Console) -> None:
    """Say which of the scene's candidates renders it, and why."""
    if choice.why:
        console.print(f"integrator {escape(choice.why)}", highlight=False)


def report_emptiness(scene: Scene, console: Console) -> None:
    """Say what a loaded scene tells of a picture that stays empty."""
    if not scene.emitters():
        console.print(f"[yellow]{NOTHING_SHINES.text}[/]", highlight=False)
    elif sees_nothing(scene):
        console.print(f"[yellow]{NOTHING_SEEN.text}[/]", highlight=False)


def report_deep_starts(session: Session, translation: Translation, console: Console) -> None:
    """Say that Mitsuba's integrators in the place of `randomwalk` make dense objects too dark."""
    stock = session.integrator.class_name() in STOCK_VOLUMES
    if not stock or "randomwalk" not in plugin_types(translation.scene["integrator"]):
        return
    if (depth := deepest_start(session.scene)) > DEEP:
        text = (
            f"too dark: this integrator begins walks up to {depth:.2g} mean free paths inside "
            "objects, not on their surface, as randomwalk does"
        )
        console.print(f"[yellow]{text}[/]", highlight=False)


def deepest_start(scene: Scene) -> float:
    """How far inside the objects of a scene rays start that begin on them [mean free path]."""
    depths = [0.0]
    mei = dr.zeros(mi.MediumInteraction3f)
    for shape in scene.shapes():
        medium = shape.interior_medium()
        if medium is None or shape.id() == BOUNDARY:
            continue
        sigma_s, _, sigma_t = (np.ravel(x) for x in medium.get_scattering_coefficients(mei))
        box = shape.bbox()
        # Where nothing is absorbed it does not matter where a walk begins.
        extinction = np.where(sigma_s < sigma_t, sigma_t, 0).max()
        depths.append(ray_offset(np.array([box.min, box.max], float)) * float(extinction))
    return max(depths)


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
