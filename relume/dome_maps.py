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
poles. The translator computes them with numpy in double precision, the plugin `ibldome` with Dr.Jit:
each formula takes the functions of its arrays, `Numpy` or the module `drjit`.
"""  # noqa: E501

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

INV_PI, INV_TWO_PI = 1 / math.pi, 1 / (2 * math.pi)

Formula = Callable[[Any, Any, Any, Any], tuple[Any, Any]]
"""Function from the functions of arrays and the coordinates x, y, z of unit vectors to (u, v)."""


class Numpy:
    """The functions of arrays that the formulas need, by their names in Dr.Jit."""

    atan2 = staticmethod(np.arctan2)
    hypot = staticmethod(np.hypot)
    maximum = staticmethod(np.maximum)
    select = staticmethod(np.where)

    @staticmethod
    def fma(a: Any, b: Any, c: Any) -> Any:
        """a b + c."""
        return a * b + c


def transposed(m: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
    """Columns along +Z, rows around it."""
    turn = m.atan2(y, x) * INV_TWO_PI
    return m.atan2(m.hypot(x, y), z) * INV_PI, m.select(turn < 0.0, turn + 1.0, turn)


def panoramic(m: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
    """Latitude and longitude, +Y up."""
    u = m.fma(m.atan2(x, -z), INV_TWO_PI, 0.5)
    return u, 1.0 - m.atan2(m.hypot(x, z), y) * INV_PI


def equirectangular(m: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
    """Latitude and longitude, upside down."""
    u = m.fma(m.atan2(z, x), INV_TWO_PI, 0.5)
    return u, 0.5 - m.atan2(y, m.hypot(x, z)) * INV_PI


def light_probe(front: float) -> Formula:
    """The light probe with the direction `front` * Z at its centre; its rim is the opposite one."""

    def formula(m: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        sine = m.hypot(x, y)
        rho = m.atan2(sine, front * z) * INV_PI / m.maximum(sine, 1e-20)
        return m.fma(0.5 * x, rho, 0.5), m.fma(0.5 * y, rho, 0.5)

    return formula


def hemisphere(m: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
    """The dome seen from above, orthographically; below y = 0 it is mirrored."""
    return m.fma(0.5, z, 0.5), m.fma(0.5, x, 0.5)


FORMULAS: dict[str, Formula] = {
    "transposed": transposed,
    "panoramic": panoramic,
    "angular": light_probe(-1.0),
    "angular_mirrored": light_probe(1.0),
    "equirectangular": equirectangular,
    "hemisphere": hemisphere,
}
"""The maps by name."""
