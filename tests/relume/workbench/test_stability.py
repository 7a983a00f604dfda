"""`relume stability`: verdicts on data of known error, cells rendered, broken methods found."""

import dataclasses
import json

import mitsuba as mi
import numpy as np
import pytest
from click.testing import CliRunner

import relume
from relume import translator
from relume.cli import main
from relume.options import RenderOptions
from relume.session import variant_context
from relume.translator.outcomes import OUTCOMES
from relume.workbench import stability, stability_page, stability_runs
from relume.workbench.cells import Case, Cell, Family, all_cells
from relume.workbench.stability_verdict import NEGLIGIBLE, Measurement, RunStatistics


def measured(generator, *, mean=1.0, noise=0.05, runs=16, grey=True):
    """The measurement of runs of 4 x 4 Gaussian pixels with the known answer 1."""
    statistics = RunStatistics(1.0, 1.0)
    for _ in range(runs):
        picture = generator.normal(mean, noise, (4, 4, 1 if grey else 3))
        statistics.add(np.broadcast_to(picture, (4, 4, 3)))
    return statistics.measurement()


@pytest.fixture
def generator(chance):
    return chance.rng()


SKY = "IMAGE\n320 240\nSAMPLING\n1\nSUPERSAMPLING\n1\nBACKGROUND\n0.2 0.4 0.6\n"


# ---- verdicts


@pytest.mark.false_alarms(1e-3)
def test_verdicts_follow_error_and_noise(generator):
    """The interval of the mean is ± 4.1 noise / 16, so that these are twenty widths from a limit,
    but for the first, which is exact with the probability 99.9 %, and the last, which no value
    below 0 may make fail."""
    assert measured(generator, noise=0.01).verdict == "exact"
    assert measured(generator, mean=1.02, noise=0.001).verdict == "degrades"
    assert measured(generator, mean=0.9, noise=0.001).verdict == "fails"
    noisy = measured(generator, noise=0.15)
    assert noisy.verdict == "degrades" and noisy.text().startswith("degrades: noisy, ")


def test_rounding_is_no_error():
    """Without noise, errors below `NEGLIGIBLE` count as none and those above as errors."""
    for error, verdict in ((0.9, "exact"), (1.1, "degrades")):
        statistics = RunStatistics(2.0, 2.0)
        for _ in range(8):
            statistics.add(np.full((4, 4, 3), 2 * (1 + error * NEGLIGIBLE)))
        assert statistics.measurement().verdict == verdict


@pytest.mark.parametrize(
    "value, share, text",
    [(np.nan, "not_finite", "not finite"), (np.inf, "not_finite", "not finite"),
     (-1.0, "negative", "negative")],
)  # fmt: skip
def test_one_bad_value_fails(value, share, text):
    """One of 8 x 48 values, in a cell that would see an error of 1 % and has none to see."""
    statistics = RunStatistics(1.0, 1.0)
    for run in range(8):
        picture = np.ones((4, 4, 3))
        if run == 0:
            picture[0, 0, 0] = value
        statistics.add(picture)
    found = statistics.measurement()
    assert found.verdict == "fails" and found.silent
    assert getattr(found, share) == pytest.approx(1 / 384)
    assert text in found.text()


def define_negative():
    """Register a path tracer of which one sample in a hundred is below 0."""

    class Negative(mi.SamplingIntegrator):
        def __init__(self, props):
            super().__init__(props)
            self.path = mi.load_dict({"type": "surfacepath"})

        def sample(self, scene, sampler, ray, medium=None, active=True):
            L, valid, values = self.path.sample(scene, sampler, ray, medium, active)
            L[sampler.next_1d() < 0.01] = mi.Spectrum(-100)
            return L, valid, values

    mi.register_integrator("test_negative", Negative)


def test_colours_of_one_wavelength_are_not_negative(chance):
    """A sample of dispersive glass has one wavelength, a colour that RGB cannot hold; radiance
    below 0 is found even there: of 16 x 256 such samples one in a hundred has it, each value of
    three."""
    (cell,) = stability.chosen(["surfacepath"], ["dispersive ball/1"])
    document = translator.read_text(cell.family.make(1).scene, "ball.txt", {})
    assert (relume.render(document, spp=1, seed=1) < 0).mean() > 0.1
    row = dataclasses.replace(cell.family, make=lambda _: Case(document, 1.0, spp=1))
    assert stability.measure(Cell(row, 1, "surfacepath"), chance.seed()).negative == 0
    with variant_context("llvm_ad_spectral"):
        define_negative()
        broken = stability.measure(Cell(row, 1, "test_negative"), chance.seed())
    assert broken.verdict == "fails" and broken.silent
    assert broken.negative == pytest.approx(0.01, abs=0.005)


