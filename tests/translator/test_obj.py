"""OBJ files: every form of the language, one mesh per material, and located errors.

The files are written here; expected meshes follow from the text by hand.
"""

import os
import time
from pathlib import Path

import numpy as np
import pytest

from relume.translator import obj_model
from relume.translator.obj import read_obj
from relume.translator.obj_model import MeshError
from relume.translator.obj_scan import stock_obstacle
from relume.translator.outcomes import make_note
from tests.translator.obj_files import SQUARE, expect, group_of, triangles, write


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
    group = group_of(tmp_path, (SQUARE + body).replace("\n", ends))
    assert triangles(group) == expect((0, 1, 2))
    assert len(group.vertices) == 3
    assert (group.normals, group.uv, group.colors, group.material) == (None,) * 4
    assert (group.vertices.dtype, group.faces.dtype) == (np.float64, np.int32)


def test_indented_lines_among_others(tmp_path):
    """Proves: leading blanks do not matter in any line of a run of equal lines."""
    text = "v 0 0 0\n  v 1 0 0\n\tv 1 1 0\nv 0 1 0\nf 1 2 3\n \t f 2 3 4\nf 1 3 4\n"
    assert triangles(group_of(tmp_path, text)) == expect((0, 1, 2), (1, 2, 3), (0, 2, 3))


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
    group = group_of(tmp_path, text)
    corner = group.faces[0]
    assert (group.uv is not None, group.normals is not None) == (has_uv, has_normals)
    if has_uv:
        assert group.uv[corner].tolist() == [[0, 0.25], [0.5, 0.5], [1, 1]]
    if has_normals:
        assert group.normals.tolist() == [[0, 0, 1]] * 3


def test_negative_indices_count_from_their_line(tmp_path):
    """Proves: -1 is the last vertex above the face, not the last of the file."""
    group = group_of(tmp_path, "v 9 9 9\n" + SQUARE[:24] + "f -3 -2 -1\nv 7 7 7\n")
    assert triangles(group) == expect((0, 1, 2))


def test_one_index_per_triple(tmp_path):
    """Proves: corners are shared if and only if v, vt and vn agree."""
    text = SQUARE + "vt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n"
    faces = "f 1/1/1 2/1/1 3/1/1\nf 1/2/1 3/1/1 4/1/1\nf 1/1/1 3/1/2 4/1/1\n"
    group = group_of(tmp_path, text + faces)
    triples = [(0, 0, 2), (1, 0, 2), (2, 0, 2), (0, 1, 2), (2, 0, 2), (3, 0, 2), (0, 0, 2),
               (2, 0, 1), (3, 0, 2)]  # vertex, u, axis of the normal
    assert len(group.vertices) == len(set(triples)) == 6
    corners = group.faces.ravel()
    axes = group.normals[corners].argmax(axis=1)
    found = zip(group.source[corners], group.uv[corners, 0], axes, strict=True)
    assert [tuple(map(int, triple)) for triple in found] == triples


def test_groups_by_material(tmp_path):
    """Proves: one mesh per material in order of appearance; names ignore case."""
    text = ("mtllib a b.mtl\nmtllib c.mtl\n" + SQUARE + "f 1 2 3\nusemtl Red\nf 1 2 3\n"
            "usemtl 木 x\nf 2 3 4\nusemtl unused\nusemtl RED\nf 1 3 4\nmtllib d.mtl\n")
    for encoding in ("utf-8", "utf-8-sig", "cp932"):
        found = read_obj(write(tmp_path, text, encoding))
        materials = [(g.material, g.line) for g in found.groups]
        assert materials == [(None, None), ("Red", 8), ("木 x", 10)]
        assert triangles(found.groups[1]) == expect((0, 1, 2), (0, 2, 3))
        assert triangles(found.groups[2]) == expect((1, 2, 3))
        assert [len(g.vertices) for g in found.groups] == [3, 4, 3]
        assert found.mtllib == [(1, "a b.mtl"), (2, "c.mtl"), (15, "d.mtl")]
        assert not found.notes


