"""Scene files as they are, and as `relume convert` writes them: whether they render alike.

    python -m studies converted FOLDER --asset-path FOLDER

Each file is converted to XML and to Python source, and both are rendered by `mi.render`. Files that
do not render, or whose meshes and pictures are not at hand, are listed with the reason.
"""

from __future__ import annotations

import re
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

import relume
from relume.convert import python_source, write_xml
from relume.loading import translated
from relume.options import RenderOptions
from relume.session import CannotRender, variant_context
from relume.translator.diagnostics import SceneError
from relume.workbench import statistics
from relume.workbench.estimates import Level

SIZE = (32, 24)
SPP = 64
RUNS = 6
ALLOWED = 2e-3
"""Difference relative to a block's mean that is not due to chance: files hold rounded numbers."""

RATE = 1e-4
"""How often two pictures that are the same are told to differ."""


def add_arguments(parser):
    parser.add_argument("folder", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, action="append", default=[])
    parser.add_argument("--spp", type=int, default=SPP, help="samples of a pixel in each of 6 runs")


def small_copy(scene: Path, folder: Path) -> Path:
    """A copy of a scene file with a small picture, in a folder."""
    size = b"%d %d" % SIZE
    text = re.sub(rb"(?m)^IMAGE\r?\n[^\r\n]*", b"IMAGE\n" + size, scene.read_bytes())
    copy = folder / scene.name
    copy.write_bytes(text)
    return copy


def blocks(picture: Any) -> np.ndarray:
    """Means of a picture's blocks of 8 x 8 pixels."""
    height, width = SIZE[1] // 8, SIZE[0] // 8
    return np.array(picture, float).reshape(height, 8, width, 8, -1).mean(axis=(1, 3))


def pictures(
    scene: Path, asset_path: Sequence[Path], seeds: Sequence[int], spp: int, folder: Path
) -> dict[str, np.ndarray]:
    """The blocks of a scene's pictures by `relume.render`, and by `mi.render` of each conversion.

    By the same integrator.

    Args:
        scene: the scene file.
        asset_path: folders of its meshes and pictures.
        seeds: of the runs.
        spp: samples of a pixel.
        folder: for the files that are written.

    Returns:
        Arrays (run, row, column, channel) by `rendered`, `xml` and `python`.

    Raises:
        SceneError: errors of the file.
        CannotRender: it cannot be rendered here.
    """
    copy = small_copy(scene, folder)
    folders = [scene.parent, *asset_path]
    out = write_xml(copy, folder / "out" / "scene.xml", asset_path=folders)[0]
    source = python_source(copy, asset_path=folders)
    plan = translated(copy, RenderOptions(asset_path=folders)).plan
    # Conversions keep the integrator of the plan, whatever a render chooses.
    own = plan.integrator if plan.integrator not in plan.candidates else None
    rendered = [
        relume.render(copy, spp=spp, seed=seed, asset_path=folders, integrator=own)
        for seed in seeds
    ]
    found = {"rendered": np.array([blocks(picture) for picture in rendered])}
    namespace: dict[str, Any] = {}
    with variant_context(mi.variant()):
        exec(compile(source, "scene.py", "exec"), namespace)
        loaded = {
            "xml": mi.load_file(str(out), optimize=False),
            "python": mi.load_dict(namespace["scene"], optimize=False),
        }
        for name, world in loaded.items():
            runs = [blocks(mi.render(world, spp=spp, seed=seed + 1)) for seed in seeds]
            found[name] = np.array(runs)
    return found


def scores(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Normal scores of the differences of two sets of runs (N, ...), by Welch's t."""
    levels = []
    for runs in (a, b):
        dof = np.full(runs.shape[1:], len(runs) - 1.0)
        levels.append(Level(runs.mean(axis=0), runs.var(axis=0, ddof=1) / len(runs), dof))
    d = statistics.difference(*levels)
    beyond = np.maximum(np.abs(d.mean) - ALLOWED * np.abs(levels[1].mean) - 1e-6, 0)
    return statistics.normal_score(beyond / np.maximum(np.sqrt(d.variance), 1e-12), d.dof)


def run(options):
    """Compare every scene file of the folder, and print ratios of the means and largest scores."""
    for scene in sorted(options.folder.rglob("*.txt")):
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                found = pictures(scene, options.asset_path, range(RUNS), options.spp, Path(folder))
            except (SceneError, CannotRender) as error:
                print(f"{scene.name}: not rendered: {str(error).splitlines()[0]}")
                continue
        words = []
        for name in ("xml", "python"):
            z = scores(found[name], found["rendered"])
            ratio = found[name].mean() / max(found["rendered"].mean(), 1e-30)
            differs = z.max() > statistics.threshold(RATE, z.size)
            words.append(f"{name} {ratio:.4f}, |z| {z.max():.1f}{' DIFFERS' if differs else ''}")
        print(f"{scene.name}: {'; '.join(words)}", flush=True)
