"""What bends space: one black hole or wormhole, settled before anything is translated.

The units of a scene are those of its hole: a mass of 1 is one scene unit (G = c = 1). A wormhole
whose mouths are far apart has a scene of its own on each side, both about their mouths.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from relume.black_holes import MOST_SPIN
from relume.translator import geometry
from relume.translator.camera import velocity, view
from relume.translator.document import Document
from relume.translator.forms.transforms import Transform
from relume.translator.gravity import OF_THE_SCENE, BlackHole, WormHole
from relume.translator.objects import SceneObject
from relume.translator.outcomes import make_note
from relume.translator.scene_values import Entry
from relume.translator.shapes import Annulus, Disk, InfinityLight, MeshFile, Plane, UVPlane

FAR_APART = 1e5
"""Distance of two mouths above which each side has objects of its own [scene unit]."""

HOTTEST = 4500.0
"""Largest temperature of a disk [K], as in James et al. 2015."""

MASS = 1.0
"""Mass of a hole [scene unit]."""


def curvature(document: Document) -> BlackHole | WormHole | None:
    """The block that bends space: the last wormhole, else the last black hole; or None."""
    by_rank = sorted(document.gravity, key=lambda block: isinstance(block, WormHole))
    return by_rank[-1] if by_rank else None


def hole(document: Document) -> BlackHole | None:
    """The black hole that bends space, or None."""
    block = curvature(document)
    return block if isinstance(block, BlackHole) else None


def is_accretion_disk(document: Document, block: SceneObject) -> bool:
    """Whether an object is a disk of matter that orbits a black hole (section 14)."""
    around = hole(document)
    flat = isinstance(block.shape, Disk | Annulus)
    return bool(around and around.accretion_disk_texture and flat and block.disk_map)


# ---- settled in a copy of the document


def settle(document: Document, dialect: str) -> None:
    """Leave one block that bends space, with its places told, and report what is left out.

    Args:
        document: changed in place, its lines and blocks, too.
        dialect: `manual` or `prender`, for the camera.
    """
    numbers = disk_numbers(document)
    for index, each in enumerate(document.objects):
        each.blackhole_disk = numbers.get(index)
        if index not in numbers:
            each.lines.becomes("blackhole_disk", "no-accretion-disk")
    block = curvature(document)
    if block is None:
        return
    document.next_event_estimation = False
    for other in document.gravity:
        if other is not block:
            other.lines.whole_becomes("another-hole", line=block.lines.line())
    document.gravity = [block]
    _leave_out_media(document)
    if isinstance(block, BlackHole):
        _settle_hole(document, block, dialect)
        _settle_disks(document, block, numbers)
    else:
        _settle_wormhole(document, block, dialect)


def _leave_out_media(document: Document) -> None:
    if document.participating_media:
        document.participating_media = False
        document.lines.becomes("participating_media", "medium-in-curved-space")
    for block in document.objects:
        if block.reflection.subsurface:
            block.reflection = dataclasses.replace(block.reflection, subsurface=False)
            block.lines.becomes("subsurface", "medium-in-curved-space")


def _before_camera(document: Document, distance: float, dialect: str) -> tuple[float, float, float]:
    seen = view(document, dialect)
    x, y, z = (float(c) for c in seen.origin + distance * seen.direction)
    return x, y, z


def _settle_hole(document: Document, block: BlackHole, dialect: str) -> None:
    if block.position is None:
        block.position = _before_camera(document, block.dist, dialect)
    else:
        block.lines.becomes("dist", "dist-unused")
    if abs(block.angular_momentum) > MOST_SPIN:
        block.angular_momentum = math.copysign(MOST_SPIN, block.angular_momentum)
        block.lines.remark("angular_momentum", "spin-limited", most=MOST_SPIN)
    away = math.dist(view(document, dialect).origin, block.position)
    if away <= 1 + math.sqrt(1 - block.angular_momentum**2):
        block.lines.becomes("", "camera-in-hole")


def _settle_disks(document: Document, around: BlackHole, numbers: Mapping[int, int]) -> None:
    count = len(around.accretion_disk_texture)
    for index, number in numbers.items():
        block = document.objects[index]
        if number >= count:
            block.blackhole_disk = count - 1
            block.lines.becomes("blackhole_disk", "disk-texture-clamped", count=count)
    used = {min(number, count - 1) for number in numbers.values()}
    for k, report in enumerate(around.lines.of("accretion_disk_texture")):
        if k not in used:
            report.becomes("no-disk-of-texture")


def disk_numbers(document: Document) -> dict[int, int]:
    """The number that each accretion disk asks for, by its index: that of the disk before it where
    it tells none, 0 at first."""
    found, number = {}, 0
    for index, block in enumerate(document.objects):
        number = number if block.blackhole_disk is None else block.blackhole_disk
        if is_accretion_disk(document, block):
            found[index] = number
    return found


def disk_picture(document: Document, number: int) -> tuple[int, str]:
    """The line and the name of the picture of accretion disks of a number, the last at most."""
    around = hole(document)
    assert around is not None
    number = min(number, len(around.accretion_disk_texture) - 1)
    lines = around.lines.of("accretion_disk_texture")
    line = lines[number].line if number < len(lines) else around.lines.line()
    return line, around.accretion_disk_texture[number]


def _settle_wormhole(document: Document, block: WormHole, dialect: str) -> None:
    for field in OF_THE_SCENE:
        document.lines.becomes(field, "wormhole-has-skies")
    document.background_texture = None
    if block.entrance is None and block.exit is None:
        block.entrance = _before_camera(document, block.dist, dialect)
    else:
        block.lines.becomes("dist", "dist-unused")
    if block.entrance is None:
        block.entrance = (0.0, 0.0, 0.0)
        block.lines.becomes("", "in-missing")
    if block.exit is None:
        block.lines.becomes("", "out-missing")
    if block.a < 0:
        block.lines.remark("a", "length-without-sign", given=block.a, read=-block.a)
        block.a = -block.a
    if block.sign < 0:
        block.lines.remark("sign", "skies-exchanged")
        for one, two in (("background_texture1", "background_texture2"),
                         ("map_coef1", "map_coef2"), ("coef1", "coef2")):  # fmt: skip
            first, second = getattr(block, one), getattr(block, two)
            setattr(block, one, second)
            setattr(block, two, first)


# ---- the two sides of a wormhole


def sides(document: Document, dialect: str) -> list[Document]:
    """The two sides of the wormhole of a settled document; without one, the document alone.

    Args:
        document: the document, whose line reports the sides share.
        dialect: `manual` or `prender`, for the camera.

    Returns:
        The documents of this side and of the other, whose surroundings are those of each side. Are
        the mouths far apart, the other one has objects of its own, its mouth at the origin, and
        the camera where it is or, as on this side, in the mouth that is looked through.
    """
    block = curvature(document)
    if not isinstance(block, WormHole):
        return [document]
    this = dataclasses.replace(document, **_sky(block, 1))
    other = dataclasses.replace(document, **_sky(block, 2), objects=[])
    if not far_apart(block):
        return [this, other]
    move = np.zeros(3) if block.exit is None else np.array(block.exit)
    objects: tuple[list[SceneObject], list[SceneObject]] = ([], [])
    for each in document.objects:
        far = nearer_to_exit(block, _place(each))
        objects[far].append(_moved(each, -move) if far else each)
    camera = view(document, dialect)
    places = [np.array(_entrance(block)), np.zeros(3)]
    if nearer_to_exit(block, camera.origin):
        places[1] = camera.origin - move
    else:
        places[0] = camera.origin
    looks = [_looking(camera.direction, place) for place in places]
    there = dataclasses.replace(block, exit=(0.0, 0.0, 0.0))
    return [
        dataclasses.replace(this, **looks[0], objects=objects[0]),
        dataclasses.replace(other, **looks[1], objects=objects[1], gravity=[there]),
    ]


def far_apart(block: WormHole) -> bool:
    """Whether the mouths of a settled wormhole are in scenes of their own."""
    return block.exit is None or math.dist(_entrance(block), block.exit) > FAR_APART


def nearer_to_exit(block: WormHole, point: np.ndarray) -> bool:
    """Whether a point is on the other side of a wormhole whose mouths are far apart."""
    if block.exit is None:
        return False
    return math.dist(point, block.exit) < math.dist(point, _entrance(block))


def other_side(document: Document, other: Document, entries: Entry, dialect: str) -> Entry:
    """Parameters of `curvedspace` that tell what is on the other side of a wormhole.

    Args:
        document: the settled document.
        other: the document of the other side, where it is rendered.
        entries: what its objects and surroundings became.
        dialect: `manual` or `prender`, for the camera.
    """
    block, there = curvature(document), curvature(other)
    assert isinstance(block, WormHole) and isinstance(there, WormHole)
    if not far_apart(block):
        return {"sky2": entries["background"]} if "background" in entries else {}
    start = 2 if nearer_to_exit(block, view(document, dialect).origin) else 1
    scene = {"type": "scene"} | entries
    return {"mouth_out": _floats(there.exit or ()), "other": scene, "start_side": start}


def beyond(integrator: Entry) -> list[Entry]:
    """Shapes and emitters on the other side of a wormhole, that an integrator's dictionary has."""
    found = [integrator[key] for key in ("sky2",) if key in integrator]
    found += [x for x in integrator.get("other", {}).values() if isinstance(x, dict)]
    nested = [x for key, x in integrator.items() if isinstance(x, dict) and key != "other"]
    return found + [entry for x in nested for entry in beyond(x)]