def test_cp932_name_ending_in_a_backslash_byte(tmp_path):
    """Proves: the second byte of a cp932 letter may be 0x5C and does not continue the line."""
    text = SQUARE + "usemtl 表\nf 1 2 3\n"
    assert text.encode("cp932").count(b"\\\n") == 1
    assert read_obj(write(tmp_path, text, "cp932")).groups[0].material == "表"


def test_vertex_colours_need_the_last_vertex(tmp_path):
    """Proves: colours count if the last v line has six numbers; further numbers are ignored."""
    coloured = "v 0 0 0 1 0 0\nv 1 0 0 0 .5 0 7\nv 1 1 0 0 0 0.25\n"
    group = group_of(tmp_path, coloured + "f 3 2 1\n")
    assert group.colors[group.faces[0]].tolist() == [[0, 0, 0.25], [0, 0.5, 0], [1, 0, 0]]
    assert group_of(tmp_path, coloured + "v 0 1 0\nf 1 2 3\n").colors is None
    found = read_obj(write(tmp_path, "v 5 5 5\n" + coloured + "f 1 2 3\n"))
    assert found.groups[0].colors[0].tolist() == [1, 1, 1]
    assert found.notes == [(1, make_note("vertices-without-color", count=1))]


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
    found = read_obj(write(tmp_path, text))
    assert triangles(found.groups[0]) == expect((0, 1, 2))
    assert code is None or (5, make_note(code, **values)) in found.notes


@pytest.mark.parametrize("word", ["nan", "-NaN", "-nan(ind)", "inf", "-1.#IND", "1.#QNAN", "1e999"])
def test_normals_and_texture_coordinates_that_are_no_numbers(tmp_path, word):
    """Proves: such a normal counts as none, such a coordinate as 0, others stay; notes say so."""
    text = f"vn 0 0.6 0.8\nvn 0 {word} 1\nvt 0.5 {word}\nvt 0.25 1\nf 1/1/1 2/2/2 3/2/1\n"
    found = read_obj(write(tmp_path, SQUARE + text))
    group = found.groups[0]
    corners = group.faces[0]
    np.testing.assert_allclose(group.normals[corners], [[0, 0.6, 0.8], [0, 0, 1], [0, 0.6, 0.8]])
    assert group.uv[corners].tolist() == [[0.5, 0], [0.25, 1], [0.25, 1]]
    assert found.notes[:2] == [
        (6, make_note("normals-not-finite", count=1)),
        (7, make_note("texture-coordinates-not-finite", count=1)),
    ]
    with pytest.raises(MeshError, match=r":5:5: .* is not a finite number"):
        read_obj(write(tmp_path, f"{SQUARE}v 0 {word} 0\nf 1 2 3\n"))


def test_colour_that_is_no_number(tmp_path):
    """Proves: it counts as 1, the other channels as they are."""
    vertices = SQUARE.replace("v 0 1 0", "v 0 1 0 inf 0.25 -nan")
    group = group_of(tmp_path, vertices + "f 1 2 4\n")
    assert group.colors.tolist() == [[1, 1, 1], [1, 1, 1], [1, 0.25, 1]]


def test_time_grows_with_length(tmp_path):
    """Proves: many materials and libraries take no more than their share.

    With a search from the start of the file for each of them, eight times as many took 64 times as
    long; they may take 16 times as long, on a busy machine, too.
    """

    def seconds(text, count):
        path = write(tmp_path, text)
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
    found = read_obj(write(tmp_path, SQUARE + "l 1 2\nl 2 3\nfx 1\nvp 1 2\n#x\ng\nf 1 2 3\n"))
    assert [line for line, _ in found.notes] == [5, 7, 8]


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
    path = write(tmp_path, text)
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
    assert len(read_obj(write(tmp_path, SQUARE * 3000 + names)).groups) == 3000
    long = SQUARE + "f " + "1 2 3 " * 50000 + "\n"
    assert len(group_of(tmp_path, long).faces) == 149998
    group_of(tmp_path, SQUARE + "f 1 2 3" + " \\\n4" * 20000 + "\n")
    group_of(tmp_path, SQUARE + " " * 2000000 + "f 1 2 3\n" + "\\\n" * 100000)
    with pytest.raises(MeshError):
        read_obj(write(tmp_path, "v" * 3000000))
    assert stock_obstacle(write(tmp_path, "v" * 3000000))


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
