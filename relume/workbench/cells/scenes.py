"""Scene texts for cells, written in short."""

from __future__ import annotations

from collections.abc import Sequence

PATHS = ("surfacepath", "path", "volpath")
"""Integrators that must agree on every scene without media."""

SIDE = 16
"""Pixels along a side of a cell's picture."""


def numbers(*values: float) -> str:
    """Numbers as the scene language reads them, to the last digit of double precision."""
    return " ".join(f"{float(x):.17g}" for x in values)


def text(
    *objects: str,
    camera: Sequence[float],
    target: Sequence[float] = (0, 0, 0),
    angle: float = 10.0,
    up: Sequence[float] = (0, 1, 0),
    depth: float = 8,
    **keywords: str,
) -> str:
    """A scene file.

    Args:
        objects: texts of objects, from `thing`.
        camera: position of the camera.
        target: point that it looks at.
        angle: field of view [degree].
        up: up direction.
        depth: depth after which roulette sets in.
        keywords: further keywords of the scene with the text of their values.
    """
    lines = {
        "IMAGE": f"{SIDE} {SIDE}",
        "SAMPLING": "1",
        "SUPERSAMPLING": "1",
        "DEPTH": numbers(depth),
        "CAMERA_POS": numbers(*camera),
        "TARGET_POS": numbers(*target),
        "CAMERA_UPVEC": numbers(*up),
        "CAMERA_ANGLE": numbers(angle),
    } | keywords
    head = "".join(f"{name}\n{values}\n\n" for name, values in lines.items())
    return head + "\n".join(objects)


def thing(shape: str, *attributes: str) -> str:
    """An `OBJECT` block of a shape line and attribute lines."""
    return "\n".join(["OBJECT", shape, *attributes, ""])


def sphere(center: Sequence[float], radius: float, *attributes: str) -> str:
    """A sphere."""
    return thing(f"sphere {numbers(*center, radius)}", *attributes)


def uvplane(
    corner: Sequence[float], u: Sequence[float], v: Sequence[float], *attributes: str
) -> str:
    """A parallelogram."""
    return thing(f"uvplane {numbers(*corner)}", f"U {numbers(*u)}", f"V {numbers(*v)}", *attributes)


def plane(point: Sequence[float], normal: Sequence[float], *attributes: str) -> str:
    """An infinite plane."""
    return thing(f"plane {numbers(*point)}", f"normal {numbers(*normal)}", *attributes)


def diffuse(albedo: float) -> tuple[str, str]:
    """Attributes of a Lambertian surface."""
    return (f"color {numbers(albedo, albedo, albedo)}", "reflection diffuse")


def emission(radiance: float) -> str:
    """Attribute of a light."""
    return f"emission {numbers(radiance, radiance, radiance)}"


def box(
    *attributes: str, low: Sequence[float] = (-1, -1, -1), high: Sequence[float] = (1, 1, 1)
) -> list[str]:
    """A closed box of six parallelograms whose normals point inwards."""
    x, y, z = (tuple((high[k] - low[k]) * (k == axis) for k in range(3)) for axis in range(3))
    return [
        uvplane(low, x, y, *attributes),
        uvplane((low[0], low[1], high[2]), y, x, *attributes),
        uvplane(low, y, z, *attributes),
        uvplane((high[0], low[1], low[2]), z, y, *attributes),
        uvplane(low, z, x, *attributes),
        uvplane((low[0], high[1], low[2]), x, z, *attributes),
    ]