def test_a_failure_that_is_said_is_not_silent():
    assert Measurement(error=0.5).silent
    assert not Measurement(error=0.5, said="single precision").silent
    assert not Measurement(said="no such light", refused=True).silent
    assert not Measurement(error=0.02).silent


def test_codes_of_limits_are_outcomes():
    """A cell asks reports for them; a code that no report has would never excuse a failure."""
    assert set(stability_runs.LIMITS) <= set(OUTCOMES)


def test_fireflies_are_in_units_of_the_answer():
    statistics = RunStatistics(0.5, 0.5)
    for pixel in (0.5, 30.0):
        picture = np.full((4, 4, 3), 0.5)
        picture[1, 2] = pixel
        statistics.add(picture)
    assert statistics.measurement().firefly == pytest.approx(60)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("grey", [True, False])
def test_false_alarms(generator, grey, chance):
    """At most 1 in 1000, of 1000 reruns of an exact method."""
    found = [measured(generator, grey=grey) for _ in range(1000)]
    alarms = sum(abs(m.error) > m.half_width for m in found)
    chance.rare(alarms, 1000, 1e-3)


@pytest.mark.false_alarms(1e-3)
def test_what_a_cell_sees_it_finds(generator, chance):
    """An error as large as `sees` is found with the probability 95 %; 94 % are judged."""
    error = np.mean([measured(generator).sees for _ in range(200)])
    found = [measured(generator, mean=1 + error) for _ in range(400)]
    chance.rare(sum(m.verdict == "exact" for m in found), 400, 0.06)


# ---- cells


def test_cells_have_names_and_answers_of_their_own():
    cells = all_cells()
    names = [cell.name for cell in cells]
    assert len(set(names)) == len(names)
    assert all(cell.family.answer and cell.family.quantity for cell in cells)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    "method, pattern",
    [("path", "shining box by size/1"), ("volpath", "grey ball/0.001"),
     ("surfacepath", "lit floor by size/1000")],
)  # fmt: skip
def test_a_cell_is_exact(method, pattern, chance):
    """Ordinary inputs."""
    (cell,) = stability.chosen([method], [pattern])
    found = stability.measure(cell, chance.seed())
    assert found.verdict == "exact" and not found.said, found.text()
    assert found.sees < 0.01


def define_broken():
    """Register path tracers that give 2 % too much light, and NaN in a thousandth of pixels."""

    class Broken(mi.SamplingIntegrator):
        def __init__(self, props):
            super().__init__(props)
            self.path = mi.load_dict({"type": "path"})

    class Brighter(Broken):
        def sample(self, scene, sampler, ray, medium=None, active=True):
            L, valid, values = self.path.sample(scene, sampler, ray, medium, active)
            return 1.02 * L, valid, values

    class Undefined(Broken):
        def sample(self, scene, sampler, ray, medium=None, active=True):
            L, valid, values = self.path.sample(scene, sampler, ray, medium, active)
            L[sampler.next_1d() < 1e-4] = mi.Float(np.nan)
            return L, valid, values

    mi.register_integrator("test_two_percent", Brighter)
    mi.register_integrator("test_undefined", Undefined)


@pytest.fixture
def broken():
    """A function that measures a grey ball by a broken integrator."""
    before = mi.variant()
    mi.set_variant("llvm_ad_rgb")
    define_broken()
    (cell,) = stability.chosen(["path"], ["grey ball/1"])
    yield lambda method: stability.measure(Cell(cell.family, cell.value, method))
    if before:
        mi.set_variant(before)


def test_two_percent_too_much_are_found(broken):
    found = broken("test_two_percent")
    assert found.verdict == "degrades"
    assert found.error == pytest.approx(0.02, abs=found.half_width)


def test_undefined_values_are_found(broken):
    """64 samples a pixel, one in 10,000 undefined: 0.64 % of the pixels, ± 0.13 % of 4096."""
    found = broken("test_undefined")
    assert found.verdict == "fails" and found.silent
    assert found.not_finite == pytest.approx(0.0064, abs=0.004)


