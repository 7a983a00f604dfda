"""Reflectances: a colour, a picture or the vertex colours of a mesh, multiplied and translated.

Three kinds of value serve wherever a surface has a colour: a tuple of three numbers, a `Texture`
and `VertexColor`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from relume.translator.geometry import affine
from relume.translator.images import as_texture, read_image
from relume.translator.scene_values import Entry, Matrix, Picture
from relume.translator.scene_values import reflectance as color_entry

Color: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SphereMap:
    """How a picture covers a sphere, where not by its own coordinates.

    Attributes:
        name: one of `dome_maps.FORMULAS`.
        center: of the sphere, (3,) [scene unit].
        to_sphere: linear map from the world to a sphere, (3, 3), or None for what is one.
    """

    name: str
    center: np.ndarray
    to_sphere: np.ndarray | None = None

    def entry(self, nested: Entry) -> Entry:
        """The dictionary of a texture that is mapped so."""
        result: Entry = {
            "type": "spheremap",
            "map": self.name,
            "center": [float(x) for x in self.center],
            "picture": nested,
        }
        if self.to_sphere is not None:
            result["to_sphere"] = Matrix.of(affine(self.to_sphere))
        return result


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture on a surface.

    Attributes:
        rgb: (height, width, 3) linear, as Mitsuba takes it: the row at v = 0 first.
        alpha: (height, width) opacity, or None where everything is opaque.
        uv_scale, uv_offset: factors and shifts of u and v.
        spectral: whether the scene is rendered by wavelength.
        clamp: outside 0 to 1 the texels at the edge go on, instead of the picture's repeating.
        map: how it covers a sphere; None for the coordinates of the shape.
    """

    rgb: np.ndarray
    alpha: np.ndarray | None = None
    uv_scale: tuple[float, float] = (1.0, 1.0)
    uv_offset: tuple[float, float] = (0.0, 0.0)
    spectral: bool = False
    clamp: bool = False
    map: SphereMap | None = None

    def adjusted(self, base: float, gain: float) -> Texture:
        """The texture with every texel x replaced by base + gain x, 0 at least."""
        if (base, gain) == (0.0, 1.0):
            return self
        return replace(self, rgb=np.maximum(np.float32(base) + np.float32(gain) * self.rgb, 0))

    def times(self, factors: Sequence[float]) -> Texture:
        """The texture with every texel multiplied by three factors."""
        return replace(self, rgb=self.rgb * np.asarray(factors, np.float32))

    def entry(self) -> Entry:
        """The dictionary of the texture."""
        # Colours are converted to spectra in spectral variants. Values above 1 have no reflectance
        # spectrum: they are used as they are, unless the scene is rendered by wavelength.
        return self._bitmap(self.rgb, raw=not self.spectral and bool(self.rgb.max() > 1))

    def opacity(self) -> Entry | None:
        """The dictionary of the opacity, None where everything is opaque."""
        return None if self.alpha is None else self._bitmap(self.alpha[..., None], raw=True)

    def _bitmap(self, pixels: np.ndarray, raw: bool) -> Entry:
        entry: Entry = {"type": "bitmap", "picture": Picture(pixels), "raw": raw}
        entry["filter_type"] = "nearest"
        if self.clamp:
            entry["wrap_mode"] = "clamp"
        if self.uv_scale != (1.0, 1.0) or self.uv_offset != (0.0, 0.0):
            entry["to_uv"] = uv_matrix(self.uv_scale, self.uv_offset)
        return entry if self.map is None else self.map.entry(entry)


@dataclass(frozen=True)
class VertexColor:
    """The colours of a mesh's vertices, multiplied by `factor`."""

    factor: float = 1.0

    def times(self, factors: Sequence[float]) -> VertexColor:
        """The vertex colours multiplied by the mean of three more factors."""
        return VertexColor(self.factor * float(np.mean(factors)))

    def entry(self) -> Entry:
        """The dictionary of the texture."""
        return {"type": "mesh_attribute", "name": "vertex_color", "scale": self.factor}


Reflectance: TypeAlias = Color | Texture | VertexColor


def uv_matrix(scale: tuple[float, float], offset: tuple[float, float]) -> Matrix:
    """Mitsuba's `to_uv` for u' = scale u + offset."""
    matrix = np.diag([scale[0], scale[1], 1.0, 1.0])
    matrix[:2, 3] = offset
    return Matrix.of(matrix)


