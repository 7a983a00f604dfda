"""RenderOptions: values are checked once, and what is wrong is said in words."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from relume.options import RenderOptions
from relume.translator.document import MAX_SAMPLES, MAX_SIDE


@pytest.mark.parametrize(
    "options, error, said",
    [
        ({"size": (0, 4)}, ValueError, "size 0x4: expected sides of 1 to"),
        ({"size": (16385, 1)}, ValueError, "size 16385x1"),
        ({"size": (16384, 16384)}, ValueError, "size 16384x16384.*at most 67108864 pixels"),
        ({"size": "640x480"}, TypeError, r"expected \(width, height\)"),
        ({"size": 640}, TypeError, r"expected \(width, height\)"),
        ({"size": (640, 480.5)}, TypeError, r"size 480\.5: expected a whole number"),
        ({"spp": 0}, ValueError, "spp 0: expected 1 to 1099511627776"),
        ({"spp": MAX_SAMPLES + 1}, ValueError, "spp 1099511627777"),
        ({"spp": 2.5}, TypeError, r"spp 2\.5: expected a whole number"),
        ({"seed": -1}, ValueError, "seed -1: expected 0 or more"),
        ({"seed": None}, TypeError, "seed None: expected a whole number"),
        ({"integrator": print}, TypeError, "integrator: expected a plugin id"),
        ({"variant": 3}, TypeError, "variant: expected a Mitsuba variant"),
        ({"sampler": "sobol"}, ValueError, "unknown sampler 'sobol', expected one of owen, indep"),
        ({"dialect": "latin"}, ValueError, "unknown dialect 'latin', expected one of manual"),
        ({"asset_path": 3}, TypeError, "asset_path: expected folders, found int"),
        ({"asset_path": ["a", None]}, TypeError, "asset_path: expected folders, found NoneType"),
        ({"bright": 3}, TypeError, "unknown option 'bright'; options are size, spp, seed"),
        ({"asset_paths": "a"}, TypeError, "'asset_paths'; did you mean 'asset_path'?"),
    ],
)
def test_wrong_values(options, error, said):
    with pytest.raises(error, match=said):
        RenderOptions.of(**options)


def test_ends_of_the_ranges():
    RenderOptions(size=(MAX_SIDE, 4096), spp=MAX_SAMPLES, seed=2**200)
    RenderOptions(size=(1, 1), spp=1, seed=0)


def test_numpy_lists_and_single_folders_are_taken():
    options = RenderOptions(size=np.array([4, 5]), spp=np.int64(3), asset_path=Path("a"))
    assert options == RenderOptions(size=[4, 5], spp=3, asset_path=[Path("a")])
    assert (options.size, options.asset_path) == ((4, 5), (Path("a"),))
    assert RenderOptions(asset_path="folder").asset_path == ("folder",)
    assert len({options, dataclasses.replace(options)}) == 1


def test_changes_leave_the_rest_and_the_original():
    options = RenderOptions(spp=5, seed=2)
    assert RenderOptions.of(options, seed=3) == RenderOptions(spp=5, seed=3)
    assert options.seed == 2 and RenderOptions.of(options) == options
    for wrong in (64, {"spp": 3}):
        with pytest.raises(TypeError, match="options: expected RenderOptions"):
            RenderOptions.of(wrong)
