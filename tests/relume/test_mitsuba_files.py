"""Mitsuba scenes (XML) by relume's commands and functions: as Mitsuba renders them."""

import os
import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from click.testing import CliRunner

import relume
from relume import mitsuba_files, output
from relume.cli import main
from relume.convert import write_xml
from relume.session import CannotRender, Session

SCENE = """\
<scene version="3.0.0">
    <default name="depth" value="4"/>
    <integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
    <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.7 0.2 0.1"/></bsdf>
    <shape type="rectangle">
        <transform name="to_world">
            <rotate x="1" angle="-90"/><scale value="4"/><translate y="-1"/>
        </transform>
        <bsdf type="twosided"><bsdf type="diffuse" id="chess">
            <texture type="bitmap" name="reflectance">
                <string name="filename" value="pictures/dots.png"/>
                <string name="filter_type" value="nearest"/>
            </texture>
        </bsdf></bsdf>
    </shape>
    <shape type="sphere"><point name="center" x="-1" y="0" z="0"/><ref id="red"/></shape>
    <shape type="sphere">
        <point name="center" x="1.2" y="0" z="0"/>
        <bsdf type="ward">
            <float name="alpha_u" value="0.2"/><float name="alpha_v" value="0.2"/>
            <rgb name="specular_reflectance" value="0.5"/>
            <spectrum name="diffuse_reflectance" value="0.2"/>
        </bsdf>
    </shape>
    <shape type="sphere">
        <float name="radius" value="0.4"/><point name="center" x="0" y="-0.5" z="1.5"/>
        <ref id="chess"/>
    </shape>
    <sensor type="perspective" id="camera">
        <float name="fov" value="50"/>
        <transform name="to_world">
            <lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="32"/><integer name="height" value="24"/>
            FILM
        </film>
        <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
    </sensor>
    <emitter type="constant">
        <spectrum name="radiance" value="400:0.5, 560:0.9, 700:0.6"/>
    </emitter>
    <emitter type="point">
        <point name="position" x="3" y="5" z="4"/><rgb name="intensity" value="60 50 40"/>
    </emitter>
</scene>
"""


@pytest.fixture
def scene(tmp_path):
    """A function that writes the scene and its picture into a folder, and returns its path."""
    (tmp_path / "xml" / "pictures").mkdir(parents=True)
    dots = np.random.default_rng(0).integers(50, 250, (8, 8, 3), np.uint8)
    mi.set_variant("llvm_ad_rgb")
    mi.Bitmap(dots).write(str(tmp_path / "xml" / "pictures" / "dots.png"))

    def write(film='<rfilter type="box"/>', **changes):
        text = SCENE.replace("FILM", film)
        for old, new in changes.values():
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "xml" / "scene.xml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A function that runs a command in an empty folder."""
    folder = tmp_path / "cwd"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return lambda *words: CliRunner().invoke(main, [str(word) for word in words])