def _entrance(block: WormHole) -> tuple[float, float, float]:
    assert block.entrance is not None  # since it is settled
    return block.entrance


def _place(block: SceneObject) -> np.ndarray:
    """A point of an object, which tells its side."""
    shape = block.shape
    if shape is None or isinstance(shape, MeshFile | InfinityLight):
        point = (0.0, 0.0, 0.0)
    elif isinstance(shape, Plane):
        point = shape.point
    elif isinstance(shape, UVPlane):
        point = shape.origin
    else:
        point = shape.center
    return geometry.point(geometry.compose(block.transforms), np.array(point))


def _moved(block: SceneObject, by: np.ndarray) -> SceneObject:
    x, y, z = (float(c) for c in by)
    transforms = [*block.transforms, Transform("translate", (x, y, z))]
    return dataclasses.replace(block, transforms=transforms)


def _looking(direction: np.ndarray, origin: np.ndarray) -> dict[str, Any]:
    """Fields of a document whose camera is elsewhere."""
    return {
        "camera_pos": tuple(float(c) for c in origin),
        "camera_dir": tuple(float(c) for c in direction),
        "target_pos": None,
        "camera_matrix": [],
    }


def _sky(block: WormHole, side: int) -> dict[str, Any]:
    """Fields of a document whose surroundings are those of a side of a wormhole."""
    return {field: getattr(block, f"{field}{side}") for field in OF_THE_SCENE}


