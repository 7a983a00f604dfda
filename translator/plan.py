"""The smallest means that render a scene: variant, integrator, plugins, with reasons."""

import dataclasses
from dataclasses import asdict, dataclass

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
        reasons: why, in words, by `variant`, `integrator`, `sensor` and `spp`.
    """

    variant: str
    integrator: str
    sensor: str
    width: int
    height: int
    spp: int
    plugins: tuple
    reasons: dict

    def as_dict(self):
        """The plan as JSON values."""
        return asdict(self) | {"plugins": list(self.plugins)}


METROPOLIS = ("pssmlt", "erpt")
"""Integrators that take their paths from another one, nested under the name `paths`."""

MUTATIONS = 32
"""Mutations of a pixel in each run where a scene asks for none or fewer (language 13.6)."""

BOOTSTRAP = 0.25
"""Uniform samples to each mutation at least: few of them leave single bright paths as spots."""


def metropolis(document):
    """The Metropolis integrator that a document asks for, or None; energy redistribution wins."""
    return "erpt" if document.erpt else "pssmlt" if document.metropolis else None


def mutations(document):
    """Mutations of a pixel in each run of a Metropolis render: a whole number, 1 or more."""
    return max(1, round(document.mutation)) if document.mutation > 0 else MUTATIONS


def samples(document):
    """Samples of a pixel: of a Metropolis render, its mutations in all runs."""
    if metropolis(document):
        return document.sampling * mutations(document)
    return document.sampling * document.supersampling**2


def with_samples(document, spp):
    """The document with another number of samples of a pixel.

    Energy redistribution has whole chains: `spp` is rounded up to a multiple of their length.
    """
    runs = {"sampling": int(spp), "supersampling": 1}
    if document.erpt:
        runs["sampling"] = -(-int(spp) // mutations(document))
    elif document.metropolis:
        # The bootstrap keeps its share.
        runs |= {"mutation": 1.0, "mlt_sample": document.mlt_sample / mutations(document)}
    return dataclasses.replace(document, **runs)


def samples_reason(document):
    if metropolis(document):
        return f"SAMPLING {document.sampling} runs of {mutations(document)} mutations a pixel"
    return f"SAMPLING {document.sampling} x SUPERSAMPLING {document.supersampling} squared"


def bootstrap(document):
    """Uniform samples to each mutation of `pssmlt`: those of mlt_sample, or `BOOTSTRAP` if more."""
    return max(BOOTSTRAP, document.mlt_sample / mutations(document))


def around(document, dialect, paths, reason):
    """The Metropolis integrator around the one that traces paths, and the reason for it."""
    if document.erpt:
        result = {"type": "erpt", "length": mutations(document), "paths": paths}
        return result, f"energyRedistributionPathTracing; its paths: {reason}"
    mutation = "lux" if dialect == "prender" else "kelemen"
    result = {"type": "pssmlt", "mutation": mutation, "bootstrap": bootstrap(document)}
    if "mlt_resampling" in document.lines.reports:
        result["resampling"] = document.mlt_resampling
    return result | {"paths": paths}, f"metropolisTransport; its paths: {reason}"


def integrator(document, dialect, dispersive, types, media, profile):
    """The integrator's dictionary and the reason for it.

    Args:
        document: the document.
        dialect: `manual` or `prender`.
        dispersive: whether glass with dispersion is rendered by wavelength.
        types: plugin ids of the objects.
        media: all `media.HomogeneousMedium` that light crosses.
        profile: profile of the dipole, or None where no object needs it.
    """
    if any(medium.chromatic for medium in media):
        kind, reason = "volpathmis", "a medium whose extinction differs between the channels"
    elif media:
        kind, reason = "volpath", "a medium with the same extinction in all channels"
    elif profile:
        kind, reason = "dipole", f"subsurface scattering by diffusion, profile {profile}"
    elif dispersive:
        kind, reason = "dispersivepath", "glass with dispersion: one wavelength for each path"
    else:
        kind, reason = "path", "no medium"
    if dispersive and media:
        # The stock ones part the wavelengths at each refraction, without bias.
        kind = "volpathmis"
        reason += "; glass with dispersion parts wavelengths with more noise than without a medium"
    if kind == "path" and metropolis(document):
        kind, reason = "dispersivepath", "no medium; quicker than path for unordered rays"
    result = {"type": kind, "max_depth": -1, "rr_depth": int(min(document.depth, 2**30)) + 1}
    if profile:
        result["profile"] = profile
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
    return around(document, dialect, result, reason) if metropolis(document) else (result, reason)


def plan(document, scene, own_plugins, dispersive, integrator_reason):
    """The `RenderPlan` of a translated scene.

    Args:
        document: the document.
        scene: the scene's plain dictionary.
        own_plugins: ids of all plugins that relume brings.
        dispersive: whether wavelengths matter.
        integrator_reason: why this integrator.
    """
    used = sorted(plugin_types(scene) & set(own_plugins))
    camera = scene["sensor"]["type"]
    stock = "a pinhole" if camera == "perspective" else "a thin lens"
    return RenderPlan(
        variant=SPECTRAL if dispersive else RGB,
        integrator=scene["integrator"]["type"],
        sensor=camera,
        width=document.image[0],
        height=document.image[1],
        spp=samples(document),
        plugins=tuple(used),
        reasons={
            "variant": "glass with dispersion" if dispersive else "no wavelengths matter",
            "integrator": integrator_reason,
            "sensor": stock
            if camera != "screencamera"
            else "pixels are not square, or the lens looks off the Z axis",
            "spp": samples_reason(document),
        },
    )


def plugin_types(value):
    """All plugin ids in a dictionary of plain values."""
    if not isinstance(value, dict):
        return set()
    own = {value["type"]} if isinstance(value.get("type"), str) else set()
    return own.union(*(plugin_types(item) for item in value.values()))
