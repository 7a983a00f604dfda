"""The smallest means that render a scene: variant, integrator, plugins, with reasons."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from relume.translator.scene_values import Entry

if TYPE_CHECKING:
    from relume.translator.candidates import Candidates
    from relume.translator.document import Document
    from relume.translator.media import HomogeneousMedium

RGB, SPECTRAL = "llvm_ad_rgb", "llvm_ad_spectral"


@dataclass(frozen=True)
class RenderPlan:
    """How a scene is rendered.

    Attributes:
        variant: Mitsuba variant.
        integrator: plugin id of the integrator.
        sensor: plugin id of the sensor.
        width, height: size of the picture [pixel].
        spp: samples of a pixel.
        plugins: ids of relume's own plugins that the scene uses.
        candidates: plugin ids of the integrators that a render may choose: one, or those that a
            pilot compares, the first of which renders where none is made. `integrator` stands in
            the scene's dictionary whatever a render chooses.
        reasons: why, in words, by `variant`, `integrator`, `candidates`, `sensor` and `spp`.
    """

    variant: str
    integrator: str
    sensor: str
    width: int
    height: int
    spp: int
    plugins: tuple[str, ...]
    candidates: tuple[str, ...]
    reasons: dict[str, str]

    def as_dict(self) -> dict[str, Any]:
        """The plan as JSON values."""
        lists = {"plugins": list(self.plugins), "candidates": list(self.candidates)}
        return asdict(self) | lists


SENSOR_REASONS = {
    "perspective": "a pinhole",
    "thinlens": "a thin lens",
    "screencamera": "pixels are not square, or the lens looks off the Z axis",
    "relativisticcamera": "a camera that moves, or sees all around",
}
"""Why a scene has a sensor, by its plugin id."""

METROPOLIS = ("pssmlt", "erpt")
"""Integrators that take their paths from another one, nested under the name `paths`."""

LATE = 9
"""Depth from which roulette ends the paths of chains where a scene asks for none."""

MUTATIONS = 32
"""Mutations of a pixel in each run where a scene asks for none or fewer (language 13.6)."""

BOOTSTRAP = 0.25
"""Uniform samples to each mutation at least: few of them leave single bright paths as spots."""


def metropolis(document: Document) -> str | None:
    """The Metropolis integrator that a document asks for, or None; energy redistribution wins."""
    return "erpt" if document.erpt else "pssmlt" if document.metropolis else None


def mutations(document: Document) -> int:
    """Mutations of a pixel in each run of a Metropolis render: a whole number, 1 or more."""
    return max(1, round(document.mutation)) if document.mutation > 0 else MUTATIONS


def samples(document: Document) -> int:
    """Samples of a pixel: of a Metropolis render, its mutations in all runs."""
    if metropolis(document):
        return document.sampling * mutations(document)
    return document.sampling * document.supersampling**2


def with_samples(document: Document, spp: int) -> Document:
    """The document with another number of samples of a pixel.

    Energy redistribution has whole chains: `spp` is rounded up to a multiple of their length.
    """
    if document.erpt:
        chains = -(-int(spp) // mutations(document))
        return dataclasses.replace(document, sampling=chains, supersampling=1)
    document = dataclasses.replace(document, sampling=int(spp), supersampling=1)
    if document.metropolis:
        # The bootstrap keeps its share.
        share = document.mlt_sample / mutations(document)
        return dataclasses.replace(document, mutation=1.0, mlt_sample=share)
    return document


def samples_reason(document: Document) -> str:
    """Where the number of samples comes from, in words."""
    if metropolis(document):
        return f"SAMPLING {document.sampling} runs of {mutations(document)} mutations a pixel"
    return f"SAMPLING {document.sampling} x SUPERSAMPLING {document.supersampling} squared"


def bootstrap(document: Document) -> float:
    """Uniform samples to each mutation of `pssmlt`: those of mlt_sample, or `BOOTSTRAP` if more."""
    return max(BOOTSTRAP, document.mlt_sample / mutations(document))


def paths_of_chains(integrator: Entry) -> Entry:
    """The path tracer that chains take their paths from: its roulette sets in late, at `LATE`.

    Chains lose by early roulette, from which independent samples gain: `docs/roulette.md`.

    Args:
        integrator: dictionary of the path tracer, or of what it is nested in.
    """
    parts = {key: paths_of_chains(x) for key, x in integrator.items() if isinstance(x, dict)}
    late = {"rr_depth": LATE} if integrator.get("type") == "surfacepath" else {}
    return late | integrator | parts


def metropolis_integrator(
    document: Document, dialect: str, paths: Entry, reason: str
) -> tuple[Entry, str]:
    """The Metropolis integrator around the one that traces paths, and the reason for it.

    Paths of surfaces alone are found from both ends, which chains gain by (docs/metropolis.md).
    """
    if paths["type"] == "surfacepath":
        paths = paths | {"type": "bdpt"}
        reason += "; found from both ends"
    if document.erpt:
        chains = {"type": "erpt", "length": mutations(document), "paths": paths}
        return chains, f"energyRedistributionPathTracing; its paths: {reason}"
    mutation = "lux" if dialect == "prender" else "kelemen"
    result: Entry = {"type": "pssmlt", "mutation": mutation, "bootstrap": bootstrap(document)}
    if document.lines.is_set("mlt_resampling"):
        result["resampling"] = document.mlt_resampling
    return result | {"paths": paths}, f"metropolisTransport; its paths: {reason}"


def integrator(
    document: Document,
    dialect: str,
    dispersive: bool,
    types: Collection[str],
    media: Sequence[HomogeneousMedium],
    profile: str | None,
    wrapped: Callable[[Entry], tuple[Entry, str]] = lambda paths: (paths, ""),
    inside: bool = False,
    followed: str = "",
) -> tuple[Entry, str]:
    """The integrator's dictionary and the reason for it.

    Args:
        document: the document.
        dialect: `manual` or `prender`.
        dispersive: whether glass with dispersion is rendered by wavelength.
        types: plugin ids of the objects.
        media: all media that light crosses.
        profile: profile of the dipole, or None where no object needs it.
        wrapped: from a path tracer to the one that knows relativity, and why.
        inside: whether some of the media fill objects.
        followed: why walks through the medium around them are to be followed, if they are.
    """
    if inside:
        kind, reason = "randomwalk", "scattering inside objects, walk by walk"
    elif followed:
        kind, reason = "randomwalk", followed
    elif any(medium.chromatic for medium in media):
        kind, reason = "volpathmis", "a medium whose extinction differs between the channels"
    elif media:
        kind, reason = "volpath", "a medium with the same extinction in all channels"
    elif profile:
        kind, reason = "dipole", f"subsurface scattering by diffusion, profile {profile}"
    elif dispersive:
        kind, reason = "surfacepath", "glass with dispersion: one wavelength for each path"
    else:
        kind, reason = "surfacepath", "no medium"
    if dispersive and media and kind != "randomwalk":
        # The stock ones part the wavelengths at each refraction, without bias.
        kind = "volpathmis"
        reason += "; glass with dispersion parts wavelengths with more noise than without a medium"
    result: Entry = {"type": kind, "max_depth": -1, "rr_depth": int(min(document.depth, 2**30)) + 1}
    if profile:
        result["profile"] = profile
    result, why = wrapped(result)
    reason += why
    if result["type"] == "surfacepath" and not document.lines.is_set("depth"):
        del result["rr_depth"]  # the plugin's own: it starts where it costs least
    if "shadowcatcher" in types:
        reason += "; wrapped by shadowcatching for shadow"
        result = {"type": "shadowcatching", "integrator": result}
    limit = 0.0 if metropolis(document) else document.luminance_cutoff * samples(document)
    if document.sensor_response != 1 or limit > 0:
        reason += "; wrapped by samplescale for sensor_response or luminance_cutoff"
        result = {
            "type": "samplescale",
            "response": document.sensor_response,
            "luminance_limit": limit,
            "integrator": result,
        }
    if metropolis(document):
        return metropolis_integrator(document, dialect, paths_of_chains(result), reason)
    return result, reason


def render_plan(
    document: Document,
    scene: Entry,
    own_plugins: Collection[str],
    dispersive: bool,
    integrator_reason: str,
    may_render: Candidates,
) -> RenderPlan:
    """The `RenderPlan` of a translated scene.

    Args:
        document: the document.
        scene: the scene's plain dictionary.
        own_plugins: ids of all plugins that relume brings.
        dispersive: whether wavelengths matter.
        integrator_reason: why this integrator.
        may_render: those that may render instead.
    """
    used = sorted(plugin_types(scene) & set(own_plugins))
    camera = scene["sensor"]["type"]
    return RenderPlan(
        variant=SPECTRAL if dispersive else RGB,
        integrator=scene["integrator"]["type"],
        sensor=camera,
        width=document.image[0],
        height=document.image[1],
        spp=samples(document),
        plugins=tuple(used),
        candidates=may_render.names,
        reasons={
            "variant": "glass with dispersion" if dispersive else "no wavelengths matter",
            "integrator": integrator_reason,
            "candidates": may_render.reason,
            "sensor": SENSOR_REASONS[camera],
            "spp": samples_reason(document),
        },
    )


def plugin_types(value: Any) -> set[str]:
    """All plugin ids in a dictionary of plain values."""
    if not isinstance(value, dict):
        return set()
    own = {value["type"]} if isinstance(value.get("type"), str) else set()
    return own.union(*(plugin_types(item) for item in value.values()))
