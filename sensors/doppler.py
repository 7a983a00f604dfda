"""What motion does to light: directions, frequencies, and colours."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

LINES = (700.0, 546.1, 435.8)
"""Wavelengths [nm] that stand for red, green and blue."""

WIDTH = 100.0
"""Standard deviation [nm] of what each primary takes from a line."""

VISIBLE = (380.0, 750.0)
"""Wavelengths [nm] beyond which lines fade by e in `FADE` nm."""

FADE = 50.0


def check_velocity(velocity: mi.Vector3f) -> None:
    """Check the velocity of an observer, in units of the speed of light.

    Raises:
        ValueError: it is not below 1.
    """
    found = np.array(velocity, np.float64).ravel()
    if not np.linalg.norm(found) < 1:
        raise ValueError(f"velocity is {found.tolist()}, but its length must be below 1")


def lorentz_factor(velocity: mi.Vector3f) -> mi.Float:
    """γ of a velocity in units of the speed of light."""
    return dr.rsqrt(1 - dr.squared_norm(velocity))


def aberrated(d: mi.Vector3f, velocity: mi.Vector3f) -> mi.Vector3f:
    """Direction in the world of what a moving observer sees in a direction.

    Args:
        d: unit direction in which the observer looks.
        velocity: of the observer, in units of the speed of light.
    """
    gamma = lorentz_factor(velocity)
    # A photon that comes from d, boosted: the parts along v and across, without v's direction.
    along = dr.dot(d, velocity)
    return dr.normalize(d + velocity * (gamma * gamma / (gamma + 1) * along - gamma))


def doppler_factor(d: mi.Vector3f, velocity: mi.Vector3f) -> mi.Float:
    """Frequency that a moving observer sees over that in the world.

    Args:
        d: unit direction in the world from which the light comes.
        velocity: of the observer, in units of the speed of light.
    """
    return lorentz_factor(velocity) * (1 + dr.dot(d, velocity))


def moved_lines(color: mi.Color3f, D: mi.Float) -> mi.Color3f:
    """Colour of three lines of the strengths of a colour, all frequencies times D."""
    moved = [line / D for line in LINES]
    strengths = []
    for strength, x in zip(color, moved, strict=True):
        beyond = dr.maximum(dr.maximum(VISIBLE[0] - x, x - VISIBLE[1]), 0)
        strengths.append(strength * dr.exp(-beyond / FADE))
    return mi.Color3f(
        *(
            sum(
                strength * dr.exp(-dr.square((x - line) / WIDTH) / 2)
                for strength, x in zip(strengths, moved, strict=True)
            )
            for line in LINES
        )
    )


def shifted(color: mi.Color3f, D: mi.Float, share: mi.Float, limit: float = dr.inf) -> mi.Color3f:
    """A colour in the sight of who sees all frequencies times D.

    Args:
        color: linear RGB.
        D: Doppler factor, above 0.
        share: s of the shift of colours, in [0, 1]; the rest is beaming, D^4.
        limit: largest value of a channel.
    """
    lines = dr.minimum(moved_lines(color, dr.fma(share, D - 1, 1)), limit)
    return dr.minimum(share * lines + (1 - share) * dr.square(dr.square(D)) * color, limit)
