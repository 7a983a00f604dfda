"""Scenes with holes through the application: converted, compared, and what a render says."""

import io

import numpy as np
import OpenEXR
import pytest
from PIL import Image
from rich.console import Console

import relume
from relume import output
from relume.convert import write_xml
from relume.rendering import render_file
from relume.session import CannotRender
from relume.translator import read_text

HEAD = "IMAGE\n8 6\nOUTPUT\na.bmp\nSAMPLING\n2\nSUPERSAMPLING\n1\n"
LOOK = "CAMERA_POS\n9 0 0\nCAMERA_DIR\n-1 0 0\nCAMERA_UPVEC\n0 0 1\nBACKGROUND\n0.2 0.3 0.4\n"
MOUTHS = "WORMHOLE\nin 0 0 0\nout 1e8 0 0\n\nOBJECT\nsphere 1e8-6 0 1 3\nemission 1 2 3\n"


def test_both_sides_of_a_wormhole_are_converted(tmp_path):
    """The scene on the other side is a scene inside the XML, and renders to the same bits."""
    path = tmp_path / "scene.txt"
    path.write_text(HEAD + LOOK + MOUTHS)
    (xml,) = write_xml(path, tmp_path / "scene.xml")
    pictures = [relume.render(scene, seed=3) for scene in (path, xml)]
    assert pictures[0].tobytes() == pictures[1].tobytes() and pictures[0].std() > 0.1


def test_straight_light_is_nothing_to_compare_with():
    """Of an integrator that knows no curved space the verdict would be known before."""
    document = read_text(HEAD + LOOK + "BLACKHOLE 0 0 0\n", environ={})
    with pytest.raises(CannotRender, match="volpath: its light goes straight on"):
        relume.compare(document)


def test_rays_that_run_out_of_steps_are_told(tmp_path):
    """With their number, after the render; a scene with steps enough says nothing of it."""
    for steps, said in ((2, True), (1000, False)):
        text = f"{HEAD}{LOOK}BLACKHOLE 0 0 0\ngeodesics_max_length {steps}\n"
        shown = Console(file=io.StringIO(), width=200)
        render_file(read_text(text, environ={}), out=tmp_path / f"{steps}.png", console=shown)
        assert ("rays ran out of steps" in shown.file.getvalue()) == said


COMMENT = "instead of missing files: 'コピー.bmp'"


@pytest.mark.parametrize("extension", [".exr", ".png", ".hdr", ".ppm", ".bmp"])
def test_metadata_of_pictures(tmp_path, extension):
    """What stands in for what is told by all formats that can; the pixels stay."""
    image = np.linspace(0, 1, 8 * 9 * 3).reshape(8, 9, 3)
    plain, told = (tmp_path / f"{name}{extension}" for name in ("plain", "told"))
    output.write_image(plain, image)
    output.write_image(told, image, finish=output.Finish(metadata={"Comment": COMMENT}))
    if extension == ".exr":
        with OpenEXR.File(str(told)) as file:
            assert file.header()["comments"] == COMMENT
        with OpenEXR.File(str(plain)) as file:
            assert "comments" not in file.header()
    elif extension == ".png":
        with Image.open(told) as a, Image.open(plain) as b:
            assert a.info["Comment"] == COMMENT and "Comment" not in b.info
            assert a.tobytes() == b.tobytes()
    else:
        kept = told.read_bytes().replace(f"# {COMMENT}\n".encode(), b"")
        assert kept == plain.read_bytes() and (len(told.read_bytes()) > len(kept)) == (
            extension != ".bmp")
