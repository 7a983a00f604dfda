"""The OBJ reader against an independent one, trimesh, on a mesh with every common form of face."""

import numpy as np
import trimesh

from relume.translator.obj import read_obj

GROUPS = 3
"""Materials of the test mesh."""


def write(path):
    """A bumpy grid of quads and triangles in several materials, with texture coordinates."""
    rng = np.random.default_rng(5)
    side = 12
    lines = []
    for y in range(side):
        for x in range(side):
            lines.append(f"v {x} {rng.uniform():.6f} {y}\nvt {x / side:.6f} {y / side:.6f}")
    for y in range(side - 1):
        lines.append(f"usemtl m{y % GROUPS}")
        for x in range(side - 1):
            a = y * side + x + 1
            corners = [a, a + side, a + side + 1, a + 1]
            if rng.uniform() < 0.5:
                lines.append("f " + " ".join(f"{c}/{c}" for c in corners))
            else:
                lines.append("f " + " ".join(f"{c}/{c}" for c in corners[:3]))
                lines.append("f " + " ".join(f"{c}/{c}" for c in (corners[0], *corners[2:])))
    path.write_text("\n".join(lines) + "\n")


def soup(vertices, faces):
    """Triangles as sorted rows of nine rounded coordinates, each from its smallest corner on."""
    corners = np.round(np.asarray(vertices)[np.asarray(faces)], 5)
    first = [min(range(3), key=lambda k, t=t: tuple(t[k])) for t in corners]
    turned = [np.roll(t, -k, axis=0).ravel() for t, k in zip(corners, first, strict=True)]
    return sorted(map(tuple, turned))


def test_agrees_with_trimesh(tmp_path):
    """Both readers find the same triangles with the same winding."""
    path = tmp_path / "grid.obj"
    write(path)
    ours = read_obj(path)
    peer = trimesh.load(path, process=False, force="mesh")
    assert len(ours.groups) == GROUPS
    found = [t for group in ours.groups for t in soup(group.vertices, group.faces)]
    assert sorted(found) == soup(peer.vertices, peer.faces)
