"""The smallest means that render a scene: variant, integrator, plugins, with reasons."""

from dataclasses import asdict, dataclass

RGB, SPECTRAL = "llvm_ad_rgb", "llvm_ad_spectral"


@dataclass(frozen=True)
class Plan:
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


def integrator(document, spp, dispersive, types, media, profile):
    """The integrator's dictionary and the reason for it.

    Args:
        document: the document.
        spp: samples of a pixel.
        dispersive: whether glass with dispersion is rendered by wavelength.
        types: plugin ids of the objects.
        media: all `media.Medium` that light crosses.
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
    result = {"type": kind, "max_depth": -1, "rr_depth": int(min(document.depth, 2**30)) + 1}
    if profile:
        result["profile"] = profile
    if "shadowcatcher" in types:
        reason += "; wrapped by shadowcatching for shadow"
        result = {"type": "shadowcatching", "integrator": result}
    if document.sensor_response != 1 or document.luminance_cutoff > 0:
        reason += "; wrapped by sensorresponse for sensor_response or luminance_cutoff"
        result = {
            "type": "sensorresponse",
            "response": document.sensor_response,
            "luminance_limit": document.luminance_cutoff * spp,
            "integrator": result,
        }
    return result, reason


def plan(document, scene, own_plugins, dispersive, integrator_reason):
    """The `Plan` of a translated scene.

    Args:
        document: the document.
        scene: the scene's plain dictionary.
        own_plugins: ids of all plugins that relume brings.
        dispersive: whether wavelengths matter.
        integrator_reason: why this integrator.
    """
    spp = document.sampling * document.supersampling**2
    used = sorted(plugin_types(scene) & set(own_plugins))
    camera = scene["sensor"]["type"]
    stock = "a pinhole" if camera == "perspective" else "a thin lens"
    return Plan(
        variant=SPECTRAL if dispersive else RGB,
        integrator=scene["integrator"]["type"],
        sensor=camera,
        width=document.image[0],
        height=document.image[1],
        spp=spp,
        plugins=tuple(used),
        reasons={
            "variant": "glass with dispersion" if dispersive else "no wavelengths matter",
            "integrator": integrator_reason,
            "sensor": stock
            if camera != "screencamera"
            else "pixels are not square, or the lens looks off the Z axis",
            "spp": f"SAMPLING {document.sampling} x SUPERSAMPLING {document.supersampling} squared",
        },
    )


def plugin_types(value):
    """All plugin ids in a dictionary of plain values."""
    if not isinstance(value, dict):
        return set()
    own = {value["type"]} if isinstance(value.get("type"), str) else set()
    return own.union(*(plugin_types(item) for item in value.values()))
