"""Which integrators may render a scene: one, or two that a render compares before it begins.

`surfacepath` finds light from the camera alone, `bdpt` from both ends at twice the cost of a
sample. Facts of the scene decide where they can; where they cannot, a pilot does (`relume.pilot`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from relume.translator.darkness import shines
from relume.translator.lights import refracts
from relume.translator.scene_values import Entry

POINT_LIKE = ("falloffspot", "parallelbeam", "directional", "domesun")
"""Plugin ids of lamps that no ray can meet."""

SKIES = ("constant", "envmap", "ibldome")
"""Plugin ids of light from all around."""

FOUND_FROM_LAMPS = (
    "lamps without size beside glass or mirrors: only paths from them find their caustics; "
    "bdpt-merging also those seen in mirrors or through glass"
)
SKY_ALONE = "the sky alone lights the scene: paths from it seldom meet what the camera sees"
NO_LAMP = "nothing shines"
COMPARED = "a pilot compares variance times cost, if the render is long enough to pay for it"
NO_BDPT = {
    "pssmlt": "the scene asks for Metropolis transport",
    "erpt": "the scene asks for energy redistribution",
    "samplescale": "luminance_cutoff bounds samples of rays, of which bdpt has none",
    "shadowcatching": "what bdpt finds from lamps cannot cross shadow catchers",
    "dipole": "bdpt knows no subsurface scattering",
    "randomwalk": "bdpt knows no media",
    "volpath": "bdpt knows no media",
    "volpathmis": "bdpt knows no media",
    "curvedspace": "the light of bdpt goes straight on",
    "dopplershift": "bdpt knows no moving camera",
}
"""Why nothing else renders a scene, by the plugin id of its integrator."""


@dataclass(frozen=True)
class Candidates:
    """Integrators that may render a scene.

    Attributes:
        names: plugin ids: one, or those that a pilot compares, the first of which renders where
            none is made.
        reason: why, in words.
    """

    names: tuple[str, ...]
    reason: str


def candidates(integrator: Entry, entries: Iterable[Entry]) -> Candidates:
    """The candidates for a scene.

    Args:
        integrator: dictionary of its integrator.
        entries: of its shapes and emitters.
    """
    kind = integrator["type"]
    paths = integrator
    if kind == "samplescale" and not integrator["luminance_limit"]:
        paths = integrator["integrator"]
    if paths["type"] != "surfacepath":
        return Candidates((kind,), NO_BDPT[paths["type"]])
    entries = list(entries)
    kinds = kinds_of_lights(entries)
    if has_points(entries) and any(map(turns_light, entries)):
        return Candidates(("bdpt",), FOUND_FROM_LAMPS)
    if kinds <= set(SKIES):
        return Candidates((kind,), SKY_ALONE if kinds else NO_LAMP)
    return Candidates((kind, "bdpt"), COMPARED)


def kinds_of_lights(entries: Iterable[Entry]) -> set[str]:
    """Plugin ids of the emitters among shapes and emitters."""
    return {entry.get("emitter", entry)["type"] for entry in entries if is_light(entry)}


def has_points(entries: Iterable[Entry]) -> bool:
    """Whether lamps that no ray can meet are among shapes and emitters."""
    return not kinds_of_lights(entries).isdisjoint(POINT_LIKE)


def is_light(entry: Entry) -> bool:
    """Whether a shape or an emitter shines."""
    return ("emitter" in entry or "bsdf" not in entry) and shines(entry)


def turns_light(entry: object) -> bool:
    """Whether what an entry describes mirrors light, or refracts it."""
    if not isinstance(entry, dict):
        return False
    if entry.get("type") == "conductor":
        return True
    return refracts(entry) or any(map(turns_light, entry.values()))
