"""relume from Python: read, load, render, and the choice of the variant."""

import dataclasses
import itertools
import subprocess
import sys
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

import relume
from relume import passes, translator
from relume.session import CannotRender, Session

GLASS = "OBJECT\nsphere 0 1 2 1\ncolor 1 1 1\nreflection reflection\n"
DISPERSIVE = GLASS + "reflection reflection99\n"


def test_read_gives_the_typed_document(room):
    document = relume.read(room())
    assert document.image == (32, 24) and document.background == (0.4, 0.5, 0.7)
    assert len(document.objects) == 4


def test_read_lists_every_error(tmp_path):
    path = tmp_path / "broken.txt"
    path.write_text("IMAGE\n0 240\nSAMPLNG\n3\n")
    with pytest.raises(relume.SceneError) as error:
        relume.read(path)
    assert [(p.line, p.kind) for p in error.value.problems] == [(2, "range"), (3, "keyword")]


def test_the_environment_overrides_the_file(room, monkeypatch):
    monkeypatch.setenv("IMAGE_X", "2*8")
    assert relume.read(room()).image == (16, 24)
    assert relume.read(room(), {}).image == (32, 24)


def test_load_gives_what_mitsuba_renders(room):
    """The scene's samples come with it, so `mi.render` needs no more than the scene."""
    mi.set_variant("llvm_ad_rgb")
    scene = relume.load(relume.read(room(spp=6)))
    assert scene.sensors()[0].sampler().sample_count() == 6
    assert np.array(mi.render(scene)).shape == (24, 32, 3)


def test_to_dict_gives_what_mitsuba_loads(room):
    mi.set_variant("llvm_ad_rgb")
    scene = relume.to_dict(room(), spp=3, size=(8, 6))
    scene["integrator"] = {"type": "depth"}
    image = np.array(mi.render(mi.load_dict(scene, optimize=False)))
    assert image.shape[:2] == (6, 8) and image.max() > 11


@pytest.mark.parametrize("function", [relume.load, relume.to_dict, relume.render])
def test_all_take_paths_and_leave_documents_alone(room, function):
    mi.set_variant("llvm_ad_rgb")
    path = room("tentfilter\n1")
    document = relume.read(path)
    before = dataclasses.replace(document)
    for scene in (document, path, str(path)):
        function(scene, spp=1, seed=3, integrator="direct")
    assert document == before


@pytest.mark.parametrize("function", [relume.load, relume.to_dict, relume.render, relume.read])
def test_what_is_no_scene_is_said_in_words(function):
    mi.set_variant("llvm_ad_rgb")
    scene = {"type": "scene"}
    for wrong, said in (
        (scene, "expected the path of a scene file.*, found dict"),
        (mi.load_dict(scene), r"found mitsuba\.Scene"),
        (3, "found int"),
    ):
        with pytest.raises(TypeError, match=said):
            function(wrong)
    if function is not relume.read:
        with pytest.raises(TypeError, match=r"Mitsuba's own is rendered by mi\.render"):
            function(scene)


def test_render_gives_linear_rgb_from_the_top(room):
    """The upper edge shows the sky, whose radiance is known exactly."""
    image = relume.render(room("CAMERA_UPVEC\n0 1 0"))
    assert image.shape == (24, 32, 3) and image.dtype == np.float32
    assert np.allclose(image[0, 0], (0.4, 0.5, 0.7)) and not np.allclose(image[-1, 0], image[0, 0])


def test_render_takes_size_samples_and_document(room):
    document = relume.read(room())
    image = relume.render(document, size=(10, 6), spp=3, seed=2)
    assert image.shape == (6, 10, 3)
    assert np.array_equal(image, relume.render(room(), size=(10, 6), spp=3, seed=2))


def test_options_and_changes_to_them(room):
    options = relume.RenderOptions(size=(10, 6), spp=3)
    image = relume.render(room(), options, seed=2)
    assert np.array_equal(image, relume.render(room(), size=(10, 6), spp=3, seed=2))
    assert options.seed == 0
    with pytest.raises(TypeError, match="unknown option 'sed'; did you mean 'seed'"):
        relume.render(room(), options, sed=2)


def test_the_dialect_changes_the_picture(room):
    """CAMERA_ANGLE: the horizontal field of view for the manual, the vertical for the program."""
    path = room("CAMERA_ANGLE\n40")
    manual, program = (relume.render(path, dialect=name) for name in ("manual", "prender"))
    assert not np.array_equal(manual, program)


# ---- variants


@pytest.mark.parametrize("before", ["scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral"])
def test_the_variant_set_before_is_set_afterwards(room, before):
    mi.set_variant(before)
    relume.render(room(objects=DISPERSIVE), spp=1)
    assert mi.variant() == before


