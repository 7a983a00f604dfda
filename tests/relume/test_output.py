"""Picture files: names, confinement of a scene's OUTPUT, formats read back by other readers."""

import os
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from relume import output


@pytest.fixture
def image():
    """Radiance of all magnitudes, with rows and columns of unequal number."""
    values = np.random.default_rng(1).exponential(0.5, (9, 14, 3))
    return (values * np.logspace(-3, 3, 14)[:, None]).astype(np.float32)


def encoded(image, exponent=1 / 2.2):
    """The manual's encoding, in the words of the manual."""
    return np.floor(255 * np.clip(image.astype(np.float64), 0, 1) ** exponent + 0.5)


# ---- names


def test_name_of_the_final_picture():
    assert (
        output.output_name("out/box", ".hdr", 100, 2, 83.449, 400)
        == "out/box_100x2_83.4(400spp).hdr"
    )
    assert (
        output.output_name("a", ".bmp", 1, 4, 0, 16, nes=True, spectrum=True, suffix="_x")
        == "a_1x4_nes_0.0(16spp)_spectrum_x.bmp"
    )
    assert (
        output.output_name("a", ".bmp", 40, 5, 7, 200, method="pssmlt", nes=True)
        == "a_40x5_mlt_nes_7.0(200spp).bmp"
    )
    assert output.output_name("a", ".bmp", 40, 5, 7, 200, method="erpt") == "a_40x5_erpt_7.0.bmp"


def test_the_tail_of_such_a_name_is_no_extension():
    assert output.split_extension("a_1x1_3.5(400spp)") == ("a_1x1_3.5(400spp)", "")
    assert output.split_extension("a_1x1_3.5(400spp).HDR") == ("a_1x1_3.5(400spp)", ".HDR")
    assert output.split_extension(".ppm") == (".ppm", "")


# ---- what a scene names stays below the base directory


@pytest.mark.parametrize(
    "name, expected",
    [
        ("image.bmp", "image.bmp"),
        ("out/image.bmp", "out/image.bmp"),
        (r"out\image.bmp", "out/image.bmp"),
        ("./image.bmp", "image.bmp"),
        ("画像/箱.bmp", "画像/箱.bmp"),
    ],
)
def test_harmless_names_are_kept_without_a_note(tmp_path, name, expected):
    assert output.safe_path(name, tmp_path) == (tmp_path / expected, "")


@pytest.mark.parametrize(
    "name, expected",
    [
        ("../../etc/passwd", "etc/passwd"),
        ("a/../../b.ppm", "a/b.ppm"),
        ("/etc/cron.d/x.ppm", "etc/cron.d/x.ppm"),
        (r"C:\Users\me\x.bmp", "Users/me/x.bmp"),
        ("c:x.bmp", "c_x.bmp"),
        (r"\\server\share\x.hdr", "server/share/x.hdr"),
        ("x\0.ppm", "x_.ppm"),
        ("x\r\n\x1b[2J.ppm", "x___[2J.ppm"),
        ("evil\u202eppm.exe", "evil_ppm.exe"),
        ("\udc80.ppm", "_.ppm"),
        ("con.bmp", "_con.bmp"),
        ("a/LPT1", "a/_LPT1"),
        ("x.bmp. . ", "x.bmp"),
        ("x.bmp:stream", "x.bmp_stream"),
        ("..", "output.ppm"),
        ("", "output.ppm"),
        ("/", "output.ppm"),
    ],
)
def test_other_names_are_tamed_with_a_note(tmp_path, name, expected):
    path, note = output.safe_path(name, tmp_path)
    assert path.relative_to(tmp_path).as_posix() == expected
    assert expected in note and note.isprintable()


def test_long_names_are_cut_at_a_character_and_keep_their_extension(tmp_path):
    path, note = output.safe_path("箱" * 500 + ".hdr", tmp_path)
    assert path.suffix == ".hdr" and len(os.fsencode(path.name)) <= 200 and "箱_" not in path.name
    assert len(note) < 1000
    path, _ = output.safe_path("d/" * 5000 + "x.hdr", tmp_path)
    assert path == tmp_path / "x.hdr"


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.sampled_from(
            ["..", "/", "\\", ".", "~", "C:", "\0", "link", "file", "a", " ", "nul", "é"]
        )
        | st.text(max_size=5),
        max_size=12,
    ).map("".join)
)
def test_no_name_at_all_leads_out(name):
    """Whatever the name, with links and files in the way, nothing appears outside the base."""
    with tempfile.TemporaryDirectory() as directory:
        base, outside = Path(directory, "base"), Path(directory, "outside")
        base.mkdir()
        outside.mkdir()
        (base / "link").symlink_to(outside)
        (base / "file").write_text("kept")
        path, _ = output.safe_path(name + "x.ppm", base)
        written = output.write_image(path, np.ones((1, 1, 3))).paths[0]
        assert written.resolve().is_relative_to(base.resolve())
        assert not list(outside.iterdir())
        assert sorted(os.listdir(directory)) == ["base", "outside"]


