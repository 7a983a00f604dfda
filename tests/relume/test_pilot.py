"""The choice between a scene's candidates: right, the same everywhere, and kept."""

import dataclasses
import io

import numpy as np
import pytest
from rich.console import Console

from relume import checkpoint, fingerprint, metadata, passes, passes_file, pilot, rendering
from relume.cluster import serialization, worker
from relume.loading import load_scene, open_session
from relume.options import RenderOptions
from relume.session import variant_context
from relume.translator import read_text, translate

BOX = """\
IMAGE
64 48
SAMPLING
700
SUPERSAMPLING
1
CAMERA_POS
0 2 9.5
CAMERA_DIR
0 0 -1
SCREEN
20 20 30

OBJECT
uvplane -3 0 -3
U 6 0 0
V 0 0 13
color 0.7 0.7 0.7

OBJECT
uvplane -3 0 -3
U 6 0 0
V 0 5 0
color 0.7 0.6 0.5

OBJECT
sphere 0 1.5 0 1.2
color 0.95 0.95 0.95
reflection reflection
refractive_index 1.5

OBJECT
uvplane {place} {height} {place}
U {side} 0 0
V 0 0 {side}
normal {normal}
emission {emission} {emission} {emission}
"""
"""A glass ball on a floor before a wall, below a square lamp."""

WIDE = BOX.format(place=-5, height=5.5, side=10, emission=1, normal=1)
SMALL = BOX.format(place=-0.05, height=4.5, side=0.1, emission=4000, normal=1)


def translated(text):
    return translate(read_text(text, environ={}))


@pytest.fixture
def console():
    return Console(record=True, file=io.StringIO(), width=200)


# ---- what short renders tell


class Flat:
    """A session that finds nothing."""

    def __init__(self, *_, **__):
        pass

    def run(self):
        return ()

    def image(self):
        return np.zeros((8, 8, 3))


def pictures(rng, variance, rare=0.0, seen=0, evenly=0.0):
    """Parts of a pilot: a grey picture of variance `variance` a sample, and light in lone pixels.

    Args:
        rng: random generator.
        variance: of a sample.
        rare: light in single samples, of a mean sample's.
        seen: how many of these samples the parts contain.
        evenly: light that comes evenly, on top of 1.
    """
    shape = (pilot.PARTS, 48, 64, 3)
    parts = 1 + evenly + rng.normal(0, np.sqrt(variance), shape)
    for _ in range(seen):
        part, y, x = (rng.integers(0, n) for n in shape[:3])
        parts[part, y, x] += rare * 48 * 64 * pilot.PARTS
    return parts


def better(first, second):
    """Error times cost of `surfacepath` over that of `bdpt`."""
    errors = pilot.errors_of({"surfacepath": first, "bdpt": second})
    return errors["surfacepath"] / errors["bdpt"] / pilot.COST["bdpt"]


@pytest.mark.parametrize("seed", range(10))
def test_even_noise_is_compared_at_equal_cost(seed):
    """16 samples against 8: variances are those of parts. The ratio has a deviation of 1.2 %."""
    rng = np.random.default_rng(seed)
    gain = better(pictures(rng, 0.04), pictures(rng, 0.02))
    assert gain == pytest.approx(0.04 * 16 / (0.02 * 8) / pilot.COST["bdpt"], rel=0.05)


@pytest.mark.parametrize("seen", [0, 1, 3])
@pytest.mark.parametrize("seed", range(5))
def test_light_that_one_finds_evenly_counts_whether_the_other_has_met_it_or_not(seen, seed):
    """2 % of the light come in samples of which a pilot has 0 to 3; without them it is better."""
    rng = np.random.default_rng(seed)
    path = pictures(rng, 0.01, rare=0.02, seen=seen)
    assert better(path, pictures(rng, 0.011, evenly=0.02)) > 1.5
    assert better(path, pictures(rng, 0.011)) < 1


