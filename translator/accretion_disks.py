"""Accretion disks: disks with `disk_map` in the scene of a black hole (section 14)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relume.black_holes import innermost_orbit
from relume.translator import curved_space, geometry, lights
from relume.translator.assets import existing
from relume.translator.curved_space import MASS
from relume.translator.images import as_texture, read_image
from relume.translator.objects import SceneObject
from relume.translator.scene_values import Entry, Picture, rgb
from relume.translator.shapes import Annulus, Disk

if TYPE_CHECKING:
    from relume.translator.object_entries import PlacedScene


def accretion_disk(
    scene: PlacedScene, name: str, index: int, block: SceneObject
) -> Entry | None:
    """The dictionary of an accretion disk: what its picture covers shines, and reflects.

    None where nothing orbits.

    Args:
        scene: the scene.
        name: key of the disk in the scene's dictionary.
        index: which of the scene's objects it is.
        block: the object.

    Raises:
        ImageError: its picture cannot be read.
    """
    assert isinstance(block.shape, Disk | Annulus)
    block.lines.remark("disk_map", "disk-layout")
    block.lines.remark("emission", "disk-motion", dialect=scene.dialect)
    block.lines.remark("blackhole_disk", "disk-opacity")
    block.lines.becomes("color", "disk-color-unused")
    texture = orbiting_matter(scene, index, block)
    edge = MASS * innermost_orbit(texture["spin"])
    if texture["outer_radius"] <= edge:
        block.lines.becomes("", "no-orbit", radius=edge)
        return None
    flat = Disk(block.shape.center, block.shape.radius, block.shape.normal)
    reflecting = {"type": "diffuse", "reflectance": texture | {"quantity": "reflectance"}}
    shape = scene.shapes.disk(block, flat, scene.geometry.matrices[index])
    shape["bsdf"] = {
        "type": "mask",
        "opacity": texture | {"quantity": "opacity"},
        "bsdf": {"type": "twosided", "bsdf": reflecting},
    }
    if any(block.emission):
        shining = texture | {"quantity": "radiance", "scale": rgb(block.emission)}
        shape["emitter"] = lights.two_sided(name, shining)
    return shape


def orbiting_matter(scene: PlacedScene, index: int, block: SceneObject) -> Entry:
    """The dictionary of the texture of an accretion disk, but for its quantity."""
    document, matrix = scene.document, scene.geometry.matrices[index]
    around = curved_space.hole(document)
    assert around is not None and around.position is not None
    assert isinstance(block.shape, Disk | Annulus)
    _, picture = curved_space.disk_picture(document, block.blackhole_disk or 0)
    image = as_texture(read_image(existing(scene.find, picture)))
    scale = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    inner = block.shape.inner_radius if isinstance(block.shape, Annulus) else 0.0
    result: Entry = {
        "type": "accretiondisk",
        "picture": _bitmap(image.rgb),
        "center": list(around.position),
        "spin": around.angular_momentum,
        "mass": MASS,
        "normal": [float(x) for x in geometry.normal(matrix, block.shape.normal)],
        "outer_radius": block.shape.radius * scale,
        "hole_radius": inner * scale,
        "shift": document.color_doppler_factor_effect,
        "motion": "doppler" if scene.dialect == "prender" else "gravity",
    }
    if image.alpha is not None:
        result["alpha"] = _bitmap(image.alpha[..., None])
    if scene.dialect == "prender":
        result["seen_from"] = [float(x) for x in scene.geometry.camera]
    if document.use_accretion_disk_temperature:
        result["temperature"] = curved_space.HOTTEST
    return result


def _bitmap(pixels: np.ndarray) -> Entry:
    """The dictionary of a picture's texels, (height, width, channels), top row first."""
    stored = Picture(np.ascontiguousarray(pixels[::-1]))
    return {
        "type": "bitmap",
        "picture": stored,
        "raw": True,
        "filter_type": "nearest",
        "wrap_mode": "clamp",
    }