def test_it_is_set_again_after_an_error(room):
    mi.set_variant("llvm_ad_rgb")
    with pytest.raises(CannotRender, match="integrator 'nope'"):
        relume.render(room(objects=DISPERSIVE), integrator="nope")
    assert mi.variant() == "llvm_ad_rgb"


def test_only_dispersion_needs_wavelengths(room):
    plans = [translator.translate(relume.read(room(objects=o))).plan for o in (GLASS, DISPERSIVE)]
    assert [plan.variant for plan in plans] == ["llvm_ad_rgb", "llvm_ad_spectral"]


@pytest.mark.parametrize("function", [relume.load, relume.to_dict])
def test_wavelengths_are_not_left_out_silently(room, function):
    """Under a variant without wavelengths the message names the one to set, and both ways work."""
    mi.set_variant("llvm_ad_rgb")
    path = room(objects=DISPERSIVE)
    said = r"needs wavelengths \(glass.*llvm_ad_rgb.*mi\.set_variant\('llvm_ad_spectral'\)"
    with pytest.raises(CannotRender, match=said):
        function(path)
    assert mi.variant() == "llvm_ad_rgb"
    function(path, variant="llvm_ad_rgb")
    assert mi.variant() == "llvm_ad_rgb"
    mi.set_variant("llvm_ad_spectral")
    function(path)
    function(path, dialect="prender")
    assert mi.variant() == "llvm_ad_spectral"


def test_load_refuses_a_scalar_variant_where_plugins_need_another(room):
    mi.set_variant("scalar_rgb")
    relume.load(room(), spp=1)
    said = r"scalar_rgb does not run .*schlickglass; call mi\.set_variant\('llvm_ad_rgb'\) before"
    with pytest.raises(CannotRender, match=said):
        relume.load(room(objects=GLASS))
    relume.load(room(objects=GLASS), variant="llvm_ad_rgb")
    assert mi.variant() == "llvm_ad_rgb"


def test_load_sets_the_variant_that_is_needed_if_none_is(room):
    """In a process of its own: once set, a variant cannot be unset."""
    code = """
import sys, mitsuba as mi, numpy as np, relume
assert mi.variant() is None
scene = relume.load(sys.argv[1], spp=1)
assert mi.variant() == "llvm_ad_spectral", mi.variant()
assert np.array(mi.render(scene)).mean() > 0
"""
    path = room(objects=DISPERSIVE)
    subprocess.run([sys.executable, "-c", code, path], cwd=path.parent, check=True)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("kind", ["mono", "spectral", "spectral_polarized"])
def test_other_variants_give_the_same_brightness(room, kind, chance, level):
    """Grey scene, eight runs of 768 pixels of 16 samples."""
    path = room(spp=16)
    text = path.read_text()
    for color in ("0.7 0.6 0.5", "0.2 0.4 0.8", "0.9 0.8 0.6", "0.4 0.5 0.7", "6 5 4"):
        text = text.replace(color, color.split()[0] + " " + " ".join([color.split()[0]] * 2))
    path.write_text(text)

    def mean(variant):
        pictures = (relume.render(path, variant=variant, seed=chance.seed()) for _ in range(8))
        return level([picture.mean() for picture in pictures])

    chance.equal(mean(f"llvm_ad_{kind}"), mean("llvm_ad_rgb"), allowed=5e-3, precision=5e-3)


BOX = [
    (corner, u, v)
    for corner, edges in (((-1,) * 3, 1), ((1,) * 3, -1))
    for u, v in (
        ((2 * edges, 0, 0), (0, 2 * edges, 0)),
        ((0, 2 * edges, 0), (0, 0, 2 * edges)),
        ((0, 0, 2 * edges), (2 * edges, 0, 0)),
    )
]
"""Corner and edges of the walls of a closed box."""

DOME = "OBJECT\nsphere 0 0 0 30\nibl_texture sky.png\npanoramic_map 1\n"


@pytest.fixture
def box(tmp_path):
    """A function that writes a scene of some walls of the box, seen from inside it."""
    Image.fromarray(np.full((8, 16, 3), 200, np.uint8)).save(tmp_path / "sky.png")

    def write(walls, objects="", settings=""):
        lines = ["IMAGE\n16 16\nCAMERA_POS\n0 0 0.5\nCAMERA_DIR\n0 0 -1\n" + settings]
        for wall in walls:
            place = (" ".join(map(str, values)) for values in wall)
            lines.append("OBJECT\nuvplane {}\nU {}\nV {}".format(*place))
            lines.append("color 0.8 0.8 0.8\nreflection diffuse\n")
        path = tmp_path / "box.txt"
        path.write_text("\n".join([*lines, objects]))
        return path

    return write


