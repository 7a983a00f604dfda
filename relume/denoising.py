"""Clean pictures out of noisy ones: Intel Open Image Denoise, by the package `mitsuba-oidn`.

A denoised picture is a guess at what more samples would show. It is for the eye alone, says so in
its name and metadata, and is never measured.

The network is told albedo and normals of what is seen (`aovs.GUIDES`), cleaned by itself first.
Where the noise of each pixel is known, it decides how much the guess counts: the more the two
pictures differ beyond the noise, the less. So detail that the samples show is not smeared away, and
with many samples the picture becomes the rendered one.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relume import metadata, output
from relume.layer_names import layer
from relume.session import CannotRender

if TYPE_CHECKING:
    from collections.abc import Mapping

MARK = ".denoised"
"""Ending of the names of denoised pictures, before the extension."""

WINDOW = 3
"""Pixels to each side over which the difference to the rendered picture is judged."""

MISSING = "to denoise needs the package mitsuba-oidn: python -m pip install 'relume[denoise]'"


def library() -> Any:
    """The module that denoises.

    Raises:
        CannotRender: it is not installed.
    """
    try:
        import mitsuba_oidn
    except ImportError:
        raise CannotRender(MISSING) from None
    return mitsuba_oidn


def by() -> dict[str, str]:
    """What a denoised picture says of itself."""
    from importlib.metadata import version

    return {metadata.DENOISED: f"Intel Open Image Denoise, mitsuba-oidn {version('mitsuba-oidn')}"}


def marked(path: str | Path) -> Path:
    """The name of the denoised picture beside a picture; its own if it has the mark already."""
    path = Path(path)
    stem, extension = output.split_extension(path.name)
    return path if stem.endswith(MARK) else path.with_name(f"{stem}{MARK}{extension}")


def guides(planes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Albedo and normal from channels by name, as far as they are there.

    Args:
        planes: such as `aovs.render_layers` returns, or `developing.read` finds in any picture.
    """
    wished = {
        "albedo": ("denoising albedo", "albedo", "diffcol"),
        "normal": ("denoising normal", "normal", "n"),
    }
    found = {name: layer(dict(planes), *names) for name, names in wished.items()}
    return {name: image for name, image in found.items() if image is not None}


def denoised(
    image: np.ndarray,
    guides: Mapping[str, np.ndarray] | None = None,
    variance: np.ndarray | None = None,
) -> np.ndarray:
    """A picture without noise.

    Args:
        image: linear RGB, (height, width, 3) float32.
        guides: `albedo` in [0, 1], and `normal` in [-1, 1]; a normal alone is no guide.
        variance: of the picture's values, (height, width, 3); None where it is unknown.

    Returns:
        Linear RGB, (height, width, 3) float32.

    Raises:
        CannotRender: the package that does it is not installed.

    Source: Áfra, Intel Open Image Denoise; for the share of the noise, Firmino et al., Progressive
    denoising of Monte Carlo rendered images, Eurographics 2022, without its network.
    """
    oidn = library()
    image = np.ascontiguousarray(output.repair(np.asarray(image, np.float32))[0])
    device = oidn.Device(oidn.DeviceType.CPU)
    clean: dict[str, np.ndarray] = {}
    if guides and "albedo" in guides:
        for name, guide in guides.items():
            clean[name] = prefiltered(device, name, guide)
    found = oidn.denoise(image, hdr=True, clean_aux=bool(clean), device=device, **clean)
    return found if variance is None else shrunk(found, image, variance)


def prefiltered(device: Any, name: str, guide: np.ndarray) -> np.ndarray:
    """A guide without its own noise; `device` is a `mitsuba_oidn.Device`."""
    plane = np.ascontiguousarray(guide, np.float32)
    clean = np.empty_like(plane)
    network = device.new_filter("RT")
    network.set_image(name, plane)
    network.set_image("output", clean)
    network.execute()
    return clean


def shrunk(guess: np.ndarray, image: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """The mean of a guess and a rendered picture with the least expected error, around each pixel.

    With the guess's bias b and the rendered picture's variance v the guess counts v / (b² + v). The
    square of their difference is b² + v on the mean; to be sure of a bias, twice v is taken off.
    """
    from scipy.ndimage import uniform_filter

    size = (2 * WINDOW + 1, 2 * WINDOW + 1)
    v = uniform_filter(np.nan_to_num(variance, posinf=0).mean(axis=2), size)
    square = uniform_filter(((guess - image).astype(np.float64) ** 2).mean(axis=2), size)
    bias2 = np.maximum(square - 2 * v, 0)
    share = np.divide(v, bias2 + v, out=np.ones_like(v), where=bias2 > 0)[..., None]
    return (share * guess + (1 - share) * image).astype(np.float32)


def write_marked(path: str | Path, image: np.ndarray, gamma: float, finish: output.Finish) -> Path:
    """Write a denoised picture under the marked name.

    Args:
        path: of the rendered one.
        image: denoised.
        gamma: as `output.write_image` gets it.
        finish: likewise.

    Returns:
        Its path.

    Raises:
        OutputError: it cannot be written.
    """
    finish = dataclasses.replace(finish, metadata={**finish.metadata, **by()}, layers={})
    return output.write_image(marked(path), image, gamma, finish).paths[0]
