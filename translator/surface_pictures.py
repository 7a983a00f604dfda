"""How pictures lie on shapes: tiles, maps of spheres, what a disk is cut out of (11.2 to 11.5)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from relume.translator import environment_maps, geometry, lights
from relume.translator.assets import existing
from relume.translator.materials import Reflectances, plain_reflectances
from relume.translator.objects import SceneObject
from relume.translator.reflectances import SphereMap, cut_out, load_texture
from relume.translator.scene_values import Entry
from relume.translator.shapes import Hemisphere, Plane, Sphere, UVPlane

if TYPE_CHECKING:
    from relume.translator.object_entries import PlacedScene


def cut_out_disk(scene: PlacedScene, name: str, index: int, block: SceneObject) -> Entry:
    """A disk with `disk_map`: what its picture covers shines with the emission (row disk-map).

    The picture spans the radius of the disk along both tangents, around the centre (section 11.3).
    """
    assert block.disk_picture is not None
    shape = scene.shapes.shape(index, block)
    mesh = shape["mesh"]
    shape["mesh"] = replace(mesh, uv=mesh.uv[:, ::-1] + 0.5)
    picture = cut_out(existing(scene.find, block.disk_picture), scene.spectral)
    assert picture.alpha is not None
    # Lamps shine as far as their mask is opaque; that of what is cut off must not.
    shown = (picture.alpha > 0)[..., None].astype(np.float32)
    block.lines.remark("disk_map", "disk-map")
    bsdf = {"type": "mask", "opacity": picture.opacity(), "bsdf": environment_maps.BLACK}
    if block.ibl_texture is not None:
        shining = replace(picture, rgb=picture.rgb * shown * np.float32(block.ibl_texture_coef))
    else:
        block.lines.becomes("color", "disk-map-shines")
        shining = replace(picture, rgb=shown * np.array(block.emission, np.float32))
    if not shining.rgb.any():
        return shape | {"bsdf": bsdf}
    emitter = lights.two_sided(name, environment_maps.radiance(shining))
    return shape | {"bsdf": bsdf, "emitter": emitter}


def object_reflectances(scene: PlacedScene, index: int, block: SceneObject) -> Reflectances:
    """The reflectances of a shape: `texture` replaces both colours (section 11.2)."""
    if block.texture is None or isinstance(block.shape, Plane):
        return plain_reflectances(block)
    u, v = picture_tiles(scene, "texture", block)
    covering, repeat = sphere_map(scene, index, block), block.repeat
    if covering is not None and covering.name == "hemisphere":
        repeat = 1  # the program finds its texel without u and v
    elif covering is not None and isinstance(block.shape, Hemisphere):
        u *= 2
    picture = load_texture(
        scene.find(block.texture),
        repeat=repeat,
        uv_scale=(u, v),
        spectral=scene.spectral,
        map=covering,
    )
    block.lines.becomes("color", "texture-replaces-color")
    return Reflectances(picture, picture)


def picture_tiles(scene: PlacedScene, field: str, block: SceneObject) -> tuple[float, float]:
    """How often a picture fits along both sides of a shape (row uvplane-texture)."""
    if not isinstance(block.shape, UVPlane):
        return 1.0, 1.0
    if not np.allclose(block.shape.tiles("prender"), 1):
        block.lines.remark(field, "uvplane-texture", dialect=scene.dialect)
    return block.shape.tiles(scene.dialect)


def sphere_map(scene: PlacedScene, index: int, block: SceneObject) -> SphereMap | None:
    """How the flags of an object ask its picture to cover the sphere, if any does (11.5)."""
    flag = environment_maps.map_flag(block)
    if flag is None or not isinstance(block.shape, Sphere | Hemisphere):
        return None
    block.lines.remark(flag, "texture-maps")
    matrix = scene.geometry.matrices[index]
    is_ball = scene.geometry.balls[index] is not None
    return SphereMap(
        environment_maps.map_name(block, scene.dialect),
        geometry.point(matrix, block.shape.center),
        None if is_ball else np.linalg.inv(matrix[:3, :3]),
    )
