"""No command writes over a file that a scene reads, whatever its name, links and letters."""

import os
import shutil

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import relume
from relume.cli import main
from relume.inputs import Inputs, file_names
from relume.output import OutputError

OBJECTS = """\
OBJECT
uvplane -3 1 -1
U 3 0 0
V 0 3 0
texture tex.bmp
reflection diffuse

OBJECT
objfile part.obj
color 0.5 0.5 0.5
reflection diffuse
"""
"""A picture, and a mesh that names an MTL file that names another picture."""

READ = ("room.txt", "tex.bmp", "part.obj", "part.mtl", "kd.png")


@pytest.fixture
def scene(room, tmp_path, monkeypatch):
    """A scene with all kinds of files, in the working directory."""
    path = room(objects=OBJECTS, spp=1, width=16, height=12)
    for name in ("tex.bmp", "kd.png"):
        Image.fromarray(np.full((4, 4, 3), 200, np.uint8)).save(tmp_path / name)
    (tmp_path / "part.mtl").write_text("newmtl a\nmap_Kd kd.png\n")
    (tmp_path / "part.obj").write_text(
        "mtllib part.mtl\nv 1 1 0\nv 3 1 0\nv 2 3 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n"
    )
    monkeypatch.chdir(tmp_path)
    return path


@pytest.fixture
def run(scene, tmp_path):
    """A function that runs a command; afterwards all files of the scene are as they were."""
    before = {name: (tmp_path / name).read_bytes() for name in READ}
    yield lambda *words: CliRunner().invoke(main, [str(word) for word in words])
    assert {name: (tmp_path / name).read_bytes() for name in READ} == before


def refused(result, name):
    """Whether a command said in one line that it would not write over a file."""
    lines = result.stderr.strip().splitlines()
    return (
        result.exit_code == 1
        and len(lines) == 1
        and f"cannot write {name}" in lines[0]
        and "the scene reads this file" in lines[0]
    )


# ---- the picture


def test_a_named_picture_is_the_only_file_that_is_written(run, tmp_path):
    """In particular no BMP beside it, which might be one of the scene's textures."""
    before = set(os.listdir(tmp_path))
    result = run("render", "room.txt", "-o", "tex.exr")
    assert (result.exit_code, result.stdout) == (0, "tex.exr\n"), result.stderr
    assert set(os.listdir(tmp_path)) == before | {"tex.exr"}


@pytest.mark.parametrize("name", ["tex.bmp", "kd.png", "./tex.bmp", "sub/../tex.bmp"])
def test_a_picture_of_the_scene_is_refused(run, tmp_path, name):
    (tmp_path / "sub").mkdir()
    assert refused(run("render", "room.txt", "-o", name, "--spp", 10**9), name.removeprefix("./"))


@pytest.mark.parametrize("link", [os.symlink, os.link])
@pytest.mark.parametrize("target", READ)
def test_links_are_seen_through(run, link, target):
    link(target, "a.exr")
    assert refused(run("render", "room.txt", "-o", "a.exr", "--spp", 10**9), "a.exr")


def test_a_linked_folder_is_seen_through(run, tmp_path):
    os.symlink(tmp_path, "here")
    assert refused(run("render", "room.txt", "-o", "here/tex.bmp", "--spp", 10**9), "here/tex.bmp")


def test_letters_of_another_case_are_one_file_where_the_system_says_so(run, tmp_path):
    result = run("render", "room.txt", "-o", "TEX.BMP")
    if (tmp_path / "tex.BMP").exists():
        assert refused(result, "TEX.BMP")
    else:
        assert result.exit_code == 0


def test_the_scene_itself_is_refused_whatever_its_name(run, tmp_path):
    shutil.copy("room.txt", "room.png")
    kept = (tmp_path / "room.png").read_bytes()
    assert refused(run("render", "room.png", "-o", "room.png"), "room.png")
    assert (tmp_path / "room.png").read_bytes() == kept


def test_the_file_of_passes_is_refused(run, tmp_path):
    os.link("tex.bmp", "a.passes.exr")
    assert refused(run("render", "room.txt", "-o", "a.png", "--spp", 10**9), "a.passes.exr")


def test_a_part_is_refused(run):
    os.link("tex.bmp", "part.exr")
    assert refused(run("render", "room.txt", "-o", "part.exr", "--passes", "0:1"), "part.exr")


def test_names_that_relume_makes_up_spare_the_scenes_files(room, tmp_path, monkeypatch):
    """The picture of the scene's own name, the BMP beside it, and the dumps."""
    from relume.accumulator import Accumulator
    from relume.destination import Destination
    from relume.passes import Pass
    from relume.translator import Document

    monkeypatch.chdir(tmp_path)
    texture = tmp_path / "box_1x1_2.0(1spp).bmp"
    texture.write_bytes(b"texture")
    (tmp_path / "image").mkdir()
    dumped = tmp_path / "image" / "box_W000001.bmp"
    os.link(texture, dumped)
    accumulator = Accumulator(2, 2)
    accumulator.add(Pass(0, 1, np.ones((3, 4), np.float32)))
    document = Document(output="box.hdr", sampling=1, supersampling=1)
    destination = Destination(document, None, Inputs([texture]))
    written = destination.write(document, accumulator, 2.0, False).paths
    assert [path.name for path in written] == ["box_1x1_2.0(1spp)_.hdr", "box_1x1_2.0(1spp)_.bmp"]
    assert destination.dump_path(1).name == "box_W000001_.bmp"
    assert texture.read_bytes() == dumped.read_bytes() == b"texture"


