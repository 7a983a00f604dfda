"""What the tests of the translator share: the scene files at hand."""

from pathlib import Path

import pytest

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
