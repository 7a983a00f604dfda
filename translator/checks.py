"""Checks that concern several values, or values together with their meaning."""

import math

from relume.translator.diagnostics import Problem
from relume.translator.document import MAX_PIXELS, MAX_SAMPLES
from relume.translator.plan import metropolis, samples, samples_reason
from relume.translator.shapes import Annulus, Disk, InfinityLight, Plane, UVPlane

NARROWEST, WIDEST = 1e-3, 179.9
"""Field of view that a camera can have [degree]."""

PARALLEL = 1e-9
"""Sine of the angle below which two vectors count as parallel."""


def check(document):
    """The problems of a document that no single value shows.

    Returns:
        Problems at the line of the value concerned (line 0 where the file does not set it).
    """
    problems = []
    _picture(document, problems)
    _camera(document, problems)
    _field_of_view(document, problems)
    for block in document.objects:
        _shape(block, problems)
        _spot(block, problems)
    return problems


def _problem(problems, source, field, message, kind="value"):
    lines = source.reports.get(field) or source.reports.get("") or ()
    line = lines[-1].line if lines else 0
    problems.append(Problem(line, 1 if line else 0, message, kind))


def _picture(document, problems):
    width, height = document.image
    if width * height > MAX_PIXELS:
        message = f"IMAGE of {width} x {height} pixels, expected at most {MAX_PIXELS} in all"
        _problem(problems, document.lines, "image", message, "range")
    if samples(document) > MAX_SAMPLES:
        message = f"{samples_reason(document)}: expected at most 2^40 samples a pixel"
        field = "mutation" if metropolis(document) else "sampling"
        _problem(problems, document.lines, field, message, "range")


def _camera(document, problems):
    if document.target_pos is not None:
        field = "target_pos"
        direction = _minus(document.target_pos, document.camera_pos)
    else:
        field, direction = "camera_dir", document.camera_dir
    if not _usable(direction):
        word = "TARGET_POS equal to CAMERA_POS" if field == "target_pos" else "CAMERA_DIR 0 0 0"
        _problem(problems, document.lines, field, f"{word}: the camera has no direction")
    elif not _usable(document.camera_upvec):
        _problem(problems, document.lines, "camera_upvec", "CAMERA_UPVEC of length 0")
    elif _parallel(direction, document.camera_upvec):
        message = "CAMERA_UPVEC is parallel to the viewing direction"
        _problem(problems, document.lines, "camera_upvec", message)


def _field_of_view(document, problems):
    width, height, distance = document.screen
    if document.camera_angle is not None:
        return
    for side, size in (("width", width), ("height", height)):
        angle = math.degrees(2 * math.atan(size / 2 / distance))
        if not NARROWEST <= angle <= WIDEST:
            wanted = f"expected {NARROWEST:g} to {WIDEST:g} degrees"
            found = f"{side} {size:g} at distance {distance:g} is {angle:.3g} degrees"
            message = f"SCREEN: {found}, {wanted}"
            _problem(problems, document.lines, "screen", message, "range")
            return


def _shape(block, problems):
    shape = block.shape
    if isinstance(shape, Plane | Disk | Annulus) and not _usable(shape.normal):
        _problem(problems, block.lines, "", "a normal of length 0")
    if isinstance(shape, InfinityLight) and not _usable(shape.direction):
        _problem(problems, block.lines, "", "infinity_light with a direction of length 0")
    if isinstance(shape, UVPlane) and (
        not _usable(shape.u) or not _usable(shape.v) or _parallel(shape.u, shape.v)
    ):
        _problem(problems, block.lines, "", "uvplane with edges that span no area")
    for transform in block.transforms:
        if transform.kind == "scale" and 0 in transform.values:
            _problem(problems, block.lines, "", "scale by 0 leaves nothing of the object")


def _spot(block, problems):
    if not block.spot_light:
        return
    w, f = block.spot_light_angle
    if not (0 < w <= 90 and f <= w):
        message = f"spot_light_angle {w:g} {f:g}: expected 0 < w <= 90 and 0 <= f <= w"
        _problem(problems, block.lines, "spot_light_angle", message, "range")
    if not _usable(block.spot_light_dir):
        _problem(problems, block.lines, "spot_light_dir", "spot_light_dir of length 0")


def _minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def _usable(v):
    """Whether a vector has a direction, without overflow or underflow in double precision."""
    return 1e-150 < max(abs(x) for x in v) < 1e150


def _parallel(a, b):
    if not _usable(a) or not _usable(b):
        return False
    cross = (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
    return math.hypot(*cross) <= PARALLEL * math.hypot(*a) * math.hypot(*b)