def test_links_on_the_way_and_at_the_end(tmp_path):
    base, outside = tmp_path / "base", tmp_path / "outside"
    (base / "inside").mkdir(parents=True)
    outside.mkdir()
    (base / "out").symlink_to(outside)
    (base / "dangling").symlink_to(tmp_path / "nowhere")
    (base / "in").symlink_to("inside")
    assert output.safe_path("out/x.ppm", base)[0] == base / "out_" / "x.ppm"
    assert output.safe_path("dangling/x.ppm", base)[0] == base / "dangling_" / "x.ppm"
    assert output.safe_path("in/x.ppm", base)[0] == base / "in" / "x.ppm"
    victim = outside / "victim.ppm"
    victim.write_text("precious")
    (base / "x.ppm").symlink_to(victim)
    path, _ = output.safe_path("x.ppm", base)
    output.write_image(path, np.ones((1, 1, 3)))
    assert victim.read_text() == "precious" and not (base / "x.ppm").is_symlink()


def test_files_and_directories_in_the_way(tmp_path):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "dir.bmp").mkdir()
    assert output.safe_path("file/x.bmp", tmp_path)[0] == tmp_path / "file_" / "x.bmp"
    assert output.safe_path("dir.bmp", tmp_path)[0] == tmp_path / "dir_.bmp"


# ---- formats


@pytest.mark.parametrize("extension", [".png", ".bmp", ".ppm", ".BMP"])
@pytest.mark.parametrize("gamma, exponent", [(0, 1 / 2.2), (0.005, 1 / 2.2), (0.3, 0.3), (-1, -1)])
def test_display_formats_hold_the_manuals_encoding(tmp_path, image, extension, gamma, exponent):
    image[0, 0] = 0
    written = output.write_image(tmp_path / f"x{extension}", image, gamma)
    with np.errstate(divide="ignore"):
        expected = encoded(image, exponent).clip(0, 255)
    with Image.open(written.paths[0]) as read:
        assert np.array_equal(np.array(read), expected)
    if extension != ".ppm":  # Mitsuba reads binary PPM only
        assert np.array_equal(np.array(mi.Bitmap(str(written.paths[0]))), expected)
    assert written.repaired == 0


def test_bmp_has_24_bits_and_ppm_is_text(tmp_path, image):
    output.write_image(tmp_path / "x.bmp", image)
    assert int.from_bytes((tmp_path / "x.bmp").read_bytes()[28:30], "little") == 24
    output.write_image(tmp_path / "x.ppm", image)
    lines = (tmp_path / "x.ppm").read_text(encoding="ascii").splitlines()
    assert lines[:3] == ["P3", "14 9", "255"]
    numbers = [int(number) for line in lines[3:] for number in line.split()]
    assert numbers == encoded(image).ravel().tolist() and max(map(len, lines)) <= 70


@pytest.mark.parametrize("name", ["x.jpg", "x", "x_1.5(4spp)"])
def test_any_other_extension_is_refused(tmp_path, image, name):
    with pytest.raises(output.OutputError, match=r"expected one of \.hdr \.exr \.png \.bmp \.ppm"):
        output.write_image(tmp_path / name, image)
    assert not os.listdir(tmp_path)


def test_exr_is_exact(tmp_path, image):
    output.write_image(tmp_path / "x.exr", image, gamma=0.3)
    assert np.array_equal(np.array(mi.Bitmap(str(tmp_path / "x.exr"))), image)
    with OpenEXR.File(str(tmp_path / "x.exr"), separate_channels=True) as file:
        channels = file.channels()
        assert sorted(channels) == ["B", "G", "R"]
        assert np.array_equal(channels["G"].pixels, image[..., 1])


@pytest.mark.parametrize("width", [1, 7, 8, 127, 128, 129, 300])
def test_hdr_is_within_half_a_mantissa_step(tmp_path, width):
    """Mantissas of the brightest channel are at least 127.75, so half a step is 1/255 of it."""
    rng = np.random.default_rng(width)
    image = rng.exponential(1, (5, width, 3)) * 10.0 ** rng.uniform(-30, 30, (5, width, 1))
    output.write_image(tmp_path / "x.hdr", image, gamma=0.3)
    error = np.abs(np.array(mi.Bitmap(str(tmp_path / "x.hdr")), dtype=np.float64) - image)
    assert (error <= image.max(axis=2, keepdims=True) / 255).all()


