"""From emission to emitters (spec section 9)."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from relume.translator import geometry
from relume.translator.diagnostics import Problem
from relume.translator.document import Document
from relume.translator.giant_spheres import Ball
from relume.translator.objects import SceneObject
from relume.translator.scene_geometry import SceneGeometry
from relume.translator.scene_values import Entry, Picture, rgb
from relume.translator.shapes import (
    Annulus,
    Disk,
    Hemisphere,
    InfinityLight,
    MeshFile,
    Plane,
    Sphere,
    UVPlane,
)

GRAZING = 1e-6
"""Sine of the angle between a plane and its parallel light below which no light leaves it."""

TWO_SIDED = (Annulus, Disk, Hemisphere, Plane, MeshFile)
"""Shapes that emit on both sides. A finite plane that is a lamp emits on the side of its normal
alone (section 9.2), and of a sphere one side is all that can be seen."""


SEEN_ONLY: Entry = {"type": "apparentlamp", "sampling_weight": 1e-3}
"""An emitter that lights nothing, but is seen; a weight of 0 would have it light others, too."""

DOWN = (0.0, -1.0, 0.0)
"""Direction of a spot that is told none: the manual's default."""

SMALL = 0.01
"""Radius over the size of the scene below which a sphere is a small lamp."""


def two_sided(name: str, radiance: Entry) -> Entry:
    """The emitter of a surface that shines on both sides.

    Args:
        name: key of its shape in the scene's dictionary: equal lights of one name would be merged
            into one.
        radiance: spectrum or texture.
    """
    return {"type": "twosidedarea", "radiance": radiance, "name": name}


def backdrop(radiance: Entry) -> Entry:
    """The emitter of a surface that is seen in its unlit colour (row background-object).

    Args:
        radiance: spectrum or texture.
    """
    return SEEN_ONLY | {"two_sided": True, "backdrop": True, "radiance": radiance}


def ambient(name: str, document: Document) -> Entry:
    """The emitter of a surface that only the ambient light makes shine (section 9.6).

    Such surfaces are too many and too dim to be looked for: they are found by chance alone.
    """
    return two_sided(name, rgb(document.ambient)) | {"sampling_weight": 0.0}


def shining(
    name: str,
    block: SceneObject,
    shape: Entry,
    scene: SceneGeometry,
    document: Document,
    index: int,
    dialect: str,
) -> Entry:
    """The dictionary of a shape that shines by its own emission, emitter included.

    Args:
        name: key of the shape in the scene's dictionary.
        block: the object, whose emission is above 0.
        shape: the shape's dictionary.
        scene: where all is: a sphere around the camera emits inwards.
        document: the document, for the ambient light, which is added where the object also
            reflects (9.6).
        index: which of the document's objects it is.
        dialect: `manual` or `prender` (row uvplane-light).
    """
    is_two_sided = isinstance(block.shape, TWO_SIDED)
    if isinstance(block.shape, Disk | Annulus):
        block.lines.remark("emission", "disk-light")
    if isinstance(block.shape, UVPlane) and not block.is_lamp:
        is_two_sided = True
        block.lines.remark("emission", "lit-uvplane")
    if isinstance(block.shape, Sphere):
        inside = encloses(block.shape, scene.matrices[index], scene.camera)
        outward = block.normal >= 0
        if inside == outward:
            turned = not shape.get("flip_normals", False)
            shape = {key: value for key, value in shape.items() if key != "flip_normals"}
            shape |= {"flip_normals": True} if turned else {}
            block.lines.remark("emission", "emits-inwards" if inside else "emits-outwards")
        # Only one side is ever seen of an opaque sphere, and `twosidedarea` samples it better.
        small = shape.get("radius", scene.whole.diameter) < SMALL * scene.whole.diameter
        is_two_sided = block.reflection.kind != "glass" and (inside or small)
    radiance = np.array(block.emission)
    if any(block.color):
        radiance = radiance + np.array(document.ambient)
    if is_two_sided:
        return shape | {"emitter": two_sided(name, rgb(radiance))}
    if isinstance(block.shape, UVPlane) and document.next_event_estimation:
        lengths = [np.linalg.norm(edge) for edge in (block.shape.u, block.shape.v)]
        if not np.allclose(lengths, 1) or (dialect == "prender" and skew(block.shape)):
            block.lines.remark("emission", "uvplane-light", dialect=dialect)
            if dialect == "prender":
                lit = apparent_lamp(block, block.shape, scene.matrices[index])
                return shape | {"emitter": lit | {"radiance": rgb(radiance)}}
    return shape | {"emitter": {"type": "area", "radiance": rgb(radiance)}}


