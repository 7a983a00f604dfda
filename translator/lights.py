"""From emission to emitters (spec section 9)."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from relume.translator import geometry
from relume.translator.diagnostics import Problem
from relume.translator.document import Document
from relume.translator.objects import SceneObject
from relume.translator.scene_geometry import SceneGeometry
from relume.translator.scene_values import Entry, rgb
from relume.translator.shapes import Hemisphere, InfinityLight, MeshFile, Plane, Sphere, UVPlane

GRAZING = 1e-6
"""Sine of the angle between a plane and its parallel light below which no light leaves it."""

TWO_SIDED = (Hemisphere, Plane, MeshFile)
"""Shapes that emit on both sides; a finite plane emits on the side of its normal alone (section
9.2), and of a sphere one side is all that can be seen."""


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
    """
    is_two_sided = isinstance(block.shape, TWO_SIDED)
    if isinstance(block.shape, Sphere):
        inside = _encloses(block.shape, scene.matrices[index], scene.camera)
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
    return shape | {"emitter": {"type": "area", "radiance": rgb(radiance)}}


def _encloses(shape: Sphere, matrix: np.ndarray, point: np.ndarray) -> bool:
    """Whether the point lies inside a sphere under a matrix."""
    local = np.linalg.solve(matrix[:3, :3], point - matrix[:3, 3])
    return float(np.linalg.norm(local - np.array(shape.center))) < shape.radius


def lamp(block: SceneObject, matrix: np.ndarray, dialect: str) -> Entry | None:
    """The emitter of an object that is no surface: infinity light, parallel light or spot.

    Args:
        block: the object.
        matrix: its transformation, (4, 4).
        dialect: `manual` or `prender`.

    Returns:
        The emitter's dictionary, None for an object that is a surface (sections 9.3 to 9.5).
    """
    if isinstance(block.shape, InfinityLight):
        return _infinity_light(block, block.shape, matrix, dialect)
    if block.parallel_light and isinstance(block.shape, UVPlane):
        return _parallel_beam(block, block.shape, matrix, dialect)
    if block.spot_light and isinstance(block.shape, Sphere):
        return _spot(block, block.shape, matrix)
    return None


def is_spot(block: SceneObject) -> bool:
    """Whether an object is a spot light."""
    return block.spot_light and isinstance(block.shape, Sphere)


def _infinity_light(
    block: SceneObject, shape: InfinityLight, matrix: np.ndarray, dialect: str
) -> Entry:
    emission = np.array(block.emission)
    direction = matrix[:3, :3] @ np.array(shape.direction)
    length = float(np.linalg.norm(direction))
    if not math.isclose(length, 1, rel_tol=1e-3):
        block.lines.remark("", "infinity-length", dialect=dialect)
    factor = length if dialect == "prender" else 1.0
    block.lines.remark("emission", "emission-units", quantity="irradiance")
    return {
        "type": "directional",
        "direction": _floats(direction / length),
        "irradiance": rgb(math.pi * factor * emission),
    }


def beam_problem(block: SceneObject, matrix: np.ndarray, dialect: str) -> Problem | None:
    """The problem of a parallel light that shines along its own plane, or None; as `lamp`."""
    if not (block.parallel_light and isinstance(block.shape, UVPlane)):
        return None
    beam = _parallel_beam(block, block.shape, matrix, dialect)
    u, v, direction = (np.array(beam[key]) for key in ("edge_u", "edge_v", "direction"))
    across = abs(np.cross(geometry.unit(u), geometry.unit(v)) @ direction)
    if not across <= GRAZING:  # a direction of length 0 is told by `checks`
        return None
    line = block.lines.line("parallel_light_dir")
    message = "parallel_light_dir lies in the plane of the light: no light leaves it"
    return Problem(line, 1, message, "value")


def _parallel_beam(
    block: SceneObject, shape: UVPlane, matrix: np.ndarray, dialect: str
) -> Entry:
    u, v = (matrix[:3, :3] @ edge for edge in shape.edges(dialect))
    if block.parallel_light_dir is not None:
        direction = np.array(block.parallel_light_dir)
    else:
        direction = geometry.normal(matrix, np.cross(shape.u, shape.v)) * (
            -1 if block.normal < 0 else 1
        )
    block.lines.remark("emission", "emission-units", quantity="irradiance")
    emission = np.array(block.emission)
    return {
        "type": "parallelbeam",
        "origin": _floats(geometry.point(matrix, shape.origin)),
        "edge_u": _floats(u),
        "edge_v": _floats(v),
        "direction": _floats(geometry.unit(direction)),
        "irradiance": rgb(math.pi * emission),
    }


def _spot(block: SceneObject, shape: Sphere, matrix: np.ndarray) -> Entry:
    w, f = block.spot_light_angle
    block.lines.remark("spot_light_angle", "spot")
    block.lines.remark("emission", "emission-units", quantity="intensity")
    return {
        "type": "falloffspot",
        "position": _floats(geometry.point(matrix, shape.center)),
        "direction": _floats(geometry.unit(block.spot_light_dir)),
        "cutoff_angle": w,
        "falloff_angle": f,
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
