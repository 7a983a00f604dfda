"""Words of general relativity, which the manual does not know: how they are read."""

import pytest

from relume.translator import parse, read_text
from relume.translator.gravity import OF_THE_SCENE, BlackHole, WormHole
from relume.translator.printer import print_document
from tests.translator.reading import error, outcomes, scene

DISK = "OBJECT\ndisk 0 0 0 9\nnromal 0 0 1\ndisk_map 1\n"


def test_blocks():
    """Each has its own table of keywords."""
    text = "BLACKHOLE 1 2 3\ndist 5\nangular_momentum 9/10\n\nWORMHOLE\nin 0 0 1\nRho 2*2\n"
    assert scene(text).gravity == [
        BlackHole((1, 2, 3), dist=5, angular_momentum=0.9), WormHole(entrance=(0, 0, 1), rho=4)]


def test_words_of_a_hole_that_are_the_scenes():
    """The sky of a `BLACKHOLE` block is that of the scene: the last line in the file counts."""
    block = "BLACKHOLE 0 0 0\nbackground_texture a b.bmp\nmap_coef 1 -pi 1 0\ncoef 2\n\n"
    inside = scene("background_texture c.bmp\ncoef 3\n" + block)
    assert (inside.background_texture, inside.coef) == ("a b.bmp", 2)
    after = scene(block + "background_texture c.bmp\n")
    assert (after.background_texture, after.coef) == ("c.bmp", 2)
    assert outcomes(block + "background_texture c.bmp\n")[2] == (
        "background_texture", "ignored", "set again in line 6")
    assert [r.line for r in after.gravity[0].lines.all] == [1, 2, 3, 4]
    assert set(OF_THE_SCENE) == {"background_texture", "map_coef", "coef"}


def test_disk_textures_add_up():
    """They are a list, in the order of the file, and none of them is overridden."""
    text = "BLACKHOLE\naccretion_disk_texture a.bmp\ncoef 1\naccretion_disk_texture b c.bmp\n"
    document = scene(text)
    assert document.gravity[0].accretion_disk_texture == ["a.bmp", "b c.bmp"]
    assert [r.line for r in document.gravity[0].lines.of("accretion_disk_texture")] == [2, 4]
    assert {outcome for _, outcome, _ in outcomes(text).values()} == {"translated"}
    assert read_text(print_document(document), environ={}) == document


def test_number_of_a_disk():
    """A whole number from 0; none where the file is silent, which is another thing than 0."""
    numbers = [b.blackhole_disk for b in scene(f"{DISK}blackhole_disk 2\n\n{DISK}").objects]
    assert numbers == [2, None]


@pytest.mark.parametrize(("block", "field", "name"), [
    ("BLACKHOLE", "dist", "BLACK_HOLE_Z"), ("WORMHOLE", "dist", "WORM_HOLE_Z")])
def test_distances_from_the_environment(block, field, name):
    """The two variables of the program are expressions that replace `dist`."""
    (hole,) = read_text(f"{block}\ndist 5\n", environ={name: "2*8"}).gravity
    assert getattr(hole, field) == 16
    assert hole.lines.of(field)[0].codes == ("overridden-by-variable",)


BLOCK = "BLACKHOLE 0 0 0\n"

ERRORS = [
    ("BLACKHOLE 1 2\n", 1, 14, "syntax", "BLACKHOLE expects 3 values, found 2 in '1 2'"),
    (BLOCK + "angular_momentum 1\n", 2, 18, "range",
     "angular_momentum must be above -1, below 1, found 1"),
    (BLOCK + "angular_momentum -1.5\n", 2, 18, "range",
     "angular_momentum must be above -1, below 1, found -1.5"),
    (BLOCK + "angular_momentum 0/0\n", 2, 18, "value", "has no finite value"),
    (BLOCK + "angular_momntum 0\n", 2, 1, "keyword", "did you mean 'angular_momentum'?"),
    (BLOCK + "distt 5\n", 2, 1, "keyword", "line of a BLACKHOLE block; did you mean 'dist'?"),
    (BLOCK + " dist 5\n", 2, 1, "keyword", "must start in the first column"),
    (BLOCK + "background_textur a.bmp\n", 2, 1, "keyword", "did you mean 'background_texture'?"),
    (BLOCK + "coef -1\n", 2, 6, "range", "coef must be at least 0, found -1"),
    ("WORMHOLE\nRho -1.3\n", 2, 5, "range", "Rho must be above 0"),
    ("WORMHOLE\nRho 0\n", 2, 5, "range", "Rho must be above 0"),
    ("WORMHOLE\nrho 1\n", 2, 1, "keyword", "did you mean 'Rho'?"),
    ("WORMHOLE\nW 0\n", 2, 3, "range", "W must be above 0"),
    ("WORMHOLE\nin 1 2\n", 2, 7, "syntax", "in expects 3 values"),
    ("WORMHOLE\nmap_coef1 1 0 1\n", 2, 16, "syntax", "map_coef1 expects 4 values"),
    ("WORMHOLE 1 2 3\n", 1, 10, "syntax", "WORMHOLE stands alone on its line"),
    ("WORMHOLE\nbackground_texture a\n", 2, 1, "keyword", "did you mean 'background_texture"),
    ("special_relativity_effect\n1\n", 1, 1, "keyword", "'special_relativity_effects'?"),
    ("special_relativity_effects 1\n", 1, 28, "syntax", "takes its values on the next line"),
    ("color_doppler_factor_effect\n1.5\n", 2, 1, "range", "must be 0 to 1, found 1.5"),
    ("velocity\n1 2\n", 2, 4, "syntax", "velocity expects 3 values"),
    (DISK + "blackhole_disk -1\n", 5, 16, "range", "blackhole_disk must be at least 0"),
    (DISK + "blackhole_dsk 1\n", 5, 1, "keyword", "did you mean 'blackhole_disk'?"),
]


@pytest.mark.parametrize(
    ("text", "line", "column", "kind", "words"), ERRORS, ids=lambda x: str(x)[:40]
)
def test_errors(text, line, column, kind, words):
    """Where, what, and what was expected."""
    found = error(text)
    assert found[:3] == (line, column, kind) and words in found[3]


def test_other_lines_are_passed_over():
    """What is no word of the block is skipped, as the program does, and a blank line ends it."""
    lines = ["BLACKHOLE 0 0 0", "charge 1", "coef 3", "", "DEPTH", "4"]
    document, problems = parse(lines, "", {})
    assert problems == [] and (document.depth, document.coef) == (4, 3)
    assert [(r.line, r.outcome) for r in document.gravity[0].lines.all] == [
        (1, "translated"), (2, "ignored"), (3, "translated")]


def test_a_block_that_is_commented_out():
    """None of its lines counts, not even those that would be the scene's outside it."""
    text = "#BLACKHOLE 0 0 0\nangular_momentum 1\nbackground_texture a.bmp\ncoef 2\n"
    document = scene(text)
    assert (document.gravity, document.background_texture, document.coef) == ([], None, 1)
    found = outcomes(text)
    assert [found[line][1] for line in (2, 3, 4)] == ["ignored"] * 3
    assert "program would apply it" in found[3][2]