def test_a_refused_scene_says_so():
    """With the message of the error, be it the scene file's or a plugin's."""
    beam = {
        "type": "scene",
        "light": {"type": "parallelbeam", "edge_v": [9, 0, 0], "direction": [0, 0, 1]},
    }
    scenes = {"text": "IMAGE\n0 16\n", "dictionary": beam}
    row = Family("refused", "", "", lambda name: Case(scenes[name], 1.0), (), ())
    text, plugin = (stability.measure(Cell(row, name, "parallelbeam")) for name in scenes)
    for found, said in ((text, "IMAGE"), (plugin, "must span space")):
        assert found.refused and said in found.said and not found.silent


def test_what_the_language_forbids_is_refused(chance):
    """An alpha of 0 is; a cell in which such a scene is rendered, or refused for another reason,
    fails."""
    (cell,) = stability.chosen(["ward"], ["ward brushed/0"])
    found = stability.measure(cell, chance.seed())
    assert found.verdict == "refused" and "alpha_y above 0" in found.said
    for scene in (SKY, "IMAGE\n0 16\n"):
        case = Case(scene, 0.4, forbidden="alpha_y above 0")
        row = dataclasses.replace(cell.family, make=lambda _, case=case: case)
        assert stability.measure(Cell(row, 0, "ward"), 0).verdict == "fails"


# ---- a given scene


@pytest.mark.parametrize(
    "expected, verdict", [((0.2, 0.4, 0.6), "exact"), ((0.2, 0.39, 0.6), "degrades"),
                          (0.4, "fails")],
)  # fmt: skip
def test_a_given_scene_is_a_cell_for_each_method(expected, verdict):
    """A sky alone has no noise: an error is what the stated answer is off, over its largest
    channel, 0.01 / 0.6 of the second, 0.2 / 0.4 of the third."""
    document = translator.read_text(SKY, "sky.txt", {})
    found = relume.stability(document, expected=expected, methods=("path", "volpath"), spp=2)
    assert [cell.name for cell, _ in found.results] == ["path/sky/as given", "volpath/sky/as given"]
    for _, measured_ in found.results:
        assert measured_.verdict == verdict
        assert measured_.samples == 16 * 2 * 160 * 120
    off = {"exact": 0, "degrades": 0.01 / 0.6, "fails": -0.5}[verdict]
    assert abs(found.results[0][1].error) == pytest.approx(abs(off), abs=1e-5)


def test_by_default_all_methods_that_can_render_the_scene(room):
    cells = stability.cells_of(relume.read(room(), {}), RenderOptions(), 1.0, ())
    assert [cell.method for cell in cells][:3] == ["surfacepath", "bdpt", "bdpt-merging"]
    assert {"pssmlt", "erpt"} <= {cell.method for cell in cells}


def test_a_method_that_does_not_exist_is_refused_and_says_so():
    document = translator.read_text(SKY, "sky.txt", {})
    found = relume.stability(document, expected=0.4, methods=("nope",))
    ((_, measurement),) = found.results
    assert measurement.refused and "nope" in measurement.said and not found.silent


@pytest.mark.parametrize(
    "arguments, said",
    [
        ({"expected": 1.0}, "expected: name the scene"),
        ({"spp": 3}, "spp: the cells of the grid have their own"),
        ({"scene": True}, "expected None: the mean radiance"),
        ({"scene": True, "expected": (1, 2)}, "one number or three"),
        ({"scene": True, "expected": -1}, "the mean radiance"),
        ({"resume": True}, "resume: name the folder"),
        ({"scene": True, "expected": 1, "out": "x"}, "out: a folder keeps cells of the grid"),
        ({"scene": True, "expected": 1, "cells": ("x",)}, "cells: patterns"),
        ({"scene": True, "expected": 1, "integrator": "path"}, "integrator: the integrators are"),
    ],
)
def test_what_has_no_meaning_is_refused(arguments, said):
    if arguments.get("scene"):
        arguments = arguments | {"scene": translator.read_text(SKY, "sky.txt", {})}
    with pytest.raises(ValueError, match=said):
        relume.stability(**arguments)


def test_stopping_keeps_the_cells_so_far():
    done = []
    found = relume.stability(
        methods=("path",),
        cells=("grey ball/*",),
        progress=lambda *count: done.append(count) or len(done) == 2,
    )
    assert len(found.results) == 2 and done == [(1, 11), (2, 11)]