def beam_shown(block: SceneObject, shape: Entry, document: Document) -> Entry:
    """The dictionary of the rectangle of a parallel light, which dialect `prender` shows.

    It hides what is behind it, and without next event estimation it is an area lamp, too (row
    parallel-lamp).

    Args:
        block: the object.
        shape: the rectangle's dictionary.
        document: the document.
    """
    emitter = SEEN_ONLY if document.next_event_estimation else {"type": "area"}
    black: Entry = {"type": "conductor", "specular_reflectance": {"type": "rgb", "value": 0.0}}
    return shape | {"bsdf": black, "emitter": emitter | {"radiance": rgb(block.emission)}}


def skew(shape: UVPlane) -> bool:
    """Whether the edges of a parallelogram are not orthogonal."""
    u, v = np.array(shape.u), np.array(shape.v)
    return bool(abs(u @ v) > 1e-6 * np.linalg.norm(u) * np.linalg.norm(v))


def apparent_lamp(block: SceneObject, shape: UVPlane, matrix: np.ndarray) -> Entry:
    """The emitter, without its radiance, of a lamp that lights by U x V, however it looks."""
    u, v = (matrix[:3, :3] @ np.array(edge) for edge in (shape.u, shape.v))
    # U x V turns round under a mirroring matrix, the normal does not.
    if (block.normal < 0) != (np.linalg.det(matrix[:3, :3]) < 0):
        u, v = v, u
    return {
        "type": "apparentlamp",
        "origin": _floats(geometry.point(matrix, shape.origin)),
        "edge_u": _floats(u),
        "edge_v": _floats(v),
    }


def encloses(shape: Sphere, matrix: np.ndarray, point: np.ndarray) -> bool:
    """Whether the point lies inside a sphere under a matrix."""
    local = np.linalg.solve(matrix[:3, :3], point - matrix[:3, 3])
    return float(np.linalg.norm(local - np.array(shape.center))) < shape.radius


def report_point_like(document: Document, entries: Iterable[Entry]) -> None:
    """Report it at lamps that no ray can meet where glass or a hole would turn their light."""
    code = "lamp-in-curved-space" if document.gravity else "no-light-through-glass"
    if not (document.gravity or any(map(refracts, entries))):
        return
    for block in document.objects:
        if is_point_like(block) and any(block.emission):
            block.lines.becomes("", code)


def is_point_like(block: SceneObject) -> bool:
    """Whether an object is a lamp that no ray can meet."""
    is_beam = block.parallel_light and isinstance(block.shape, UVPlane)
    return isinstance(block.shape, InfinityLight) or is_beam or is_spot(block)


def dimmed(shape: Entry, spectral: bool) -> Entry:
    """A shape that shines only where it is, for integrators that do not know of its opacity.

    Args:
        shape: dictionary of a shape, whose BSDF may be a mask.
        spectral: whether the scene is rendered by wavelength.
    """
    mask, emitter = shape.get("bsdf", {}), shape.get("emitter", {})
    radiance = emitter.get("radiance", {})
    if mask.get("type") != "mask" or radiance.get("type") != "rgb":
        return shape
    opacity, rgb_value = mask["opacity"], np.array(radiance["value"])
    if not isinstance(opacity, dict):
        return shape | {"emitter": emitter | {"radiance": rgb(opacity * rgb_value)}}
    pixels = np.asarray(opacity["picture"].pixels, np.float32) * rgb_value.astype(np.float32)
    texture = opacity | {"picture": Picture(pixels), "raw": not spectral}
    if spectral:
        # Only colours up to 1 have spectra, and those of reflectances, to be lit by white.
        scale = max(float(pixels.max()), 1e-30)
        nested = texture | {"picture": Picture(pixels / np.float32(scale))}
        texture = {"type": "d65", "scale": scale, "nested": nested}
    return shape | {"emitter": emitter | {"radiance": texture}}


def refracts(entry: object) -> bool:
    """Whether light that crosses what an entry describes changes its direction."""
    if not isinstance(entry, dict):
        return False
    if entry.get("type") == "schlickglass":
        return "dispersion" in entry or entry["int_ior"] != entry["ext_ior"]
    return any(map(refracts, entry.values()))


