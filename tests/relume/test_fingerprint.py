"""Hashes by content: equal for equal scenes wherever their files lie, different for any change."""

import dataclasses
import importlib.metadata
import shutil

import numpy as np
import pytest

import relume
from relume import translator
from relume.fingerprint import content_hash, differences, of_render
from relume.options import RenderOptions
from relume.translator.scene_values import Color, Matrix, Mesh, Picture

MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def scene_hash(path):
    return content_hash(translator.translate(relume.read(path)).scene)


def mesh_scene(room, folder, text=MESH):
    """A scene in a folder of its own beside its mesh."""
    folder.mkdir()
    path = shutil.move(room(objects="OBJECT\nobjfile part.obj\ncolor 1 1 1\nreflection diffuse\n"),
                       folder / "scene.txt")  # fmt: skip
    (folder / "part.obj").write_text(text)
    return path


def test_places_do_not_count_and_contents_do(room, tmp_path):
    first, moved = (mesh_scene(room, tmp_path / name) for name in ("a", "b"))
    edited = mesh_scene(room, tmp_path / "c", MESH.replace("1 0 0", "1 0 1"))
    assert scene_hash(first) == scene_hash(moved) != scene_hash(edited)


def test_number_of_samples_and_comments_do_not_count(room):
    again = room(spp=7, name="again.txt")
    again.write_text(again.read_text() + "\n# the end\n")
    assert scene_hash(room()) == scene_hash(again)
    assert scene_hash(room()) != scene_hash(room(width=33, name="wider.txt"))


TRIANGLE = np.eye(3)
VALUES = [
    None, True, 1, 2, 1.0, -1.0, "1", b"1", [1], [1, 2], [[1], 2], [], {}, {"a": 1}, {"a": [1]},
    {"a": 1, "b": 2}, {"b": 2, "a": 1}, ["a", 1], float("inf"), "", Color((0.1, 0.2, 0.3)),
    Matrix.of(np.eye(4)), Matrix.of(2 * np.eye(4)), TRIANGLE, TRIANGLE.T[1], TRIANGLE.ravel(),
    TRIANGLE.astype(np.float32), Picture(TRIANGLE), Mesh(TRIANGLE, TRIANGLE),
    Mesh(TRIANGLE, TRIANGLE, normals=TRIANGLE), Mesh(TRIANGLE, TRIANGLE, uv=TRIANGLE),
    np.zeros((0, 3)), np.zeros((3, 0)),
]  # fmt: skip


def test_no_two_values_share_a_hash():
    assert len({content_hash(value) for value in VALUES}) == len(VALUES)


@pytest.mark.parametrize("value", [1, 1.5, True, "x"])
def test_numbers_of_numpy_count_as_those_of_python(value):
    assert content_hash(np.array([value])[0]) == content_hash(value)


def test_memory_layout_does_not_count():
    turned = np.arange(12.0).reshape(3, 4)
    assert content_hash(np.asfortranarray(turned)) == content_hash(turned)
    assert content_hash(turned.astype(">f8")) == content_hash(turned)


def test_what_has_no_content_is_refused():
    with pytest.raises(TypeError, match="no hash of a generator"):
        content_hash({"a": (x for x in "b")})


def test_every_field_of_a_mesh_counts():
    mesh = Mesh(*(np.full((3, 3), float(k)) for k in range(5)))
    changed = [dataclasses.replace(mesh, **{f.name: TRIANGLE}) for f in dataclasses.fields(mesh)]
    assert len({content_hash(m) for m in [mesh, *changed]}) == 6


@pytest.mark.parametrize("package", ["relume", "mitsuba", "drjit"])
def test_a_render_is_of_the_versions_that_made_it(room, monkeypatch, package):
    """Each by itself: its samples may differ with any of them."""
    translation = translator.translate(relume.read(room()))
    before = of_render(translation, RenderOptions(), 4)
    real = importlib.metadata.version
    monkeypatch.setattr(
        importlib.metadata, "version", lambda name: "9.9" if name == package else real(name)
    )
    after = of_render(translation, RenderOptions(), 4)
    assert list(differences(before, after)) == [f"its {package} is {real(package)}, here 9.9"]
