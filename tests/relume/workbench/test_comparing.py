"""`relume compare`: methods that agree, methods and pictures that do not, its JSON."""

import json
import re
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from click.testing import CliRunner

import relume
from relume import output
from relume.cli import main
from relume.options import RenderOptions
from relume.session import CannotRender
from relume.workbench import comparing, estimates, statistics
from relume.workbench.compare_page import page
from relume.workbench.comparison import Comparison, Side

SMALL = {"size": (32, 24), "spp": 64}


@pytest.fixture
def brighter():
    """The id of a path tracer that gives 2 % too much light: a planted error."""

    def define():
        class Brighter(mi.SamplingIntegrator):
            def __init__(self, props):
                super().__init__(props)
                self.path = mi.load_dict({"type": "path"})

            def sample(self, scene, sampler, ray, medium=None, active=True):
                L, valid, values = self.path.sample(scene, sampler, ray, medium, active)
                return 1.02 * L, valid, values

        mi.register_integrator("test_brighter", Brighter)

    before = mi.variant()
    mi.set_variant("llvm_ad_rgb")
    define()
    yield "test_brighter"
    if before:
        mi.set_variant(before)


@pytest.fixture
def invoke(tmp_path, monkeypatch):
    """A function that runs the command in an empty folder."""
    folder = tmp_path / "cwd"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return lambda *words: CliRunner().invoke(main, ["compare", *map(str, words)])


# ---- verdicts


@pytest.mark.false_alarms(0.01)
def test_path_and_volpath_agree(room, chance):
    """The rate of the verdict."""
    found = comparing.compare(room(), **SMALL, seed=chance.seed())
    assert found.agree and found.verdict().startswith("agree: ")
    for channel in found.energy():
        assert abs(channel["ratio"] - 1) < 2 * channel["ratio_plus_minus"] < 0.05


@pytest.mark.false_alarms(1e-3)
def test_a_method_that_is_2_percent_too_bright_differs(room, brighter, chance):
    """Found in the mean, whose interval is a quarter of that; the reported interval covers 2 %."""
    found = comparing.compare(
        room(), with_=brighter, size=(64, 48), spp=256, seed=chance.seed()
    )
    report = found.report()
    assert report["verdict"] == "differ"
    for channel in report["energy"]:
        assert abs(channel["ratio"] - 1 / 1.02) < 2 * channel["ratio_plus_minus"] < 0.014
    assert re.match(r"differ by -[12]\.\d+ % ± 0\.\d+ % in the mean of \w+, most", report["text"])


def test_a_ball_of_another_colour_is_found_where_it_is(room, tmp_path):
    """Against a picture, in which the ball at the left is twice as red."""
    changed = tmp_path / "changed.txt"
    changed.write_text(room().read_text().replace("0.2 0.4 0.8", "0.4 0.4 0.8"))
    picture = tmp_path / "changed.exr"
    output.write_image(picture, relume.render(changed, size=(32, 24), spp=256))
    report = comparing.compare(room(), with_=str(picture), spp=128).report()
    most = report["most"]
    assert report["verdict"] == "differ" and report["size"] == [32, 24]
    assert most["channel"] == "red" and most["ratio"] < 0.8 and most["z"] < -5
    assert most["x"] < 16 and f"({most['x']}, {most['y']})" in report["text"]


@pytest.mark.false_alarms(0.01)
@pytest.mark.parametrize("extension, spp", [(".exr", 16), (".exr", 1024), (".hdr", 64)])
def test_a_noisy_picture_of_the_scene_agrees(room, tmp_path, extension, spp, chance):
    """Whether it has more or less noise than the renders; RGBE rounds to half a percent."""
    picture = tmp_path / f"stored{extension}"
    seed = chance.seed()
    output.write_image(picture, relume.render(room(), size=(32, 24), spp=spp, seed=seed))
    found = comparing.compare(room(), with_=str(picture), spp=64, seed=chance.seed())
    assert found.agree, found.verdict()
    assert found.sides[1].runs == 0 and found.report()["sides"][1]["efficiency"] is None


def test_values_that_are_no_numbers_differ(room, tmp_path):
    import OpenEXR

    stored = relume.render(room(), size=(32, 24), spp=64, seed=5)
    stored[3, 4] = np.nan
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    picture = str(tmp_path / "holed.exr")
    OpenEXR.File(header, {"RGB": stored}).write(picture)
    found = comparing.compare(room(), with_=picture, spp=64)
    assert found.verdict() == f"differ: {picture} has 3 values that are no numbers"
    assert page(found) and json.dumps(found.report(), allow_nan=False)


