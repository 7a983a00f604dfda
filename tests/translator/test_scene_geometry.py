"""Where objects are: extents, giant spheres, and what encloses the camera."""

import copy
import math

import numpy as np
import pytest

from relume.translator import read_text
from relume.translator.meshes import Meshes
from relume.translator.scene_geometry import measure

CAMERA = "CAMERA_POS\n0 1 10\nTARGET_POS\n0 1 0\n\n"
BALL = "OBJECT\nsphere 2 1 0 1\n\n"
SKY = "OBJECT\nsphere 0 0 0 500\nemission 1 1 1\n\n"
FLOOR = "OBJECT\nplane 0 -3 0\nnormal 0 2 0\n\n"
GIANT = "OBJECT\nsphere 0 -1e5 0 1e5\n\n"


def measured(objects, dialect="manual"):
    document = read_text(CAMERA + objects, environ={})
    return measure(document, dialect, Meshes(lambda _: None), lambda _: None)


def test_the_extent_holds_all_objects_and_the_camera():
    """From the camera at (0, 1, 10) to the far corner (3, 0, -1) of the ball's box."""
    found = measured(BALL).whole
    assert found.diameter == pytest.approx(np.linalg.norm([3, 2, 11]))
    assert tuple(found.center) == (1.5, 1.0, 4.5)


def test_what_surrounds_the_camera_does_not_tell_how_fine_a_scene_is():
    found = measured(BALL + SKY)
    assert found.whole.diameter == pytest.approx(1000 * 3**0.5)
    assert found.inner.diameter == measured(BALL).whole.diameter == found.shown
    assert [found.encloses_camera(k) for k in (0, 1)] == [False, True]


@pytest.mark.parametrize(
    ("objects", "shown"), [(FLOOR, 4), (GIANT, math.hypot(1e5 + 1, 10) - 1e5), ("", 0)]
)
def test_surroundings_alone_tell_the_size_by_their_distance(objects, shown):
    assert measured(objects).shown == pytest.approx(shown)


def test_giants_are_no_part_of_any_extent():
    found = measured(BALL + GIANT)
    assert found.giants == (1,) and found.surroundings is not None
    assert found.whole.diameter == measured(BALL).whole.diameter


def test_spheres_scaled_unevenly_have_no_ball():
    """Nor are they giants, which only balls can be."""
    objects = GIANT.rstrip() + "\nscale 1 2 1\n\n" + BALL.rstrip() + "\nscale 2 2 2\n"
    uneven, even = measured(objects).balls.values()
    assert uneven is None
    assert (tuple(even.center), even.radius) == ((4, 2, 0), 2)


def test_normals_of_planes_have_length_1():
    ((point, normal),) = measured(FLOOR).planes
    assert tuple(point) == (0, -3, 0) and tuple(normal) == (0, 1, 0)


@pytest.mark.parametrize(("objects", "radius"), [(BALL, None), (BALL + FLOOR, 8.0)])
def test_the_medium_reaches_beyond_what_is_shown(objects, radius):
    """Twice as far as the plane, from the middle (1.5, 1, 4.5)."""
    ball = measured(objects).medium_ball()
    assert ball.radius == pytest.approx(max(radius or 0, measured(BALL).whole.diameter))


def test_measuring_changes_nothing():
    """A second measurement finds the same, and no line has a note."""
    document = read_text(CAMERA + BALL + SKY + FLOOR + GIANT, environ={})
    before = copy.deepcopy(document)
    for _ in range(2):
        found = measure(document, "manual", Meshes(lambda _: None), lambda _: None)
        assert found.whole.diameter == pytest.approx(1000 * 3**0.5)
    assert document == before and document.lines == before.lines
