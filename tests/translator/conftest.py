"""What the tests of the translator share: the scene files at hand, and scenes made of text."""

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from relume import translator
from relume.translator.scene_values import Color, Matrix, Mesh, Picture

ROOT = Path(__file__).resolve().parents[2]
OWN_SCENES = sorted((ROOT / "scenes").glob("*.txt"))
CORPUS_FOLDER = ROOT.parent / "shared" / "corpus"
CORPUS = sorted(CORPUS_FOLDER.rglob("*.txt"))


def pytest_generate_tests(metafunc):
    """Tests that take `scene_file` run on every scene file; the corpus is not in the repository."""
    if "scene_file" not in metafunc.fixturenames:
        return
    files = [pytest.param(path, id=path.name) for path in [*OWN_SCENES, *CORPUS]]
    if not CORPUS:
        reason = f"no corpus of real scene files in {CORPUS_FOLDER}"
        files.append(pytest.param(None, id="corpus", marks=pytest.mark.skip(reason=reason)))
    metafunc.parametrize("scene_file", files)


@pytest.fixture(scope="session")
def scene_files():
    """The repository's own scenes and those of the corpus, if it is there."""
    return [*OWN_SCENES, *CORPUS]


@pytest.fixture
def translated(tmp_path):
    """The `Translation` of scene text; its files are looked for in `tmp_path`."""

    def run(text, dialect="manual", environ=None):
        document = translator.read_text(text, str(tmp_path / "scene.txt"), environ or {})
        return translator.translate(document, dialect)

    return run


@pytest.fixture
def load(translated):
    """The loaded Mitsuba scene of scene text, under its plan's variant."""
    before = mi.variant()

    def run(text, dialect="manual", environ=None):
        translation = translated(text, dialect, environ)
        mi.set_variant(translation.plan.variant)
        return mi.load_dict(translation.dictionary())

    yield run
    if before:
        mi.set_variant(before)


@pytest.fixture
def view():
    """Scene text of a camera at `position` that looks at `target`.

    `width` is the width of the picture at unit distance; the default shows one spot. The program's
    limit of the luminance is off.
    """

    def text(position, target, width=0.002, size=(8, 8), up=(0, 1, 0)):
        triples = [" ".join(f"{x:.9g}" for x in v) for v in (position, target, up)]
        return (
            f"IMAGE\n{size[0]} {size[1]}\n\nSCREEN\n{width} {width} 1\n\nCAMERA_POS\n{triples[0]}"
            f"\n\nTARGET_POS\n{triples[1]}\n\nCAMERA_UPVEC\n{triples[2]}\n\nluminance_cutoff\n0\n\n"
        )

    return text


@pytest.fixture
def measure(load, chance, level):
    """Mean radiance over the picture of scene text as a `Level` of its channels."""

    def run(text, spp=256, runs=8, dialect="manual", environ=None):
        return level(chance.runs(load(text, dialect, environ), spp, runs).mean(axis=(1, 2)))

    return run


@pytest.fixture
def agrees(chance):
    """Judge whether a measurement is a closed form's value, its standard error below 0.3 %.

    Float32 and the finite size of a pixel are granted 2e-4.
    """

    def check(measured, expected, of=1):
        chance.equal(measured, expected, allowed=2e-4, precision=3e-3, of=of)

    return check


@pytest.fixture
def write_picture(tmp_path):
    """Write a picture of bytes, (height, width, channels) uint8 with the top row first."""

    def write(name, pixels):
        Image.fromarray(np.asarray(pixels, np.uint8)).save(tmp_path / name)
        return name

    return write


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Matrix):
        return _plain(value.rows)
    if isinstance(value, Color):
        return _plain(value.rgb)
    if isinstance(value, Mesh):
        return _plain({key: item for key, item in vars(value).items() if item is not None})
    if isinstance(value, Picture):
        return _plain(value.pixels)
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.9g}") + 0.0  # so that -0 and rounding make no difference
    return value


@pytest.fixture(scope="session")
def plain():
    """Function from a translated scene to values that can be compared and written as JSON."""
    return _plain