@pytest.mark.false_alarms(0.01)
def test_the_other_integrator_gets_what_the_plan_wraps_around_the_planned(room, chance):
    """`sensor_response` 0.5 halves both sides; bare, the other one would be twice as bright."""
    scene = room("sensor_response\n0.5")
    found = comparing.compare(scene, **SMALL, seed=chance.seed())
    assert found.agree, found.verdict()
    assert [side.name for side in found.sides] == ["surfacepath", "volpath"]


def test_the_mutations_of_a_scene_are_its_samples(room):
    """2 runs of 16 mutations a pixel, not SAMPLING x SUPERSAMPLING squared."""
    scene = room("metropolisTransport\n1\nmutation\n16", spp=2)
    found = comparing.compare(scene, with_="path", size=(8, 6), runs=8)
    assert (found.settings["integrator"], found.settings["spp"]) == ("pssmlt", 32)


def test_both_sides_can_be_named(room):
    """`direct` lacks what comes by way of other surfaces: it is darker than `path`."""
    found = comparing.compare(room(), integrator="direct", with_="path", **SMALL)
    report = found.report()
    assert [side.name for side in found.sides] == ["direct", "path"] and not found.agree
    assert all(channel["ratio"] < 0.97 for channel in report["energy"])
    assert "--integrator direct --with path" in report["command"]


def test_a_method_may_change_the_scene(room):
    """Stock glass with Fresnel's own formulas: another picture than Schlick's where the ball is.

    Index 3: at 75 degrees Schlick reflects 0.418, Fresnel 0.352. The rest is the same.
    """
    ball = "OBJECT\nsphere 0 3 4 3\ncolor 1 1 1\nrefractive_index 3\nreflection reflection\n"
    found = comparing.compare(room(objects=ball), with_="dielectric", spp=512, size=(32, 24))
    most = found.report()["most"]
    assert not found.agree and 8 < most["x"] < 24


# ---- what is rendered


def test_runs_share_nothing_but_the_scene(room):
    """The same integrator on both sides: other seeds, so other noise; the same with each call."""
    first, second = (
        comparing.compare(room(), with_="path", size=(16, 12), spp=16, runs=8) for _ in range(2)
    )
    a, b = (side.estimate.pixels.mean for side in first.sides)
    assert not np.array_equal(a, b) and first.agree
    assert np.array_equal(a, second.sides[0].estimate.pixels.mean)
    assert (first.sides[0].estimate.pixels.variance > 0).mean() > 0.5


def test_samples_are_those_asked_for_rounded_up_to_whole_runs(room):
    done = []
    found = comparing.compare(
        room(), size=(8, 6), spp=30, runs=8, progress=lambda *count: done.append(count)
    )
    assert (found.settings["spp"], found.settings["runs"]) == (32, 8)
    assert done == [(k, 8) for k in range(1, 9)]
    assert all(len(side.seconds) == side.runs == 8 for side in found.sides)


def test_stopping_keeps_the_runs_so_far(room):
    found = comparing.compare(room(), size=(8, 6), spp=32, progress=lambda done, _: done == 9)
    assert found.settings["runs"] == 9 and found.settings["spp"] == 9
    with pytest.raises(CannotRender, match="stopped after 7 runs; 8 are needed"):
        comparing.compare(room(), size=(8, 6), spp=32, progress=lambda done, _: done == 7)


def test_neither_side_has_an_advantage_in_the_noise():
    """Two sides of one heavy-tailed law, 100 times: which has less noise is a coin's throw.

    27 or fewer, or 73 or more, of 100 throws have a chance of 5e-6. Weighed by the reference alone,
    whose outliers would count less, the reference has less noise in all 100.
    """
    rng, wins = np.random.default_rng(8), 0
    for _ in range(100):
        sides = []
        for name in "ab":
            runs = estimates.Runs()
            for _ in range(4):
                runs.add(rng.lognormal(sigma=2, size=(8, 8, 3)))
            sides.append(Side(name, runs.estimate(), 4, (1.0,) * 4, 0, 0))
        scores = statistics.all_levels(*(side.estimate for side in sides), 0.01)
        report = Comparison(tuple(sides), scores, None, {"spp": 4}).report()
        a, b = (side["rel_mse_of_noise"] for side in report["sides"])
        wins += a < b
    assert 27 < wins < 73


