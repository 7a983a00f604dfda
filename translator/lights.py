"""From emission to emitters (spec section 9)."""

import math

import numpy as np

from relume.translator import geometry
from relume.translator.dialects import note
from relume.translator.scene_values import rgb
from relume.translator.shapes import Hemisphere, InfinityLight, MeshFile, Plane, Sphere, UVPlane

TWO_SIDED = (Hemisphere, Plane, MeshFile)
"""Shapes that emit on both sides; a finite plane emits on the side of its normal alone (section
9.2), and of a sphere one side is all that can be seen."""


SMALL = 0.01
"""Radius over the size of the scene below which a sphere is a small lamp."""


def area(block, entry, matrix, camera, size, ambient=(0.0, 0.0, 0.0)):
    """Add the emitter of a surface's own emission to its shape's dictionary.

    Args:
        block: `SceneObject` with emission.
        entry: the shape's dictionary.
        matrix: its transformation, (4, 4).
        camera: position of the camera, (3,): a sphere around it emits inwards.
        size: diameter of the scene [scene unit].
        ambient: radiance of the ambient light, added where the object also reflects (9.6).
    """
    kind = "twosidedarea" if isinstance(block.shape, TWO_SIDED) else "area"
    if isinstance(block.shape, Sphere):
        inside = _encloses(block.shape, matrix, camera)
        outward = block.normal >= 0
        if inside == outward:
            entry["flip_normals"] = not entry.get("flip_normals", False)
            if not entry["flip_normals"]:
                del entry["flip_normals"]
            side = "inwards, towards the camera" if inside else "outwards"
            block.lines.remark("emission", f"the sphere emits {side}")
        # Only one side is ever seen of an opaque sphere, and `twosidedarea` samples it better.
        if block.reflection.kind != "glass" and (
            inside or entry.get("radius", size) < SMALL * size
        ):
            kind = "twosidedarea"
    radiance = np.array(block.emission) + (np.array(ambient) if any(block.color) else 0.0)
    return entry | {"emitter": {"type": kind, "radiance": rgb(radiance)}}


def _encloses(shape, matrix, point):
    """Whether the point lies inside a sphere under a matrix."""
    local = np.linalg.solve(matrix[:3, :3], point - matrix[:3, 3])
    return float(np.linalg.norm(local - np.array(shape.center))) < shape.radius


def standalone(block, matrix, dialect):
    """Emitters that are no surfaces: infinity light, parallel light and spot (9.3 to 9.5).

    Returns:
        A list of dictionaries.
    """
    emission = np.array(block.emission)
    if isinstance(block.shape, InfinityLight):
        return [_infinity_light(block, emission, matrix, dialect)]
    if block.parallel_light and isinstance(block.shape, UVPlane):
        return [_parallel_beam(block, emission, matrix, dialect)]
    if block.spot_light and isinstance(block.shape, Sphere):
        return [_spot(block, emission, matrix)]
    return []


def _infinity_light(block, emission, matrix, dialect):
    direction = matrix[:3, :3] @ np.array(block.shape.direction)
    length = float(np.linalg.norm(direction))
    if not math.isclose(length, 1, rel_tol=1e-3):
        block.lines.remark("", note("infinity-length", dialect))
    factor = length if dialect == "prender" else 1.0
    block.lines.remark("emission", "emission-units: irradiance pi times the emission")
    return {
        "type": "directional",
        "direction": [float(x) for x in direction / length],
        "irradiance": rgb(math.pi * factor * emission),
    }


def _parallel_beam(block, emission, matrix, dialect):
    shape = block.shape
    u, v = (matrix[:3, :3] @ edge for edge in shape.edges(dialect))
    if block.parallel_light_dir is not None:
        direction = np.array(block.parallel_light_dir)
    else:
        direction = geometry.normal(matrix, np.cross(shape.u, shape.v)) * (
            -1 if block.normal < 0 else 1
        )
    block.lines.remark("emission", "emission-units: irradiance pi times the emission")
    return {
        "type": "parallelbeam",
        "origin": [float(x) for x in geometry.point(matrix, shape.origin)],
        "edge_u": [float(x) for x in u],
        "edge_v": [float(x) for x in v],
        "direction": [float(x) for x in geometry.unit(direction)],
        "irradiance": rgb(math.pi * emission),
    }


def _spot(block, emission, matrix):
    w, f = block.spot_light_angle
    block.lines.remark("spot_light_angle", note("spot", "manual"))
    block.lines.remark("emission", "emission-units: intensity pi times the emission")
    return {
        "type": "falloffspot",
        "position": [float(x) for x in geometry.point(matrix, block.shape.center)],
        "direction": [float(x) for x in geometry.unit(block.spot_light_dir)],
        "cutoff_angle": w,
        "falloff_angle": f,
        "falloff_exponent": block.spot_light_falloff,
        "attenuation": [float(x) for x in block.spot_attenuation],
        "intensity": rgb(math.pi * emission),
    }


def background(document):
    """The emitter of the surroundings, or None where they are black."""
    if not any(document.background):
        return None
    return {"type": "constant", "radiance": rgb(document.background)}
