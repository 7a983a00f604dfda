"""References: what a file keeps, when the cache answers, and what it does with broken files."""

import dataclasses
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

import relume
from relume import cache, translator
from relume.loading import resized, variant_and_threads
from relume.session import CannotRender
from relume.workbench import comparing, estimate_files, estimates, methods, references


@pytest.fixture
def stage(room):
    before = mi.variant()
    document = resized(relume.read(room()), (12, 10))
    translation = translator.translate(document)
    with variant_and_threads(translation):
        yield methods.Stage(document, translation)
    if before:
        mi.set_variant(before)


@pytest.fixture
def made(stage, tmp_path):
    """A function that asks for a reference and says how many runs were rendered for it."""

    def ask(spp=64, **options):
        rendered = []
        found = references.reference(
            stage,
            methods.find("path"),
            spp,
            tmp_path / "cache",
            progress=lambda done, _: rendered.append(done),
            **options,
        )
        return found, len(rendered)

    return ask


def test_the_cache_answers_the_second_time(made):
    first, rendered = made()
    assert rendered == references.RUNS and first.about["spp"] == 2
    second, rendered = made()
    assert rendered == 0 and second.about == first.about
    np.testing.assert_array_equal(
        second.estimate.pixels.mean.astype("f"), first.estimate.pixels.mean.astype("f")
    )


def test_the_cache_makes_a_reference_of_too_few_samples_anew(made):
    made(64)
    found, rendered = made(128)
    assert rendered == references.RUNS and found.about["spp"] == 4
    assert made(64)[1] == 0


@pytest.mark.parametrize("broken", ["empty", "cut", "other name", "no variance", "not finite"])
def test_broken_files_are_made_anew(made, tmp_path, broken):
    first, _ = made()
    (path,) = (tmp_path / "cache").iterdir()
    if broken == "empty":
        path.write_bytes(b"")
    elif broken == "cut":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif broken == "other name":
        estimate_files.write(path, first.estimate, 32, first.about | {"key": "0" * 32})
    elif broken == "no variance":
        relume.output.write_image(path, np.ones((10, 12, 3)))
    else:
        pixels = first.estimate.pixels
        level = estimates.Level(pixels.mean, pixels.variance * np.nan, pixels.dof)
        spoiled = dataclasses.replace(first.estimate, pixels=level)
        estimate_files.write(path, spoiled, 32, first.about)
    again, rendered = made()
    assert rendered == references.RUNS
    np.testing.assert_array_equal(again.estimate.pixels.mean, first.estimate.pixels.mean)
    assert made()[1] == 0 and list((tmp_path / "cache").iterdir()) == [path]


def test_a_reference_that_was_stopped_is_used_but_not_kept(stage, tmp_path):
    def ask(last):
        path = methods.find("path")
        return references.reference(stage, path, 64, tmp_path, progress=lambda n, _: n == last)

    with pytest.raises(CannotRender, match="stopped after 7 of 32 runs"):
        ask(7)
    assert ask(9).about["runs"] == 9
    assert not list(tmp_path.glob("*.exr"))


def test_everything_that_makes_the_picture_changes_the_key(stage, monkeypatch):
    """The scene's own hash has tests of its own."""
    translation = stage.translation

    def key(**entries):
        scene = translation.scene | entries
        return references.content_key(dataclasses.replace(translation, scene=scene))

    assert key() == key() != key(x={"type": "sphere"})
    other = stage.translated(methods.find("volpath"))
    assert references.content_key(other) != key()
    sources = references.plugin_sources()
    assert {"bsdfs/ward.py", "sensors/screencamera.py"} <= sources.keys()
    before = key()
    monkeypatch.setattr(references, "plugin_sources", lambda: sources | {"bsdfs/ward.py": "new"})
    assert key() != before


def test_the_folder_is_the_users_cache(monkeypatch):
    monkeypatch.setattr(cache, "folder", lambda: Path("/somewhere/relume"))
    assert references.cache_folder() == Path("/somewhere/relume/references")


def test_compare_takes_a_stored_variance_at_its_word(room, made, tmp_path):
    """With it single pixels count; a reference of another seed agrees, one 3 % brighter differs."""
    made(2048)
    (path,) = (tmp_path / "cache").iterdir()
    agreeing = comparing.compare(room(), with_=str(path), spp=512)
    report = agreeing.report()
    assert agreeing.agree, agreeing.verdict()
    assert [side["variance"] for side in report["sides"]] == ["runs", "stored"]
    assert [test["counts"] for test in report["tests"]] == [True] * 3
    stored, about = estimate_files.read(path)
    levels = {
        name: estimates.Level(1.03 * level.mean, level.variance, level.dof)
        for name, level in vars(stored).items()
        if name != "lone"
    }
    estimate_files.write(tmp_path / "brighter.exr", estimates.Estimate(**levels), 32, about)
    differing = comparing.compare(room(), with_=str(tmp_path / "brighter.exr"), spp=512)
    assert not differing.agree
