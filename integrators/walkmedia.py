"""The homogeneous media of a scene, as walks need them: coefficients and phase functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.integrators.translucentmaterials import nested, shapes_below
from relume.phasefunctions.henyeygreenstein import henyey_greenstein, sample_henyey_greenstein
from relume.phasefunctions.hgrgb import DELTA_DENSITY, at_wavelengths, toward


@dataclass
class Coefficients:
    """A medium at the wavelengths of a path.

    Attributes:
        sigma_t: ``mi.Spectrum``, extinction [1/scene unit].
        albedo: ``mi.Spectrum``, share of what is met that is scattered.
        g: ``mi.Spectrum``, mean cosines.
    """

    sigma_t: mi.Spectrum
    albedo: mi.Spectrum
    g: mi.Spectrum

    @property
    def reduced(self) -> mi.Spectrum:
        """Extinction of the medium that scatters evenly and diffuses light alike."""
        return self.sigma_t * (1 - self.albedo * self.g)

    @property
    def reduced_albedo(self) -> mi.Spectrum:
        """Its albedo."""
        scatters = self.albedo * (1 - self.g)
        return dr.select(self.g < 1, scatters / (1 - self.albedo * self.g), 0)


def mean_cosines(phase: mi.PhaseFunction) -> list[float]:
    """g of red, green and blue of a phase function; ValueError for one that has none."""
    name = phase.class_name()
    if name == "IsotropicPhaseFunction":
        return [0.0] * 3
    if name == "HGPhaseFunction":
        return [float(dr.ravel(mi.traverse(phase)["g"])[0])] * 3
    if hasattr(phase, "channels"):
        return [float(np.array(g).ravel()[0]) for g in phase.g]
    raise ValueError(f"randomwalk takes the phase functions isotropic, hg and hgrgb, not {name}")


def registry_number(medium: mi.Medium) -> int:
    """The number by which ``mi.MediumPtr`` refers to a medium."""
    return int(dr.reinterpret_array(mi.UInt32, mi.MediumPtr(medium))[0])


class Media:
    """The media of a scene, as it is now.

    Args:
        scene: `mi.Scene`.
        camera: the medium that the sensor is in, or None.

    Attributes:
        exist: whether there is any.
        emitters_sampled: whether lamps are to be looked for from inside some medium.
        chromatic: whether the extinction of some medium differs between the channels.
        isotropic: whether all of them scatter evenly to all sides.
        one_g: whether g is the same for all channels of each medium.
        densest: largest reduced extinction [1/scene unit].
        similar: whether one medium that scatters evenly diffuses light as each of them does.

    Raises:
        ValueError: a medium or phase function that walks do not know.
    """

    def __init__(self, scene: mi.Scene, camera: mi.Medium | None) -> None:
        found: dict[int, mi.Medium] = {}
        for shape in shapes_below(scene):
            for medium in (shape.interior_medium(), shape.exterior_medium()):
                if medium is not None:
                    found[registry_number(medium)] = medium
        if camera is not None:
            found[registry_number(camera)] = camera
        self.exist = bool(found)
        self.emitters_sampled = any(m.use_emitter_sampling() for m in found.values())
        self.chromatic = any(not is_grey(m) for m in found.values())
        cosines = {number: mean_cosines(m.phase_function()) for number, m in found.items()}
        table = np.zeros((max(found, default=0) + 1, 3), np.float32)
        for number, g in cosines.items():
            table[number] = g
        self.isotropic = not table.any()
        self.one_g = bool((np.ptp(table, axis=1) == 0).all())
        self.similar = self.isotropic or (self.one_g and not self.chromatic)
        self._g = [mi.Float(column) for column in table.T]
        self.densest = max(map(self.reduced, found.values()), default=0.0)

    def reduced(self, medium: mi.Medium) -> float:
        """Largest reduced extinction of a medium [1/scene unit]."""
        ray = dr.zeros(mi.Ray3f)
        if mi.is_spectral:
            ray.wavelengths = mi.Spectrum(450, 520, 580, 640)
        inner = self.coefficients(mi.MediumPtr(medium), ray.wavelengths, mi.Bool(True))
        return float(np.max(np.array(inner.reduced)))

    def coefficients(self, medium: mi.MediumPtr, wavelengths: Any, active: mi.Bool) -> Coefficients:
        """`Coefficients` of the media that paths are in."""
        mei = dr.zeros(mi.MediumInteraction3f)
        mei.wavelengths = wavelengths
        sigma_s, _, sigma_t = map(mi.Spectrum, medium.get_scattering_coefficients(mei, active))
        albedo = dr.select(sigma_t > 0, sigma_s / sigma_t, 0)
        return Coefficients(sigma_t, albedo, self.cosines(medium, wavelengths, active))

    def transmittance(
        self, medium: mi.MediumPtr, wavelengths: Any, way: mi.Float, active: mi.Bool
    ) -> mi.Spectrum:
        """What is left of light on its way through media."""
        mei = dr.zeros(mi.MediumInteraction3f)
        mei.wavelengths = wavelengths
        _, _, sigma_t = medium.get_scattering_coefficients(mei, active)
        return dr.exp(-mi.Spectrum(sigma_t) * way)

    def cosines(self, medium: mi.MediumPtr, wavelengths: Any, active: mi.Bool) -> mi.Spectrum:
        """Mean cosines at the wavelengths of a path."""
        if self.isotropic:
            return mi.Spectrum(0)
        number = dr.reinterpret_array(mi.UInt32, medium)
        g = [dr.gather(mi.Float, column, number, active) for column in self._g]
        return mi.Spectrum(at_wavelengths(g, wavelengths))


def is_grey(medium: mi.Medium) -> bool:
    """Whether all channels have the same extinction; ValueError for a medium that varies."""
    name = medium.class_name()
    if name != "HomogeneousMedium" or varies(medium):
        raise ValueError(f"randomwalk takes homogeneous media, not {name} that varies in space")
    if mi.is_monochromatic:
        return True
    if mi.is_spectral:
        return not medium.has_spectral_extinction()
    sigma_t = np.array(mi.traverse(medium)["sigma_t.value.value"], float).ravel()
    return bool(np.ptp(sigma_t) <= 1e-6 * sigma_t.max())


def varies(medium: mi.Medium) -> bool:
    """Whether a homogeneous medium has an albedo that differs between places."""
    return any(volume.class_name() != "ConstVolume" for volume in nested(medium, mi.Volume))


def mixture(weights: mi.Spectrum) -> mi.Spectrum:
    """Probabilities in proportion to the weights of the channels, the first for none."""
    total = dr.sum(weights)
    return dr.select(total > 0, weights / total, 1 / len(weights))


def chosen(q: mi.Spectrum, values: mi.Spectrum, sample: mi.Float) -> mi.Float:
    """The value of a channel that is drawn with the probabilities q, never of one with 0."""
    value, below = values[0], q[0]
    for k in range(1, len(q)):
        value = dr.select((sample >= below) & (q[k] > 0), values[k], value)
        below = below + q[k]
    return value


def sample_phase(
    media: Media, g: mi.Spectrum, q: mi.Spectrum, d: mi.Vector3f, sample1: Any, sample2: Any
) -> tuple[mi.Vector3f, mi.Spectrum, mi.Float]:
    """Draw a direction of travel from the mixture of the channels' phase functions.

    Args:
        media: those of the scene.
        g: mean cosines.
        q: probability of each channel.
        d: direction of travel before.
        sample1: uniform variate for the channel.
        sample2: ``mi.Point2f``, uniform variates for the direction.

    Returns:
        (direction, weight of each channel, density [1/sr]).
    """
    if media.isotropic:
        uniform = mi.Float(dr.inv_four_pi)
        return mi.warp.square_to_uniform_sphere(sample2), mi.Spectrum(1), uniform
    g_chosen = g[0] if media.one_g else chosen(q, g, sample1)
    x = sample_henyey_greenstein(g_chosen, sample2.x)
    sin_phi, cos_phi = dr.sincos(dr.two_pi * sample2.y)
    sin = dr.safe_sqrt(x * (2 - x))
    w = mi.Vector3f(sin * cos_phi, sin * sin_phi, 1 - x)
    w = mi.Frame3f(toward(-d, g_chosen)).to_world(w)
    p, pdf = phase_values(media, g, q, d, w)
    delta = dr.abs(g_chosen) == 1
    if media.one_g:
        return w, mi.Spectrum(1), dr.select(delta, DELTA_DENSITY, pdf)
    # Channels of the same Dirac lobe share its samples.
    same = dr.select(g == g_chosen, mi.Spectrum(1), 0)
    weight = dr.select(delta, same / dr.sum(q * same), dr.select(pdf > 0, p / pdf, 0))
    return w, weight, dr.select(delta, DELTA_DENSITY, pdf)


def phase_values(
    media: Media, g: mi.Spectrum, q: mi.Spectrum, d: mi.Vector3f, w: mi.Vector3f
) -> tuple[mi.Spectrum, mi.Float]:
    """The phase function of each channel [1/sr], and the density of `sample_phase`.

    Args:
        media: those of the scene.
        g: mean cosines.
        q: probability of each channel.
        d: direction of travel before.
        w: direction of travel after.
    """
    if media.isotropic:
        return mi.Spectrum(dr.inv_four_pi), mi.Float(dr.inv_four_pi)
    ahead, back = 0.5 * dr.squared_norm(w - d), 0.5 * dr.squared_norm(w + d)
    p = henyey_greenstein(g, dr.select(g >= 0, mi.Spectrum(ahead), mi.Spectrum(back)))
    return p, dr.sum(q * p)
