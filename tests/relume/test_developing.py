"""`relume develop`: linear pictures, of any renderer, as pictures to look at."""

import numpy as np
import OpenEXR
import pytest
from click.testing import CliRunner
from PIL import Image

from relume import denoising, developing, layer_names, metadata, output
from relume.cli import main
from relume.tone import Look

RNG = np.random.default_rng(3)


def exr(path, channels, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    OpenEXR.File(header, channels).write(str(path))
    return path


@pytest.fixture
def planes():
    return [RNG.random((6, 8), np.float32) for _ in range(9)]


@pytest.mark.parametrize(
    "names",
    [
        ("R", "G", "B"),
        ("ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"),
        ("rgba.red", "rgba.green", "rgba.blue"),
        ("anything.R", "anything.G", "anything.B"),
    ],
)
def test_the_colours_are_found_among_other_layers(tmp_path, planes, names):
    others = ("ViewLayer.Normal.X", "ViewLayer.Normal.Y", "ViewLayer.Normal.Z", "Z", "a.G", "a.B")
    path = exr(tmp_path / "a.exr", dict(zip((*names, *others), planes, strict=True)))
    assert np.array_equal(developing.read(path).image, np.stack(planes[:3], axis=-1))


def test_the_picture_comes_before_layers_of_colour(tmp_path, planes):
    names = ("albedo.R", "albedo.G", "albedo.B", "beauty.R", "beauty.G", "beauty.B")
    path = exr(tmp_path / "a.exr", dict(zip(names, planes, strict=False)))
    assert np.array_equal(developing.read(path).image, np.stack(planes[3:6], axis=-1))


def test_colours_without_a_layer_come_before_any_layer(tmp_path, planes):
    names = ("beauty.R", "beauty.G", "beauty.B", "R", "G", "B")
    path = exr(tmp_path / "a.exr", dict(zip(names, planes, strict=False)))
    assert np.array_equal(developing.read(path).image, np.stack(planes[3:6], axis=-1))


def test_parts_are_layers_by_their_names_and_those_of_another_size_are_left_out(tmp_path, planes):
    """Parts of one file may have channels of the same names."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {
        "N": dict(zip("XYZ", planes[:3], strict=True)),
        "combined": dict(zip("RGB", planes[3:6], strict=True)),
        "albedo": dict(zip("RGB", planes[6:9], strict=True)),
        "small": dict.fromkeys("RGB", np.ones((2, 2), "f4")),
    }
    header["displayWindow"] = ((0, 0), (7, 5))
    parts = [OpenEXR.Part(dict(header), given, name) for name, given in channels.items()]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    found = developing.read(tmp_path / "a.exr")
    assert np.array_equal(found.image, np.stack(planes[3:6], axis=-1))
    guides = denoising.guides(found.planes)
    assert np.array_equal(guides["albedo"], np.stack(planes[6:9], axis=-1))
    assert np.array_equal(guides["normal"], np.stack(planes[:3], axis=-1))
    assert not any(name.startswith("small") for name in found.planes)


def test_luminance_alone_is_grey(tmp_path, planes):
    path = exr(tmp_path / "a.exr", {"Y": planes[0]})
    assert np.array_equal(developing.read(path).image, np.stack([planes[0]] * 3, axis=-1))


def test_layers_are_found_by_other_programs_names(tmp_path, planes):
    names = [f"ViewLayer.Denoising Albedo.{c}" for c in "RGB"]
    found = layer_names.layer(dict(zip(names, planes, strict=False)), "denoising_albedo")
    assert np.array_equal(found, np.stack(planes[:3], axis=-1))
    assert layer_names.layer({"albedo.R": planes[0]}, "albedo") is None


def test_a_render_is_developed_as_it_was_rendered(room, tmp_path, monkeypatch):
    """The PNG of the scene, with its gamma, is that of its developed EXR."""
    monkeypatch.chdir(tmp_path)
    path = str(room("gamma_offset\n0.4"))
    for name in ("a.exr", "b.png"):
        assert CliRunner().invoke(main, ["render", path, "-o", name]).exit_code == 0
    assert CliRunner().invoke(main, ["develop", "a.exr", "-o", "a.png"]).exit_code == 0
    assert np.array_equal(np.asarray(Image.open("a.png")), np.asarray(Image.open("b.png")))
    facts = metadata.of_file("a.png")
    assert facts["relume.scene"] == "room.txt" and "relume.look" not in facts
    assert facts["Software"].startswith("relume ")


def test_exposure_and_curve_are_applied_and_told(tmp_path):
    image = np.full((4, 4, 3), 0.02, np.float32)
    output.write_image(tmp_path / "a.exr", image)
    words = [str(tmp_path / "a.exr"), "-o", str(tmp_path / "a.png")]
    result = CliRunner().invoke(
        main, ["develop", *words, "--exposure", "auto", "--tone-map", "aces"]
    )
    assert result.exit_code == 0, result.output
    look = Look("auto", "aces")
    assert np.array_equal(
        np.asarray(Image.open(words[2])), output.encode_display(look.applied(image))
    )
    assert metadata.of_file(words[2])["relume.look"] == "exposure +3.17, aces"
    assert "exposure +3.17, aces" in result.stderr


def test_what_is_no_linear_picture_is_refused(tmp_path):
    (tmp_path / "broken.exr").write_bytes(b"no picture")
    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    for name, why in (("broken.exr", "cannot read"), ("a.png", "expected a linear"), ("b.exr", "")):
        result = CliRunner().invoke(
            main, ["develop", str(tmp_path / name), "-o", str(tmp_path / "x.png")]
        )
        assert result.exit_code == 1 and why in result.stderr and "Traceback" not in result.output


def test_the_picture_that_is_read_is_not_written_over(tmp_path, planes):
    path = exr(tmp_path / "a.exr", {"Y": planes[0]})
    result = CliRunner().invoke(main, ["develop", str(path), "-o", str(path)])
    assert result.exit_code == 1 and "is the picture that is read" in result.stderr
