"""relume from Python: read, translate, render, and the choice of the variant."""

import dataclasses

import mitsuba as mi
import numpy as np
import pytest

import relume
from relume import application, llvm, translator
from relume.session import CannotRender

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


def test_translate_gives_what_mitsuba_loads_and_renders(room):
    """The scene's samples come with it, so `mi.render` needs no more than the scene."""
    mi.set_variant("llvm_ad_rgb")
    scene = mi.load_dict(relume.translate(relume.read(room(spp=6))))
    assert scene.sensors()[0].sampler().sample_count() == 6
    assert np.array(mi.render(scene)).shape == (24, 32, 3)


def test_translate_takes_a_path_and_leaves_the_document_alone(room):
    document = relume.read(room())
    before = dataclasses.replace(document)
    relume.translate(document)
    relume.translate(room())
    assert document == before


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


def test_spp_replaces_sampling_and_supersampling(room):
    document = application.resized(relume.read(room("SUPERSAMPLING\n3")), spp=5)
    assert (document.sampling, document.supersampling) == (5, 1)
    assert translator.translate(document).plan.spp == 5


@pytest.mark.parametrize(
    "options, said",
    [
        ({"size": (0, 4)}, "size 0x4"),
        ({"size": (16384, 16384)}, "size 16384x16384"),
        ({"spp": 0}, "spp 0"),
        ({"seed": -1}, "seed -1"),
        ({"dialect": "latin"}, "unknown dialect"),
    ],
)
def test_values_out_of_range(room, options, said):
    with pytest.raises(ValueError, match=said):
        relume.render(room(), **options)


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


def test_without_llvm_scenes_of_stock_plugins_render_slowly(room, monkeypatch):
    nothing = llvm.Library(None, "none", reason="no usable LLVM library")
    monkeypatch.setattr(llvm, "install", lambda: nothing)
    with pytest.warns(UserWarning, match="rendering slowly with scalar_rgb: no usable LLVM"):
        assert relume.render(room(), size=(4, 3), spp=1).shape == (3, 4, 3)


def test_without_llvm_scenes_of_other_plugins_say_what_they_need(room, monkeypatch):
    nothing = llvm.Library(None, "none", reason="no usable LLVM library")
    monkeypatch.setattr(llvm, "install", lambda: nothing)
    with pytest.raises(CannotRender, match="the scene needs schlickglass: no usable LLVM"):
        relume.render(room(objects=GLASS))
    with pytest.raises(CannotRender, match="llvm_ad_rgb does not work here"):
        relume.render(room(), variant="llvm_ad_rgb")


def test_what_mitsuba_refuses_is_said_in_one_line(room):
    translation = translator.translate(relume.read(room()))
    translation.scene["sensor"]["fov"] = 200.0
    with (
        pytest.raises(CannotRender, match=r"Mitsuba does not take the scene: .*sensor") as error,
        application.prepared(translation),
    ):
        pass
    assert "\n" not in str(error.value)


def test_walls_of_one_material_keep_the_sky_out(tmp_path):
    """Inside a closed box of six rectangles it is dark. Merged by Mitsuba 3.9, they have no
    bounding box, and 2 % of the sky's light came through."""
    low, high = -1, 1
    walls = [
        (corner, u, v)
        for corner, edges in (((low,) * 3, 1), ((high,) * 3, -1))
        for u, v in (
            ((2 * edges, 0, 0), (0, 2 * edges, 0)),
            ((0, 2 * edges, 0), (0, 0, 2 * edges)),
            ((0, 0, 2 * edges), (2 * edges, 0, 0)),
        )
    ]
    lines = ["IMAGE\n16 16\nBACKGROUND\n1 1 1\nCAMERA_POS\n0 0 0.5\nCAMERA_DIR\n0 0 -1\n"]
    for corner, u, v in walls:
        place = (" ".join(map(str, values)) for values in (corner, u, v))
        lines.append("OBJECT\nuvplane {}\nU {}\nV {}".format(*place))
        lines.append("color 0.8 0.8 0.8\nreflection diffuse\n")
    path = tmp_path / "box.txt"
    path.write_text("\n".join(lines))
    assert relume.render(path, spp=16).max() == 0