def times(reflectance: Reflectance, factors: float | Iterable[float]) -> Reflectance:
    """A reflectance multiplied by three factors or one number."""
    r, g, b = factors if isinstance(factors, Iterable) else (factors,) * 3
    if isinstance(reflectance, Texture | VertexColor):
        return reflectance.times((r, g, b))
    return reflectance[0] * r, reflectance[1] * g, reflectance[2] * b


def at_most_one(reflectance: Reflectance) -> Reflectance:
    """A reflectance whose values are cut off at 1; vertex colours are taken as they are."""
    if isinstance(reflectance, Texture):
        return replace(reflectance, rgb=np.minimum(reflectance.rgb, 1))
    if isinstance(reflectance, VertexColor):
        return reflectance
    r, g, b = reflectance
    return min(r, 1.0), min(g, 1.0), min(b, 1.0)


def entry(reflectance: Reflectance) -> Entry:
    """What a BSDF takes as a reflectance."""
    if isinstance(reflectance, Texture | VertexColor):
        return reflectance.entry()
    return color_entry(reflectance)


def mean(reflectance: Reflectance) -> float:
    """Mean over channels and texels; vertex colours count as 1."""
    if isinstance(reflectance, Texture):
        return float(reflectance.rgb.mean())
    if isinstance(reflectance, VertexColor):
        return reflectance.factor
    return float(np.mean(reflectance))


def used_texels(pixels: np.ndarray) -> np.ndarray:
    """The texels of a picture that any u and v below 1 look up, top row first.

    The original program takes the texel in column floor((w - 1) u) and, from the bottom, row
    floor((h - 1) v): the last column and the top row are never used (section 11.1). Without them
    the nearest texel is the same one.
    """
    height, width = pixels.shape[:2]
    return pixels[min(1, height - 1) :, : max(1, width - 1)]


def load_texture(
    path: str | Path | None,
    *,
    flip: bool = True,
    repeat: int = 1,
    uv_scale: tuple[float, float] = (1.0, 1.0),
    uv_offset: tuple[float, float] = (0.0, 0.0),
    clamp: bool = False,
    spectral: bool = False,
    map: SphereMap | None = None,
) -> Texture:
    """The `Texture` of a picture file.

    Args:
        path: the picture.
        flip: True for shapes, whose v = 0 is the bottom row; False for meshes, whose v is turned
            round when they are read.
        repeat: how often the picture repeats along each side.
        uv_scale: further factors of u and v.
        uv_offset: shifts of u and v.
        clamp: let the texels at the edge go on outside 0 to 1.
        spectral: whether the scene is rendered by wavelength.
        map: how it covers a sphere.

    Raises:
        ImageError: the file is no picture.
    """
    assert path is not None  # missing files were reported before
    image = as_texture(read_image(path))
    rgb, alpha = used_texels(image.rgb), None if image.alpha is None else used_texels(image.alpha)
    if flip:
        rgb, alpha = rgb[::-1], None if alpha is None else alpha[::-1]
    scale = (uv_scale[0] * repeat, uv_scale[1] * repeat)
    offset = (uv_offset[0] * repeat, uv_offset[1] * repeat)
    return Texture(np.ascontiguousarray(rgb), alpha, scale, offset, spectral, clamp, map)


def cut_out(path: str | Path, spectral: bool) -> Texture:
    """The `Texture` of a picture that is cut out: transparent and black outside.

    Unlike those of `load_texture` it has all texels: the column is w u, rounded towards 0, so that
    the first column and the lowest row are twice as wide as the others (11.3).

    Args:
        path: the picture.
        spectral: whether the scene is rendered by wavelength.

    Raises:
        ImageError: the file is no picture.
    """
    image = as_texture(read_image(path))
    alpha = np.ones(image.rgb.shape[:2], np.float32) if image.alpha is None else image.alpha
    rgb, alpha = (
        np.pad(np.pad(texels[::-1], (*((1, 0),) * 2, (0, 0)), "edge"), (*((1, 1),) * 2, (0, 0)))
        for texels in (image.rgb, alpha[..., None])
    )
    height, width = rgb.shape[:2]
    scale = ((width - 3) / width, (height - 3) / height)
    offset = (2 / width, 2 / height)
    return Texture(rgb, alpha[..., 0], scale, offset, spectral, clamp=True)