def test_hdr_extremes(tmp_path):
    """Powers of two are exact; values just below one round up to it; the largest float is kept."""
    values = [0, 1, 0.5, 1 - 2**-24, 255.4 / 256, 1e-42, 3e38, 2.0**-100]
    image = np.repeat(np.array(values, np.float32)[None, :, None], 3, axis=2)
    output.write_image(tmp_path / "x.hdr", image)
    read = np.array(mi.Bitmap(str(tmp_path / "x.hdr")))[0, :, 0]
    assert read[:4].tolist() == [0, 1, 0.5, 1] and read[4] == 255 / 256
    assert read[5] == 0 and read[6] == 255 * 2.0**119 and read[7] == 2.0**-100


@pytest.mark.parametrize("extension", [".exr", ".hdr", ".png"])
def test_what_no_picture_can_show_is_repaired_and_counted(tmp_path, extension):
    image = np.full((1, 5, 3), 0.5, np.float32)
    image[0, :4, 1] = np.nan, np.inf, -np.inf, -1
    written = output.write_image(tmp_path / f"x{extension}", image)
    read = np.array(mi.Bitmap(str(written.paths[0]))).astype(float)[0, :, 1]
    white = 255 if extension == ".png" else 1
    assert written.repaired == 4 and read[:4].tolist() == [0, white, 0, 0]


def test_a_bmp_is_always_beside_it(tmp_path, image):
    written = output.write_outputs(tmp_path / "x.hdr", image)
    assert written.paths == (tmp_path / "x.hdr", tmp_path / "x.bmp")
    with Image.open(tmp_path / "x.bmp") as read:
        assert np.array_equal(np.array(read), encoded(image))
    assert output.write_outputs(tmp_path / "y.Bmp", image).paths == (tmp_path / "y.Bmp",)
    assert sorted(os.listdir(tmp_path)) == ["x.bmp", "x.hdr", "y.Bmp"]


@pytest.mark.parametrize("shape", [(4, 4), (4, 4, 4), (0, 4, 3)])
def test_other_shapes_are_refused(tmp_path, shape):
    with pytest.raises(ValueError, match="height, width, 3"):
        output.write_image(tmp_path / "x.png", np.zeros(shape))


# ---- failure


@pytest.mark.parametrize("extension", output.WRITERS)
def test_a_full_disk_leaves_the_old_picture_and_nothing_else(tmp_path, extension):
    """A limit on the size of files stands in for the disk; it must hold in a process of its own."""
    pytest.importorskip("resource")
    path = tmp_path / f"x{extension}"
    path.write_text("old")
    code = """if True:
        import resource, signal, sys
        import numpy as np
        from relume import output
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        image = np.random.default_rng(0).random((99, 99, 3))
        resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))
        try:
            output.write_image(sys.argv[1], image)
        except output.OutputError as error:
            print(error)
    """
    run = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True)
    assert run.stdout.startswith(f"cannot write {path}: "), run.stdout + run.stderr
    assert path.read_text() == "old" and os.listdir(tmp_path) == [path.name]


def test_an_interrupted_write_leaves_nothing(tmp_path, image, monkeypatch):
    def interrupted(path, contents):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setitem(output.WRITERS, ".png", (interrupted, False))
    with pytest.raises(KeyboardInterrupt):
        output.write_image(tmp_path / "x.png", image)
    assert not os.listdir(tmp_path)


def test_a_place_that_cannot_be_written_is_named_before_rendering(tmp_path):
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "x.png"
    for attempt in (lambda: output.check_writable(path), lambda: output.safe_path("x/y.png", path)):
        with pytest.raises(output.OutputError, match="file"):
            attempt()
    output.check_writable(tmp_path / "new" / "x.png")
    assert os.listdir(tmp_path / "new") == []


def test_files_get_the_modes_of_new_files(tmp_path, image):
    (tmp_path / "plain").write_text("")
    path = output.write_image(tmp_path / "x.png", image).paths[0]
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE((tmp_path / "plain").stat().st_mode)


def test_a_large_text_picture_takes_well_under_a_second(tmp_path):
    image = np.random.default_rng(0).random((960, 1280, 3), np.float32)
    output.write_image(tmp_path / "x.ppm", image)
    taken = []
    for _ in range(3):
        start = time.process_time()
        output.write_image(tmp_path / "x.ppm", image)
        taken.append(time.process_time() - start)
    assert min(taken) < 1
