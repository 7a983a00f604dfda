"""Pictures of the surroundings: light on domes, and the background (spec sections 11.5, 11.6)."""

import math

import numpy as np

from relume.translator.dialects import note
from relume.translator.images import as_texture, read_image
from relume.translator.reflectances import Texture, used_texels
from relume.translator.scene_values import Picture
from relume.translator.shapes import Hemisphere, InfinityLight, Sphere

FAR = 50.0
"""A dome whose radius exceeds this multiple of the scene's extent becomes an environment map: what
is looked up by direction instead of by hit point then is off by at most 1/50 rad."""

MAP_ROWS = 1024
"""Fewest rows of a resampled environment map; larger pictures keep twice their own."""

FLAGS = (
    ("hemisphere_map", "hemisphere"),
    ("panoramic_map", "panoramic"),
    ("angular_map", "angular"),
    ("equirectangular_map", "equirectangular"),
)
"""Flags of an object and the map they ask for, in order of precedence."""


def map_name(block, dialect):
    """Name of the map of an object's picture, as the plugin `ibldome` knows it."""
    name = next((name for flag, name in FLAGS if getattr(block, flag)), "transposed")
    if name == "angular":
        block.lines.remark("angular_map", note("angular-map", dialect))
        return "angular_mirrored" if dialect == "prender" else name
    return name


def picture(path, block=None):
    """The linear pixels of a picture that shines, (height, width, 3), top row first."""
    image = read_image(path)
    if not image.hdr and block is not None:
        block.lines.remark("ibl_texture", "values of 0 to 255 are taken as linear")
    return image.rgb


class Domes:
    """Makes the image-based lights of a scene.

    Args:
        document: the document.
        shapes: `surfaces.ShapeBuilder` of the document.
        find: function from the name of a file to its path.
        dialect: `manual` or `prender` (row angular-map).
        spectral: whether the scene is rendered by wavelength.
    """

    def __init__(self, document, shapes, find, dialect, spectral):
        self.shapes = shapes
        self.find = find
        self.dialect = dialect
        self.spectral = spectral
        self.sun = any(isinstance(b.shape, InfinityLight) for b in document.objects)
        self.environments = 0

    def light(self, index, block):
        """The dictionary of an object with `ibl_texture`: a shape, or an environment map."""
        pixels = picture(self.find(block.ibl_texture), block)
        if not isinstance(block.shape, Sphere | Hemisphere):
            return self.shapes.shape(index, block) | self.shining(
                pixels, block.ibl_texture_coef, flip=True
            )
        ball = self.shapes.balls[index]
        name = map_name(block, self.dialect)
        upper = isinstance(block.shape, Hemisphere)
        if ball is not None and not self.becomes_map(index, ball, block):
            block.lines.remark("ibl_texture", note("ibl-lookup", self.dialect))
            return self.dome(block, ball, pixels, name, upper)
        self.environments += 1
        latlong = resample(pixels, FORMULAS[name], upper)
        return environment(latlong, block.ibl_texture_coef)

    def becomes_map(self, index, ball, block):
        """Whether a dome is replaced by an environment map, with a note why."""
        if self.environments or not self.shapes.encloses(index, self.shapes.camera):
            return False
        if self.sun:
            text = "an environment map, looked up by direction, so that infinity_light passes"
            block.lines.becomes("ibl_texture", "approximated", text)
            return True
        if ball.radius > FAR * self.shapes.extent:
            off = math.degrees(self.shapes.extent / ball.radius)
            text = f"the dome is far: an environment map, looked up at most {off:.2g} degrees off"
            block.lines.remark("ibl_texture", text)
            return True
        return False

    def dome(self, block, ball, pixels, name, upper):
        """A sphere that shines, with the parallax kept."""
        light = {
            "type": "ibldome",
            "picture": Picture(pixels),
            "map": name,
            "scale": block.ibl_texture_coef,
        }
        black = {"type": "conductor", "specular_reflectance": {"type": "rgb", "value": 0.0}}
        if upper:
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

    def shining(self, pixels, scale, *, flip):
        """BSDF and emitter of a surface that shines with a picture by its own coordinates.

        Args:
            pixels: linear, (height, width, 3), top row first.
            scale: factor of the radiance.
            flip: whether v = 0 is the bottom row.
        """
        shown = used_texels(pixels) * np.float32(scale)
        shown = np.ascontiguousarray(shown[::-1] if flip else shown)
        return {
            "bsdf": {"type": "conductor", "specular_reflectance": {"type": "rgb", "value": 0.0}},
            "emitter": {"type": "twosidedarea", "radiance": self.radiance(shown)},
        }

    def radiance(self, pixels):
        """The texture of radiances, the row at v = 0 first."""
        if not self.spectral:
            return Texture(pixels).entry()
        # Only colours up to 1 have spectra, and those of reflectances, to be lit by white.
        brightest = max(float(pixels.max()), 1e-30)
        nested = Texture(pixels / np.float32(brightest), spectral=True)
        return {"type": "d65", "scale": brightest, "nested": nested.entry()}


