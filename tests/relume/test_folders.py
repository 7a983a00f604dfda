"""`relume render` of folders: errors, going on, the contact sheet."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from relume import contact_sheet, folders, metadata, noise, passes, running
from relume.cli import main

SMALL = ("--size", "16x12", "--spp", "2")


@pytest.fixture
def scenes(room, tmp_path, monkeypatch):
    """A folder of a good scene, one with a mistake, and below one that is not quite as written."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in" / "below").mkdir(parents=True)
    room(name="in/a room.txt")
    room(name="in/below/ring.txt", objects="OBJECT\ndisk2 0 1 0 2 1\nnormal 0 1 0\n")
    (tmp_path / "in/broken.txt").write_text("SAMPLNG\n16\n")
    return tmp_path / "in"


def run(*arguments):
    return CliRunner().invoke(main, ["render", *map(str, arguments)])


def test_all_scenes_are_rendered_whatever_becomes_of_one(scenes):
    result = run(scenes, "-o", "out/", *SMALL)
    assert result.exit_code == 1 and result.stdout == "out/index.html\n", result.output
    made = sorted(path.relative_to("out").as_posix() for path in Path("out").rglob("*.*"))
    pictures = [f"{name}.{kind}" for name in ("a room", "below/ring") for kind in ("exr", "png")]
    assert made == sorted([*pictures, "index.html", "index.png", "times.json"])
    lines = result.stderr.splitlines()
    assert any(re.match(r"broken .*did you mean 'SAMPLING'", line) for line in lines)
    assert lines[-1].startswith("3 scenes: 1 as written, 1 not quite as written, 1 without")


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.pictures, self.text = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag == "img":
            self.pictures.append(dict(attributes)["src"])

    def handle_data(self, data):
        self.text += data


def test_the_sheet_shows_each_picture_and_what_is_to_know_of_it(scenes):
    run(scenes, "-o", "out", *SMALL)
    page = Page(Path("out/index.html").read_text())
    assert page.pictures == ["a%20room.png", "below/ring.png"]
    told = float(metadata.of_file("out/a room.exr")[metadata.NOISE])
    for part in (
        f"16x12 · 2 spp · noise {noise.significant(100 * told)} %",
        "a ring",
        "did you mean 'SAMPLING'",
    ):
        assert part in page.text
    with Image.open("out/index.png") as sheet:
        assert sheet.size == (3 * 248 + 8, 222 + 8)
        tile = np.asarray(sheet)[8:188, 8:248].astype(int)
    with Image.open("out/a room.png") as picture:
        assert abs(tile.mean() - np.asarray(picture).mean()) < 4


def test_resumed_only_what_is_missing_is_rendered(scenes, monkeypatch):
    run(scenes, "-o", "out", *SMALL)
    Path("out/below/ring.exr").unlink()
    before = Path("out/a room.exr").stat().st_mtime_ns
    asked = []
    original = folders.render_scene
    monkeypatch.setattr(
        folders,
        "render_scene",
        lambda scene, *a, **k: asked.append(scene.name) or original(scene, *a, **k),
    )
    result = run(scenes, "-o", "out", *SMALL, "--resume")
    assert asked == ["ring.txt", "broken.txt"] and "1 were there already" in result.stderr
    assert Path("out/a room.exr").stat().st_mtime_ns == before
    run(scenes, "-o", "out", "--size", "16x12", "--spp", 2, "--seed", 3, "--resume")
    assert "a room.txt" in asked, "that of another seed is another picture"
    asked.clear()
    run(scenes, "-o", "out", "--size", "16x12", "--spp", 3, "--seed", 3, "--resume")
    assert "a room.txt" in asked, "it has too few samples"


def test_resumed_renders_go_on_with_their_passes(scenes, monkeypatch):
    monkeypatch.setattr(passes, "SAMPLES_PER_PASS", 16 * 12)
    words = (scenes / "a room.txt", scenes / "below", "-o", "out", "--size", "16x12", "--spp", 6)
    result = run(*words, "--time-limit", 0)
    assert "2 ended early" in result.stderr and result.exit_code == 0
    assert Path("out/a room.passes.exr").exists()
    result = run(*words, "--resume")
    assert "ended early" not in result.stderr and not Path("out/a room.passes.exr").exists()
    assert (
        run(scenes / "a room.txt", "-o", "whole.exr", "--size", "16x12", "--spp", 6).exit_code == 0
    )
    assert Path("whole.exr").read_bytes() == Path("out/a room.exr").read_bytes()


