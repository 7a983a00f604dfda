"""`relume chart`: what is measured, its files, its command."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import relume
from relume.cli import main
from relume.session import CannotRender
from relume.workbench import chart_files, chart_table, charting, methods, renders

GLASS = "OBJECT\nsphere 0 1 3 1\ncolor 1 1 1\nrefractive_index 1.5\nreflection reflection\n"
SMALL = {"size": (16, 12), "seconds": 0.5, "runs": 4}


LEVELS = 5


@pytest.fixture(autouse=True)
def levels(monkeypatch):
    """As many numbers of samples on a busy machine as on an idle one."""
    monkeypatch.setattr(charting.curves, "LEAST_LEVELS", LEVELS)
    monkeypatch.setattr(charting, "MOST_LEVELS", LEVELS)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("references")


@pytest.fixture
def measured(room, cache):
    """The chart of a small room with a glass ball."""
    methods = ("path", "volpath", "dielectric")
    return relume.chart(room(objects=GLASS), methods=methods, cache=cache, **SMALL)


@pytest.fixture
def invoke(tmp_path, monkeypatch, cache):
    """A function that runs the command in an empty folder."""
    folder = tmp_path / "cwd"
    folder.mkdir()
    monkeypatch.chdir(folder)
    small = ["--size", "16x12", "--seconds", "0.2", "--runs", "4", "--cache", str(cache)]
    return lambda *words: CliRunner().invoke(main, ["chart", *map(str, words), *small])


def test_every_method_gets_a_curve(measured):
    """Errors fall as the samples grow; both clocks run; what path traces is what volpath does."""
    assert [c.name for c in measured.curves] == ["path", "volpath", "dielectric"]
    assert measured.settings["runs"] == 4 and not measured.skipped
    for curve in measured.curves:
        assert list(curve.spp) == [2**k for k in range(len(curve.spp))] and len(curve.spp) == LEVELS
        assert (curve.wall > 0).all() and (curve.cpu > 0).all() and curve.not_finite == 0
        error, half = curve.error()
        assert error[0] > error[-1] > 0 and (half > 0).all()
    about = measured.reference.about
    top = measured.curves[0].spp[-1]
    assert about["method"] == "surfacepath" and about["spp"] * about["runs"] >= 16 * top


def test_an_integrator_that_does_not_work_is_left_out_with_its_reason(room, cache):
    options = SMALL | {"runs": 8, "seconds": 2}
    found = relume.chart(room(), methods=("direct", "nope"), cache=cache, **options)
    assert [c.name for c in found.curves] == ["direct"] and found.curves[0].biased()
    assert "nope" in found.skipped["nope"]
    with pytest.raises(CannotRender, match="integrator 'nope'"):
        relume.chart(room(), methods=("nope",), cache=cache, **SMALL)


def test_pictures_are_the_same_with_the_same_seed_alone(room, cache):
    """What is measured at each number of samples, against the same reference.

    That is kept in single precision, but for the first time.
    """
    first, again, other = (
        charting.chart(room(), methods=("path",), cache=cache, seed=seed, **SMALL).curves[0]
        for seed in (0, 0, 1)
    )
    assert first.gram.shape == (LEVELS, 4, 4)
    assert np.allclose(first.gram, again.gram, rtol=1e-5, atol=1e-7)
    assert not np.isclose(first.gram, other.gram, rtol=1e-3).any()


def test_the_number_of_samples_grows_while_the_next_render_fits_the_share(monkeypatch):
    """Renders of 1 ms a sample: up to 64 samples and no more in a share of 0.3 s."""

    class Timed(charting.Racer):
        def __init__(self):
            self.spp = [1]

        def render(self, spp, seed):
            return renders.Render(None, 1e-3 * spp, 0.0)

    monkeypatch.setattr(charting, "MOST_LEVELS", 20)
    for share, most in ((0.3, 128), (0.25, 64), (0.0, 2 ** (LEVELS - 1))):
        racer = Timed()
        racer.warm_up(share)
        assert racer.spp == [2**k for k in range(len(racer.spp))] and racer.spp[-1] == most


def test_stopping_keeps_whole_rounds(room, cache):
    """Stopped within the sixth round, five are left; within the fourth, too few."""

    def measure(last):
        def progress(what, done, of):
            return what == "render" and done >= last * of / 8

        options = SMALL | {"runs": 8, "progress": progress}
        return charting.chart(room(), methods=("path",), cache=cache, **options)

    assert measure(5.5).curves[0].runs == 5
    with pytest.raises(CannotRender, match="stopped after 3 rounds of renders; 4 are needed"):
        measure(3.5)


def test_the_default_size_keeps_the_shape():
    assert charting.reduced((640, 480)) == (160, 120)
    assert charting.reduced((100, 2000)) == (8, 160)
    assert charting.reduced((120, 90)) == (120, 90)


def test_references_are_unbiased_and_planned_if_they_can_be(room, cache):
    with pytest.raises(ValueError, match="runs 3"):
        relume.chart(room(), runs=3)
    found = relume.chart(room(), methods=("path",), reference="volpath", cache=cache, **SMALL)
    assert found.reference.about["method"] == "volpath"
    assert all(row.unbiased for row in methods.METHODS if row.name in ("path", "volpath"))


def test_documents_are_charted_and_options_without_meaning_are_refused(room, cache):
    found = relume.chart(relume.read(room(), {}), methods=("path",), cache=cache, **SMALL)
    assert found.name == "room" and found.settings["scene"] == str(room())
    for option in ({"spp": 4}, {"integrator": "path"}):
        with pytest.raises(ValueError, match=f"{next(iter(option))}: the "):
            relume.chart(room(), **option)


def test_columns_of_the_data(measured):
    text = chart_table.as_csv(chart_table.POINTS, chart_table.points(measured))
    rows = list(csv.DictReader(io.StringIO(text)))
    assert list(rows[0]) == list(chart_table.POINTS)
    assert len(rows) == sum(len(curve.spp) for curve in measured.curves)
    for row in rows:
        assert row["scene"] == "room" and row["runs"] == "4"
        assert float(row["wall_s"]) > 0 and float(row["error_plus_minus"]) > 0
    assert {row["on_front"] for row in rows} == {"0", "1"}
    first = min(rows, key=lambda row: float(row["wall_s"]))
    assert first["on_front"] == "1"


def test_the_command_writes_figures_data_and_overview(invoke, room):
    result = invoke(room(name="a.txt"), room(name="日本.txt"), "--method", "path", "-o", "out")
    assert result.exit_code == 0, result.stderr
    names = {file.name for file in Path("out").iterdir()}
    assert names == {
        *(f"{stem}{end}" for stem in ("a", "日本") for end in (".svg", ".png", ".csv")),
        "overview.svg",
        "overview.png",
        "methods.csv",
    }
    for file in Path("out").glob("*.png"):
        with Image.open(file) as picture:
            assert min(picture.size) > 200 and len(picture.getcolors(1 << 20)) > 20
            assert "relume chart" in picture.text["Description"]
    svg = Path("out/a.svg").read_text(encoding="utf-8")
    assert "path" in svg and "--seconds 0.2 --runs 4 --seed 0" in svg and "<dc:date>" not in svg
    rows = list(csv.DictReader(io.StringIO(Path("out/methods.csv").read_text("utf-8"))))
    assert [(row["scene"], row["method"]) for row in rows] == [("a", "path"), ("日本", "path")]
    assert "slope" in result.stdout and "Reference: surfacepath" in result.stdout


def test_errors_are_one_readable_line_and_come_first(invoke, room, tmp_path):
    assert invoke(room(), "missing.txt").exit_code == 1
    assert not Path("charts").exists()
    result = invoke(room(), "--method", "nope")
    assert result.exit_code == 1 and "integrator 'nope'" in result.stderr
    Path("file").touch()
    result = invoke(room(), "-o", "file")
    assert result.exit_code == 1 and "cannot write file" in result.stderr


def test_files_of_scenes_with_the_same_name_are_numbered():
    assert chart_files.unique_names(["a/x.txt", "b/x.txt", "y.txt", "c/x.txt"]) == [
        "x", "x-2", "y", "x-3",
    ]  # fmt: skip
