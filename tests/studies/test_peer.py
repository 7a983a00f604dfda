"""The study of the program's pictures: what it lets pass, and what it finds."""

import json

import numpy as np
import pytest

from relume.translator.dialects import DIFFERENCES
from studies import __main__, peer, peer_pictures
from studies.peer_defects import DEFECTS, ELSEWHERE
from studies.peer_page import page, verdict

HEIGHT, WIDTH = 40, 48
NO_NOISE = np.zeros(3)


@pytest.fixture
def picture():
    """Random tiles of four pixels on a grey ground, without symmetry."""
    tiles = np.random.default_rng(1).uniform(0.2, 1, (HEIGHT // 4, WIDTH // 4, 3))
    return np.kron(tiles, np.ones((4, 4, 1)))


def judged(ours, theirs, noise=NO_NOISE):
    error = np.full(ours.shape, 1e-6)
    return peer_pictures.judge(peer_pictures.Picture(ours, error), theirs, noise)


def test_the_same_picture_agrees(picture):
    found = judged(picture, picture)
    assert found.faults == [] and found.place == 1 and found.ratio == [1, 1, 1]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda p: p[:, ::-1], "features left-right"),
        (lambda p: p[::-1], "features top-bottom"),
        (lambda p: p[::-1, ::-1], "features turned"),
        (lambda p: np.roll(p, 1, axis=1), "features 0 down, 1 right"),
        (lambda p: np.roll(p, -2, axis=0), "features -2 down, 0 right"),
        (lambda p: p * [1, 1.02, 1], "mean of green"),
        (lambda p: np.where(np.indices(p.shape)[0] < 8, 1.1 * p, p), "6 of 30 blocks"),
        (lambda p: np.full_like(p, p.mean(axis=(0, 1))), "features"),
    ],
)
def test_what_does_not_pass(picture, change, fault):
    """Mirrored, turned, shifted; a channel 2 % off; blocks a tenth too bright; no texture."""
    assert fault in judged(change(picture), picture).faults


def test_a_square_that_lies_on_its_side():
    """Transposed, in a square picture."""
    tiles = np.random.default_rng(2).uniform(0.2, 1, (10, 10, 3))
    square = np.kron(tiles, np.ones((4, 4, 1)))
    assert "features transposed" in judged(square.swapaxes(0, 1), square).faults


def test_noise_passes_and_a_difference_beyond_it_does_not(picture):
    """The program's noise is known by the error of its mean; 5 % more light stands out."""
    rng = np.random.default_rng(3)
    noise = 0.1 * np.sqrt(picture / picture.mean(axis=(0, 1)))
    theirs = picture + noise * rng.normal(size=picture.shape)
    error_of_mean = np.full(3, 0.1 / np.sqrt(HEIGHT * WIDTH))
    assert judged(picture, theirs, error_of_mean).faults == []
    assert judged(1.05 * picture, theirs, error_of_mean).faults


def test_sub_pixels_are_taken_at_their_centres(tmp_path):
    """An edge at a quarter of a pixel: of the two columns of points of it one is hit, exactly."""
    text = (
        "IMAGE\n8 8\nSUPERSAMPLING\n2\nSCREEN\n8 8 8\nCAMERA_POS\n0 0 8\nCAMERA_DIR\n0 0 -1\n\n"
        "OBJECT\nuvplane 0.4 -9 0\nU 9 0 0\nV 0 18 0\nemission 1 2 3\n"
    )
    (tmp_path / "edge.txt").write_text(text)
    found = peer_pictures.render(tmp_path / "edge.txt", spp=8, seed=1)
    assert found.mean[3, :, 1] == pytest.approx([0, 0, 0, 0, 1, 2, 2, 2])
    assert np.all(found.error == 0)


def test_a_folder_of_references(tmp_path, capsys):
    """Figures, page and exit status: 0 if all agree, 1 with a picture that does not."""
    scenes, pictures = tmp_path / "scenes", tmp_path / "pictures"
    scenes.mkdir()
    pictures.mkdir()
    for name, value in (("sky", 0.5), ("wrong", 0.6)):
        (scenes / f"{name}.txt").write_text("IMAGE\n8 8\nBACKGROUND\n0.5 0.5 0.5\n")
        np.save(pictures / f"{name}.npy", np.full((8, 8, 3), value, np.float16))
    head = "scene\tspp\tse_of_mean\tverdict\n"
    rows = [f"{name}\t4\t0 0 0\tagree\n" for name in ("sky", "wrong")]
    (tmp_path / "table.tsv").write_text(head + "".join(rows))
    figures = tmp_path / "out.json"
    words = ["peer", str(tmp_path), "--figures", str(figures)]
    assert __main__.main([*words[:2], "--figures", str(figures), "--scenes", "sky"]) == 0
    assert __main__.main(words) == 1
    verdicts = {f["name"]: verdict(f) for f in json.loads(figures.read_text())}
    assert verdicts["sky"] == "agree" and verdicts["wrong"].startswith("**DISAGREE**: mean of red")
    text = figures.with_suffix(".md").read_text()
    assert "1 of 2 agree, 0 show a known defect of the program, and 1 disagree." in text
    assert "0.833 / 0.833 / 0.833" in text


def test_defects_are_rows_of_the_dialects():
    """Each has its row, and no scene shows two."""
    rows = {defect.row for defect in DEFECTS} | {row for row, *_ in ELSEWHERE}
    assert rows <= set(DIFFERENCES)
    kinds = {row: DIFFERENCES[row].kind for row in rows}
    assert {row for row, kind in kinds.items() if kind == "switch"} == set()
    scenes = [scene for defect in DEFECTS for scene in defect.scenes]
    assert len(set(scenes)) == len(scenes)


def test_the_page_is_made_of_the_figures():
    """docs/peer.md is what the stored figures give."""
    stored = json.loads(peer.FIGURES.read_text(encoding="utf-8"))
    assert peer.FIGURES.with_suffix(".md").read_text(encoding="utf-8") == page(stored)