# ---- command and page


def test_command(tmp_path):
    """The report is printed, and written with its heat map."""
    out = tmp_path / "out"
    words = ["stability", "--method", "path", "--cell", "grey ball/1", "-o", str(out), "--json"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0
    (cell,) = json.loads(result.stdout)["cells"]
    assert cell["method"] == "path" and cell["verdict"] == "exact"
    page = (out / "stability.md").read_text()
    assert "| path | 1 | 1 | 0 | 0 | 0 | 0 |" in page and "convex body" in page
    assert (out / "stability.png").stat().st_size > 1000


@pytest.fixture
def constant(monkeypatch):
    """Cells are not rendered: a function that sets what all give, and returns their names."""
    asked = []

    def give(found):
        def measure(cell, seed):
            asked.append(cell.name)
            if isinstance(found, Exception):
                raise found
            return found

        monkeypatch.setattr(stability, "measure", measure)
        return asked

    return give


GREY = {"methods": ("path",), "cells": ("grey ball/1", "grey ball/10")}


def cells_on(folder):
    """The objects of the results of a folder, by the cell's value."""
    found = json.loads((folder / "stability.json").read_text())["cells"]
    return {entry["at"]: entry for entry in found}


def test_results_of_other_calls_are_kept(tmp_path, constant):
    """Page and picture show cells of both calls; what is measured again is replaced."""
    constant(Measurement(error=0.5, half_width=0.1))
    relume.stability(methods=("ward",), cells=("ward brushed/1",), out=tmp_path)
    first = (tmp_path / "stability.png").stat().st_size
    constant(Measurement(error=0.25, said="dark"))
    relume.stability(**GREY, out=tmp_path)
    constant(Measurement(error=0.123456789, said="dark"))
    found = relume.stability(methods=("path",), cells=("grey ball/10",), out=tmp_path)
    assert len(found.results) == 1
    text = (tmp_path / "stability.md").read_text()
    rows = section(text, "What Mitsuba's own integrators do there")
    assert "| ward | ward brushed | 1 | fails: +50 %" in text
    assert "| path | grey ball | 1 | fails: +25 %" in rows
    assert "| path | grey ball | 10 | fails: +12.3 %" in rows and "+25 %" in rows
    assert f"3 cells are of version {relume.__version__}" in text
    assert (tmp_path / "stability.png").stat().st_size > first
    entry = cells_on(tmp_path)["10"]
    assert entry["error"] == 0.12346 and entry["said"] == "dark" and entry["verdict"] == "fails"


def test_each_cell_is_kept_at_once(tmp_path, constant):
    """An error at the second of three loses nothing of the first; the call that resumes leaves it
    out, and measures what another version has."""
    asked = constant(Measurement(error=0.01))
    stop = lambda done, of: constant(RuntimeError("off")) is None  # noqa: E731
    with pytest.raises(RuntimeError, match="off"):
        relume.stability(**GREY, out=tmp_path, progress=stop)
    assert list(cells_on(tmp_path)) == ["1"] and not (tmp_path / "stability.md").exists()
    asked[:] = []
    asked = constant(Measurement())
    relume.stability(**GREY, out=tmp_path, resume=True)
    assert asked == ["path/grey ball/10"]
    file = tmp_path / "stability.json"
    lines = file.read_text().splitlines()
    lines[1] = lines[1].replace(relume.__version__, "0.0.1")
    file.write_text("\n".join(lines))
    asked[:] = []
    relume.stability(**GREY, out=tmp_path, resume=True)
    assert asked == ["path/grey ball/1"]
    asked[:] = []
    relume.stability(**GREY, out=tmp_path, resume=True)
    assert asked == []
    page_ = (tmp_path / "stability.md").read_text()
    assert "| path | 2 | 2 | 0 | 0 | 0 | 0 |" in page_ and "2 cells are of version" in page_


def test_page_tells_what_is_earlier_and_what_is_not_measured(tmp_path, constant):
    """A cell without version and date is of an earlier state."""
    constant(Measurement())
    entry = {"method": "path", "scene": "grey ball", "at": "10", "verdict": "exact"}
    (tmp_path / "stability.json").write_text(json.dumps({"cells": [entry, entry | {"at": "1"}]}))
    relume.stability(methods=("path",), cells=("grey ball/1",), out=tmp_path)
    text = (tmp_path / "stability.md").read_text()
    assert f"1 cell is of version {relume.__version__}, measured 2" in text
    assert "1 cell is of an earlier state" in text
    assert "path, grey ball: 0.0001, 0.001, 0.01, 0.1, 100, " in text
    assert cells_on(tmp_path)["10"] == entry


def test_what_is_no_file_of_results_is_kept(tmp_path):
    """The error names it."""
    for content in ("{", "[]", '{"cells": [{}]}', '{"cells": [1]}'):
        (tmp_path / "stability.json").write_text(content)
        words = ["stability", "--method", "path", "--cell", "grey ball/1", "-o", str(tmp_path)]
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 1 and "is not what `relume stability` writes" in result.output
        assert (tmp_path / "stability.json").read_text() == content


def test_command_names_the_methods_that_there_are():
    result = CliRunner().invoke(main, ["stability", "--method", "pth"])
    assert result.exit_code == 1
    assert "method 'pth' has no cells; those that have: " in result.output
    assert "no cell matches" in CliRunner().invoke(main, ["stability", "--cell", "x"]).output


def test_silent_failure_ends_with_status_4(monkeypatch):
    monkeypatch.setattr(stability, "measure", lambda cell, seed: Measurement(error=0.5))
    result = CliRunner().invoke(main, ["stability", "--method", "path", "--cell", "grey ball/1"])
    assert result.exit_code == 4
    assert "path/grey ball/1: fails: +50 %" in result.stdout


def page(cell, *measurements):
    """The page of some measurements of a cell."""
    found = [stability.report(cell, m) for m in measurements]
    versions = {"mitsuba": "", "drjit": ""}
    return stability_page.markdown({"cells": found, "command": "", "versions": versions}, "x.png")


def section(text, heading):
    """What stands below a heading of a page, to the next one; empty if there is no such heading."""
    return text.partition(f"## {heading}\n")[2].partition("\n## ")[0]


def test_page_lists_what_is_not_exact():
    """A row for each such cell, with what says so."""
    row = Family("grey ball", "", "", lambda _: None, (1,), ("surfacepath",), "Nobody knows.")
    cell = Cell(row, 1, "surfacepath")
    text = page(
        cell, Measurement(), Measurement(error=0.5), Measurement(error=0.5, said="too | far")
    )
    assert "- **grey ball**. Nobody knows." in section(text, "What is not exact")
    assert "| surfacepath | grey ball | 1 | fails: +50 % ± 0 % | 0 | - |" in text
    assert "too \\| far" in text
    assert "| surfacepath | 3 | 1 | 0 | 0 | 1 | 1 | 0.1 % |" in text


def test_page_keeps_mitsubas_integrators_and_refusals_apart():
    """A reference is what Mitsuba's own render where one of this product does, too."""
    (reference,) = stability.chosen(["path"], ["white room/0.99"])
    (own,) = stability.chosen(["surfacepath"], ["white room/0.99"])
    assert stability_runs.is_reference(reference) and not stability_runs.is_reference(own)
    for cell, heading in (
        (reference, "What Mitsuba's own integrators do there"),
        (own, "What is not exact"),
    ):
        text = page(cell, Measurement(error=0.5))
        assert f"| {cell.method} | white room | 0.99 | fails" in section(text, heading)
        assert text.count("| white room | 0.99 |") == 1
    text = page(own, Measurement(refused=True, forbidden=True, said="above 0"))
    assert "| above 0 |" in section(text, "What the scene language forbids")
    assert "| surfacepath | 1 | 0 | 1 | 0 | 0 | 0 | - |" in text


@pytest.mark.parametrize(
    "method, pattern, is_reference",
    [
        ("volpath", "fog by density/1", False),
        ("volpathmis", "fog by density/1", False),
        ("volpath", "fog by density/100", True),
        ("volpathmis", "fog by density/1e+06", True),
        ("randomwalk", "fog by density/100", False),
        ("volpath", "camera inside a filled ball/3", True),
        ("path", "grey ball/1", True),
        ("path", "longest path/3", True),
    ],
)
def test_the_plan_tells_what_is_a_reference(method, pattern, is_reference):
    """It takes `volpath` in thin fog, `randomwalk` in dense one; a dictionary has no plan."""
    (cell,) = stability.chosen([method], [pattern])
    assert stability_runs.is_reference(cell) == is_reference