@pytest.mark.parametrize("seed", range(5))
def test_what_surfaces_show_is_no_noise(seed):
    """A chessboard that one renders with a hundredth of the variance: half of it is far above the
    mean of its block, and is not cut off as rare light that the other one finds."""
    rng = np.random.default_rng(seed)
    board = 1 + 0.8 * (-1.0) ** np.add.outer(np.arange(48), np.arange(64))[..., None]
    path, both = (board * pictures(rng, variance) for variance in (1e-4, 1e-2))
    assert better(path, both) < 0.02


@pytest.mark.parametrize("seen", [(0, 1), (1, 0), (2, 1)])
@pytest.mark.parametrize("seed", range(5))
def test_light_that_is_rare_for_both_does_not_decide(seen, seed):
    rng = np.random.default_rng(seed)
    found = [pictures(rng, v, 0.1, n) for v, n in zip((0.01, 0.02), seen, strict=True)]
    assert better(*found) == pytest.approx(0.01 * 16 / (0.02 * 8) / pilot.COST["bdpt"], rel=0.05)


@pytest.mark.parametrize("lamp, cost", [("", 2.0), ("spot_light 1\n", 3.2)])
def test_the_cost_of_a_sample_counts(monkeypatch, lamp, cost):
    """More where lamps have no size, for which `bdpt` traces more light subpaths."""
    text = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\n\nOBJECT\nsphere 0 4 0 1\nemission 1 1 1\n"
    found = translated(text + lamp)
    monkeypatch.setattr(pilot, "Session", Flat)
    monkeypatch.setattr(pilot, "errors_of", lambda pictures: dict.fromkeys(pictures, 1.0))
    with variant_context("llvm_ad_rgb"):
        times = pilot.measured(None, found, RenderOptions())
    assert times == {"surfacepath": 1.0, "bdpt": cost}


def test_black_pictures_have_no_better_candidate():
    black = np.zeros((pilot.PARTS, 48, 64, 3))
    errors = pilot.errors_of({"surfacepath": black, "bdpt": black})
    assert pilot.decided(errors, ("surfacepath", "bdpt"))[0] == "surfacepath"


# ---- real scenes


@pytest.mark.parametrize("text, name", [(WIDE, "surfacepath"), (SMALL, "bdpt")])
def test_the_better_one_is_chosen(text, name):
    """Below a wide lamp, and for the caustic of a small one; the scenes share their kernels."""
    choice = pilot.choice(translated(text), RenderOptions(seed=1))
    assert (choice.options.integrator or "surfacepath") == name
    assert choice.why.startswith(f"{name}: by a pilot ")


def test_a_pilot_gives_the_same_numbers_again():
    found = translated(SMALL)
    with variant_context("llvm_ad_rgb"):
        measured = [pilot.measured(load_scene(found), found, RenderOptions(seed=3)) for _ in "ab"]
    assert measured[0] == measured[1]


# ---- where the choice goes


@pytest.fixture
def decided(monkeypatch):
    """A function that makes pilots find one of the candidates better."""

    def use(name):
        def measured(scene, translation, options):
            return {each: float(each != name) for each in translation.plan.candidates}

        monkeypatch.setattr(pilot, "measured", measured)

    monkeypatch.setattr(pilot, "LEAST", 0)
    return use


def test_no_pilot_where_there_is_no_choice(monkeypatch):
    """Another integrator is asked for, the render is short, or the scene has one candidate."""
    monkeypatch.setattr(pilot, "measured", None)
    found = translated(WIDE)
    assert pilot.choice(found, RenderOptions(integrator="path")).options.integrator == "path"
    short = dataclasses.replace(found, plan=dataclasses.replace(found.plan, spp=4))
    assert pilot.choice(short, RenderOptions()).options.integrator is None
    spot = translated(SMALL.replace("uvplane -0.05", "sphere 0 4.5 0 1\nspot_light 1\n#"))
    choice = pilot.choice(spot, RenderOptions())
    assert choice.options.integrator == "bdpt" and "lamps without size" in choice.why


