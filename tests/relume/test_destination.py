"""Where pictures go: the file or folder asked for, the scene's own name, dumps beside it."""

import pytest

from relume import output
from relume.destination import Destination, Dumps
from relume.translator import Document


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_with_a_time_limit_the_picture_is_dumped_every_minute(here):
    document = Document(image_dump=600.0)
    beside = Destination(document, "a.png")
    assert Dumps(document, beside, None).interval == 600
    assert Dumps(document, beside, 3600).interval == 60


@pytest.mark.parametrize(
    "out, passes, dump",
    [
        ("new/a.png", "new/a.passes.exr", "new/image/a_W000003.bmp"),
        ("new/", "new/shots/box.passes.exr", "new/shots/image/box_W000003.bmp"),
        (None, "shots/box.passes.exr", "shots/image/box_W000003.bmp"),
    ],
)
def test_passes_and_dumps_lie_beside_the_picture(here, out, passes, dump):
    destination = Destination(Document(output="shots/box.hdr"), out)
    destination.check()
    assert (here / destination.passes_path()) == here / passes
    assert (here / destination.dump_path(3)) == here / dump


@pytest.mark.parametrize("out", ["a.png", "folder/", None])
def test_passes_alone_go_into_an_exr_that_is_named(here, out):
    with pytest.raises(output.OutputError, match="to a file that -o names"):
        Destination(Document(), out).part_path()
    assert Destination(Document(), "part.exr").part_path().name == "part.exr"


def test_what_cannot_be_written_is_known_before(here):
    here.joinpath("a").write_text("")
    with pytest.raises(output.OutputError, match=r"cannot write a/b\.png"):
        Destination(Document(), "a/b.png").check()