def mean(picture, rows=3, columns=4):
    """Means of blocks of a picture of 32x24 pixels."""
    return picture.reshape(rows, 24 // rows, columns, 32 // columns, 3).mean(axis=(1, 3))


def sessions(path, seed, count=16, **options):
    """Pictures of a file that `mi.load_file` loaded: (count, 24, 32, 3)."""
    mi.set_variant("llvm_ad_rgb")
    loaded = mi.load_file(str(path), optimize=False)
    made = [Session(loaded, 16, seed + k) for k in range(count)]
    for one in made:
        for _ in one.run():
            pass
    return np.array([one.image() for one in made])


# ---- the picture


def test_the_picture_is_that_of_the_scene_as_mitsuba_loads_it(scene):
    """Sample by sample, up to the rounding of transformations."""
    path = scene()
    (expected,) = sessions(path, 5, 1)
    picture = relume.render(path, seed=5)
    assert picture.shape == (24, 32, 3)
    assert np.mean(np.abs(picture - expected) > 1e-3 * expected.mean()) < 0.02


@pytest.mark.parametrize("film", ["", '<rfilter type="tent"/>', '<rfilter type="gaussian"/>'])
def test_the_reconstruction_filter_is_the_films(scene, film):
    """Against Mitsuba's own film, with the pixels' scatter by numbers like Mitsuba's as measure."""
    path = scene(film)
    mi.set_variant("llvm_ad_rgb")
    loaded = mi.load_file(str(path))
    expected = np.array(mi.render(loaded, spp=4096, seed=3))[..., :3]
    options = {"spp": 64, "sampler": "independent"}
    runs = np.array([relume.render(path, seed=seed, **options) for seed in range(24)])
    error = runs.std(axis=0, ddof=1) / np.sqrt(len(runs))
    z = (runs.mean(axis=0) - expected) / np.maximum(error, 1e-3)
    inner = z[3:-3, 3:-3]  # splats over the border are weighted otherwise
    assert np.sqrt(np.mean(inner**2)) < 1.5 and np.abs(inner).max() < 6


def test_a_filter_with_negative_weights_is_refused(scene, run):
    result = run("render", scene('<rfilter type="mitchell"/>'), "-o", "a.exr")
    assert result.exit_code == 1 and "expected a box, tent or gaussian" in result.stderr


def test_a_crop_window_is_the_picture(scene):
    """The lower right quarter of the film, seen alone."""
    whole = scene()
    expected = sessions(whole, 0, 32).mean(axis=0)[12:, 16:]
    crop = '<rfilter type="box"/>' + "".join(
        f'<integer name="crop_{name}" value="{value}"/>'
        for name, value in (("offset_x", 16), ("offset_y", 12), ("width", 16), ("height", 12))
    )
    path = scene(crop)
    picture = relume.render(path, spp=512)
    assert picture.shape == expected.shape
    assert np.abs(picture - expected).mean() < 0.05 * expected.mean()
    with pytest.raises(CannotRender, match="a film with a crop window has no other size"):
        relume.render(path, size=(8, 8))


def test_converted_scenes_give_the_picture_of_their_scene_file(room, tmp_path):
    """Bit for bit where nothing is rounded on the way."""
    path = room(objects="OBJECT\nsphere 0 1 3 1\ncolor 1 1 1\nreflection reflection\n")
    out = write_xml(path, tmp_path / "out" / "room.xml")[0]
    for options in ({}, {"spp": 8, "size": (16, 12), "seed": 3, "integrator": "volpath"}):
        assert np.array_equal(relume.render(out, **options), relume.render(path, **options))


def test_media_around_everything_convert(room, tmp_path):
    path = room("participatingMedia\n1\nSCATTERING\n0\n0.02 0.02 0.02\nABSORBING\n0\n0 0 0")
    out = write_xml(path, tmp_path / "fog.xml")[0]
    a, b = (relume.render(p, spp=256).mean(axis=(0, 1)) for p in (path, out))
    np.testing.assert_allclose(a, b, rtol=0.02)


def test_dispersive_glass_sets_the_spectral_variant(room, tmp_path):
    prism = "OBJECT\nsphere 0 1 2 1\ncolor 1 1 1\nreflection reflection1\n1.04 0.2\n"
    path = room(objects=prism)
    out = write_xml(path, tmp_path / "prism.xml")[0]
    assert mitsuba_files.plan_of(mitsuba_files.read(out)).variant == "llvm_ad_spectral"
    assert np.array_equal(relume.render(out), relume.render(path))


# ---- what is asked for


def test_size_and_samples_are_the_files_or_those_asked_for(scene):
    source = mitsuba_files.read(scene())
    assert (source.image, source.spp) == ((32, 24), 16)
    other = source.resized((8, 6), 3)
    assert (other.image, other.spp) == ((8, 6), 3)
    assert relume.render(scene(), size=(8, 6), spp=1).shape == (6, 8, 3)


def test_what_a_file_leaves_out_has_mitsubas_defaults(tmp_path):
    path = tmp_path / "bare.xml"
    path.write_text('<scene version="3.0.0"><sensor type="perspective"/></scene>')
    source = mitsuba_files.read(path)
    assert (source.image, source.spp) == ((768, 576), 4)
    assert relume.render(path, size=(4, 3), spp=1).tolist() == np.zeros((3, 4, 3)).tolist()


def test_load_gives_the_scene_with_its_seed_and_samples(scene):
    mi.set_variant("llvm_ad_rgb")
    loaded = relume.load(scene(), spp=3)
    assert loaded.sensors()[0].sampler().sample_count() == 3
    assert len(loaded.shapes()) == 4


def test_files_are_found_beside_the_xml_in_its_paths_and_in_asset_folders(scene, tmp_path):
    path = scene()
    elsewhere = tmp_path / "elsewhere"
    os.renames(path.parent / "pictures", elsewhere / "pictures")
    with pytest.raises(CannotRender, match=r"no such file 'pictures/dots\.png'; --asset-path"):
        relume.render(path)
    assert relume.render(path, spp=1, asset_path=elsewhere).shape == (24, 32, 3)
    own = f'<path value="{elsewhere}"/><default name="depth"'
    assert relume.render(scene(path=('<default name="depth"', own)), spp=1).shape == (24, 32, 3)
    with pytest.raises(CannotRender, match="no such file"):
        relume.render(path.with_name("b.xml"))


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("<scene version", "<scene verion", "scene.xml"),
        ('type="ward"', 'type="wart"', "wart"),
        ('<ref id="red"/>', '<ref id="green"/>', "green"),
        ('type="constant"', 'type="constant" id="red"', "red"),
    ],
)
def test_errors_are_one_readable_line(scene, run, old, new, said):
    result = run("render", scene(change=(old, new)), "-o", "a.exr")
    assert result.exit_code == 1 and result.stdout == ""
    assert said in result.stderr and len(result.stderr.strip().splitlines()) == 1
    assert "Traceback" not in result.stderr


