r"""The maps from directions to image coordinates that image-based lights use.

A map sends a unit vector n = (x, y, z), y up, to image coordinates (u, v) in [0, 1]²; u runs from
the left column to the right one, v from the bottom row to the top one. The texel is the nearest
one in the legacy sense, column floor((w - 1) u) and row floor((h - 1) v) from the bottom, so that
the last column and row are only met at u = 1 or v = 1 exactly.

| name               | u                                | v                          | centre of the image |
|--------------------|----------------------------------|----------------------------|---------------------|
| `transposed`       | arccos(z) / π                    | φ / 2π, φ = atan2(y, x)    | -X, columns go from +Z to -Z |
| `panoramic`        | (1 + atan2(x, -z) / π) / 2       | 1 - arccos(y) / π          | -Z, +X to the right, +Y up |
| `angular`          | (1 + x ρ) / 2                    | (1 + y ρ) / 2              | -Z, +X to the right, +Y up |
| `angular_mirrored` | the same, with +z for -z in ρ    |                            | +Z, +X to the right, +Y up |
| `equirectangular`  | (1 + atan2(z, x) / π) / 2        | 1 / 2 - arcsin(y) / π      | +X, +Z to the right, +Y down |
| `hemisphere`       | (1 + z) / 2                      | (1 + x) / 2                | +Y, +Z to the right, +X up |

with ρ = arccos(-z) / (π √(x² + y²)): `angular` is Debevec's light probe. Source: section 11.5 of
the scene language; `angular_mirrored` is how the original program read such images.

The arccos and arcsin are computed as atan2 of the two legs, which keeps float32 exact near the
poles.
"""  # noqa: E501

import drjit as dr
import mitsuba as mi
import numpy as np

SINE_FLOOR = 1e-5  # keeps densities finite at the poles of a map


def _polar(sine, cosine):
    return dr.atan2(sine, cosine) * dr.inv_pi


def _turn(y, x):
    """Angle of (x, y) as a fraction of a full turn, in [0, 1)."""
    angle = dr.atan2(y, x) * dr.inv_two_pi
    return dr.select(angle < 0.0, angle + 1.0, angle)


def _latlong_density(sine):
    """d(u, v)/dω of a map that is linear in both angles: 1 / (2π² sin θ)."""
    return dr.rcp(2.0 * dr.square(dr.pi) * dr.maximum(sine, SINE_FLOOR))


class Transposed:
    @staticmethod
    def to_uv(n):
        return mi.Point2f(_polar(dr.hypot(n.x, n.y), n.z), _turn(n.y, n.x))

    @staticmethod
    def to_direction(uv):
        sine, cosine = dr.sincos(dr.pi * uv.x)
        s, c = dr.sincos(dr.two_pi * uv.y)
        return mi.Vector3f(sine * c, sine * s, cosine)

    @staticmethod
    def density(n):
        return _latlong_density(dr.hypot(n.x, n.y))


class Panoramic:
    @staticmethod
    def to_uv(n):
        u = dr.fma(dr.atan2(n.x, -n.z), dr.inv_two_pi, 0.5)
        return mi.Point2f(u, 1.0 - _polar(dr.hypot(n.x, n.z), n.y))

    @staticmethod
    def to_direction(uv):
        sine, cosine = dr.sincos(dr.pi * (1.0 - uv.y))
        s, c = dr.sincos(dr.pi * dr.fma(2.0, uv.x, -1.0))
        return mi.Vector3f(sine * s, cosine, -sine * c)

    @staticmethod
    def density(n):
        return _latlong_density(dr.hypot(n.x, n.z))


class Equirectangular:
    @staticmethod
    def to_uv(n):
        u = dr.fma(dr.atan2(n.z, n.x), dr.inv_two_pi, 0.5)
        return mi.Point2f(u, 0.5 - _polar(n.y, dr.hypot(n.x, n.z)))

    @staticmethod
    def to_direction(uv):
        sine, cosine = dr.sincos(dr.pi * (0.5 - uv.y))
        s, c = dr.sincos(dr.pi * dr.fma(2.0, uv.x, -1.0))
        return mi.Vector3f(cosine * c, sine, cosine * s)

    @staticmethod
    def density(n):
        return _latlong_density(dr.hypot(n.x, n.z))


class Angular:
    """Light probe with the direction `front` * Z at the centre; the rim is the opposite one."""

    def __init__(self, front):
        self.front = front

    def to_uv(self, n):
        sine = dr.hypot(n.x, n.y)
        rho = _polar(sine, self.front * n.z) / dr.maximum(sine, 1e-20)
        return mi.Point2f(dr.fma(0.5 * n.x, rho, 0.5), dr.fma(0.5 * n.y, rho, 0.5))

    def to_direction(self, uv):
        x, y = dr.fma(2.0, uv.x, -1.0), dr.fma(2.0, uv.y, -1.0)
        r = dr.hypot(x, y)
        sine, cosine = dr.sincos(dr.pi * r)
        scale = dr.select(r < 1.0, sine / dr.maximum(r, 1e-20), dr.nan)  # no direction beyond
        return mi.Vector3f(scale * x, scale * y, self.front * cosine)

    def density(self, n):
        sine = dr.hypot(n.x, n.y)
        r = dr.maximum(_polar(sine, self.front * n.z), SINE_FLOOR)
        return r / (4.0 * dr.pi * dr.maximum(sine, SINE_FLOOR))


