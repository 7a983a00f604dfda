"""`bdpt-merging`: `bdpt` that merges vertices, under a name that users can ask for."""

import io

import mitsuba as mi
import numpy as np
import pytest
from rich.console import Console

from relume import checkpoint, fingerprint, metadata, passes, pilot, rendering
from relume.cluster import serialization, worker
from relume.loading import integrator_entry, open_session
from relume.options import RenderOptions
from relume.session import Session, variant_context
from relume.translator import read_text, translate
from relume.workbench import methods

POOL = """\
IMAGE
16 12
SAMPLING
12
SUPERSAMPLING
1
CAMERA_POS
0 9 4
TARGET_POS
0 0 0
SCREEN
20 15 30

OBJECT
plane 0 0 0
normal 0 1 0
color 0.7 0.7 0.7

OBJECT
uvplane -8 1 -8
U 16 0 0
V 0 0 16
color 1 1 1
reflection reflection
refractive_index 1.33

OBJECT
sphere 0 5 0 0.1
emission 50 50 50
spot_light 1
spot_light_dir 0 -1 0
"""
"""The ground of a pool, which a spot lights through the water that it is seen through."""

NAME = "bdpt-merging"


@pytest.fixture
def pool(tmp_path):
    path = tmp_path / "pool.txt"
    path.write_text(POOL)
    return path


def translated():
    return translate(read_text(POOL, environ={}))


def render(path, out, **options):
    console = Console(file=io.StringIO())
    kept = {name: options.pop(name) for name in ("resume",) if name in options}
    found = rendering.render_file(
        path, out=out, passes=rendering.PassOptions(**kept), console=console, **options
    )
    return found[0]


def test_both_tables_mean_the_same_parameters():
    """The command line's, and that of the workbench; roulette and depth are the scene's."""
    planned = {"type": "surfacepath", "max_depth": -1, "rr_depth": 7}
    with variant_context("llvm_ad_rgb"):
        made = integrator_entry(NAME, planned)
    assert made == planned | {"type": "bdpt", "merge_radius": 0.5}
    assert methods.find(NAME).integrator(planned) == made
    assert not methods.find(NAME).unbiased


def test_light_hidden_from_both_ends_is_there_and_no_note_says_otherwise():
    found = translated()
    choice = pilot.choice(found, RenderOptions(integrator=NAME))
    assert choice.translation is found
    lit = {}
    for name in ("bdpt", NAME):
        with open_session(found, RenderOptions(integrator=name)) as session:
            lit[name] = session.render_pass(0, 12).sum.mean()
    assert lit["bdpt"] == 0 and lit[NAME] > 0


def test_a_resumed_render_is_that_of_one_go(pool, tmp_path, monkeypatch):
    """Pass by pass with its own radius; the picture tells who rendered it."""
    monkeypatch.setattr(passes, "SAMPLES_PER_PASS", 4 * 16 * 12)
    monkeypatch.setattr(checkpoint, "INTERVAL", 0)
    whole = render(pool, tmp_path / "whole.exr", integrator=NAME)
    left = render(pool, tmp_path / "a.exr", integrator=NAME, time_limit=0)
    assert left.read_bytes() != whole.read_bytes()
    again = render(pool, tmp_path / "a.exr", integrator=NAME, resume=True)
    assert again.read_bytes() == whole.read_bytes()
    assert metadata.of_file(whole)["relume.integrator"] == NAME


def test_a_workers_pass_is_that_of_the_render(monkeypatch):
    """Bit for bit, by the radius of its index: that of the first is another one."""
    found = translated()
    options = RenderOptions(integrator=NAME, variant="llvm_ad_rgb")
    render = fingerprint.of_render(found, options, 4)
    scene, contents = serialization.pack(found.scene)
    job = worker.Job.of(found, scene, render, options)
    worker.load(job, contents, 2)
    by_worker = worker.render(job.key, 2, 4).pass_
    with open_session(found, options, 4) as session:
        expected = session.render_pass(2, 4)
        monkeypatch.setattr(Session, "_tell_index", lambda self, index: None)
        session.integrator.pass_index = 0
        wide = session.render_pass(2, 4)
        assert mi.variant() == "llvm_ad_rgb"
    for a, b in zip(by_worker.arrays, expected.arrays, strict=True):
        assert np.array_equal(a, b)
    assert not np.array_equal(wide.sum, expected.sum)
