"""Names of the layers of pictures: those that are written, and those of other programs."""

from __future__ import annotations

import numpy as np

LAYERS = {
    "albedo": "RGB",
    "normal": "XYZ",
    "depth": "Z",
    "position": "XYZ",
    "object": "X",
    "denoising_albedo": "RGB",
    "denoising_normal": "XYZ",
}
"""Layers with their channels."""


def layer(planes: dict[str, np.ndarray], *names: str) -> np.ndarray | None:
    """A layer of three channels by any of its names, whatever stands before it; else None.

    Args:
        planes: channels by name.
        names: of the layer, such as `albedo`; blanks and `_` are alike, and so are cases.
    """
    wished = [_plain(name) for name in names]
    for letters in (("r", "g", "b"), ("x", "y", "z")):
        for wish in wished:
            found = {
                n.rpartition(".")[2].lower(): plane
                for n, plane in planes.items()
                if _plain(n.rpartition(".")[0]).rpartition(".")[2] == wish
            }
            if set(letters) <= found.keys():
                return np.stack([found[letter] for letter in letters], axis=-1)
    return None


def _plain(name: str) -> str:
    return name.replace("_", " ").lower()
