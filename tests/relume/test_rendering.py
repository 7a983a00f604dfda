"""`relume render` as a whole: names, formats, confinement, dumps, limits and interrupts."""

import io
import os
import re
import signal
import subprocess
import sys
import time

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image
from rich.console import Console

import relume
from relume import destination, output, passes
from relume.accumulator import Accumulator
from relume.noise import in_words
from relume.rendering import render_file
from relume.translator.darkness import NOTHING_ARRIVES, NOTHING_SEEN

PATIENCE = 600
"""Time for another process to begin or end on a busy machine [s]."""

NAME = re.compile(r"box_4x1_\d+\.\d\(4spp\)\.hdr")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working directory, apart from the folder that holds the scenes."""
    folder = tmp_path / "work" / "here"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def console():
    return Console(record=True, file=io.StringIO(), width=200)


@pytest.fixture
def short_passes(monkeypatch):
    """Many passes even of a small picture."""
    monkeypatch.setattr(passes, "SAMPLES_PER_PASS", 32 * 24)


def files(folder):
    """Names of all files below a folder, links not followed."""
    paths = (os.path.join(at, name) for at, _, names in os.walk(folder) for name in names)
    return sorted(os.path.relpath(path, folder) for path in paths)


# ---- notes on the picture as a whole


@pytest.mark.parametrize("target, told", [("0 2 0", False), ("0 90 14.001", True)])
def test_a_camera_that_nothing_is_before_is_told(room, here, console, target, told):
    """The room from its door, and the sky above it; the picture is written all the same."""
    path = room("CAMERA_UPVEC\n0 0 1")
    path.write_text(path.read_text().replace("TARGET_POS\n0 2 0", f"TARGET_POS\n{target}"))
    written = render_file(path, out="a.exr", console=console)
    assert [path.name for path in written] == ["a.exr"]
    picture = np.array(mi.Bitmap("a.exr"))[..., :3]
    assert np.isfinite(picture).all() and picture.min() >= 0
    assert (np.ptp(picture) < 0.4) == told
    assert (NOTHING_SEEN.text in console.export_text()) == told


FULL = "OBJECT\nsphere 0 0 14 1\ncolor 1 1 1\nreflection reflection\n" + (
    "reflection Subsurface_Scattering\nBSSRDF\n0\nSCATTERING\n0\n{s} {s} {s}\n"
    "ABSORBING\n0\n{a} {a} {a}\n"
)


@pytest.mark.parametrize(
    ("integrator", "s", "a", "told"),
    [("volpathmis", 900, 100, True), ("volpath", 900, 100, True), ("volpathmis", 1000, 0, False),
     ("volpathmis", 9, 1, False), (None, 900, 100, False)],
)  # fmt: skip
def test_walks_that_begin_deep_inside_are_told(room, here, console, integrator, s, a, told):
    """Mitsuba starts rays 0.0014 off the surface of a ball at 15: 1.4 mean free paths of 1/1000."""
    path = room(objects=FULL.format(s=s, a=a), width=4, height=3, spp=1)
    render_file(path, out="a.exr", console=console, integrator=integrator)
    assert ("begins walks up to 1.4 mean free paths inside" in console.export_text()) == told


LAMP = "OBJECT\nuvplane -1 {y} -1\nU 2 0 0\nV 0 0 -2\nemission 9 9 9\n{more}\n"
CLOSED = "OBJECT\nsphere 0 0 14 2\ncolor 1 1 1\nreflection diffuse\n"


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (LAMP.format(y=5, more="normal -1"), False),
        (LAMP.format(y=5, more=""), True),
        (LAMP.format(y=5, more="normal -1\ntexture clear.png"), True),
        (LAMP.format(y=5, more="normal -1") + "\n" + CLOSED, True),
    ],
    ids=["lit", "lamp that faces away", "lamp that is absent", "camera shut in"],
)
def test_a_picture_that_no_light_reaches_is_told(here, console, more, told):
    """A lamp above a floor that gives the picture no light, whatever the reason."""
    exr = mi.Bitmap(np.zeros((2, 2, 4), np.uint8))
    exr.write(str(here / "clear.png"))
    head = "IMAGE\n8 8\n\nSAMPLING\n1\n\nCAMERA_POS\n0 1 14\n\nTARGET_POS\n0 0 0\n"
    floor = "\nOBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    (here / "dark.txt").write_text(head + floor + more)
    render_file("dark.txt", out="a.exr", spp=64, console=console)
    assert (np.array(mi.Bitmap("a.exr"))[..., :3].max() == 0) == told
    assert (NOTHING_ARRIVES.text in console.export_text()) == told


# ---- names


def test_without_o_the_name_is_the_scenes_with_what_was_rendered(room, here, console):
    picture, bmp = render_file(room("OUTPUT\nshots/box.hdr"), console=console)
    assert picture.parent == here / "shots" and NAME.fullmatch(picture.name)
    assert bmp == picture.with_suffix(".bmp")
    assert len(files(here)) == 2


def test_marks_in_the_name(room, here, console, monkeypatch):
    monkeypatch.setenv("SUFFIX_SYMBOL", "_draft")
    path = room("OUTPUT\nbox.bmp\nnextEventEstimation\n1")
    (picture,) = render_file(path, spp=2, variant="llvm_ad_rgb", console=console)
    assert re.fullmatch(r"box_2x1_nes_\d+\.\d\(2spp\)_draft\.bmp", picture.name)
    assert files(here) == [picture.name]


def test_with_o_the_name_is_that_one(room, here, console):
    written = render_file(room(), out="new/a.exr", console=console)
    assert [path.as_posix() for path in written] == files(here) == ["new/a.exr"]


def test_a_folder_takes_the_scenes_own_name(room, here, console):
    path = room("OUTPUT\nbox.hdr")
    for out in ("new/", "new"):
        picture = render_file(path, out=out, console=console)[0]
        assert picture.parent.name == "new" and NAME.fullmatch(picture.name)


@pytest.mark.parametrize("named", ["../../a.bmp", "/a.bmp", "..\\..\\a.bmp", "C:\\a.bmp"])
def test_what_a_scene_names_stays_below_the_working_directory(room, here, console, named):
    (picture,) = render_file(room(f"OUTPUT\n{named}"), console=console)
    assert picture.resolve().is_relative_to(here)
    assert "is written as" in console.export_text()
    assert files(here.parent.parent) == ["room.txt", f"work/here/{picture.name}"]


def test_dumps_stay_there_too(room, here, console, short_passes):
    here.joinpath("image").symlink_to(here.parent)
    render_file(room("IMAGEDUMP\n1e-9\nOUTPUT\n../../box.bmp"), spp=2, console=console)
    assert all(name.startswith("here/") for name in files(here.parent))
    assert "image_/box_W000001.bmp" in files(here)


def test_a_name_without_a_known_extension_becomes_a_ppm(room, here, console):
    picture, _ = render_file(room("OUTPUT\nbox.tiff"), console=console)
    assert picture.suffix == ".ppm" and "no known extension" in console.export_text()


# ---- formats


@pytest.mark.parametrize("extension", [".exr", ".hdr", ".png", ".bmp", ".ppm"])
def test_formats_hold_the_picture_that_python_gets(room, here, console, extension):
    """Linear formats to their precision (RGBE: 1/128 of the brightest channel), others encoded."""
    path = room("gamma_offset\n0.4")
    expected = relume.render(path, seed=2)
    (written,) = render_file(path, out=f"a{extension}", seed=2, console=console)
    assert written.name == f"a{extension}"
    if extension in (".png", ".bmp", ".ppm"):
        encoded = output.encode_display(expected, 0.4)
        assert np.array_equal(np.asarray(Image.open(written)), encoded)
    else:
        read = np.array(mi.Bitmap(str(written)))[..., :3]
        brightest = np.maximum(expected.max(axis=2, keepdims=True), 1e-30)  # black stays black
        error = np.abs(read - expected) / brightest
        assert error.max() <= (0 if extension == ".exr" else 1 / 128)


# ---- dumps and limits


def test_dumps_at_the_scenes_interval(room, here, console, short_passes):
    """An interval that every pass exceeds: one dump a pass but the last, which is the picture."""
    render_file(room("IMAGEDUMP\n1e-9"), out="a.png", spp=5, console=console)
    assert files(here / "image") == [f"a_W{k:06d}.bmp" for k in range(1, 5)]
    last, final = (np.asarray(Image.open(p), float) for p in ("image/a_W000004.bmp", "a.png"))
    assert abs(last.mean() - final.mean()) < 0.05 * final.mean()


@pytest.mark.parametrize("seconds, expected", [(10, [10, 20, 30]), (12.5, [13, 26])])
def test_dumps_come_as_often_as_the_scene_says(room, monkeypatch, seconds, expected):
    """Offered a picture each second, they take the first after each interval."""
    document = relume.read(room(f"IMAGEDUMP\n{seconds}"))
    dumps = destination.Dumps(document, destination.Destination(document, "a.png"), None)
    taken = []
    monkeypatch.setattr(destination.output, "write_image", lambda *_: taken.append(now))
    for now in range(36):
        dumps.offer(Accumulator(1, 1), now)
    assert taken == expected


def test_dumps_lie_beside_the_picture_that_the_scene_names(room, here, console, short_passes):
    render_file(room("IMAGEDUMP\n1e-9\nOUTPUT\nshots/box.bmp"), spp=2, console=console)
    assert "shots/image/box_W000001.bmp" in files(here)


def test_imagedump_0_means_none(room, here, console, short_passes):
    render_file(room("IMAGEDUMP\n0"), out="a.png", spp=5, console=console)
    assert files(here) == ["a.png"]


@pytest.mark.parametrize("in_file", [False, True])
def test_a_time_limit_ends_the_render_with_what_there_is(room, here, console, in_file):
    settings, limit = (f"TIMELIMIT\n{0.5 / 3600}", None) if in_file else ("", 0.5)
    render_file(room(settings), out="a.exr", spp=10**8, time_limit=limit, console=console)
    assert "time limit reached after" in console.export_text()
    mean = np.array(mi.Bitmap("a.exr")).mean()
    assert mean == pytest.approx(relume.render(room(), spp=400).mean(), rel=0.02)


def test_the_command_line_limit_goes_before_the_files(room, here, console):
    render_file(room("TIMELIMIT\n0"), out="a.exr", spp=3, time_limit=60, console=console)
    assert "time limit" not in console.export_text()


def test_an_interrupt_keeps_the_picture_so_far(room, here):
    """SIGINT to the command once its first dump shows that it renders."""
    code = "from relume.cli import main; main()"
    path = room("IMAGEDUMP\n0.2")
    command = [sys.executable, "-c", code, "render", str(path), "--spp", "100000000", "-o", "a.exr"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    deadline = time.monotonic() + PATIENCE
    while not here.joinpath("image/a_W000001.bmp").exists():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    assert out.split() == ["a.exr"]
    assert "interrupted after" in err and "Traceback" not in err
    mean = np.array(mi.Bitmap("a.exr")).mean()
    assert mean == pytest.approx(relume.render(path, spp=400).mean(), rel=0.02)


def test_what_cannot_be_written_is_said_before_rendering(room, here, console):
    here.joinpath("a").write_text("")
    with pytest.raises(output.OutputError, match=r"cannot write a/b\.png"):
        render_file(room(), out="a/b.png", spp=10**9, console=console)


# ---- what is said


def test_progress_shows_passes_and_rate_on_a_terminal(room, here, short_passes):
    shown, plain = io.StringIO(), io.StringIO()
    terminal = Console(force_terminal=True, width=120, file=shown)
    render_file(room(), out="a.png", spp=3, console=terminal)
    for part in ("pass", "3/3", "M samples/s", "left"):
        assert part in shown.getvalue()
    render_file(room(), out="a.png", spp=3, console=Console(file=plain))
    (line,) = plain.getvalue().splitlines()
    assert re.fullmatch(
        r"noise of a pixel: [0-9.]+ % of the mean; 1 % would take [0-9]+ times the samples \(.*\)",
        line,
    )


@pytest.mark.parametrize(
    "ratio, said",
    [
        (0.00012, "0.012 % of the mean"),
        (0.115, "12 % of the mean"),
        (1.2, "120 % of the mean"),
        (13.2, "13 times its mean"),
        (1234, "1200 times its mean"),
    ],
)
def test_numbers_are_said_without_exponents(ratio, said):
    assert in_words(ratio) == said


def test_what_is_not_rendered_as_written_is_said(room, here, console):
    ring = "OBJECT\ndisk2 0 1 0 2 1\nnormal 0 1 0\n"
    path = room("BLACKHOLE 0 0 0\n\nparticipatingMedia\n1", objects=ring)
    render_file(path, out="a.png", console=console)
    text = console.export_text()
    assert re.search(r"unsupported line \d+, participatingMedia: ", text)
    assert re.search(r"approximated line \d+, OBJECT: a ring", text)