# ---- the command


def test_exit_status_0_agree_4_differ_1_error(invoke, room, tmp_path):
    small = ("--size", "16x12", "--spp", "32")
    result = invoke(room(), *small)
    assert result.exit_code == 0 and result.stdout.startswith("agree: ")
    output.write_image("white.exr", np.ones((12, 16, 3)))
    result = invoke(room(), "--with", "white.exr", "--spp", "32")
    assert result.exit_code == 4 and result.stdout.startswith("differ by -")
    assert invoke("missing.txt").exit_code == 1


def test_shape_of_the_json(invoke, room):
    result = invoke(room(), "--size", "16x12", "--spp", "32", "--json", "-o", "deep/page.html")
    report = json.loads(result.stdout)
    assert list(report) == [
        "verdict", "text", "scene", "integrator", "with", "size", "spp", "runs", "seed", "dialect",
        "variant", "command", "notes", "false_alarms", "confidence", "sides", "energy", "rel_mse",
        "rel_mse_debiased", "flip", "tests", "most", "versions",
    ]  # fmt: skip
    for side in report["sides"]:
        assert list(side) == [
            "name", "runs", "variance", "spp", "mean", "mean_plus_minus", "rel_mse_of_noise",
            "seconds", "efficiency", "not_finite", "negative",
        ]  # fmt: skip
        assert side["runs"] == 32 and len(side["mean"]) == 3 and side["seconds"] > 0
    assert [channel["channel"] for channel in report["energy"]] == ["red", "green", "blue"]
    assert [test["tests"] for test in report["tests"]] == [3, 3 * 12, 3 * 16 * 12]
    assert Path("deep/page.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


@pytest.mark.parametrize(
    "words, status, said",
    [
        (["--with", "nope"], 1, "integrator 'nope'"),
        (["--with", "nope.exr"], 1, "nope.exr: no such file"),
        (["--with", "picture.png"], 1, "expected an integrator's id or a linear picture"),
        (["--with", "broken.exr"], 1, "broken.exr: "),
        (["--with", "flat.exr", "--size", "9x9"], 1, "size 9x9: flat.exr has 8x6"),
        (["--runs", "7"], 2, "--runs"),
        (["-o", "."], 1, "cannot write .: it is a folder"),
        (["-o", "broken.exr/page.html"], 1, "cannot write broken.exr/page.html"),
    ],
)
def test_errors_are_one_readable_line(invoke, room, words, status, said):
    output.write_image("flat.exr", np.ones((6, 8, 3)))
    Path("broken.exr").touch()
    result = invoke(room(), *words)
    assert result.exit_code == status and said in result.stderr
    assert result.stdout == "" and "Traceback" not in result.stderr
    if status == 1:
        assert len(result.stderr.strip().splitlines()) == 1


# ---- documents and options


def test_a_document_is_compared_as_its_file_is(room):
    """The same pictures; options are a record, fields of it, or both."""
    options = RenderOptions(size=(16, 12), spp=16, seed=3)
    whole = comparing.compare(room(), options, with_="path", runs=8)
    document = relume.read(room(), {})
    parts = comparing.compare(document, size=(16, 12), spp=16, seed=3, with_="path", runs=8)
    changed = comparing.compare(document, options, seed=4, with_="path", runs=8)
    pictures = [f.sides[0].estimate.pixels.mean for f in (whole, parts, changed)]
    assert np.array_equal(*pictures[:2]) and not np.array_equal(*pictures[1:])
    assert parts.settings["scene"] == str(room()) and "--seed 3" in parts.settings["command"]
    with pytest.raises(TypeError, match="sedd"):
        comparing.compare(document, sedd=1)


def test_the_variant_can_be_chosen(room):
    """It renders, and the command repeats it."""
    seen = []
    small = {"size": (8, 6), "spp": 8, "runs": 8}
    found = comparing.compare(
        room(), variant="scalar_rgb", progress=lambda *_: seen.append(mi.variant()), **small
    )
    assert set(seen) == {"scalar_rgb"}
    assert found.settings["variant"] == "scalar_rgb"
    assert "--variant scalar_rgb --dialect manual" in found.settings["command"]
