"""Denoised pictures: what they are made of, and that they say what they are."""

import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from relume import denoising, developing, metadata, output
from relume.cli import main
from relume.session import CannotRender

installed = pytest.mark.skipif(
    not __import__("importlib.util").util.find_spec("mitsuba_oidn"),
    reason="the package mitsuba-oidn is not installed",
)
SIZE = (48, 64)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def checker():
    """A picture of squares under a gradient, and what stands in it: albedo without light."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    albedo = np.where((x // 8 + y // 8) % 2, 0.8, 0.2)[..., None] * np.array([1, 0.7, 0.4])
    light = (1 + x / SIZE[1])[..., None]
    return (albedo * light).astype("f4"), albedo.astype("f4")


@installed
def test_noise_goes_and_edges_of_the_guides_stay():
    truth, albedo = checker()
    noisy = truth * np.random.default_rng(1).gamma(1, 1, truth.shape).astype("f4")
    flat = np.broadcast_to(np.array([0, 0, 1], "f4"), truth.shape)
    plain = denoising.denoised(noisy)
    guided = denoising.denoised(noisy, {"albedo": albedo, "normal": flat})
    errors = [np.square(image - truth).mean() for image in (noisy, plain, guided)]
    assert errors[1] < errors[0] / 4 and errors[2] < errors[1] / 1.5


def test_the_more_is_known_the_less_is_guessed():
    """A guess that differs by d counts v / (d² - 2 v + v): all where noise explains d."""
    image = np.zeros((16, 16, 3), "f4")
    guess = np.full((16, 16, 3), 0.3, "f4")
    for v, share in ((1.0, 1.0), (0.045, 1.0), (0.0009, 1 / 99), (0.0, 0.0)):
        found = denoising.shrunk(guess, image, np.full(image.shape, v))
        assert found == pytest.approx(0.3 * share, rel=0.02, abs=1e-6), v


def test_the_difference_is_judged_over_seven_by_seven_pixels():
    """One pixel that differs by 7 d counts as all of them by d."""
    guess = np.zeros((16, 16, 3), "f4")
    guess[8, 8] = 7 * 0.3
    image = np.zeros_like(guess)
    found = denoising.shrunk(guess, image, np.full(image.shape, 0.0009))
    assert found[8, 8] == pytest.approx(7 * 0.3 / 99, rel=0.02)


@installed
def test_a_denoised_picture_lies_beside_the_rendered_one_and_says_so(room, here):
    result = run("render", room(), "-o", "a.png", "--denoise")
    assert result.stdout == "a.png\na.denoised.png\n", result.output
    run("render", room(), "-o", "b.png")
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes(), "the rendered one as ever"
    assert metadata.DENOISED not in metadata.of_file("a.png")
    assert "Open Image Denoise" in metadata.of_file("a.denoised.png")[metadata.DENOISED]
    a, b = (np.asarray(Image.open(p), float) for p in ("a.png", "a.denoised.png"))
    assert a.shape == b.shape and not np.array_equal(a, b) and abs(a.mean() - b.mean()) < 3


@installed
def test_finished_pictures_are_denoised_with_their_guides(room, here, monkeypatch):
    run("render", room(), "-o", "a.exr", "--denoise")
    asked = []
    original = denoising.denoised
    monkeypatch.setattr(denoising, "denoised", lambda *a: asked.append(a) or original(*a))
    result = run("develop", "a.exr", "-o", "b.png", "--denoise")
    assert result.stdout == "b.denoised.png\n", result.output
    assert set(asked[0][1]) == {"albedo", "normal"}
    assert metadata.DENOISED in metadata.of_file("b.denoised.png")
    result = run("develop", "a.denoised.exr", "-o", "c.png")
    assert metadata.DENOISED in metadata.of_file("c.png"), "the mark stays"


@installed
def test_denoised_pictures_are_never_measured(room, here):
    run("render", room(), "-o", "a.exr", "--denoise")
    result = run("compare", room(), "--with", "a.denoised.exr", "--spp", 64)
    assert result.exit_code == 1 and "is denoised" in result.stderr


@installed
def test_folders_show_the_denoised_pictures(room, here):
    assert run("render", room(), room(name="b.txt"), "-o", "out", "--denoise").exit_code == 0
    page = Path("out/index.html").read_text()
    assert 'src="room.denoised.png"' in page and "denoised" in page
    result = run("render", room(), here / "b.txt", "-o", "out", "--denoise", "--resume")
    assert "2 were there already" in result.stderr
    Path("out/room.denoised.exr").unlink()
    result = run("render", room(), here / "b.txt", "-o", "out", "--denoise", "--resume")
    assert "1 were there already" in result.stderr and Path("out/room.denoised.exr").exists()


def test_without_the_package_it_is_said_before_rendering(room, here, monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba_oidn", None)
    result = run("render", room(), "-o", "a.png", "--spp", 10**9, "--denoise")
    assert result.exit_code == 1 and "pip install 'relume[denoise]'" in result.stderr
    with pytest.raises(CannotRender):
        denoising.library()


@pytest.mark.parametrize("name, marked", [("a.png", "a.denoised.png"), ("b.denoised.exr",) * 2])
def test_names_are_marked_once(name, marked):
    assert denoising.marked(name) == Path(marked)


@installed
def test_what_is_no_number_does_not_spread():
    image = np.ones((*SIZE, 3), "f4")
    image[10, 10] = np.nan
    assert np.isfinite(denoising.denoised(image)).all()


def test_a_normal_alone_is_no_guide(tmp_path):
    planes = {f"N.{c}": np.zeros((2, 2), "f4") for c in "XYZ"}
    assert set(denoising.guides(planes)) == {"normal"}
    output.write_image(tmp_path / "a.exr", np.ones((2, 2, 3)), finish=output.Finish(layers=planes))
    assert set(developing.read(tmp_path / "a.exr").planes) == {"R", "G", "B", *planes}
