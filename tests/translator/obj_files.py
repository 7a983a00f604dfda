"""OBJ files of tests: written by text, and what reading them gives."""

import numpy as np

from relume.translator.obj import read_obj

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)


def write(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "mesh.obj"
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return path


def group_of(tmp_path, text):
    found = read_obj(write(tmp_path, text))
    assert len(found.groups) == 1
    return found.groups[0]


def triangles(group):
    """Corner positions, the order of vertices aside."""
    return group.vertices[group.faces].tolist()


def expect(*faces):
    return [POINTS[list(face)].tolist() for face in faces]
