"""Normals of vertices."""

import numpy as np

from relume.translator.obj import read_obj
from relume.translator.obj_model import vertex_normals
from tests.translator.obj_files import write


def test_vertex_normals_weigh_by_area():
    """Proves: two faces at a right angle with areas 1/2 and 1 give (0, -2, 1)/√5 at their edge.

    Face 0-1-2 in z = 0 has normal +z and area 1/2; face 0-1-3 in y = 0, with vertex 3 at z = 2, has
    normal -y and area 1. An unused vertex gets +z.
    """
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2], [9, 9, 9]], float)
    normals = vertex_normals(vertices, np.array([[0, 1, 2], [0, 1, 3]]))
    edge = np.array([0, -2, 1]) / np.sqrt(5)
    expected = [edge, edge, [0, 0, 1], [0, -1, 0], [0, 0, 1]]
    np.testing.assert_allclose(normals, expected, atol=1e-15)


def test_smooth_normals_cross_seams(tmp_path):
    """Proves: corners that differ only in uv or material get the same averaged normal."""
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2\nvt 0 0\nvt 1 1\n"
    found = read_obj(write(tmp_path, text + "f 1/1 2/1 3/1\nusemtl m\nf 1/2 2/2 4/2\n"))
    edge = np.array([0, -2, 1]) / np.sqrt(5)
    for group in found.groups:
        np.testing.assert_allclose(found.smooth_normals(group)[:2], [edge, edge], atol=1e-15)
