"""What stands in for missing pictures: which kinds, what is said, and what is not replaced."""

import numpy as np
import pytest

from relume.translator import environment_maps, read_text, translate
from relume.translator.diagnostics import SceneError
from relume.translator.images import read_image
from relume.translator.stand_ins import STAND_INS, Workshop

HOLE = "BLACKHOLE 0 0 0\naccretion_disk_texture disk.bmp\nbackground_texture sky.bmp\n\n"
DISK = "OBJECT\ndisk 0 0 0 30\nnormal 0 0 1\nemission 1 1 1\ndisk_map 1\n"


@pytest.mark.parametrize("field", STAND_INS)
def test_each_kind_is_a_picture(field, tmp_path):
    """Readable, neither black nor of one colour; that of a disk has opacity, and a middle."""
    path, what = Workshop(tmp_path).make(field)
    image = read_image(path)
    assert what.startswith("a ") and image.rgb.std() > 0.1 and 0.1 < image.rgb.mean() < 0.9
    assert (image.alpha is not None) == (field == "accretion_disk_texture")
    if image.alpha is not None:
        height, width = image.alpha.shape
        assert image.alpha[height // 2, width // 2] == 1 and image.alpha[0, 0] == 0


def test_a_sky_tells_directions_apart(tmp_path):
    """The grid is neither mirrored nor upside down alike."""
    path, _ = Workshop(tmp_path).make("background_texture")
    rgb = read_image(path).rgb
    for other in (rgb[::-1], rgb[:, ::-1], np.roll(rgb, rgb.shape[1] // 2, axis=1)):
        assert np.abs(rgb - other).mean() > 0.05


def test_missing_pictures_are_replaced_and_told(monkeypatch):
    """Both at their lines, which are approximated, and by name; without the switch they are errors
    that speak of it."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 8)
    document = read_text(HOLE + DISK, environ={})
    found = translate(document, stand_ins=True)
    assert set(found.stand_ins) == {"disk.bmp", "sky.bmp"}
    notes = {r.line: (r.outcome, r.codes[-1]) for r in found.document.lines.all if r.notes}
    assert notes[2] == notes[3] == ("approximated", "stand-in")
    assert "accretiondisk" in found.plan.plugins and "background" in found.scene
    with pytest.raises(SceneError) as caught:
        translate(document)
    first, second = (problem.message for problem in caught.value.problems)
    assert "--stand-ins shows a ring of tiles" in first
    assert "--stand-ins shows a grid of latitude and longitude" in second


def test_what_is_there_is_used(tmp_path, monkeypatch):
    """Files that are found stay, and nothing is said of them."""
    monkeypatch.setattr(environment_maps, "MAP_ROWS", 8)
    (tmp_path / "sky.bmp").write_bytes(b"P6\n4 2\n255\n" + bytes(range(24)))
    found = translate(read_text(HOLE + DISK, environ={}), asset_path=[tmp_path], stand_ins=True)
    assert found.stand_ins == ("disk.bmp",)
