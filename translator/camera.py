"""The camera and the film (spec sections 5, 13.4 and 13.5)."""

import math
from dataclasses import dataclass

import numpy as np

from relume.translator.geometry import affine, compose, point, rotation, unit
from relume.translator.scene_values import Matrix

NEAR, FAR = 1e-6, 1e12
"""Clip distances: the original program has none, so they are out of reach [scene unit]."""

AXIS_TOLERANCE = 1e-6
"""Largest sine of the angle to the Z axis at which the stock thin lens is the program's lens."""


@dataclass(frozen=True)
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


def view(document, dialect="manual"):
    """The `View` of a document.

    Args:
        document: the document.
        dialect: `manual` reads `CAMERA_ANGLE` as the horizontal, `prender` as the vertical field of
            view (decisions, row camera-angle).
    """
    origin = np.array(document.camera_pos)
    if document.target_pos is not None:
        direction = np.array(document.target_pos) - origin
    else:
        direction = np.array(document.camera_dir)
    turns = [t for t in document.camera_matrix if t.kind == "rotation"]
    for turn in turns:
        direction = rotation(turn.values) @ direction
    origin = point(compose([t for t in document.camera_matrix if t.kind != "scale"]), origin)
    direction = unit(direction)
    right = unit(np.cross(direction, unit(document.camera_upvec)))
    aspect = document.image[0] / document.image[1]
    width, height, distance = document.screen
    width, height = width / distance * aspect, height / distance
    if document.camera_angle is not None:
        size = 2 * math.tan(math.radians(document.camera_angle) / 2)
        width, height = (size, size / aspect) if dialect == "manual" else (size * aspect, size)
    return View(origin, direction, right, np.cross(right, direction), width, height)


def sensor(document, dialect="manual"):
    """The sensor's dictionary, with film and sampler; notes go to the document's lines."""
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
            result |= {"type": "thinlens", "aperture_radius": radius, "focus_distance": abs(focus)}
        return result | common
    return {
        "type": "screencamera",
        "width": seen.width,
        "height": seen.height,
        "aperture_radius": max(radius, 0.0),
        "focus_distance": abs(focus),
    } | common


def film(document):
    """The film's dictionary: linear RGB in single precision, box or tent filter."""
    if document.tent_filter:
        reconstruction = {"type": "tent", "radius": 0.5}
        note = "a tent of half-width 0.5 pixel, centred; the program's is off by a quarter pixel"
        document.lines.remark("tent_filter", note)
    else:
        reconstruction = {"type": "box"}
    return {
        "type": "hdrfilm",
        "width": document.image[0],
        "height": document.image[1],
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": reconstruction,
    }


def account(document, dialect):
    """Notes on the camera's lines: rows of the table of dialects, and what has no effect."""
    source = document.lines
    if document.camera_angle is not None:
        source.becomes("screen", "ignored", "CAMERA_ANGLE sets the field of view")
        if document.image[0] != document.image[1]:
            which = "horizontal" if dialect == "manual" else "vertical"
            source.remark("camera_angle", f"camera-angle: read as the {which} field of view")
    elif not math.isclose(document.screen[0], document.screen[1], rel_tol=1e-9):
        source.remark("screen", "pixels are not square")
    if document.target_pos is not None:
        source.becomes("camera_dir", "ignored", "TARGET_POS sets the direction")
    if document.camera_matrix:
        note = "camera-matrix-up: the up vector is not turned"
        if any(t.kind == "scale" for t in document.camera_matrix):
            note += ", scale is ignored"
        source.remark("camera_matrix", note)
    if document.lens[0] <= 0:
        source.becomes("lens", "ignored", "radius 0 or less: a pinhole")