class Hemisphere:
    """The dome seen from above, orthographically; below y = 0 it is mirrored."""

    @staticmethod
    def to_uv(n):
        return mi.Point2f(dr.fma(0.5, n.z, 0.5), dr.fma(0.5, n.x, 0.5))

    @staticmethod
    def to_direction(uv):
        z, x = dr.fma(2.0, uv.x, -1.0), dr.fma(2.0, uv.y, -1.0)
        return mi.Vector3f(x, dr.sqrt(1.0 - dr.square(x) - dr.square(z)), z)  # NaN off the dome

    @staticmethod
    def density(n):
        return 0.25 * dr.abs(n.y)


MAPS = {
    "transposed": Transposed(),
    "panoramic": Panoramic(),
    "angular": Angular(-1.0),
    "angular_mirrored": Angular(1.0),
    "equirectangular": Equirectangular(),
    "hemisphere": Hemisphere(),
}


def find_map(name):
    """Return the map called `name`.

    Each has `to_uv(n)`, its inverse `to_direction(uv)` (NaN where the image shows no direction)
    and `density(n)`, the area in (u, v) per solid angle at n.

    Raises:
        ValueError: there is none.
    """
    if name not in MAPS:
        raise ValueError(f"map must be one of {', '.join(MAPS)}, got {name!r}")
    return MAPS[name]


def texel(uv, width, height):
    """Column and row from the top (`mi.UInt32`) of the texel at `uv` in a width x height image."""

    def index(x, size):
        return mi.UInt32(dr.clip(dr.floor(x * (size - 1)), 0.0, size - 1))

    return index(uv.x, width), height - 1 - index(uv.y, height)


def cell_solid_angles(dome_map, width, height, upper_only, samples=8):
    """Solid angle of the directions that look up each texel.

    Args:
        dome_map: one of `MAPS`.
        width: columns of the image.
        height: rows of the image.
        upper_only: count directions with y >= 0 only.
        samples: the midpoint rule takes samples x samples points a texel.

    Returns:
        float64 array of shape (max(height - 1, 1), max(width - 1, 1)) in sr, rows from the bottom.
    """
    columns, rows = max(width - 1, 1), max(height - 1, 1)
    total = np.zeros((rows, columns))
    j, i = dr.meshgrid(dr.arange(mi.Float, columns), dr.arange(mi.Float, rows))
    for a in range(samples):
        for b in range(samples):
            uv = mi.Point2f((j + (a + 0.5) / samples) / columns, (i + (b + 0.5) / samples) / rows)
            n = dome_map.to_direction(uv)
            shown = dr.isfinite(n.x) & dr.isfinite(n.y)
            if upper_only:
                shown &= n.y >= 0.0
            # the orthographic map has 1/|y| at its rim; the floor is below what a texel resolves
            per_uv = dr.rcp(dr.maximum(dome_map.density(n), SINE_FLOOR))
            total += np.array(dr.select(shown, per_uv, 0.0)).reshape(rows, columns)
    return total / (samples**2 * rows * columns)


def resample_to_latlong(image, name, height=None, samples=3):
    """Resample a dome image for the stock `envmap`.

    Wanted where the dome is so much larger than the scene that parallax does not matter.

    Args:
        image: float array of shape (h, w, 3), first row on top.
        name: one of `MAPS`.
        height: rows of the result; default: as many as `image` has.
        samples: samples x samples lookups are averaged for each texel of the result.

    Returns:
        float32 array of shape (height, 2 height, 3) in the layout of `envmap` without `to_world`:
        rows from +Y to -Y with a row at each pole, the first column centred half a texel after
        -Z, growing towards +X.

    Raises:
        ValueError: there is no such map.
    """
    dome_map = find_map(name)
    image = np.asarray(image, dtype=np.float32)
    h, w = image.shape[:2]
    rows = height or h
    columns = 2 * rows
    texels = mi.Float(image.ravel())
    result = np.zeros((rows * columns, 3))
    j, i = dr.meshgrid(dr.arange(mi.Float, columns), dr.arange(mi.Float, rows))
    for a in range(samples):
        for b in range(samples):
            s, c = dr.sincos(dr.two_pi * (j + (a + 0.5) / samples) / columns)
            theta = dr.pi * (i + (b + 0.5) / samples - 0.5) / (rows - 1)
            sine, cosine = dr.sincos(dr.clip(theta, 0.0, dr.pi))
            n = mi.Vector3f(sine * s, cosine, -sine * c)
            column, row = texel(dome_map.to_uv(n), w, h)
            colour = dr.gather(mi.Color3f, texels, row * w + column)
            result += np.array(colour).T
    return (result / samples**2).reshape(rows, columns, 3).astype(np.float32)
