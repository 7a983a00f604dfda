"""Exposure and tone curves: from linear radiance to what a display shows, still linear in [0, 1].

Without a wish nothing is changed: values above 1 are cut off, as the scene language has it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

AUTO = "auto"
LOOK = "relume.look"
"""Name of the text that tells the look of a picture, see `metadata`."""

MOST_STOPS = 100.0
MIDDLE_GREY = 0.18
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
DISPLAY_EXPONENT = 1 / 2.2
DARKEST = 1e-3
"""Least luminance that counts for the exposure, in units of the brightest percent."""

BLACK, BURNT = 26, 0.5
"""A picture is nearly black whose brightest percent is below this of 255, and burnt out of which
this share has all channels at 1 or above."""


@dataclass(frozen=True)
class Look:
    """How linear radiance is shown.

    Attributes:
        exposure: in stops, a factor 2^exposure; `auto` for `auto_exposure`.
        tone_map: a name of `TONE_MAPS`.
    """

    exposure: float | str = 0.0
    tone_map: str = "linear"

    @property
    def plain(self) -> bool:
        """Whether it changes nothing."""
        return self.exposure == 0 and self.tone_map == "linear"

    def stops(self, image: np.ndarray) -> float:
        """The exposure of a picture in stops."""
        return auto_exposure(image) if isinstance(self.exposure, str) else self.exposure

    def applied(self, image: np.ndarray) -> np.ndarray:
        """The picture as it is shown: linear, (height, width, 3) float32.

        Args:
            image: linear RGB, (height, width, 3), not negative.
        """
        if self.plain:
            return image
        exposed = np.asarray(image, np.float64) * 2.0 ** self.stops(image)
        return TONE_MAPS[self.tone_map](exposed).astype(np.float32)

    def described(self, image: np.ndarray) -> str:
        """The exposure and the curve in words."""
        return f"exposure {self.stops(image):+.2f}, {self.tone_map}"

    def metadata(self, image: np.ndarray) -> dict[str, str]:
        """What a picture that is shown so says of it."""
        return {} if self.plain else {LOOK: self.described(image)}


AS_IT_IS = Look()


def auto_exposure(image: np.ndarray) -> float:
    """The exposure in stops that puts the mean of the logarithm of luminance at middle grey.

    Pixels without light, and those of less than `DARKEST` of the brightest percent, do not count:
    a black background says nothing about the light on what stands before it.

    Args:
        image: linear RGB, (height, width, 3); values that are not finite do not count.

    Returns:
        Stops; 0 for a picture without light.

    Source: Reinhard et al., Photographic tone reproduction for digital images, 2002, eq. 1 and 2.
    """
    with np.errstate(invalid="ignore"):
        Y = (np.asarray(image, np.float64) @ LUMINANCE).ravel()
    Y = Y[np.isfinite(Y) & (Y > 0)]
    if not Y.size:
        return 0.0
    Y = Y[np.quantile(Y, 0.99) * DARKEST <= Y]
    return float(math.log2(MIDDLE_GREY) - np.log2(Y).mean())


def advice(image: np.ndarray, encoded: np.ndarray) -> str:
    """Which exposure would show a picture that is nearly black or burnt out; empty for others.

    Args:
        image: linear RGB, (height, width, 3).
        encoded: the same as it is shown, uint8.
    """
    brightest = encoded.max(axis=2)
    if not brightest.any():
        return ""
    stops = auto_exposure(image)
    shows = f"--exposure {stops:.1f} or auto would show it"
    # A few bright pixels in the dark are no picture that more exposure shows, nor less.
    if (level := np.quantile(brightest, 0.99)) < BLACK and stops > 0:
        return f"nearly black, its brightest percent from {level:.0f} of 255 on: {shows}"
    if (burnt := (encoded.min(axis=2) == 255).mean()) > BURNT and stops < 0:
        return f"burnt out, {100 * burnt:.0f} % of it white: {shows}"
    return ""


def linear(x: np.ndarray) -> np.ndarray:
    """Values cut off at 1."""
    return np.clip(x, 0, 1)


def filmic(x: np.ndarray) -> np.ndarray:
    """Hable's curve with shoulder and toe, white at 11.2.

    Source: Hable, Filmic tonemapping for real-time rendering, SIGGRAPH 2010 course Color
    enhancement and rendering in film and game production.
    """

    def curve(x: np.ndarray | float) -> np.ndarray | float:
        A, B, C, D, E, F = 0.15, 0.50, 0.10, 0.20, 0.02, 0.30
        return (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F

    exposure_bias, white = 2.0, 11.2
    return np.clip(curve(exposure_bias * np.minimum(x, 1e6)) / curve(white), 0, 1)


def aces(x: np.ndarray) -> np.ndarray:
    """Narkowicz's fit of the reference transform of ACES, a curve for each channel.

    Source: Narkowicz, ACES filmic tone mapping curve, 2015.
    """
    x = np.minimum(x, 1e6)
    return np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0, 1)


AGX_INSET = np.array(
    [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ]
)
AGX_RANGE = (-12.47393, 4.026069)
"""Stops around 1 that AgX holds."""

AGX_CURVE = (15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232)
"""Polynomial of the sigmoid, the highest power first."""


def agx(x: np.ndarray) -> np.ndarray:
    """AgX, its base look: bright colours go to white instead of to their nearest primary.

    Source: Sobotka, AgX, 2022; the polynomial of its sigmoid is Wrensch's, Minimal AgX
    implementation, 2023.
    """
    low, high = AGX_RANGE
    inset = np.maximum(np.minimum(x, 1e6) @ AGX_INSET.T, 2.0**low)
    t = np.clip((np.log2(inset) - low) / (high - low), 0, 1)
    outset = np.polyval(AGX_CURVE, t) @ np.linalg.inv(AGX_INSET).T
    return np.clip(outset, 0, 1) ** (1 / DISPLAY_EXPONENT)


TONE_MAPS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": linear,
    "filmic": filmic,
    "aces": aces,
    "agx": agx,
}
"""Curves by name: from linear RGB, not negative, to linear RGB in [0, 1]."""