@pytest.mark.parametrize("spp, name", [(64, "bdpt"), (48, None)])
def test_pilots_are_for_a_million_samples_or_more(monkeypatch, spp, name):
    """A picture of 160x120 with 64 samples a pixel may have a caustic that is worth it."""
    monkeypatch.setattr(pilot, "measured", lambda *_: {"surfacepath": 1.0, "bdpt": 0.0})
    found = translated(WIDE)
    plan = dataclasses.replace(found.plan, width=160, height=120, spp=spp)
    choice = pilot.choice(dataclasses.replace(found, plan=plan), RenderOptions())
    assert choice.options.integrator == name


@pytest.mark.parametrize("sampler", ["owen", "independent"])
def test_a_resumed_render_keeps_the_choice(room, tmp_path, monkeypatch, decided, console, sampler):
    """Whatever a pilot would say now; and the picture says who rendered it, and why."""
    monkeypatch.setattr(passes, "SAMPLES_PER_PASS", 32 * 24)
    monkeypatch.setattr(checkpoint, "INTERVAL", 0)

    def render(out, resume=False, **limit):
        again = rendering.PassOptions(resume=resume)
        out, options = tmp_path / out, {"spp": 6, "sampler": sampler}
        return rendering.render_file(
            room(), out=out, passes=again, console=console, **options, **limit
        )[0]

    decided("bdpt")
    whole = render("whole.exr")
    render("a.exr", time_limit=0)
    header = passes_file.read_header(tmp_path / "a.passes.exr")
    assert header.render["integrator"] == "bdpt"
    decided("surfacepath")
    assert render("a.exr", resume=True).read_bytes() == whole.read_bytes()
    facts = metadata.of_file(whole)
    assert facts["relume.integrator"] == "bdpt"
    assert facts[metadata.CHOICE] == "bdpt: by a pilot surfacepath takes inf times as long " \
        "for the same noise"  # fmt: skip
    assert facts[metadata.CHOICE] in console.export_text()


def test_a_worker_renders_what_was_chosen(room, decided):
    decided("bdpt")
    choice = pilot.choice(translate(read_text(room().read_text(), environ={})), RenderOptions())
    options = RenderOptions.of(choice.options, variant="llvm_ad_rgb")
    render = fingerprint.of_render(choice.translation, options, 4)
    scene, contents = serialization.pack(choice.translation.scene)
    job = worker.Job.of(choice.translation, scene, render, options)
    worker.load(job, contents, 2)
    found = worker.render(job.key, 1, 4).pass_
    with open_session(choice.translation, options, 4, choice.scene) as session:
        expected = session.render_pass(1, 4)
        assert str(session.integrator).startswith("BDPT[")
    for a, b in zip(found.arrays, expected.arrays, strict=True):
        assert np.array_equal(a, b)


# ---- scenes with a factor of the radiance


def test_the_factor_stays_with_whoever_renders(decided):
    """`sensor_response` 2 doubles the picture of `bdpt`, chosen or asked for, bit for bit, also
    beside `luminance_cutoff`, which only path tracers follow; and a pilot measures both."""
    single = translated(SMALL)
    double = translated("sensor_response\n2\n" + SMALL)
    held = translated("sensor_response\n2\nluminance_cutoff\n0.5\n" + SMALL)
    assert double.plan.candidates == ("samplescale", "bdpt")
    decided("bdpt")
    choice = pilot.choice(double, RenderOptions())
    assert choice.options.integrator == "bdpt"
    asked = RenderOptions(integrator="bdpt")
    sums = []
    for translation, options in (
        (single, asked), (double, asked), (double, choice.options), (held, asked)
    ):  # fmt: skip
        with open_session(translation, options) as session:
            sums.append(session.render_pass(0, 2).sum)
    assert sums[0].max() > 0
    assert all(np.array_equal(2 * sums[0], x) for x in sums[1:])


def test_a_pilot_measures_scenes_with_a_factor():
    """As those without: relative errors do not depend on it."""
    found = translated("sensor_response\n2\n" + SMALL)
    with variant_context("llvm_ad_rgb"):
        errors = pilot.measured(load_scene(found), found, RenderOptions(seed=1))
    name, why = pilot.decided(errors, found.plan.candidates)
    assert name == "bdpt" and "by a pilot samplescale takes" in why
