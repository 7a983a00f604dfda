"""`relume scenes`: what is listed, and copies that stand by themselves."""

import pytest
from click.testing import CliRunner

from relume import examples
from relume.checking import check_file
from relume.cli import main


def run(*words):
    return CliRunner().invoke(main, ["scenes", *map(str, words)], catch_exceptions=False)


def files(folder):
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file()}


def test_the_list_has_every_scene_with_what_it_shows():
    listed = run()
    assert listed.exit_code == 0
    assert [line.split()[0] for line in listed.stdout.splitlines() if line[0] != " "] == (
        examples.names()
    )
    assert "A lens of radius 1.2 that is focused 40 away." in listed.stdout
    assert "Look for" not in listed.stdout and all(map(examples.opening, examples.names()))


def test_a_scene_is_copied_with_all_that_it_names(tmp_path):
    """The mesh names its materials, and these a picture."""
    done = run("mesh", "lens.txt", "-o", tmp_path / "new")
    assert done.exit_code == 0
    copied = [str(tmp_path / "new" / name) for name in ("mesh.txt", "lens.txt")]
    assert done.stdout.split() == copied
    assert files(tmp_path / "new") == {
        "lens.txt", "mesh.txt", "assets/tetrahedron.obj", "assets/vase.obj", "assets/vase.mtl",
        "assets/tiles_opaque.png",
    }  # fmt: skip


@pytest.mark.parametrize("name", examples.names())
def test_every_copy_is_complete(tmp_path, name):
    (copied,) = examples.copy([name], tmp_path)
    assert check_file(copied, environ={})["errors"] == []


def test_all_are_copied_without_names(tmp_path):
    assert run("-o", tmp_path).exit_code == 0
    assert {file.name for file in tmp_path.glob("*.txt")} == {
        f"{name}.txt" for name in examples.names()
    }


def test_names_alone_are_copied_to_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("lens").stdout.split() == ["lens.txt"] and files(tmp_path) == {"lens.txt"}


def test_nothing_is_written_over_other_files(tmp_path):
    """The same content may be there; another one stops the copy before anything is written."""
    assert run("mesh", "-o", tmp_path).exit_code == run("mesh", "-o", tmp_path).exit_code == 0
    (tmp_path / "assets" / "sky.hdr").write_text("mine")
    done = run("lens", "sky", "-o", tmp_path)
    assert done.exit_code == 1 and "sky.hdr is there already, with other content" in done.stderr
    assert not (tmp_path / "lens.txt").exists() and not (tmp_path / "sky.txt").exists()
    assert (tmp_path / "assets" / "sky.hdr").read_text() == "mine"


@pytest.mark.parametrize(
    "name, hint",
    [("glas", "did you mean 'glass'?"), ("zzz", "relume scenes lists them"), ("../glass", "glass")],
)
def test_unknown_names_are_told(tmp_path, name, hint):
    done = run("lens", name, "-o", tmp_path)
    assert done.exit_code == 1 and f"no example scene '{name}'" in done.stderr
    assert hint in done.stderr and files(tmp_path) == set()


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    done = run("lens", "-o", tmp_path / "file")
    assert done.exit_code == 1 and "cannot copy to" in done.stderr