# ---- formats


@pytest.mark.parametrize("name", ["a.jpg", "a.tif", "a.pfm", "t.txt", "a", "a.exr.gz"])
def test_other_formats_are_refused_with_the_list(run, tmp_path, name):
    before = set(os.listdir(tmp_path))
    result = run("render", "room.txt", "-o", name, "--spp", 10**9)
    assert result.exit_code == 1 and f"cannot write {name}: " in result.stderr
    assert "expected one of .hdr .exr .png .bmp .ppm" in result.stderr
    assert set(os.listdir(tmp_path)) == before


# ---- other commands


@pytest.mark.parametrize("name", ["x.png", "room.txt", "x"])
def test_xml_goes_into_no_file_of_another_kind(run, tmp_path, name):
    before = set(os.listdir(tmp_path))
    result = run("convert", "room.txt", "-o", name)
    assert result.exit_code == 1 and "the name of an XML file ends with .xml" in result.stderr
    assert set(os.listdir(tmp_path)) == before


def test_xml_and_its_folder_go_over_no_file_of_the_scene(run, tmp_path):
    os.symlink("tex.bmp", "a.xml")
    assert refused(run("convert", "room.txt", "-o", "a.xml"), "a.xml")
    assert run("convert", "room.txt", "-o", "b.xml").exit_code == 0
    mesh = min((tmp_path / "b_files").glob("*.ply"))
    mesh.unlink()
    os.link("part.obj", mesh)
    (tmp_path / "b.xml").unlink()
    assert refused(run("convert", "room.txt", "-o", "b.xml"), f"b_files/{mesh.name}")
    assert not (tmp_path / "b.xml").exists()


def test_a_page_goes_over_no_file_that_is_read(run):
    words = ("compare", "room.txt", "--spp", 10**9, "-o")
    os.link("kd.png", "a.html")
    assert refused(run(*words, "a.html"), "a.html")
    assert "ends with .html" in run(*words, "kd.png").stderr
    assert run("render", "room.txt", "-o", "old.exr").exit_code == 0
    os.link("old.exr", "b.html")
    assert refused(run(*words, "b.html", "--with", "old.exr"), "b.html")


def test_charts_go_over_no_file_of_any_scene(run, tmp_path):
    os.link("kd.png", "room.png")
    assert refused(run("chart", "room.txt", "-o", ".", "--seconds", 1e9), "room.png")
    (tmp_path / "room.png").unlink()
    os.symlink("part.mtl", "methods.csv")
    assert refused(run("chart", "room.txt", "-o", ".", "--seconds", 1e9), "methods.csv")


def test_copies_of_examples_follow_no_link(run, tmp_path):
    (tmp_path / "copies").mkdir()
    os.symlink(tmp_path / "new.txt", tmp_path / "copies" / "glass.txt")
    result = run("scenes", "glass", "-o", "copies")
    assert result.exit_code == 1 and "is there already" in result.stderr
    assert not (tmp_path / "new.txt").exists()


def test_merged_passes_are_one_file(run, tmp_path):
    assert run("render", "room.txt", "--passes", "0:1", "-o", "part.exr").exit_code == 0
    before = set(os.listdir(tmp_path))
    assert run("merge", "part.exr", "-o", "tex.png").stdout == "tex.png\n"
    assert set(os.listdir(tmp_path)) == before | {"tex.png"}
    assert "expected one of .hdr" in run("merge", "part.exr", "-o", "a.jpg").stderr


# ---- the measure


def test_files_that_do_not_exist_are_no_inputs(tmp_path):
    inputs = Inputs([tmp_path / "none", "", "a\0b"])
    inputs.refuse(tmp_path / "none", "a\0b")
    (tmp_path / "none").write_text("")
    inputs = Inputs([tmp_path / "none"])
    with pytest.raises(OutputError, match="the scene reads this file"):
        inputs.refuse(tmp_path / "other", tmp_path / "none")


def test_names_in_a_scene():
    scene = {"type": "scene", "a": {"filename": "x.obj", "bsdf": {"t": {"filename": "y.png"}}}}
    assert list(file_names(scene)) == ["x.obj", "y.png"]


@pytest.mark.parametrize("name", [*READ, "link.png", "PART.OBJ"])
def test_a_document_is_not_written_over_what_it_reads(name, run, tmp_path):
    """Proves: `overwrite` replaces no scene, mesh or picture of the document's own."""
    document = relume.read("room.txt")
    if name not in READ:
        os.link({"link.png": "kd.png", "PART.OBJ": "part.obj"}[name], name)
    with pytest.raises(FileExistsError, match="the scene reads it, as"):
        relume.write(document, name, overwrite=True)


def test_a_document_that_misses_a_file_spares_the_others(run, tmp_path):
    text = (tmp_path / "room.txt").read_text()
    (tmp_path / "other.txt").write_text(text + OBJECTS.replace("part.obj", "missing.obj"))
    document = relume.read("other.txt")
    with pytest.raises(FileExistsError, match="the scene reads it, as"):
        relume.write(document, "tex.bmp", overwrite=True)
    relume.write(document, "new.txt", overwrite=True)
    relume.write(document, "new.txt", overwrite=True)
