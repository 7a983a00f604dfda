"""Pictures of the surroundings: light on domes, and the background (spec sections 11.5, 11.6)."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from relume import dome_maps
from relume.translator.assets import Find, existing
from relume.translator.document import Document
from relume.translator.giant_spheres import Ball
from relume.translator.images import as_texture, read_image
from relume.translator.lights import is_spot, two_sided
from relume.translator.objects import SceneObject
from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note
from relume.translator.reflectances import Texture, used_texels
from relume.translator.scene_geometry import SceneGeometry
from relume.translator.scene_values import Entry, Picture
from relume.translator.shapes import Hemisphere

LEAST_ANGLE = 0.1
"""A dome becomes an environment map if looking its picture up by direction instead of by hit point
is off by less, from all that the camera can see [degree]."""

MAP_ROWS = 1024
"""Fewest rows of a resampled environment map; larger pictures keep twice their own."""

BAND = 16
"""Rows that are resampled at a time: they stay in the cache, and large maps in the memory."""

FLAGS = (
    ("hemisphere_map", "hemisphere"),
    ("panoramic_map", "panoramic"),
    ("angular_map", "angular"),
    ("equirectangular_map", "equirectangular"),
)
"""Flags of an object and the map they ask for, in order of precedence."""

BLACK: Entry = {"type": "conductor", "specular_reflectance": {"type": "rgb", "value": 0.0}}
"""A surface that reflects nothing."""

Formula = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Function from unit vectors (..., 3) to image coordinates u and v, from the bottom."""


def map_flag(block: SceneObject) -> str | None:
    """The flag that decides how an object's picture covers a sphere; None without flags."""
    return next((flag for flag, _ in FLAGS if getattr(block, flag)), None)


def map_name(block: SceneObject, dialect: str) -> str:
    """Name of the map of an object's picture, as `dome_maps` knows it."""
    name = dict(FLAGS).get(map_flag(block) or "", "transposed")
    if name == "angular":
        block.lines.remark("angular_map", "angular-map", dialect=dialect)
        return "angular_mirrored" if dialect == "prender" else name
    return name


def picture(path: Path, block: SceneObject) -> np.ndarray:
    """The linear pixels of a picture that shines, (height, width, 3), top row first."""
    image = read_image(path)
    if not image.hdr:
        block.lines.remark("ibl_texture", "bytes-are-linear")
    return image.rgb


def domes_by_direction(document: Document, scene: SceneGeometry) -> dict[int, Note | None]:
    """The domes that become environment maps, looked up by direction instead of by hit point.

    Args:
        document: the document.
        scene: where its objects are.

    Returns:
        Indices of the objects, with a note why; None for ellipsoids, which have no other way.
    """
    found: dict[int, Note | None] = {}
    for index, block in enumerate(document.objects):
        if block.ibl_texture is None or is_spot(block) or index not in scene.balls:
            continue
        ball = scene.balls[index]
        if ball is None:
            found[index] = None
        # Mitsuba takes one environment map.
        elif not found and scene.encloses_camera(index):
            # From a point e off the centre, at right angles to e, it is off by asin(e / radius).
            away = scene.farthest(ball.center, index)
            degrees = math.degrees(math.asin(min(away / ball.radius, 1.0)))
            if degrees < LEAST_ANGLE:
                found[index] = make_note("dome-far", degrees=degrees)
    return found


def environment_of_dome(
    block: SceneObject, pixels: np.ndarray, dialect: str, note: Note | None
) -> Entry:
    """The environment map that a dome becomes.

    Args:
        block: the object.
        pixels: its picture, linear, (height, width, 3), top row first.
        dialect: `manual` or `prender` (row angular-map).
        note: why it is one.
    """
    name = map_name(block, dialect)
    if note is not None:
        block.lines.add("ibl_texture", note)
    latlong = resample(pixels, name, isinstance(block.shape, Hemisphere))
    return environment(latlong, block.ibl_texture_coef)


def dome(block: SceneObject, ball: Ball, pixels: np.ndarray, dialect: str) -> Entry:
    """A sphere that shines, with the parallax kept; arguments as `environment_of_dome`."""
    light: Entry = {
        "type": "ibldome",
        "picture": Picture(pixels),
        "map": map_name(block, dialect),
        "scale": block.ibl_texture_coef,
    }
    block.lines.remark("ibl_texture", "ibl-lookup")
    black = BLACK
    if isinstance(block.shape, Hemisphere):
        light["hemisphere"] = True
        # The default coordinate u runs around +Z from +X: its first half is where y > 0.
        half = Texture(np.ones((1, 2, 3), np.float32), np.array([[1.0, 0.0]], np.float32))
        black = {"type": "mask", "opacity": half.opacity(), "bsdf": black}
    return {
        "type": "sphere",
        "center": [float(x) for x in ball.center],
        "radius": float(ball.radius),
        "bsdf": black,
        "emitter": light,
    }