def test_an_exposure_that_would_show_a_dark_scene_is_told_also_of_pictures_that_are_kept(scenes):
    dark = (scenes / "a room.txt").read_text()
    dark = dark.replace("emission 6 5 4", "emission .006 .005 .004")
    (scenes / "a room.txt").write_text(dark.replace("0.4 0.5 0.7", "0.0004 0.0005 0.0007"))
    for again in ((), ("--resume",)):
        result = run(scenes, "-o", "out", *SMALL, *again)
        lines = [line for line in result.stderr.splitlines() if "would show it" in line]
        assert len(lines) == 1 and lines[0].startswith("nearly black"), result.stderr


def test_looks_times_and_noise_of_pictures_that_are_kept(scenes):
    words = ("in/below", "-o", "out", "--size", "16x12", "--exposure", 2)
    result = run(*words, "--spp", 2)
    assert metadata.of_file("out/ring.png")["relume.look"] == "exposure +2.00, linear"
    assert "stays linear" not in result.stderr, "the OpenEXR file is not what is looked at"
    Path("out/times.json").write_text('{"ring": 7200}')
    result = run(*words, "--spp", 2, "--resume")
    assert "1 were there already" in result.stderr and "2 h of rendering" in result.stderr
    result = run(*words, "--noise", "0.001%", "--time-limit", 0, "--resume")
    assert "were there already" not in result.stderr, "it is noisier than is asked for"


def test_a_defect_in_one_scene_is_told_and_left_behind(scenes, monkeypatch):
    def odd(*_, **__):
        raise RuntimeError("odd")

    monkeypatch.setattr(folders, "render_scene", odd)
    result = run("in", "-o", "out", *SMALL)
    assert result.exit_code == 1 and result.stderr.count("RuntimeError: odd\n") >= 2


def test_an_interrupt_ends_the_folder_with_a_sheet(scenes, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(running, "open_session", interrupted)
    result = run(scenes, "-o", "out", *SMALL)
    assert "interrupted" in result.stderr and Path("out/index.html").exists()


def test_brackets_in_names_and_errors_are_no_markup(room, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    room(name="in/[b].txt", objects="OBJECT\ndisk2 0 1 0 2 1\nnormal 0 1 0\n")
    (tmp_path / "in/a.txt").write_text("OBJECT\nsphere 0 0 [/b] 1\n")
    result = run("in", "-o", "out", *SMALL)
    assert Path("out/[b].exr").exists() and result.stdout == "out/index.html\n", result.output
    for text in ("1 of 2 in/[b].txt", "found '[/b] 1'"):
        assert text in result.stderr


def test_scenes_of_one_name_get_pictures_of_their_own(room, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        room(name=f"{folder}/room.txt")
    assert run("a/room.txt", "b/room.txt", "-o", "out", *SMALL).exit_code == 0
    assert Path("out/room.png").exists() and Path("out/room_2.png").exists()
    assert set(json.loads(Path("out/times.json").read_text())) == {"room", "room_2"}


def test_pictures_and_pages_of_others_are_kept(scenes):
    Path("out").mkdir()
    Image.new("RGB", (2, 2)).save("out/a room.png")
    result = run(scenes, "-o", "out", *SMALL)
    assert "out/a room.png is no picture rendered by relume" in result.stderr
    with Image.open("out/a room.png") as kept:
        assert kept.size == (2, 2)
    Path("site").mkdir()
    Path("site/index.html").write_text("mine")
    result = run(scenes, "-o", "site", *SMALL)
    assert result.exit_code == 1 and Path("site/index.html").read_text() == "mine"


@pytest.mark.parametrize("words", [(), ("-o", "a.png"), ("-o", "out", "--passes", "0:1")])
def test_several_scenes_need_a_folder(scenes, words):
    assert run(scenes, *words).exit_code == 2


def test_names_are_written_in_an_installed_font_that_has_their_characters(monkeypatch):
    charts = contact_sheet.font_file(frozenset(map(ord, "Ωмír 1")))
    assert Path(charts).name == "DejaVuSans.ttf"
    # A character for private use, which among the fonts of matplotlib one alone has.
    monkeypatch.setattr(
        "matplotlib.font_manager.findSystemFonts",
        lambda: [str(path) for path in Path(charts).parent.glob("*.ttf")],
    )
    found = contact_sheet.font_file(frozenset(map(ord, "\ue001")))
    assert Path(found).name == "STIXNonUni.ttf"