@pytest.mark.parametrize("objects, settings", [("", "BACKGROUND\n1 1 1\n"), (DOME, "")])
def test_walls_of_one_material_keep_the_sky_out(box, objects, settings):
    """Inside a closed box of six rectangles it is dark. Merged by Mitsuba 3.9, they have no
    bounding box, and 2 % of the sky's light came through."""
    mi.set_variant("llvm_ad_rgb")
    path = box(BOX, objects, settings)
    assert relume.render(path, spp=16).max() == 0
    assert np.array(mi.render(relume.load(path, spp=16))).max() == 0


@pytest.mark.parametrize("integrator", [None, "direct", "pssmlt"])
def test_what_is_loaded_is_what_is_rendered(box, integrator):
    """Two rectangles under a dome: sample by sample the picture of `render`."""
    mi.set_variant("llvm_ad_rgb")
    path = box(BOX[:2], DOME, "tentfilter\n1\n")
    options = relume.RenderOptions(spp=9, integrator=integrator)
    session = Session(relume.load(path, options), options.spp)
    for _ in session.run():
        pass
    expected = relume.render(path, options)
    assert expected.mean() > 0.1 and np.array_equal(session.image(), expected)


def test_the_seed_of_a_loaded_scene(room):
    """Seeds beyond Mitsuba's 32 bits count, too."""
    mi.set_variant("llvm_ad_rgb")
    same, again, other, large = (
        np.array(mi.render(relume.load(room(), seed=seed))) for seed in (1, 1, 2, 2**32 + 1)
    )
    assert np.array_equal(same, again)
    assert not np.array_equal(same, other) and not np.array_equal(same, large)


# ---- time limit and progress


@pytest.fixture
def passes_of_one_sample(monkeypatch):
    monkeypatch.setattr(passes, "SAMPLES_PER_PASS", 32 * 24)


@pytest.mark.usefixtures("passes_of_one_sample")
def test_progress_is_told_after_each_pass(room):
    told = []
    relume.render(room(), spp=3, progress=told.append)
    assert [(p.passes, p.all_passes, p.spp, p.all_spp) for p in told] == [
        (1, 3, 1, 3), (2, 3, 2, 3), (3, 3, 3, 3)
    ]  # fmt: skip
    assert 0 < told[0].seconds < told[1].seconds < told[2].seconds


@pytest.mark.usefixtures("passes_of_one_sample")
def test_progress_as_a_bar_on_standard_error(room, capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    relume.render(room(), spp=3, progress=True)
    shown = capsys.readouterr()
    assert "3/3" in shown.err and shown.out == ""
    for silent in (False, None):
        relume.render(room(), spp=3, progress=silent)
        assert capsys.readouterr() == ("", "")


@pytest.mark.usefixtures("passes_of_one_sample")
def test_a_time_limit_gives_the_picture_so_far(room, monkeypatch):
    """One pass at least; the progress tells how many samples the picture has.

    Each pass takes a tenth of a second of a clock of our own.
    """
    ticks = itertools.count()
    clock = SimpleNamespace(perf_counter=lambda: next(ticks) / 10)
    monkeypatch.setattr(relume.session, "time", clock)
    told = []
    image = relume.render(room(), spp=3000, time_limit=0.32, progress=told.append)
    samples = told[-1].spp
    assert samples == 3
    assert np.array_equal(image, relume.render(room(), spp=samples))
    image = relume.render(room(), spp=3000, time_limit=0)
    assert np.array_equal(image, relume.render(room(), spp=1))


@pytest.mark.parametrize(
    "arguments, error, said",
    [
        ({"time_limit": -1}, ValueError, "time limit -1: expected 0 seconds or more"),
        ({"time_limit": float("nan")}, ValueError, "time limit nan"),
        ({"progress": "bar"}, TypeError, "progress: expected True or a function, found str"),
    ],
)
def test_wrong_limits_and_progress_are_said(room, arguments, error, said):
    with pytest.raises(error, match=said):
        relume.render(room(), spp=1, **arguments)


# ---- documents written back


def test_a_document_is_written_and_read_back(room, tmp_path):
    """What was changed is in the file; no file is replaced unless that is asked for."""
    path = tmp_path / "written.txt"
    document = relume.read(room("SAMPLING\n3"))
    document.sampling = 5
    relume.write(document, path)
    assert relume.read(path) == document and relume.read(path).sampling == 5
    document.sampling = 7
    with pytest.raises(FileExistsError):
        relume.write(document, path)
    assert relume.read(path).sampling == 5
    relume.write(document, path, overwrite=True)
    assert relume.read(path).sampling == 7
