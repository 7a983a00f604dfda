"""Distances to the next surface: never too large, and not much too small."""

import mitsuba as mi
import numpy as np
import pytest

import relume  # noqa: F401  registers the plugins
from relume.integrators.boundaries import distances


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def at(scene, points):
    from relume.integrators.clearances import Clearances

    found = Clearances(mi.load_dict({"type": "scene"} | scene), True)
    assert found.known
    p = mi.Point3f(*points.T.astype(np.float32))
    return [np.array(v, float) for v in found.two(p, mi.Bool(True))]


POINTS = np.random.default_rng(4).uniform(-1.4, 1.4, (4000, 3))


def test_spheres_and_lamps():
    balls = {"a": {"type": "sphere"}, "b": {"type": "sphere", "radius": 0.2, "center": [0, 0.5, 0]}}
    first, second = at(balls | {"c": {"type": "point", "position": [1, 1, 1]}}, POINTS)
    a = abs(np.linalg.norm(POINTS, axis=1) - 1)
    b = abs(np.linalg.norm(POINTS - [0, 0.5, 0], axis=1) - 0.2)
    exact = np.sort([a, b, np.linalg.norm(POINTS - 1, axis=1)], axis=0)
    assert first == pytest.approx(exact[0], abs=1e-6)
    assert second == pytest.approx(exact[1], abs=1e-6)


def test_flat_faces():
    """A grid of 96 voxels along a side: inside at most 4 of them less than it is, 2.8 on average
    over distances of 15, of which 3 % are 0.35."""
    turned = mi.ScalarTransform4f().rotate([1, 2, 3], 40)
    mesh = mi.load_dict({"type": "cube", "to_world": turned})
    corners = np.array(mesh.vertex_positions_buffer()).reshape(-1, 3)
    faces = corners[np.array(mesh.faces_buffer()).reshape(-1, 3)]
    first, _ = at({"cube": {"type": "cube", "to_world": turned}}, POINTS)
    exact = np.array([distances(faces - p).min() for p in POINTS])
    low, high = corners.min(axis=0), corners.max(axis=0)
    inside = ((low < POINTS) & (high > POINTS)).all(axis=1)
    assert (first <= exact + 1e-6).all()
    less = (exact[inside] - first[inside]) / ((high - low).max() / 96)
    assert (less < 4).all()
    assert less[first[inside] > 0].mean() == pytest.approx(2.8, abs=0.2)


def test_what_is_not_known():
    from relume.integrators.clearances import Clearances

    scene = mi.load_dict({"type": "scene", "a": {"type": "cylinder"}})
    assert not Clearances(scene, True).known
