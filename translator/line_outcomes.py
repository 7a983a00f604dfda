"""What becomes of keywords that set no value of their own in the Mitsuba scene.

Each row: field, condition on the document or object, code of the outcome. A row applies where the
condition holds, to the lines that set the field.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from relume.translator import curved_space
from relume.translator.camera import velocity
from relume.translator.document import Document
from relume.translator.lights import is_spot
from relume.translator.objects import SceneObject
from relume.translator.outcomes import make_note
from relume.translator.plan import BOOTSTRAP, metropolis, mutations
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

Row = tuple[str, Callable[[Any], Any], str]


def always(_: object) -> bool:
    """The condition of a row that applies wherever its field is set."""
    return True


DOCUMENT_ROWS: tuple[Row, ...] = (
    ("depth", always, "roulette"),
    ("metropolis", lambda d: d.metropolis and not d.erpt, "mlt"),
    ("erpt", lambda d: d.erpt, "erpt"),
    ("ambient", always, "ambient"),
    ("luminance_cutoff", always, "luminance-cutoff"),
    ("next_event_estimation", lambda d: several_lamps(d), "several-lights"),
    ("depth_limit", always, "depth-limit-unused"),
    ("mlt_r1r2", always, "no-effect"),
    ("metropolis", lambda d: d.metropolis and d.erpt, "erpt-wins"),
    ("supersampling", metropolis, "supersampling-unused"),
    ("luminance_cutoff", metropolis, "cutoff-unused"),
    ("mutation", lambda d: not (d.metropolis or d.erpt), "no-metropolis"),
    ("mlt_sample", lambda d: metropolis(d) != "pssmlt", "metropolis-transport-only"),
    ("mlt_sample",
     lambda d: metropolis(d) == "pssmlt" and d.mlt_sample < BOOTSTRAP * mutations(d),
     "bootstrap-raised"),
    ("mlt_resampling", lambda d: metropolis(d) != "pssmlt", "metropolis-transport-only"),
    *((field, lambda d: not d.participating_media, "no-participating-media")
      for field in ("scattering", "absorbing", "phase")),
    *((field, lambda d: not d.background_texture, "no-background-texture")
      for field in ("map_coef", "coef")),
    ("use_accretion_disk_temperature",
     lambda d: d.use_accretion_disk_temperature and not curved_space.disk_numbers(d),
     "no-accretion-disk"),
    ("use_accretion_disk_temperature",
     lambda d: d.use_accretion_disk_temperature and curved_space.disk_numbers(d),
     "disk-temperature"),
    ("color_doppler_factor_effect",
     lambda d: d.color_doppler_factor_effect and not shifts_colors(d), "no-doppler"),
    ("color_doppler_factor_effect",
     lambda d: d.color_doppler_factor_effect and velocity(d), "doppler-cosine"),
    ("velocity", lambda d: any(d.velocity) and not d.special_relativity_effects,
     "no-relativity-effects"),
    ("special_relativity_effects", lambda d: d.special_relativity_effects and not velocity(d),
     "no-velocity"),
    ("use_mollweide_projection", lambda d: d.use_mollweide_projection and velocity(d),
     "mollweide-order"),
    *((field, lambda d: d.use_mollweide_projection, "mollweide-screen")
      for field in ("screen", "camera_angle")),
    ("camera_matrix", lambda d: bends_view(d), "camera-matrix-order"),
    ("next_event_estimation", lambda d: has_kind(d, "ward"), "ward-nee"),
    ("next_event_estimation", lambda d: has_kind(d, "glass"), "glass-nee"),
    ("participating_media", lambda d: d.participating_media and shows_sky(d), "fog-sky"),
    ("next_event_estimation", lambda d: not d.gravity, "lights-always-sampled"),
    ("next_event_estimation", lambda d: d.gravity, "next-event-in-curved-space"),
    ("depth", always, "roulette-depth"),
    ("gamma_offset", lambda d: d.gamma_offset == 0, "gamma"),
    ("time_limit", always, "timelimit"),
)  # fmt: skip


def several_lamps(document: Document) -> bool:
    """Whether explicit light comes from more than one lamp."""
    lamps = [b for b in document.objects if any(b.emission) and not any(b.color)]
    return document.next_event_estimation and len(lamps) > 1


def shifts_colors(document: Document) -> bool:
    """Whether anything that moves has its colours shifted."""
    return velocity(document) is not None or bool(curved_space.disk_numbers(document))


def bends_view(document: Document) -> bool:
    """Whether the program would bend the direction of view: by translations before others."""
    kinds = [t.kind for t in document.camera_matrix if t.kind in ("rotation", "translate")]
    return "translate" in kinds[:-1]


def has_kind(document: Document, kind: str) -> bool:
    """Whether there is a surface of a kind, under next event estimation."""
    kinds = [block.reflection.kind for block in document.objects]
    return document.next_event_estimation and kind in kinds


def shows_sky(document: Document) -> bool:
    """Whether rays that meet no surface show anything."""
    return any(document.background) or document.background_texture is not None


def no_subsurface(block: SceneObject) -> bool:
    """Whether no light scatters inside an object."""
    return not block.reflection.subsurface


MAPS = ("panoramic_map", "angular_map", "equirectangular_map", "hemisphere_map")
"""Flags that ask for the map of an image-based light."""


def is_disk(block: SceneObject) -> bool:
    """Whether an object is a disk, with or without a hole."""
    return isinstance(block.shape, Disk | Annulus)


def is_below_ward(block: SceneObject, field: str) -> bool:
    """Whether a line that sets a field comes after that of Ward's parameters."""
    if not (block.lines.of(field) and block.lines.of("ward_brdf")):
        return False
    return block.lines.line(field) > block.lines.line("ward_brdf")