def test_what_only_scene_files_have_is_refused(scene):
    path = scene()
    with pytest.raises(ValueError, match="a Mitsuba scene has none"):
        relume.render(path, dialect="prender")
    with pytest.raises(ValueError, match="a Mitsuba scene; relume"):
        relume.read(path)
    with pytest.raises(ValueError, match="not Mitsuba scenes"):
        relume.stability(path, expected=1)


POSE = '<lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/>'
PINHOLE = '<sensor type="perspective" id="camera">'
LENS = '<sensor type="thinlens" id="camera"><float name="aperture_radius" value="1"/>'
LENS += '<float name="focus_distance" value="{}"/>'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (POSE, '<matrix value="nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>', "to_world is not finite"),
        (POSE, '<translate x="inf"/>', "to_world is not finite: 1 0 0 inf"),
        (POSE, '<translate y="1e39"/>', "to_world is not finite"),
        (POSE, POSE.replace("0, 1, 6", "0, 9, 0"), "lookat"),
        (POSE, '<scale value="0"/>', "Scale factors"),
        ('"fov" value="50"', '"fov" value="nan"', "the sensor has no rays"),
        ('"fov" value="50"', '"fov" value="180"', "field of view"),
        (PINHOLE, LENS.format("0"), "the sensor has no rays"),
        (PINHOLE, LENS.format("inf"), "the sensor has no rays"),
        (PINHOLE, LENS.format("1e30"), "the sensor has no rays"),
    ],
)
def test_cameras_without_rays_are_errors(scene, old, new, said):
    """They see nothing: the background, without a word."""
    with pytest.raises(CannotRender, match=said):
        relume.render(scene(change=(old, new)), spp=1)


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "scalar_rgb"])
def test_cameras_without_rays_are_errors_in_every_variant(tmp_path, variant):
    path = tmp_path / "bare.xml"
    lens = LENS.format("0").replace(' id="camera"', "")
    path.write_text(f'<scene version="3.0.0">{lens}</sensor></scene>')
    with pytest.raises(CannotRender, match=r"bare\.xml: the sensor has no rays"):
        relume.render(path, spp=1, variant=variant)


def test_a_picture_without_light_says_so(scene, run):
    """Emitters may have Mitsuba's own brightness; none at all is told."""
    lamps = SCENE[SCENE.index('<emitter type="constant">') :]
    plain = lamps.replace(lamps, '<emitter type="constant"/></scene>')
    bright = run("render", scene(change=(lamps, plain)), "-o", "a.exr", "--spp", "1")
    dark = run("render", scene(change=(lamps, "</scene>")), "-o", "b.exr", "--spp", "1")
    assert "nothing shines" in dark.stdout + dark.stderr
    assert "nothing shines" not in bright.stdout + bright.stderr


# ---- commands


