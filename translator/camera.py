"""The camera and the film (spec sections 5, 13.4 and 13.5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relume.translator.document import Document
from relume.translator.geometry import affine, compose, point, rotation, unit
from relume.translator.scene_values import Entry, Matrix

NEAR, FAR = 1e-6, 1e12
"""Clip distances: the original program has none, so they are out of reach [scene unit]."""

PARALLEL_RAYS = 1e15
"""Focus distance beyond which the stock lens has no numbers, and its rays are parallel long since
[scene unit]."""

FORWARD = (0.0, 0.0, -1.0)
"""Direction of a camera that is told none, as in all real files whose CAMERA_MATRIX turns it."""

AXIS_TOLERANCE = 1e-6
"""Largest sine of the angle to the Z axis at which the stock thin lens is the program's lens."""


@dataclass(frozen=True, eq=False)
class View:
    """What the camera keywords add up to.

    Attributes:
        origin: position, (3,).
        direction: unit viewing direction, (3,).
        right, up: unit axes of the screen, (3,).
        width, height: size of the screen at distance 1.
    """

    origin: np.ndarray
    direction: np.ndarray
    right: np.ndarray
    up: np.ndarray
    width: float
    height: float


def view(document: Document, dialect: str = "manual") -> View:
    """The `View` of a document.

    Args:
        document: the document.
        dialect: `manual` reads `CAMERA_ANGLE` as the horizontal, `prender` as the vertical field of
            view (decisions, row camera-angle).
    """
    origin = np.array(document.camera_pos)
    direction = viewing_direction(document)
    origin = point(compose([t for t in document.camera_matrix if t.kind != "scale"]), origin)
    direction = unit(direction)
    right = unit(np.cross(direction, unit(up_vector(document))))
    aspect = document.image[0] / document.image[1]
    width, height, distance = document.screen
    width, height = width / distance * aspect, height / distance
    if document.camera_angle is not None:
        size = 2 * math.tan(math.radians(document.camera_angle) / 2)
        width, height = (size, size / aspect) if dialect == "manual" else (size * aspect, size)
    return View(origin, direction, right, np.cross(right, direction), width, height)


def has_length(v: Sequence[float] | np.ndarray) -> bool:
    """Whether a vector has a direction, without overflow or underflow in double precision."""
    return bool(1e-150 < max(abs(x) for x in v) < 1e150)


def has_target(document: Document) -> bool:
    """Whether there is a target that tells a direction: another place than the camera's."""
    return document.target_pos is not None and document.target_pos != document.camera_pos


def told_direction(document: Document) -> tuple[float, float, float]:
    """CAMERA_DIR, or -Z where it has no length, or is not set for a target to take its place."""
    is_told = document.target_pos is None or document.lines.is_set("camera_dir")
    return document.camera_dir if is_told and any(document.camera_dir) else FORWARD


def viewing_direction(document: Document) -> np.ndarray:
    """The direction that the camera looks in, turned by CAMERA_MATRIX, of any length."""
    direction = np.array(told_direction(document))
    if document.target_pos is not None and has_target(document):
        direction = np.subtract(document.target_pos, document.camera_pos)
    for turn in document.camera_matrix:
        if turn.kind == "rotation":
            direction = rotation(turn.values) @ direction
    return direction


def up_vector(document: Document) -> tuple[float, float, float]:
    """CAMERA_UPVEC, or +Y where it has no length."""
    return document.camera_upvec if any(document.camera_upvec) else (0.0, 1.0, 0.0)


def sensor(document: Document, dialect: str = "manual") -> Entry:
    """The sensor's dictionary, with film and sampler."""
    seen = view(document, dialect)
    # Mitsuba's camera looks along +Z with +X to the left of the picture.
    axes = np.stack([-seen.right, seen.up, seen.direction], axis=1)
    common = {
        "to_world": Matrix.of(affine(axes, seen.origin)),
        "film": film(document),
        "sampler": {"type": "independent"},
    }
    radius, focus = document.lens
    square = math.isclose(
        seen.width * document.image[1], seen.height * document.image[0], rel_tol=1e-9
    )
    result: Entry
    along_z = math.hypot(*seen.direction[:2]) <= AXIS_TOLERANCE
    if square and (radius <= 0 or along_z):
        fov = math.degrees(2 * math.atan(seen.height / 2))
        result = {
            "type": "perspective",
            "fov_axis": "y",
            "fov": fov,
            "near_clip": NEAR,
            "far_clip": FAR,
        }
        if radius > 0:
            focus = min(abs(focus), PARALLEL_RAYS)
            result |= {"type": "thinlens", "aperture_radius": radius, "focus_distance": focus}
        return result | common
    result = {"type": "screencamera", "width": seen.width, "height": seen.height}
    if radius > 0:
        result |= {"aperture_radius": radius, "focus_distance": abs(focus)}
    return result | common


def film(document: Document) -> Entry:
    """The film's dictionary: linear RGB in single precision, box or tent filter."""
    tent = {"type": "tent", "radius": 0.5}
    return {
        "type": "hdrfilm",
        "width": document.image[0],
        "height": document.image[1],
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": tent if document.tent_filter else {"type": "box"},
    }


def report_camera(document: Document, dialect: str) -> None:
    """Report what becomes of the camera's lines: dialect differences, and what has no effect."""
    lines = document.lines
    if document.camera_angle is not None:
        lines.becomes("screen", "screen-replaced")
        if document.image[0] != document.image[1]:
            axis = "horizontal" if dialect == "manual" else "vertical"
            lines.remark("camera_angle", "camera-angle", axis=axis)
    elif not math.isclose(document.screen[0], document.screen[1], rel_tol=1e-9):
        lines.remark("screen", "pixels-not-square")
    if has_target(document):
        lines.becomes("camera_dir", "direction-replaced")
    elif document.target_pos is not None:
        x, y, z = told_direction(document)
        lines.becomes("target_pos", "target-at-camera", x=x, y=y, z=z)
    elif not any(document.camera_dir):
        lines.becomes("camera_dir", "direction-missing")
    if not any(document.camera_upvec):
        lines.becomes("camera_upvec", "up-missing")
    if document.camera_matrix:
        lines.remark("camera_matrix", "camera-matrix-up")
        if any(t.kind == "scale" for t in document.camera_matrix):
            lines.remark("camera_matrix", "camera-matrix-scale")
    if document.lens[0] <= 0:
        lines.becomes("lens", "pinhole")
    if document.tent_filter:
        lines.remark("tent_filter", "tent-centred")