def lamp(
    block: SceneObject, matrix: np.ndarray, dialect: str, dome: Ball | None = None
) -> Entry | None:
    """The emitter of an object that is no surface: infinity light, parallel light or spot.

    Args:
        block: the object.
        matrix: its transformation, (4, 4).
        dialect: `manual` or `prender`.
        dome: the image-based light around the camera that an infinity light has to pass, if any.

    Returns:
        The emitter's dictionary, None for an object that is a surface (sections 9.3 to 9.5).
    """
    if isinstance(block.shape, InfinityLight):
        return _infinity_light(block, block.shape, matrix, dialect, dome)
    if block.parallel_light and isinstance(block.shape, UVPlane):
        return _parallel_beam(block, block.shape, matrix, dialect)
    if block.spot_light and isinstance(block.shape, Sphere):
        return _spot(block, block.shape, matrix)
    return None


def is_spot(block: SceneObject) -> bool:
    """Whether an object is a spot light."""
    return block.spot_light and isinstance(block.shape, Sphere)


def _infinity_light(
    block: SceneObject,
    shape: InfinityLight,
    matrix: np.ndarray,
    dialect: str,
    dome: Ball | None,
) -> Entry:
    emission = np.array(block.emission)
    direction = matrix[:3, :3] @ np.array(shape.direction)
    length = float(np.linalg.norm(direction))
    if not math.isclose(length, 1, rel_tol=1e-3):
        block.lines.remark("", "infinity-length", dialect=dialect)
    factor = length if dialect == "prender" else 1.0
    block.lines.remark("emission", "emission-units", quantity="irradiance")
    entry: Entry = {
        "type": "directional",
        "direction": _floats(direction / length),
        "irradiance": rgb(math.pi * factor * emission),
    }
    if dome is None:
        return entry
    return entry | {"type": "domesun", "center": _floats(dome.center), "radius": float(dome.radius)}


def beam_problem(block: SceneObject, matrix: np.ndarray, dialect: str) -> Problem | None:
    """The problem of a parallel light that shines along its own plane, or None; as `lamp`."""
    if not (block.parallel_light and isinstance(block.shape, UVPlane)):
        return None
    u, v, direction = _beam_vectors(block, block.shape, matrix, dialect)
    across = abs(np.cross(geometry.unit(u), geometry.unit(v)) @ direction)
    if not across <= GRAZING:  # a direction of length 0 is told by `checks`
        return None
    line = block.lines.line("parallel_light_dir")
    message = "parallel_light_dir lies in the plane of the light: no light leaves it"
    return Problem(line, 1, message, "value")


def _beam_vectors(
    block: SceneObject, shape: UVPlane, matrix: np.ndarray, dialect: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Both edges of a parallel light, and its direction of length 1."""
    u, v = (matrix[:3, :3] @ edge for edge in shape.edges(dialect))
    if block.parallel_light_dir is not None:
        direction = np.array(block.parallel_light_dir)
    else:
        direction = geometry.normal(matrix, np.cross(shape.u, shape.v)) * (
            -1 if block.normal < 0 else 1
        )
    return u, v, geometry.unit(direction)


def _parallel_beam(block: SceneObject, shape: UVPlane, matrix: np.ndarray, dialect: str) -> Entry:
    u, v, direction = _beam_vectors(block, shape, matrix, dialect)
    block.lines.remark("emission", "emission-units", quantity="irradiance")
    emission = np.array(block.emission)
    return {
        "type": "parallelbeam",
        "origin": _floats(geometry.point(matrix, shape.origin)),
        "edge_u": _floats(u),
        "edge_v": _floats(v),
        "direction": _floats(direction),
        "irradiance": rgb(math.pi * emission),
    }


def _spot(block: SceneObject, shape: Sphere, matrix: np.ndarray) -> Entry:
    w, f = block.spot_light_angle
    block.lines.remark("spot_light_angle", "spot")
    if f > w:
        block.lines.becomes("spot_light_angle", "spot-falloff-whole", angle=w)
    direction = block.spot_light_dir if any(block.spot_light_dir) else DOWN
    if direction != block.spot_light_dir:
        block.lines.becomes("spot_light_dir", "spot-direction-missing")
    block.lines.remark("emission", "emission-units", quantity="intensity")
    return {
        "type": "falloffspot",
        "position": _floats(geometry.point(matrix, shape.center)),
        "direction": _floats(geometry.unit(direction)),
        "cutoff_angle": w,
        "falloff_angle": min(f, w),
        "falloff_exponent": block.spot_light_falloff,
        "attenuation": _floats(block.spot_attenuation),
        "intensity": rgb(math.pi * np.array(block.emission)),
    }


def _floats(values: Iterable[float]) -> list[float]:
    return [float(x) for x in values]


def background(document: Document) -> Entry | None:
    """The emitter of the surroundings, or None where they are black."""
    if not any(document.background):
        return None
    return {"type": "constant", "radiance": rgb(document.background)}