def is_scaled_round(block: SceneObject) -> bool:
    """Whether an object is a sphere, a dome or a disk with a scale."""
    is_round = isinstance(block.shape, Sphere | Hemisphere | Disk | Annulus)
    return is_round and any(transform.kind == "scale" for transform in block.transforms)


def is_unit(vector: tuple[float, float, float]) -> bool:
    """Whether a vector has the length 1."""
    return math.isclose(math.hypot(*vector), 1, rel_tol=1e-3)


def emits_and_reflects(block: SceneObject) -> bool:
    """Whether an object that looks like a lamp alone reflects, too."""
    lamp = isinstance(block.shape, Plane | InfinityLight)
    return lamp and any(block.emission) and any(block.color)


OBJECT_ROWS: tuple[Row, ...] = (
    ("reflection", lambda b: b.reflection.kind == "glass" and no_subsurface(b), "glass-fresnel"),
    ("reflection", lambda b: b.reflection.dispersion is not None, "dispersion-rgb"),
    ("ward_brdf", lambda b: b.reflection.kind == "ward", "ward-exponent"),
    *((field, lambda b, field=field: b.reflection.kind == "ward" and is_below_ward(b, field),
       "ward-colour") for field in ("color", "specular")),
    ("phong_brdf", lambda b: b.reflection.kind == "phong", "phong-cosine"),
    ("texture", always, "texture"),
    ("back", always, "no-effect"),
    ("media_ignore_front_back", always, "medium-everywhere"),
    ("disk_map", lambda b: b.disk_map and not is_disk(b), "disk-map-without-disk"),
    ("disk_map", lambda b: b.disk_map and is_disk(b) and not b.disk_picture
     and b.blackhole_disk is None, "no-texture"),
    ("background", lambda b: b.background and not b.is_backdrop, "background-not-plane"),
    ("", is_scaled_round, "sphere-radius-scale"),
    ("", lambda b: isinstance(b.shape, Hemisphere) and b.ibl_texture is None,
     "hemisphere-inside"),
    ("", lambda b: isinstance(b.shape, InfinityLight) and not is_unit(b.shape.direction),
     "infinity-shadow"),
    ("ibl_texture",
     lambda b: b.ibl_texture and isinstance(b.shape, Hemisphere) and not b.hemisphere_map,
     "ibl-hemisphere-u"),
    ("hemisphere_map",
     lambda b: b.hemisphere_map and (b.texture or b.ibl_texture)
     and isinstance(b.shape, Sphere | Hemisphere),
     "hemisphere-map-integer"),
    ("texture", lambda b: isinstance(b.shape, Plane), "no-texture-on-plane"),
    *((flag, lambda b, flag=flag: getattr(b, flag) and not (b.texture or b.ibl_texture),
       "map-without-picture") for flag in MAPS),
    *((flag, lambda b, flag=flag: getattr(b, flag) and (b.texture or b.ibl_texture)
       and not isinstance(b.shape, Sphere | Hemisphere), "map-without-sphere") for flag in MAPS),
    ("shadow", lambda b: b.shadow and not isinstance(b.shape, Plane | UVPlane),
     "only-planes-catch-shadows"),
    ("repeat", lambda b: isinstance(b.shape, MeshFile), "repeat"),
    ("repeat", lambda b: not b.texture and not isinstance(b.shape, MeshFile), "no-texture"),
    ("ibl_texture_coef", lambda b: b.ibl_texture is None, "no-ibl-texture"),
    ("smooth", lambda b: b.smooth and not isinstance(b.shape, MeshFile), "no-mesh"),
    ("r_refractive_index", always, "one-index"),
    *((field, no_subsurface, "no-subsurface") for field in (
        "scattering", "absorbing", "phase", "level", "bssrdf", "material_symbol", "material_scale",
        "material_r_max")),
    *((field, lambda b: b.parallel_light and not isinstance(b.shape, UVPlane),
       "only-uvplane-parallel-light")
      for field in ("parallel_light", "parallel_light_dir")),
    ("parallel_light_dir", lambda b: not b.parallel_light, "no-parallel-light"),
    ("spot_light", lambda b: b.spot_light and not isinstance(b.shape, Sphere), "only-sphere-spot"),
    *((field, lambda b: not is_spot(b), "no-spot")
      for field in ("spot_light_dir", "spot_light_angle", "spot_light_falloff",
                    "spot_attenuation")),
    ("emission", emits_and_reflects, "emits-and-reflects"),
)  # fmt: skip


def report_keywords(document: Document, dialect: str) -> None:
    """Report the outcome of every line that no other pass reports on.

    Args:
        document: the document; its line reports are changed.
        dialect: `manual` or `prender`, for the notes on where the two differ.
    """
    _apply(document, DOCUMENT_ROWS, dialect)
    for block in document.objects:
        _apply(block, OBJECT_ROWS, dialect)


def _apply(target: Document | SceneObject, rows: tuple[Row, ...], dialect: str) -> None:
    for field, applies, code in rows:
        if applies(target):
            target.lines.add(field, make_note(code, dialect=dialect))
