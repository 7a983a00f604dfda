"""Polygons of any shape, and corners that lack an attribute."""

import numpy as np
import pytest

from relume.translator.obj import read_obj
from relume.translator.outcomes import make_note
from tests.translator.obj_files import SQUARE, expect, group_of, triangles, write


def test_quads_and_polygons(tmp_path):
    """Proves: a quad is 0-1-2 and 0-2-3 (2-3-0 turned), a convex pentagon a fan."""
    group = group_of(tmp_path, SQUARE + "f 1 2 3\nf 1 2 3 4\n")
    assert triangles(group) == expect((0, 1, 2), (0, 1, 2), (0, 2, 3))
    found = read_obj(write(tmp_path, SQUARE + "f 2 3 4 1 2\nf 1 2 3\n"))
    assert triangles(found.groups[0]) == expect((1, 2, 3), (1, 3, 0), (1, 0, 1), (0, 1, 2))
    assert found.notes == []


def _area(group):
    a, b, c = (group.vertices[group.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def _turned(points, seed):
    """Points under a random rotation."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(points, float) @ (q * np.sign(np.linalg.det(q))).T


@pytest.mark.parametrize(
    ("outline", "area"),
    [
        # an arrow head, 8 - 6, and a wider one, 8 - 2
        ([(0, 0), (4, -2), (1.0, 0), (4, 2)], 2.0),
        ([(0, 0), (4, -2), (3.0, 0), (4, 2)], 6.0),
        # an L and a U
        ([(2, 1), (2, 2), (0, 2), (0, 0), (4, 0), (4, 1)], 6.0),
        ([(0, 0), (5, 0), (5, 3), (4, 3), (4, 1), (1, 1), (1, 3), (0, 3)], 9.0),
        # a frame: the hole is joined to the outline by an edge there and back
        ([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], 12.0),
        # corners in a line, and a convex outline
        ([(0, 0), (1, 0), (2, 0), (2, 2), (1, 1.0), (0, 2)], 3.0),
        ([(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2)], 4.0),
    ],
)
def test_concave_faces_do_not_fold_over(tmp_path, outline, area):
    """Proves: the area is that of the outline (shoelace) and no triangle is turned, from any first
    corner, in any plane, in both senses."""
    for first in range(len(outline)):
        for turn in (1, -1):
            order = (outline[first:] + outline[:first])[::turn]
            points = _turned([(x, y, 0) for x, y in order], first)
            normal = _turned([(0, 0, 1)], first)[0] * np.sign(_shoelace(order))
            lines = "".join("v {!r} {!r} {!r}\n".format(*map(float, p)) for p in points)
            face = "f " + " ".join(str(k + 1) for k in range(len(points))) + "\n"
            group = group_of(tmp_path, lines + face)
            assert _area(group) == pytest.approx(area, rel=1e-12)
            a, b, c = (group.vertices[group.faces[:, k]] for k in range(3))
            assert (np.cross(b - a, c - a) @ normal > -1e-12).all()


def _shoelace(outline):
    x, y = np.array(outline, float).T
    return (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2


def test_concave_faces_out_of_plane(tmp_path):
    """Proves: corners a little out of plane make no difference but their own."""
    outline = [(4, 1, 0), (2, 1, 0.05), (2, 2, 0), (0, 2, 0.03), (0, 0, 0), (4, 0, 0.04)]
    lines = "".join("v {} {} {}\n".format(*p) for p in outline)
    found = read_obj(write(tmp_path, lines + "usemtl a\nf 1 2 3 4 5 6\nusemtl b\nf 4 5 6\n"))
    assert _area(found.groups[0]) == pytest.approx(6.0, rel=1e-2)
    assert len(found.groups[0].faces) == 4
    assert len(found.groups[1].faces) == 1
    assert found.notes == [(8, make_note("concave-faces", count=1))]


def test_corners_without_a_normal_get_that_of_their_vertex(tmp_path):
    """Proves: only corners without a normal of some length get a mean one, and a note says so."""
    given = SQUARE + "vn 0 0.6 0.8\nvn 0 0 0\nusemtl m\nf 1//1 2//1 3//1\n"
    for bare in ("f 1 3 4\n", "f 1//2 3//2 4//2\n"):
        found = read_obj(write(tmp_path, given + bare))
        group = found.groups[0]
        np.testing.assert_allclose(group.normals[group.faces[0]], [[0, 0.6, 0.8]] * 3)
        np.testing.assert_allclose(group.normals[group.faces[1]], [[0, 0, 1]] * 3)
        assert found.notes == [(9, make_note("corners-without-normal", count=1))]
    mixed = group_of(tmp_path, given + "f 1//1 3//2 4//1\n")
    given = [0, 0.6, 0.8]
    np.testing.assert_allclose(mixed.normals[mixed.faces[1]], [given, [0, 0, 1], given])
    none = read_obj(write(tmp_path, SQUARE + "vn 0 0 0\nf 1//1 2//1 3//1\n"))
    assert none.groups[0].normals is None
    assert len(none.notes) == 1


def test_faces_without_texture_coordinates_do_not_drop_those_of_others(tmp_path):
    """Proves: one corner without ``vt`` costs its own face the picture, not its material."""
    text = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3 4/3\n"
    found = read_obj(write(tmp_path, text))
    group = found.groups[0]
    assert group.uv[group.faces[0]].tolist() == [[0, 0], [1, 0], [1, 1]]
    assert group.uv[group.faces[1]].tolist() == [[0, 0]] * 3
    assert found.notes == [(9, make_note("corners-without-texture-coordinate", count=1))]


@pytest.mark.parametrize("length", ["1e200", "1e-200"])
def test_normals_of_extreme_length(tmp_path, length):
    """Proves: their squares neither overflow nor vanish."""
    group = group_of(tmp_path, SQUARE + f"vn 0 {length} {length}\nf 1//1 2//1 3//1\n")
    np.testing.assert_allclose(group.normals, [[0, 0.5**0.5, 0.5**0.5]] * 3)
