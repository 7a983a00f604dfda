"""What the tests of the translator share: the scene files at hand."""

from pathlib import Path

import numpy as np
import pytest

from translator.neutral import Color, Matrix, Mesh, Picture

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
