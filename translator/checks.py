"""Checks that concern several values, or values together with their meaning."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from relume.translator.camera import has_length, has_target, up_vector, viewing_direction
from relume.translator.diagnostics import LineReports, Problem
from relume.translator.document import MAX_PIXELS, MAX_SAMPLES, Document
from relume.translator.objects import SceneObject
from relume.translator.plan import metropolis, samples, samples_reason
from relume.translator.shapes import Annulus, Disk, InfinityLight, Plane, UVPlane

MIN_FIELD_OF_VIEW, MAX_FIELD_OF_VIEW = 1e-3, 179.9
"""What a camera can have [degree]."""

Vector: TypeAlias = Sequence[float] | np.ndarray

PARALLEL = 1e-9
"""Sine of the angle below which two vectors count as parallel."""


def check(document: Document) -> list[Problem]:
    """The problems of a document that no single value shows.

    Returns:
        Problems at the line of the value concerned (line 0 where the file does not set it).
    """
    problems: list[Problem] = []
    _picture(document, problems)
    _camera(document, problems)
    _field_of_view(document, problems)
    _lens(document, problems)
    for block in document.objects:
        _shape(block, problems)
        _spot(block, problems)
        _parallel_light(block, problems)
    return problems


def _problem(
    problems: list[Problem],
    reports: LineReports,
    field: str,
    message: str,
    kind: str = "value",
) -> None:
    lines = reports.reports.get(field) or reports.reports.get("") or ()
    line = lines[-1].line if lines else 0
    problems.append(Problem(line, 1 if line else 0, message, kind))


def _picture(document: Document, problems: list[Problem]) -> None:
    width, height = document.image
    if width * height > MAX_PIXELS:
        message = f"IMAGE of {width} x {height} pixels, expected at most {MAX_PIXELS} in all"
        _problem(problems, document.lines, "image", message, "range")
    if samples(document) > MAX_SAMPLES:
        message = f"{samples_reason(document)}: expected at most 2^40 samples a pixel"
        field = "mutation" if metropolis(document) else "sampling"
        _problem(problems, document.lines, field, message, "range")


def _camera(document: Document, problems: list[Problem]) -> None:
    direction, up = viewing_direction(document), up_vector(document)
    if not has_length(direction):
        field = "target_pos" if has_target(document) else "camera_dir"
        message = "too near or too far to tell the camera a direction"
        _problem(problems, document.lines, field, message)
    elif not has_length(up):
        message = "CAMERA_UPVEC is too short or too long to tell a direction"
        _problem(problems, document.lines, "camera_upvec", message)
    elif _parallel(direction, up):
        message = "CAMERA_UPVEC is parallel to the viewing direction"
        setting = ("camera_upvec", "camera_matrix", "target_pos", "camera_dir")
        field = next((name for name in setting if document.lines.is_set(name)), "camera_upvec")
        if field != "camera_upvec":
            message += ": it is 0 1 0 unless the file sets it"
        _problem(problems, document.lines, field, message)


def _field_of_view(document: Document, problems: list[Problem]) -> None:
    width, height, distance = document.screen
    if document.camera_angle is not None:
        return
    for side, size in (("width", width), ("height", height)):
        angle = math.degrees(2 * math.atan(size / 2 / distance))
        if not MIN_FIELD_OF_VIEW <= angle <= MAX_FIELD_OF_VIEW:
            wanted = f"expected {MIN_FIELD_OF_VIEW:g} to {MAX_FIELD_OF_VIEW:g} degrees"
            found = f"{side} {size:g} at distance {distance:g} is {angle:.3g} degrees"
            message = f"SCREEN: {found}, {wanted}"
            _problem(problems, document.lines, "screen", message, "range")
            return


def _lens(document: Document, problems: list[Problem]) -> None:
    radius, focus = document.lens
    if radius > 0 and focus == 0:
        message = "LENS: a lens that focuses at distance 0 has no picture"
        _problem(problems, document.lines, "lens", message, "range")


def _shape(block: SceneObject, problems: list[Problem]) -> None:
    shape = block.shape
    if isinstance(shape, Plane | Disk | Annulus) and not has_length(shape.normal):
        _problem(problems, block.lines, "", "a normal of length 0")
    if isinstance(shape, InfinityLight) and not has_length(shape.direction):
        _problem(problems, block.lines, "", "infinity_light with a direction of length 0")
    if isinstance(shape, UVPlane) and (
        not has_length(shape.u) or not has_length(shape.v) or _parallel(shape.u, shape.v)
    ):
        _problem(problems, block.lines, "", "uvplane with edges that span no area")
    for transform in block.transforms:
        if transform.kind == "scale" and 0 in transform.values:
            _problem(problems, block.lines, "", "scale by 0 leaves nothing of the object")


def _spot(block: SceneObject, problems: list[Problem]) -> None:
    if not block.spot_light:
        return
    w, f = block.spot_light_angle
    if not 0 < w <= 90:
        message = f"spot_light_angle {w:g} {f:g}: expected 0 < w <= 90"
        _problem(problems, block.lines, "spot_light_angle", message, "range")
    if any(block.spot_light_dir) and not has_length(block.spot_light_dir):
        message = "spot_light_dir is too short or too long to tell a direction"
        _problem(problems, block.lines, "spot_light_dir", message)


def _parallel_light(block: SceneObject, problems: list[Problem]) -> None:
    direction = block.parallel_light_dir
    if block.parallel_light and direction is not None and not has_length(direction):
        _problem(problems, block.lines, "parallel_light_dir", "parallel_light_dir of length 0")


def _parallel(a: Vector, b: Vector) -> bool:
    if not has_length(a) or not has_length(b):
        return False
    return math.hypot(*np.cross(a, b)) <= PARALLEL * math.hypot(*a) * math.hypot(*b)
