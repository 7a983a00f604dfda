"""`relume convert`: XML and Python source that give the picture of `relume render`."""

import importlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from click.testing import CliRunner

import relume
from relume import translator
from relume.cli import main
from relume.convert import KINDS, python_source, write_xml
from relume.loading import open_session
from relume.session import Session
from relume.translator.scene import OWN_PLUGINS
from relume.workbench.statistics import normal_score
from studies import converted

SPP = 400
FOLDERS = {
    "bsdf": "bsdfs",
    "emitter": "emitters",
    "integrator": "integrators",
    "phase function": "phasefunctions",
    "sampler": "samplers",
    "sensor": "sensors",
    "texture": "textures",
}
"""Packages of plugins by kind."""

SCENES = Path(__file__).parents[2] / "scenes"

EVERYTHING = """\
OBJECT
sphere 0 0 0 1
scale 0.6 1.2 0.6
translate 0 1.2 2.5
color 0.8 0.7 0.2
reflection diffuse

OBJECT
sphere 1 0.6 2.5 0.6
color 0.9 0.9 0.9
reflection reflection

OBJECT
sphere -2.6 0.7 1.5 0.7
color 0.5 0.2 0.2
specular 0.5 0.5 0.5
reflection ward_brdf
ward_brdf 0.7 0.3 0.1 0.3

OBJECT
objfile roof.obj
color 0.3 0.7 0.3
reflection diffuse

OBJECT
uvplane -5 0 -2
U 3 0 0
V 0 4 0
color 0.5 0.5 0.5
texture chess.png
reflection diffuse

OBJECT
sphere 0 8 0 0.1
emission 20 20 20
spot_light 1
spot_light_dir 0 -1 0
"""
"""An ellipsoid (a mesh), glass, Ward, an OBJ file, a texture and a spot light."""

ROOF = """\
IMAGE
32 24

CAMERA_POS
0 100 0

TARGET_POS
0 0 0

CAMERA_UPVEC
0 0 -1

SCREEN
5 5 100

OBJECT
objfile roof.obj
color 0.5 0.5 0.5
reflection diffuse

OBJECT
infinity_light 0 -1 0
emission 1 1 1
color 0 0 0
reflection diffuse
"""


@pytest.fixture
def scene(room):
    """The room with every kind of thing that becomes a file or a plugin of relume."""
    path = room("tentfilter\n1", objects=EVERYTHING, spp=SPP)
    path.with_name("roof.obj").write_text("v -1 2 1\nv 1.5 2 1\nv 0 4 0\nf 1 2 3\n")
    picture = np.zeros((4, 4, 3), np.uint8)
    picture[::2, ::2] = picture[1::2, 1::2] = 220
    mi.set_variant("llvm_ad_rgb")
    mi.Bitmap(picture).write(str(path.with_name("chess.png")))
    return path


def blocks(picture):
    """Means of blocks of 8x8 pixels."""
    return picture.reshape(3, 8, 4, 8, 3).mean(axis=(1, 3))


