"""OBJ files: every form of the language, one mesh per material, located errors, and the scan.

The files are written here; expected meshes follow from the text by hand.
"""

import os
import time
from pathlib import Path

import numpy as np
import pytest

from relume.translator import obj_model, obj_scan, obj_text
from relume.translator.obj import read_obj
from relume.translator.obj_model import MeshError, vertex_normals
from relume.translator.obj_scan import stock_obstacle
from relume.translator.outcomes import make_note

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)


def _write(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "mesh.obj"
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return path


def _group(tmp_path, text):
    found = read_obj(_write(tmp_path, text))
    assert len(found.groups) == 1
    return found.groups[0]


def _triangles(group):
    """Corner positions, the order of vertices aside."""
    return group.vertices[group.faces].tolist()


def _expect(*faces):
    return [POINTS[list(face)].tolist() for face in faces]


@pytest.mark.parametrize(
    "body",
    [
        "f 1 2 3\n",
        "f 1/ 2/ 3/\n",
        "f +1 +2 +3\n",
        "f -4 -3 -2\n",
        "  \tf 1 2 3",
        "f\t1\t2  3 \t\n",
        "f 1 2 3 # the lower half\n",
        "# comment \\\nf 1 2 3\n",
        "f 1 2 \\\n3\n",
        "f 1 \\\n2 \\\n3\n",
        "g a\no b\ns off\nf 1 2 3\n\n\n",
    ],
)
@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_forms_of_a_triangle(tmp_path, body, ends):
    """Proves: signs, blanks, comments, continued lines and all line ends give the same triangle."""
    group = _group(tmp_path, (SQUARE + body).replace("\n", ends))
    assert _triangles(group) == _expect((0, 1, 2))
    assert len(group.vertices) == 3
    assert (group.normals, group.uv, group.colors, group.material) == (None,) * 4
    assert (group.vertices.dtype, group.faces.dtype) == (np.float64, np.int32)


def test_indented_lines_among_others(tmp_path):
    """Proves: leading blanks do not matter in any line of a run of equal lines."""
    text = "v 0 0 0\n  v 1 0 0\n\tv 1 1 0\nv 0 1 0\nf 1 2 3\n \t f 2 3 4\nf 1 3 4\n"
    assert _triangles(_group(tmp_path, text)) == _expect((0, 1, 2), (1, 2, 3), (0, 2, 3))


def test_numbers_keep_double_precision(tmp_path):
    """Proves: numbers are the doubles that Python reads, exponents and bare points included."""
    words = ["0.1", "-1e-3", "+2.E5", ".5", "-.25e+2", "123456.789012345678", "7", "0", "1e-300"]
    text = "".join(f"v {' '.join(words[k : k + 3])}\n" for k in (0, 3, 6))
    group = _group(tmp_path, text + "f 1 2 3\n")
    assert group.vertices.ravel().tolist() == [float(word) for word in words]


@pytest.mark.parametrize("form", ["{:.6f}", "{:g}", "{:e}", "{:.0f}.", "{:+.15g}", "{!r}"])
def test_conversion_agrees_with_python(tmp_path, form):
    """Proves: 3000 numbers in each usual form are bit for bit what Python's float makes of them."""
    values = np.random.default_rng(5).normal(0, 1, 3000)
    values *= 10.0 ** np.tile([-7, -2, 0, 1, 4, 9], 500)
    words = [form.format(float(value)) for value in values]
    text = "".join(f"v {' '.join(words[k : k + 3])}\n" for k in range(0, 3000, 3))
    found = read_obj(_write(tmp_path, text + "f 1 2 3\n"))
    assert found.positions.ravel().tolist() == [float(word) for word in words]


def test_quads_and_polygons(tmp_path):
    """Proves: a quad is 0-1-2 and 0-2-3 (2-3-0 turned), a convex pentagon a fan."""
    group = _group(tmp_path, SQUARE + "f 1 2 3\nf 1 2 3 4\n")
    assert _triangles(group) == _expect((0, 1, 2), (0, 1, 2), (0, 2, 3))
    found = read_obj(_write(tmp_path, SQUARE + "f 2 3 4 1 2\nf 1 2 3\n"))
    assert _triangles(found.groups[0]) == _expect((1, 2, 3), (1, 3, 0), (1, 0, 1), (0, 1, 2))
    assert found.notes == []


@pytest.mark.parametrize(
    ("face", "has_uv", "has_normals"),
    [
        ("f 1/1 2/2 3/3\n", True, False),
        ("f 1//1 2//1 3//1\n", False, True),
        ("f 1/1/1 2/2/1 3/3/1\n", True, True),
        ("f -4/-3/-1 -3/-2/-1 -2/-1/-1\n", True, True),
        ("f -4//-1 2//1 -2//1\n", False, True),
    ],
)
def test_texture_coordinates_and_normals(tmp_path, face, has_uv, has_normals):
    """Proves: all corner forms; v stays upwards; normals come back as unit vectors."""
    text = SQUARE + "vt 0 0.25\nvt 0.5 0.5 0\nvt 1 1\nvn 0 0 5\n" + face
    group = _group(tmp_path, text)
    corner = group.faces[0]
    assert (group.uv is not None, group.normals is not None) == (has_uv, has_normals)
    if has_uv:
        assert group.uv[corner].tolist() == [[0, 0.25], [0.5, 0.5], [1, 1]]
    if has_normals:
        assert group.normals.tolist() == [[0, 0, 1]] * 3


def test_negative_indices_count_from_their_line(tmp_path):
    """Proves: -1 is the last vertex above the face, not the last of the file."""
    group = _group(tmp_path, "v 9 9 9\n" + SQUARE[:24] + "f -3 -2 -1\nv 7 7 7\n")
    assert _triangles(group) == _expect((0, 1, 2))


def test_one_index_per_triple(tmp_path):
    """Proves: corners are shared if and only if v, vt and vn agree."""
    text = SQUARE + "vt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n"
    faces = "f 1/1/1 2/1/1 3/1/1\nf 1/2/1 3/1/1 4/1/1\nf 1/1/1 3/1/2 4/1/1\n"
    group = _group(tmp_path, text + faces)
    triples = [(0, 0, 2), (1, 0, 2), (2, 0, 2), (0, 1, 2), (2, 0, 2), (3, 0, 2), (0, 0, 2),
               (2, 0, 1), (3, 0, 2)]  # vertex, u, axis of the normal
    assert len(group.vertices) == len(set(triples)) == 6
    corners = group.faces.ravel()
    axes = group.normals[corners].argmax(axis=1)
    found = zip(group.source[corners], group.uv[corners, 0], axes, strict=True)
    assert [tuple(map(int, triple)) for triple in found] == triples


def test_unify_against_a_dictionary():
    """Proves: on random corners the new vertices are exactly the distinct triples."""
    rng = np.random.default_rng(3)
    for size, top in ((300, 20), (30, 5000)):
        corners = rng.integers(0, (top, 3, 2), (size, 3))
        source, pairs, index = obj_text.unify(corners)
        assert np.array_equal(np.column_stack([source[index], pairs[index]]), corners)
        assert len(source) == len({tuple(corner) for corner in corners.tolist()})


def test_groups_by_material(tmp_path):
    """Proves: one mesh per material in order of appearance; names ignore case."""
    text = ("mtllib a b.mtl\nmtllib c.mtl\n" + SQUARE + "f 1 2 3\nusemtl Red\nf 1 2 3\n"
            "usemtl 木 x\nf 2 3 4\nusemtl unused\nusemtl RED\nf 1 3 4\nmtllib d.mtl\n")
    for encoding in ("utf-8", "utf-8-sig", "cp932"):
        found = read_obj(_write(tmp_path, text, encoding))
        materials = [(g.material, g.line) for g in found.groups]
        assert materials == [(None, None), ("Red", 8), ("木 x", 10)]
        assert _triangles(found.groups[1]) == _expect((0, 1, 2), (0, 2, 3))
        assert _triangles(found.groups[2]) == _expect((1, 2, 3))
        assert [len(g.vertices) for g in found.groups] == [3, 4, 3]
        assert found.mtllib == [(1, "a b.mtl"), (2, "c.mtl"), (15, "d.mtl")]
        assert not found.notes


def test_cp932_name_ending_in_a_backslash_byte(tmp_path):
    """Proves: the second byte of a cp932 letter may be 0x5C and does not continue the line."""
    text = SQUARE + "usemtl 表\nf 1 2 3\n"
    assert text.encode("cp932").count(b"\\\n") == 1
    assert read_obj(_write(tmp_path, text, "cp932")).groups[0].material == "表"


def test_vertex_colours_need_the_last_vertex(tmp_path):
    """Proves: colours count if the last v line has six numbers; further numbers are ignored."""
    coloured = "v 0 0 0 1 0 0\nv 1 0 0 0 .5 0 7\nv 1 1 0 0 0 0.25\n"
    group = _group(tmp_path, coloured + "f 3 2 1\n")
    assert group.colors[group.faces[0]].tolist() == [[0, 0, 0.25], [0, 0.5, 0], [1, 0, 0]]
    assert _group(tmp_path, coloured + "v 0 1 0\nf 1 2 3\n").colors is None
    found = read_obj(_write(tmp_path, "v 5 5 5\n" + coloured + "f 1 2 3\n"))
    assert found.groups[0].colors[0].tolist() == [1, 1, 1]
    assert found.notes == [(1, make_note("vertices-without-color", count=1))]


def test_corners_without_a_normal_get_that_of_their_vertex(tmp_path):
    """Proves: only corners without a normal of some length get a mean one, and a note says so."""
    given = SQUARE + "vn 0 0.6 0.8\nvn 0 0 0\nusemtl m\nf 1//1 2//1 3//1\n"
    for bare in ("f 1 3 4\n", "f 1//2 3//2 4//2\n"):
        found = read_obj(_write(tmp_path, given + bare))
        group = found.groups[0]
        np.testing.assert_allclose(group.normals[group.faces[0]], [[0, 0.6, 0.8]] * 3)
        np.testing.assert_allclose(group.normals[group.faces[1]], [[0, 0, 1]] * 3)
        assert found.notes == [(9, make_note("corners-without-normal", count=1))]
    mixed = _group(tmp_path, given + "f 1//1 3//2 4//1\n")
    given = [0, 0.6, 0.8]
    np.testing.assert_allclose(mixed.normals[mixed.faces[1]], [given, [0, 0, 1], given])
    none = read_obj(_write(tmp_path, SQUARE + "vn 0 0 0\nf 1//1 2//1 3//1\n"))
    assert none.groups[0].normals is None
    assert len(none.notes) == 1


def test_faces_without_texture_coordinates_do_not_drop_those_of_others(tmp_path):
    """Proves: one corner without ``vt`` costs its own face the picture, not its material."""
    text = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3 4/3\n"
    found = read_obj(_write(tmp_path, text))
    group = found.groups[0]
    assert group.uv[group.faces[0]].tolist() == [[0, 0], [1, 0], [1, 1]]
    assert group.uv[group.faces[1]].tolist() == [[0, 0]] * 3
    assert found.notes == [(9, make_note("corners-without-texture-coordinate", count=1))]


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
            group = _group(tmp_path, lines + face)
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
    found = read_obj(_write(tmp_path, lines + "usemtl a\nf 1 2 3 4 5 6\nusemtl b\nf 4 5 6\n"))
    assert _area(found.groups[0]) == pytest.approx(6.0, rel=1e-2)
    assert len(found.groups[0].faces) == 4
    assert len(found.groups[1].faces) == 1
    assert found.notes == [(8, make_note("concave-faces", count=1))]


@pytest.mark.parametrize(
    ("text", "code", "values"),
    [
        (SQUARE + "vt 0.5\nvt 1\nf 1/1 2/2 3/1\n", None, {}),
        (SQUARE + "f 1//1 2//1 3//1\n",
         "attribute-missing", {"count": 1, "attribute": "normal"}),
        (SQUARE + "f 1/1 2/1 3/1\n",
         "attribute-missing", {"count": 1, "attribute": "texture coordinate"}),
        (SQUARE + "f 1 2\nf 1 2 3\nf\n", "faces-of-few-corners", {"count": 2}),
        (SQUARE + "v 0 0 0 nan 0 0\nf 1 2 3\n",
         "colors-not-finite", {"count": 1}),
    ],
)
def test_harmless_mistakes_are_noted(tmp_path, text, code, values):
    """Proves: what is usable is used, and what was left out is said."""
    found = read_obj(_write(tmp_path, text))
    assert _triangles(found.groups[0]) == _expect((0, 1, 2))
    assert code is None or (5, make_note(code, **values)) in found.notes


@pytest.mark.parametrize("word", ["nan", "-NaN", "-nan(ind)", "inf", "-1.#IND", "1.#QNAN", "1e999"])
def test_normals_and_texture_coordinates_that_are_no_numbers(tmp_path, word):
    """Proves: such a normal counts as none, such a coordinate as 0, others stay; notes say so."""
    text = f"vn 0 0.6 0.8\nvn 0 {word} 1\nvt 0.5 {word}\nvt 0.25 1\nf 1/1/1 2/2/2 3/2/1\n"
    found = read_obj(_write(tmp_path, SQUARE + text))
    group = found.groups[0]
    corners = group.faces[0]
    np.testing.assert_allclose(group.normals[corners], [[0, 0.6, 0.8], [0, 0, 1], [0, 0.6, 0.8]])
    assert group.uv[corners].tolist() == [[0.5, 0], [0.25, 1], [0.25, 1]]
    assert found.notes[:2] == [
        (6, make_note("normals-not-finite", count=1)),
        (7, make_note("texture-coordinates-not-finite", count=1)),
    ]
    with pytest.raises(MeshError, match=r":5:5: .* is not a finite number"):
        read_obj(_write(tmp_path, f"{SQUARE}v 0 {word} 0\nf 1 2 3\n"))


@pytest.mark.parametrize("length", ["1e200", "1e-200"])
def test_normals_of_extreme_length(tmp_path, length):
    """Proves: their squares neither overflow nor vanish."""
    group = _group(tmp_path, SQUARE + f"vn 0 {length} {length}\nf 1//1 2//1 3//1\n")
    np.testing.assert_allclose(group.normals, [[0, 0.5**0.5, 0.5**0.5]] * 3)


def test_colour_that_is_no_number(tmp_path):
    """Proves: it counts as 1, the other channels as they are."""
    vertices = SQUARE.replace("v 0 1 0", "v 0 1 0 inf 0.25 -nan")
    group = _group(tmp_path, vertices + "f 1 2 4\n")
    assert group.colors.tolist() == [[1, 1, 1], [1, 1, 1], [1, 0.25, 1]]


def test_time_grows_with_length(tmp_path):
    """Proves: many materials and libraries take no more than their share.

    With a search from the start of the file for each of them, eight times as many took 64 times as
    long; they may take 16 times as long, on a busy machine, too.
    """

    def seconds(text, count):
        path = _write(tmp_path, text)
        start = time.process_time()
        found = read_obj(path)
        assert max(len(found.mtllib), len(found.groups)) == count
        return time.process_time() - start

    def libraries(count):
        return "".join(f"mtllib {k}.mtl\n" for k in range(count)) + SQUARE + "f 1 2 3\n"

    def materials(count):
        faces = (f"usemtl m{k}\nv {k} 0 0\nf {k + 5} 2 3\n" for k in range(count))
        return SQUARE + "".join(faces)

    for text, few in ((libraries, 10000), (materials, 1000)):
        base = min(seconds(text(few), few) for _ in range(2))
        assert seconds(text(8 * few), 8 * few) < 16 * base


def test_unknown_lines_are_noted_once(tmp_path):
    """Proves: what is skipped is reported, by word, with its first line."""
    found = read_obj(_write(tmp_path, SQUARE + "l 1 2\nl 2 3\nfx 1\nvp 1 2\n#x\ng\nf 1 2 3\n"))
    assert [line for line, _ in found.notes] == [5, 7, 8]


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
    found = read_obj(_write(tmp_path, text + "f 1/1 2/1 3/1\nusemtl m\nf 1/2 2/2 4/2\n"))
    edge = np.array([0, -2, 1]) / np.sqrt(5)
    for group in found.groups:
        np.testing.assert_allclose(found.smooth_normals(group)[:2], [edge, edge], atol=1e-15)


@pytest.mark.parametrize(
    ("text", "line", "column", "message"),
    [
        (SQUARE + "f 0 1 2\n", 5, 3, "index 0"),
        (SQUARE + "f 1 2 5\n", 5, 7, "'5' names no vertex: there are 4"),
        (SQUARE + "f 1 2 -5\n", 5, 7, "'-5' names no vertex"),
        (SQUARE + "vt 0 0\nf 1/2 2/1 3/1\n", 6, 3, "'1/2' names no texture coordinate: there"),
        (SQUARE + "vn 0 0 1\n  f 1//1 2//2 3//1\n", 6, 10, "'2//2' names no normal: there are 1"),
        (SQUARE + "f 1 2 \\\n 7\n", 6, 2, "names no vertex"),
        (SQUARE + "vt 0 0\nf 1/0 2/1 3/1\n", 6, 3, "index 0"),
        (SQUARE + "f 1 2\n", 5, 1, "2 of at least 3 corners"),
        (SQUARE + "f\n", 5, 1, "0 of at least 3 corners"),
        (SQUARE + "v 1 2e39 0\nf 1 2 5\n", 5, 1, "a vertex beyond single precision"),
        (SQUARE + "f 1 2 x\n", 5, 7, "'x' is no corner"),
        (SQUARE + "f 1 2\x0b3 9\n", 5, 9, "'9' names no vertex"),
        (SQUARE + "v 1\x110 x\n", 5, 7, "'x' is not a finite number"),
        (SQUARE + "v 1 2\x11\nf 1 2 3\n", 5, 1, "vertex with 2 of 3 numbers"),
        (SQUARE + "f 1 2 3.0\n", 5, 7, "'3.0' is no corner"),
        (SQUARE + "f 1 /2 3\n", 5, 5, "'/2' is no corner"),
        (SQUARE + "f 1/1/1/1 2 3\n", 5, 3, "is no corner"),
        (SQUARE + "f 1 2///1 3\n", 5, 5, "is no corner"),
        (SQUARE + "f 1-2 2 3\n", 5, 3, "is no corner"),
        (SQUARE + "f f1 2 3\n", 5, 3, "is no corner"),
        (SQUARE + "f 1 2 " + "9" * 30 + "\n", 5, 7, "too many digits"),
        (SQUARE + "f 1 2 " + "9" * 16 + "\n", 5, 7, "names no vertex"),
        ("v 0 0\nf 1 1 1\n", 1, 1, "vertex with 2 of 3 numbers"),
        ("# a\n\n\tv 0 nan 0\nf 1 1 1\n", 3, 6, "'nan' is not a finite number"),
        ("v 0 0 -inf\nf 1 1 1\n", 1, 7, "'-inf' is not"),
        ("v 0 0 1e999\nf 1 1 1\n", 1, 7, "'1e999' is not"),
        ("v 0,5 0 0\nf 1 1 1\n", 1, 3, "'0,5' is not"),
        ("v 0 0 1.2.3\nf 1 1 1\n", 1, 7, "'1.2.3' is not"),
        ("v 0 0 1-2\nf 1 1 1\n", 1, 7, "'1-2' is not"),
        ("v 0 0 1_0\nf 1 1 1\n", 1, 7, "'1_0' is not"),
        ("v 0 0 0x10\nf 1 1 1\n", 1, 7, "'0x10' is not"),
        ("v 0 0 t\nf 1 1 1\n", 1, 7, "'t' is not"),
        ("v 0 0 0\nvt\nf 1 1 1\n", 2, 1, "texture coordinate with 0 of 1 numbers"),
        ("v 0 0 0\nvn 1 0 e\nf 1 1 1\n", 2, 8, "'e' is not"),
        (SQUARE, None, None, "no faces"),
        ("", None, None, "no faces"),
        ("\\\n\\\n", None, None, "no faces"),
        (b"v 0 0 0\n\0\0\0", 2, None, "binary"),
        ("v 0 0 0\nf 1 1 1\n".encode("utf-16"), 1, None, "binary"),
    ],
)
def test_located_errors(tmp_path, text, line, column, message):
    """Proves: a broken file is a `MeshError` with path, line, column and reason."""
    path = _write(tmp_path, text)
    with pytest.raises(MeshError) as caught:
        read_obj(path)
    assert (caught.value.line, caught.value.column) == (line, column)
    assert message in caught.value.message
    assert str(caught.value).startswith(str(path))


def test_no_regular_file(tmp_path, monkeypatch):
    """Proves: missing files, directories, pipes, monsters and bad names are errors, at once."""
    os.mkfifo(tmp_path / "pipe")
    big = tmp_path / "big.obj"
    with open(big, "wb") as file:
        file.truncate(obj_model.MAX_BYTES + 1)
    for path, message in [(tmp_path / "absent", "does not exist"), (tmp_path, "not a regular"),
                          (tmp_path / "pipe", "not a regular file"), (big, "larger than 1024 MiB"),
                          ("a\0b", "null|not exist")]:
        for read in (read_obj, stock_obstacle):
            with pytest.raises(MeshError, match=message):
                read(path)


def test_hostile_files_end_soon(tmp_path):
    """Proves: long lines, many materials, blanks and backslashes cost no more than their length."""
    names = "".join(f"usemtl m{k}\nf 1 2 3\n" for k in range(3000))
    assert len(read_obj(_write(tmp_path, SQUARE * 3000 + names)).groups) == 3000
    long = SQUARE + "f " + "1 2 3 " * 50000 + "\n"
    assert len(_group(tmp_path, long).faces) == 149998
    _group(tmp_path, SQUARE + "f 1 2 3" + " \\\n4" * 20000 + "\n")
    _group(tmp_path, SQUARE + " " * 2000000 + "f 1 2 3\n" + "\\\n" * 100000)
    with pytest.raises(MeshError):
        read_obj(_write(tmp_path, "v" * 3000000))
    assert stock_obstacle(_write(tmp_path, "v" * 3000000))


@pytest.mark.parametrize(
    "text",
    [
        SQUARE + "f 1 2 3\nf 1 3 4\n",
        "# made\n\n" + SQUARE + "g a\nf 1 2 3\ns 1\nf 2 3 4",
        (SQUARE + "f 1 2 3 \nf  1 2\t4\n").replace("\n", "\r\n"),
        SQUARE + "vt 0 0\nvt 1 1 0\nf 1/1 2/2 3/1\nf 1/1 2/1 4/1\n",
        SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\n" * 2,
        "v 1e-05 -1.5E+3 .5\nv 1 1 1\nv 2. 2 -0 1\nvt 0 0\nvn 0 1 0\nf 1/1/1 2/1/1 3/1/1\n",
        "v 0 0 0 1 0 0\n" + SQUARE + "f 1 2 3\n",
    ],
)
def test_plain_files(tmp_path, text):
    """Proves: files that Mitsuba's reader handles are told to be plain."""
    assert stock_obstacle(_write(tmp_path, text)) == ""


@pytest.mark.parametrize(
    "text",
    [
        "usemtl a\n" + SQUARE + "f 1 2 3\n",
        "mtllib a\n" + SQUARE + "f 1 2 3\n",
        SQUARE + "v 0 0 0 1 0 0\nf 1 2 3\n",
        SQUARE + "f -1 -2 -3\n",
        SQUARE + "f 1 2 3 4 1\n",
        SQUARE + "f 1 2 3 4\n",
        "f 1 2 3\n" + SQUARE,
        SQUARE + "f 1 2 5\n" + SQUARE,
        SQUARE + "f 1 2 3\nf 1 2 9\n",
        SQUARE * 3 + "f 1 2 13\n",
        SQUARE * 3 + "f 1 2 12\nf 1 2 21\n",
        SQUARE + "vt 0 0\nf 1/1 2/2 3/1\n",
        SQUARE + "vn 0 0 1\nf 1//1 2//1 3//2\n",
        SQUARE + "vn 0 0 1\nvn 0 -0.0 0\nf 1//1 2//1 3//2\n",
        SQUARE + "v 1e39 0 0\nf 1 2 5\n",
        SQUARE + "v 1" + "0" * 40 + " 0 0\nf 1 2 5\n",
        SQUARE + "f 1 2 \\\n3\n",
        SQUARE + "f 1 2\nf 1 2 3\n",
        SQUARE + "f 1 2 0\n",
        SQUARE + "f 1 2 3\nf 1 2 0\n",
        SQUARE + "f 1 2 9999999999999\n",
        SQUARE + "f 1 2 3.0\n",
        SQUARE + "f 1 2 3x\n",
        SQUARE + "f1 2 3 4\nf 1 2 3\n",
        SQUARE + "v1 2 3 4\nf 1 2 3\n",
        SQUARE + "f\nf 1 2 3\n",
        SQUARE + "vn 0 0 1\nf 1 2 3\n",
        SQUARE + "vt 0 0\nf 1 2 3\n",
        SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 3\n",
        SQUARE + "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\nf 1//1 2//1 3//1\n",
        SQUARE + "vn 0 0 1\nf 1 2 3//1\n",
        SQUARE + "vt 0 0\nf 1/0 2/1 3/1\n",
        SQUARE + "vt 0 0\nf 1/ 2/ 3/\n",
        SQUARE + "v 1.2.3 0 0\nf 1 2 3\n",
        SQUARE + "v 1-2 0 0\nf 1 2 3\n",
        SQUARE + "v 1e5.3 0 0\nf 1 2 3\n",
        SQUARE + "v 1e5e5 0 0\nf 1 2 3\n",
        SQUARE + "v 1d5 0 0\nf 1 2 3\n",
        SQUARE + "v 1 0 0 e5\nf 1 2 3\n",
        SQUARE + "v 0 0 nan\nf 1 2 3\n",
        SQUARE + "l 1 2\nf 1 2 3\n",
        (SQUARE + "f 1 2 3\n").replace("\n", "\r"),
        SQUARE,
        "",
        SQUARE + "\0\nf 1 2 3\n",
        " " + SQUARE + "f 1 2 3\n",
    ],
)
def test_files_that_are_not_plain(tmp_path, text):
    """Proves: what Mitsuba's reader ignores, refuses or reads from stale memory is not plain."""
    assert stock_obstacle(_write(tmp_path, text))


def test_plain_does_not_depend_on_blocks(tmp_path, monkeypatch):
    """Proves: mistakes are found at any offset, whatever block of the scan they fall into."""
    vertices, faces = SQUARE * 40, "f 1 2 3\n" * 60
    for block in (64, 1000):
        monkeypatch.setattr(obj_scan.PlainScan, "BLOCK", block)
        assert stock_obstacle(_write(tmp_path, vertices + faces)) == ""
        for bad in ("f 1 2\n", "f 1 2 0\n", "f 1  2\n", "f 1 2 3 4\n", "f 1//1 2//1 3//1\n",
                    "usemtl a\n", "f 1 2 161\n"):
            for at in (0, 30, 60):
                cut = at * len("f 1 2 3\n")
                text = vertices + faces[:cut] + bad + faces[cut:]
                assert stock_obstacle(_write(tmp_path, text))


def _corpus():
    given = os.environ.get("RELUME_CORPUS")
    root = Path(given) if given else Path(__file__).parents[3] / "shared" / "assets"
    found = sorted(root.rglob("*.obj"))
    return found or [pytest.param(None, marks=pytest.mark.skip(reason=f"no meshes in {root}"))]


@pytest.mark.parametrize("path", _corpus(), ids=lambda p: p and p.name)
def test_meshes_of_the_corpus(path):
    """Proves: the meshes at hand read, one triangle for each of their faces, all inside."""
    found = read_obj(path)
    lines = path.read_bytes().splitlines()
    corners = [len(line.split()) - 1 for line in lines if line.startswith(b"f ")]
    assert sum(len(group.faces) for group in found.groups) == sum(n - 2 for n in corners)
    for group in found.groups:
        assert group.faces.max() == len(group.vertices) - 1
        assert np.isfinite(group.vertices).all()