def environment(latlong, scale):
    """The dictionary of an environment map from linear pixels (height, width, 3)."""
    return {"type": "envmap", "picture": Picture(latlong), "scale": float(scale)}


def directions(height, width):
    """Directions (height, width, 3) at the texels of Mitsuba's environment map, Y up."""
    v = (np.arange(height) + 0.5) / height * np.pi
    u = (np.arange(width) + 0.5) / width * 2 * np.pi
    v, u = np.meshgrid(v, u, indexing="ij")
    return np.stack([np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)], axis=-1)


def _turn(y, x):
    return np.mod(np.arctan2(y, x) / (2 * np.pi), 1.0)


def _angular(z):
    def formula(n):
        r = np.hypot(n[..., 0], n[..., 1])
        rho = np.arctan2(r, z * n[..., 2]) / (np.pi * np.maximum(r, 1e-30))
        return 0.5 + 0.5 * n[..., 0] * rho, 0.5 + 0.5 * n[..., 1] * rho

    return formula


FORMULAS = {
    "transposed": lambda n: (
        np.arccos(np.clip(n[..., 2], -1, 1)) / np.pi,
        _turn(n[..., 1], n[..., 0]),
    ),
    "panoramic": lambda n: (
        0.5 * (1 + np.arctan2(n[..., 0], -n[..., 2]) / np.pi),
        1 - np.arccos(np.clip(n[..., 1], -1, 1)) / np.pi,
    ),
    "angular": _angular(-1),
    "angular_mirrored": _angular(1),
    "equirectangular": lambda n: (
        (np.arctan2(n[..., 2], n[..., 0]) + np.pi) / (2 * np.pi),
        0.5 - np.arcsin(np.clip(n[..., 1], -1, 1)) / np.pi,
    ),
    "hemisphere": lambda n: (0.5 * (1 + n[..., 2]), 0.5 * (1 + n[..., 0])),
}
"""Column and row coordinates (u, v from the bottom) of a direction for each map (section 11.5)."""


def resample(pixels, formula, upper=False):
    """A latitude-longitude map of a picture: the mean of 2x2 nearest texels for each direction.

    Args:
        pixels: (h, w, 3), top row first.
        formula: function from directions (..., 3) to u and v.
        upper: whether directions below the horizon are black.
    """
    height = max(MAP_ROWS, 2 * pixels.shape[0])
    n = directions(2 * height, 4 * height)
    u, v = formula(n)
    texels = nearest(pixels, u, v)
    if upper:
        texels[n[..., 1] < 0] = 0
    return texels.reshape(height, 2, 2 * height, 2, 3).mean(axis=(1, 3))


def nearest(pixels, u, v):
    """Texels in column floor((w - 1) u) and, from the bottom, row floor((h - 1) v)."""
    h, w = pixels.shape[:2]
    column = np.floor((w - 1) * np.clip(u, 0, 1)).astype(int)
    row = np.floor((h - 1) * np.clip(v, 0, 1)).astype(int)
    return pixels[h - 1 - row, column].copy()


def background(document, find):
    """The environment map of `background_texture`, `map_coef` and `coef`, or None (11.6)."""
    if document.background_texture is None:
        return None
    image = as_texture(read_image(find(document.background_texture)))
    a, b, c, d = document.map_coef
    document.lines.becomes("background", "ignored", "background_texture takes its place")

    def formula(n):
        theta = np.arccos(np.clip(n[..., 2], -1, 1))
        phi = np.mod(np.arctan2(n[..., 1], n[..., 0]), 2 * np.pi)
        theta = np.abs(np.fmod(a * theta + b, np.pi))
        phi = np.mod(np.fmod(c * phi + d, 2 * np.pi), 2 * np.pi)
        # floor(w phi / 2 pi) where `nearest` takes floor((w - 1) u).
        h, w = image.rgb.shape[:2]
        return phi / (2 * np.pi) * w / max(w - 1, 1), theta / np.pi * h / max(h - 1, 1)

    return environment(resample(image.rgb, formula), document.coef)