def deviation(scene, picture, chance):
    """Normal scores of the block means of a picture against those of `relume.render`.

    Sixteen references with an eighth of its samples tell the noise: their variance v makes that of
    the picture v / 8, that of their mean v / 16 (Student's t). 0.001 allows for blocks without
    noise.
    """
    references = []
    with open_session(translator.translate(relume.read(scene))) as session:
        for _ in range(16):
            session = Session(session.scene, SPP // 8, chance.seed())
            for _ in session.run():
                pass
            references.append(blocks(session.image()))
    error = np.sqrt(np.var(references, axis=0, ddof=1) * (1 / 8 + 1 / 16))
    beyond = np.maximum(np.abs(blocks(picture) - np.mean(references, axis=0)) - 0.001, 0)
    return normal_score(beyond / np.maximum(error, 1e-9), 15)


@pytest.mark.false_alarms(1e-3)
def test_the_measure_tells_pictures_apart(scene, chance):
    """Power: it sees a missing texture and a colour that is a little off."""
    text = scene.read_text()
    for old, new in (("", ""), ("texture chess.png\n", ""), ("0.3 0.7 0.3", "0.3 0.5 0.3")):
        scene.write_text(text.replace(old, new) if old else text)
        picture = relume.render(scene, seed=chance.seed())
        scene.write_text(text)
        z = deviation(scene, picture, chance)
        if old == new:
            chance.scores(z)
        else:
            assert z.max() > 6


@pytest.mark.false_alarms(1e-3)
def test_xml_gives_the_same_picture_wherever_it_is_moved(scene, tmp_path, chance):
    written = write_xml(scene, tmp_path / "out" / "room.xml")
    assert written[0] == tmp_path / "out" / "room.xml" and all(p.exists() for p in written)
    assert {p.suffix for p in written} >= {".xml", ".ply"}
    moved = tmp_path / "elsewhere"
    shutil.move(tmp_path / "out", moved)
    for name in ("roof.obj", "chess.png"):
        scene.with_name(name).rename(tmp_path / f"hidden_{name}")
    mi.set_variant("llvm_ad_rgb")
    picture = np.array(mi.render(mi.load_file(str(moved / "room.xml")), seed=chance.seed()))
    for name in ("roof.obj", "chess.png"):
        (tmp_path / f"hidden_{name}").rename(scene.with_name(name))
    chance.scores(deviation(scene, picture, chance))


def test_xml_is_well_formed_and_names_its_files_relatively(scene, tmp_path):
    out = write_xml(scene, tmp_path / "room.xml")[0]
    root = ElementTree.parse(out).getroot()
    names = [e.get("value") for e in root.iter("string") if e.get("name") == "filename"]
    assert names and all(name.startswith("room_files/") for name in names)
    kinds = {e.get("type"): e.tag for e in root.iter() if e.get("type")}
    assert kinds["ward"] == kinds["schlickglass"] == "bsdf"
    assert kinds["falloffspot"] == "emitter"


def test_the_variant_set_before_is_set_afterwards(scene, tmp_path):
    mi.set_variant("scalar_rgb")
    write_xml(scene, tmp_path / "room.xml")
    assert mi.variant() == "scalar_rgb"


@pytest.mark.false_alarms(1e-3)
def test_python_source_executes_in_a_fresh_process_and_gives_the_same_picture(
    scene, tmp_path, chance
):
    source = tmp_path / "room.py"
    source.write_text(
        f"{python_source(scene)}\n"
        f"image = np.array(mi.render(mi.load_dict(scene), seed={chance.seed()}))\n"
        f"np.save({str(tmp_path / 'image.npy')!r}, image)\n"
    )
    command = [sys.executable, "-W", "error", str(source)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    chance.scores(deviation(scene, np.load(tmp_path / "image.npy"), chance))


@pytest.mark.false_alarms(1e-3)
def test_dispersive_scenes_convert_for_a_spectral_variant(room, tmp_path, chance):
    prism = "OBJECT\nsphere 0 1 2 1\ncolor 1 1 1\nreflection reflection1\n1.04 0.2\n"
    scene = room(objects=prism, spp=SPP)
    out = write_xml(scene, tmp_path / "prism.xml")[0]
    assert "mi.set_variant('llvm_ad_spectral')" in python_source(scene)
    mi.set_variant("llvm_ad_spectral")
    picture = np.array(mi.render(mi.load_file(str(out)), seed=chance.seed()))
    chance.scores(deviation(scene, picture, chance))


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("scene", sorted(SCENES.glob("*.txt")), ids=lambda path: path.stem)
def test_the_scenes_look_the_same_converted(scene, tmp_path, chance):
    """Block by block, as XML and as Python source."""
    seeds = [chance.seed() for _ in range(converted.RUNS)]
    spp = chance.samples(converted.SPP)
    found = converted.pictures(scene, [], seeds, spp, tmp_path)
    for name in ("xml", "python"):
        chance.scores(converted.scores(found[name], found["rendered"]), name, of=2)


@pytest.mark.false_alarms(1e-3)
def test_flat_faces_stay_flat(tmp_path, chance):
    """Two faces that share an edge, without normals: a roof under parallel light.

    Lit along -Y and tilted by 60 and 0 degrees, cosines 0.5 and 1, each all over its face.
    """
    mesh = "v -8 0 4\nv 0 0 4\nv 0 0 -4\nv -8 0 -4\nv 4 -6.9282 4\nv 4 -6.9282 -4\nf 1 2 3 4\n"
    (tmp_path / "roof.obj").write_text(mesh + "f 2 5 6 3\n")
    scene = tmp_path / "roof.txt"
    scene.write_text(ROOF)
    seeds = [chance.seed() for _ in range(converted.RUNS)]
    found = converted.pictures(scene, [], seeds, 64, tmp_path)
    for name in ("rendered", "xml", "python"):
        left, right = found[name][..., 0, :], found[name][..., -1, :]
        assert np.allclose(left, 0.5, rtol=1e-3) and np.allclose(right, 0.25, rtol=2e-3), name


def test_files_of_one_name_are_kept_apart(tmp_path, room):
    """Two meshes `m.obj` of different folders become two files."""
    for folder, x in (("a", 0), ("b", 9)):
        (tmp_path / folder).mkdir()
        mesh = f"v {x} 0 0\nv {x + 1} 0 0\nv {x} 1 0\nf 1 2 3\n"
        (tmp_path / folder / "m.obj").write_text(mesh)
    objects = [f"OBJECT\nobjfile {f}/m.obj\ncolor 1 1 1\nreflection diffuse\n" for f in "ab"]
    written = write_xml(room(objects="\n".join(objects)), tmp_path / "out" / "room.xml")
    floor, *meshes = written[1:]
    assert floor.name == "object_19.ply"
    texts = [path.read_bytes() for path in meshes]
    assert len(set(texts)) == len(texts) == 2


def test_all_plugins_are_known_with_their_kinds():
    """The list that the translator keeps, without Mitsuba, is that of the packages."""
    registered = {
        plugin: kind
        for kind, folder in FOLDERS.items()
        for plugin in importlib.import_module(f"relume.{folder}").PLUGINS
    }
    assert registered == OWN_PLUGINS
    mi.set_variant("llvm_ad_rgb")
    assert all(hasattr(mi.ObjectType, KINDS[kind]) for kind in registered.values())


@pytest.mark.parametrize("glass", [True, False])
def test_light_that_converted_scenes_lack_is_told(tmp_path, glass):
    """Where relume renders by `bdpt` alone: on standard error, in the XML and in the source."""
    text = "OBJECT\nsphere 0 8 0 1\nemission 9 9 9\nspot_light 1\n\n"
    text += "OBJECT\nsphere 1 0.6 2.5 0.6\ncolor 0.9 0.9 0.9\n" + glass * "reflection reflection\n"
    scene, xml = tmp_path / "spot.txt", tmp_path / "out" / "spot.xml"
    scene.write_text(text)
    run = CliRunner().invoke
    found = [run(main, ["convert", str(scene), *way]) for way in (["-o", str(xml)], ["--python"])]
    for text in (found[0].stderr, found[1].stderr, found[1].stdout, xml.read_text()):
        assert ("bdpt" in text) == glass