def test_convert_ends_with_the_command_that_renders(room, run):
    result = run("convert", room(spp=2), "-o", "out/a.xml")
    last = result.stderr.strip().splitlines()[-1]
    assert last == "render it by: relume render out/a.xml -o out/a.exr"
    assert run(*last.partition("relume ")[2].split()).stdout == "out/a.exr\n"


def test_the_xml_begins_with_what_it_needs(room, run, tmp_path):
    (tmp_path / "a--b.txt").write_bytes(room().read_bytes())
    run("convert", tmp_path / "a--b.txt", "-o", "a--b.xml")
    comment = Path("a--b.xml").read_text().partition("-->")[0]
    assert comment.startswith("<!--") and "--" not in comment[4:]
    for part in ("llvm_ad_rgb", "Mitsuba 3.9", "relume render", "import relume", "optimize=False"):
        assert part in comment
    assert run("render", "a--b.xml", "-o", "a.exr", "--spp", 1).exit_code == 0


def test_passes_are_resumed_and_limits_kept(scene, run):
    path = scene()
    whole = run("render", path, "-o", "a.exr", "--spp", 64, "--seed", 2, "--per-pass", 16)
    assert whole.stdout == "a.exr\n", whole.stderr
    words = ("render", path, "-o", "b.exr", "--spp", 64, "--seed", 2, "--per-pass", 16)
    assert "time limit reached" in run(*words, "--time-limit", 0).stderr
    assert os.path.exists("b.passes.exr")
    assert run(*words, "--resume").exit_code == 0
    assert Path("a.exr").read_bytes() == Path("b.exr").read_bytes()
    changed = scene(light=("60 50 40", "61 50 40"))
    run(*words[:1], changed, *words[2:], "--keep")
    refused = run("render", scene(), *words[2:], "--resume")
    assert refused.exit_code == 1 and "another content" in refused.stderr


def test_without_o_the_picture_is_named_after_the_file(scene, run):
    result = run("render", scene(), "--spp", 1)
    assert result.stdout.splitlines()[0].rpartition("/")[2].startswith("scene_1x1_")
    assert result.stdout.splitlines()[0].endswith("(1spp).exr")


def test_workers_get_the_file_and_all_that_it_names(scene, run):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    path = scene()
    words = ("--spp", 32, "--per-pass", 8, "--seed", 1)
    assert run("render", path, "-o", "a.exr", *words).exit_code == 0
    assert run("render", path, "-o", "b.exr", *words, "--workers", 2).exit_code == 0
    assert Path("a.exr").read_bytes() == Path("b.exr").read_bytes()


def test_nothing_is_written_over_what_it_names(scene, run):
    path = scene()
    os.link(path.parent / "pictures" / "dots.png", "a.exr")
    os.link(path, "b.exr")
    for name in ("a.exr", "b.exr"):
        result = run("render", path, "-o", name)
        assert result.exit_code == 1 and "the scene reads this file" in result.stderr


def test_compare_and_chart_take_it(scene, run):
    path = scene()
    result = run("compare", path, "--runs", 8, "--spp", 64, "--size", "16x12")
    assert result.exit_code == 0, result.stderr
    result = run("chart", path, "--seconds", 0.2, "--runs", 4, "--cache", "cache", "-o", "out")
    assert result.exit_code == 0, result.stderr
    assert "path" in result.stdout and os.path.exists("out/scene.svg")


def test_methods_that_change_the_document_are_left_out(tmp_path):
    path = Path(relume.__file__).parent.parent / "scenes" / "sss.txt"
    out = write_xml(path, tmp_path / "milk.xml")[0]
    for method in ("simulation", "dipole-normalized"):
        with pytest.raises(CannotRender, match="only scene files"):
            relume.compare(out, with_=method, runs=8, spp=8, size=(8, 6))
    picture = tmp_path / "milk.exr"
    output.write_image(picture, relume.render(path, size=(8, 6), spp=64))
    found = relume.compare(out, with_=str(picture), runs=8, spp=64)
    assert found.sides[0].name == "dipole" and found.agree


def test_the_command_needs_no_variant_to_be_set(scene, tmp_path):
    """In a process of its own, where nothing has set one."""
    code = "from relume.cli import main; main()"
    words = ["render", str(scene()), "-o", str(tmp_path / "a.exr"), "--spp", "1"]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
