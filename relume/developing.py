"""Finished pictures developed: linear radiance of a file, of any renderer, to a picture to look at.

A picture in OpenEXR may have its colours in a layer, or in a part of its own. Those named `R`, `G`
and `B` alone come first, then those of a layer named as a whole picture, then any others; a picture
with luminance alone is grey.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relume import denoising, metadata, output
from relume.tone import AS_IT_IS, Look

WHOLE = ("combined", "rgba", "rgb", "beauty", "color", "colour", "composite", "image")
"""Names of layers that are the picture itself, lower case."""

COLOUR = ({"r": 0, "red": 0}, {"g": 1, "green": 1}, {"b": 2, "blue": 2})


@dataclass(frozen=True)
class LinearPicture:
    """A linear picture that was read.

    Attributes:
        image: linear RGB, (height, width, 3) float32.
        planes: all its channels by name, (height, width) float32.
        facts: its texts by name, as `metadata.of_file`.
    """

    image: np.ndarray
    planes: dict[str, np.ndarray]
    facts: dict[str, str]


def develop(source: str | Path, out: str | Path, look: Look = AS_IT_IS) -> output.Written:
    """Write a linear picture as one to look at.

    Args:
        source: OpenEXR or Radiance file.
        out: the picture (.png .bmp .ppm); linear formats are written as they are.
        look: exposure and tone curve.

    Raises:
        OutputError: a file cannot be read or written, or is the same.
    """
    found = read(source)
    return write(found, source, out, look)


def write(found: LinearPicture, source: str | Path, out: str | Path, look: Look) -> output.Written:
    """Write a picture that was read; as `develop`."""
    out = Path(out)
    if out.exists() and out.samefile(source):
        raise output.OutputError(f"cannot write {out}: it is the picture that is read")
    output.check_format(out)
    return output.write_image(out, found.image, gamma_of(found), output.Finish(look, found.facts))


def denoised(found: LinearPicture, out: str | Path) -> tuple[LinearPicture, Path]:
    """A picture denoised with the guides that it holds, and its marked name.

    Raises:
        CannotRender: the package that does it is not installed.
    """
    clean = denoising.denoised(found.image, denoising.guides(found.planes))
    facts = {**found.facts, **denoising.by()}
    return LinearPicture(clean, found.planes, facts), denoising.marked(out)


def gamma_of(found: LinearPicture) -> float:
    """The `gamma_offset` of the scene, where the picture tells it; else 0."""
    try:
        return float(found.facts.get(metadata.GAMMA, 0.0))
    except ValueError:
        return 0.0


def read(path: str | Path) -> LinearPicture:
    """Read a linear picture.

    Raises:
        OutputError: there is no such file, or it holds no picture.
    """
    import OpenImageIO as oiio

    if Path(path).suffix.lower() not in (".exr", ".hdr", ".pic", ".rgbe"):
        raise output.OutputError(f"{path}: expected a linear picture (.exr .hdr)")
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise output.OutputError(f"cannot read {path}: {oiio.geterror() or 'no picture'}")
    planes: dict[str, np.ndarray] = {}
    try:
        part = 0
        while file.seek_subimage(part, 0):
            _read_part(file, part, planes)
            part += 1
    finally:
        file.close()
    if not planes:
        raise output.OutputError(f"cannot read {path}: it is damaged, or has no channels")
    return LinearPicture(picture_of(planes), planes, metadata.of_file(path))


def _read_part(file: Any, part: int, planes: dict[str, np.ndarray]) -> None:
    """Add the channels of one part to `planes`; those of another size are left out."""
    import OpenImageIO as oiio

    spec = file.spec()
    pixels = file.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
    if pixels is None:
        return
    shape = next(iter(planes.values())).shape if planes else (spec.height, spec.width)
    name = spec.getattribute("oiio:subimagename") or ""
    several = (spec.getattribute("oiio:subimages") or 1) > 1
    for index, channel in enumerate(spec.channelnames):
        full = f"{name}.{channel}" if several and name else channel
        if pixels.shape[:2] == shape and full not in planes:
            planes[full] = np.ascontiguousarray(pixels[..., index], np.float32)


def picture_of(planes: dict[str, np.ndarray]) -> np.ndarray:
    """The picture among channels: linear RGB, (height, width, 3)."""
    layers: dict[str, dict[str, np.ndarray]] = {}
    for name in planes:
        layer, _, channel = name.rpartition(".")
        layers.setdefault(layer, {})[channel.lower()] = planes[name]
    for layer in sorted(layers, key=_rank):
        found = layers[layer]
        colours = [next((found[n] for n in names if n in found), None) for names in COLOUR]
        if all(colour is not None for colour in colours):
            return np.stack([c for c in colours if c is not None], axis=-1)
    grey = next((p for n, p in planes.items() if n.rpartition(".")[2].lower() in ("y", "l")), None)
    return np.stack([grey if grey is not None else next(iter(planes.values()))] * 3, axis=-1)


def _rank(layer: str) -> int:
    if not layer:
        return 0
    return 1 if layer.rpartition(".")[2].lower() in WHOLE else 2