# ---- dictionaries


def wrapped(
    document: Document, dialect: str, apart: Entry, paths: Entry
) -> tuple[Entry, str]:
    """A path tracer's dictionary inside those that know relativity, and why.

    Args:
        document: the settled document, where it is rendered.
        dialect: `manual` or `prender`.
        apart: parameters of `curvedspace` that tell what is on the other side.
        paths: the path tracer.
    """
    result, reason = paths, ""
    if curvature(document) is not None:
        result = integrator(document, dialect, paths) | apart
        reason = "; inside curvedspace, as light follows curved space"
    moving, share = velocity(document), document.color_doppler_factor_effect
    if moving is None or share == 0:
        return result, reason
    reason += "; wrapped by dopplershift for color_doppler_factor_effect"
    shift: Entry = {"type": "dopplershift", "velocity": list(moving), "share": share}
    return shift | {"integrator": result}, reason


def integrator(document: Document, dialect: str, nested: Entry) -> Entry:
    """The dictionary of `curvedspace`, without what is on the other side of a wormhole.

    Args:
        document: the settled document, where it is rendered.
        dialect: `manual` or `prender` (row hole-observer).
        nested: the path tracer whose depths it has.
    """
    block = curvature(document)
    assert block is not None
    length = block.geodesics_max_length
    budget = -1 if length < 0 else max(int(min(length, 2**30)), 1)
    result: Entry = {"type": "curvedspace", "geodesics_max_length": budget, "nested": nested}
    if isinstance(block, WormHole):
        out = {} if far_apart(block) else {"mouth_out": _floats(block.exit or ())}
        return result | out | {
            "metric": "wormhole",
            "mouth_in": _floats(_entrance(block)),
            "rho": block.rho,
            "a": block.a,
            "W": block.w,
        }
    assert block.position is not None
    spin = {"spin": block.angular_momentum} if block.angular_momentum else {}
    return result | {
        "metric": "kerr" if spin else "schwarzschild",
        "center": _floats(block.position),
        "mass": MASS,
        **spin,
        "observer": "coordinate" if dialect == "prender" else "static",
    }


def _floats(values: Iterable[float]) -> list[float]:
    return [float(x) for x in values]


# ---- what is reported


def report_bending(document: Document, dialect: str) -> None:
    """Report how the light of a settled document finds its way.

    Args:
        document: the document; its line reports are changed.
        dialect: `manual` or `prender`.
    """
    block = curvature(document)
    if block is None:
        return
    block.lines.remark("geodesics_max_length", "hole-budget")
    if isinstance(block, BlackHole):
        block.lines.remark("", "hole-observer", dialect=dialect)
        block.lines.becomes("initial_condition", "initial-condition")
        block.lines.becomes("accretion_disk", "no-effect")
        if block.angular_momentum:
            block.lines.remark("angular_momentum", "hole-poles")
    else:
        for code in ("wormhole-start", "wormhole-bounces", "wormhole-mirrored"):
            block.lines.add("", make_note(code))