def shining_surface(
    name: str,
    pixels: np.ndarray,
    scale: float,
    *,
    flip: bool,
    spectral: bool,
    tiles: tuple[float, float] = (1.0, 1.0),
) -> Entry:
    """BSDF and emitter of a surface that shines with a picture by its own coordinates.

    Args:
        name: key of the shape in the scene's dictionary.
        pixels: linear, (height, width, 3), top row first.
        scale: factor of the radiance.
        flip: whether v = 0 is the bottom row.
        spectral: whether the scene is rendered by wavelength.
        tiles: how often the picture fits along u and v.
    """
    shown = used_texels(pixels) * np.float32(scale)
    shown = np.ascontiguousarray(shown[::-1] if flip else shown)
    shining = radiance(Texture(shown, uv_scale=tiles, spectral=spectral))
    return {"bsdf": BLACK, "emitter": two_sided(name, shining)}


def radiance(texture: Texture) -> Entry:
    """The dictionary of a texture of radiances."""
    if not texture.spectral:
        return texture.entry()
    # Only colours up to 1 have spectra, and those of reflectances, to be lit by white.
    brightest = max(float(texture.rgb.max()), 1e-30)
    nested = texture.times([1 / brightest] * 3)
    return {"type": "d65", "scale": brightest, "nested": nested.entry()}


def environment(latlong: np.ndarray, scale: float) -> Entry:
    """The dictionary of an environment map from linear pixels (height, width, 3)."""
    return {"type": "envmap", "picture": Picture(latlong), "scale": float(scale)}


def directions(height: int, width: int, rows: slice = slice(None)) -> np.ndarray:
    """Directions (2 height, 2 width, 3) in the texels of Mitsuba's environment map, Y up.

    Its rows lie from pole to pole, the first and the last one on them; its columns side by side. In
    each texel are 2 x 2 directions; those of the poles' rows that would lie beyond, on the pole.

    Args:
        height: rows of the map.
        width: columns of the map.
        rows: those of the map to take alone.
    """
    row = (np.arange(height)[rows, None] + [-0.25, 0.25]).ravel()
    v = np.clip(row / max(height - 1, 1), 0, 1) * np.pi
    u = (np.arange(2 * width) + 0.5) / (2 * width) * 2 * np.pi
    v, u = np.meshgrid(v, u, indexing="ij")
    return np.stack([np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)], axis=-1)


def resample(pixels: np.ndarray, name: str, upper: bool = False) -> np.ndarray:
    """A latitude-longitude map, for `envmap`, of the picture of a dome.

    Args:
        pixels: (h, w, 3), top row first.
        name: its map, one of `dome_maps.FORMULAS`.
        upper: whether directions below the horizon are black.

    Returns:
        Array (rows, 2 rows, 3), rows being `MAP_ROWS` or 2 h, if that is more.
    """
    formula = dome_maps.FORMULAS[name]

    def to_uv(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return formula(dome_maps.Numpy, n[..., 0], n[..., 1], n[..., 2])

    return _resample(pixels, to_uv, upper)


def _resample(pixels: np.ndarray, formula: Formula, upper: bool = False) -> np.ndarray:
    """The mean of the nearest texels of 2 x 2 directions for each texel."""
    height = max(MAP_ROWS, 2 * pixels.shape[0])
    result = np.empty((height, 2 * height, 3), pixels.dtype)
    for first in range(0, height, BAND):
        rows = slice(first, min(first + BAND, height))
        n = directions(height, 2 * height, rows)
        u, v = formula(n)
        texels = nearest(pixels, u, v)
        if upper:
            texels[n[..., 1] < 0] = 0
        result[rows] = texels.reshape(-1, 2, 2 * height, 2, 3).mean(axis=(1, 3))
    return result


def nearest(pixels: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Texels in column floor((w - 1) u) and, from the bottom, row floor((h - 1) v)."""
    h, w = pixels.shape[:2]
    column = np.floor((w - 1) * np.clip(u, 0, 1)).astype(int)
    row = np.floor((h - 1) * np.clip(v, 0, 1)).astype(int)
    return pixels[h - 1 - row, column].copy()


def background(document: Document, find: Find) -> Entry | None:
    """The environment map of `background_texture`, `map_coef` and `coef`, or None (11.6)."""
    if document.background_texture is None:
        return None
    image = as_texture(read_image(existing(find, document.background_texture)))
    a, b, c, d = document.map_coef
    document.lines.becomes("background", "background-replaced")

    def formula(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        theta = np.arccos(np.clip(n[..., 2], -1, 1))
        phi = np.mod(np.arctan2(n[..., 1], n[..., 0]), 2 * np.pi)
        theta = np.abs(np.fmod(a * theta + b, np.pi))
        phi = np.mod(np.fmod(c * phi + d, 2 * np.pi), 2 * np.pi)
        # floor(w phi / 2 pi) where `nearest` takes floor((w - 1) u).
        h, w = image.rgb.shape[:2]
        return phi / (2 * np.pi) * w / max(w - 1, 1), theta / np.pi * h / max(h - 1, 1)

    return environment(_resample(image.rgb, formula), document.coef)
