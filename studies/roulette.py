"""Which paths roulette ends, and what that gains: docs/roulette.md.

    python -m studies roulette CORPUS --asset-path FOLDER [--only SCENE ...]

The scenes of the charts and two rooms of docs/metropolis, each by several rules in turn: their
efficiency 1 / (relMSE x CPU-seconds) over that of the first rule, and the geometric means of the
charts' scenes and of all, with 95 % intervals. All are without bias, so the squared error is the
variance between independent runs; relMSE = mean(variance / (R² + 0.01 mean(R)²)), R being a render
of stock `path` with independent numbers of other seeds. In brackets is the mean of all runs over
that of R.
"""

from pathlib import Path

import mitsuba as mi
import numpy as np

from relume.integrators import surfacepath
from relume.integrators.common import DIM
from relume.loading import open_session, translated
from relume.options import RenderOptions
from relume.workbench import measures, renders
from studies import DOCS
from studies.corpus import SCENES

ROOMS = {"door": DOCS / "metropolis" / "door.txt", "caustic": DOCS / "metropolis" / "caustic.txt"}
SIZE = (96, 72)
SPP = {"ibl": 96, "beam": 64}
USUAL_SPP, REFERENCE_SPP = 32, 512
RUNS = 8
REFERENCE, MEASURED, FIRST = range(3)
"""Purposes of seeds."""

METHODS = {
    "βη² from depth 9": ("throughputpath", {"usual": 1 / DIM, "rr_depth": 9}),
    "βη² from depth 3": ("throughputpath", {"usual": 1 / DIM, "rr_depth": 3}),
    "2.5 βη² from depth 2": ("throughputpath", {"usual": 1.0, "rr_depth": 2}),
    "surfacepath": ("surfacepath", {}),
    "bdpt, from depth 9": ("bdpt", {"rr_depth": 9}),
    "bdpt": ("bdpt", {}),
}
"""Plugin and parameters."""

BASES = {"bdpt": "bdpt, from depth 9"}
"""Rules that are held against another one than the first."""


def add_arguments(parser):
    parser.add_argument("corpus", type=Path, nargs="?", help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, action="append", default=[])
    parser.add_argument("--only", nargs="*", help="scenes; default: all")


def register():
    """Register `throughputpath`: `surfacepath` with a usual throughput that is given."""
    SurfacePath = surfacepath.define()

    class ThroughputPath(SurfacePath):
        def __init__(self, props):
            super().__init__(props)
            self.usual = props["usual"]

        def started(self, scene, ray, active):
            path = super().started(scene, ray, active)
            path.usual = mi.Float(self.usual)
            return path

    mi.register_integrator("throughputpath", ThroughputPath)


def rendered(session, integrator, spp, *place, sampler="owen"):
    seed = renders.own_seed(0, *place)
    return renders.render(session.scene, integrator, spp, seed, sampler)


def measured(session, spp):
    """By method: relMSE of each run, median CPU-seconds of one, and mean over the reference's."""
    path = mi.load_dict({"type": "path", "max_depth": -1})
    R = rendered(session, path, REFERENCE_SPP, REFERENCE, sampler="independent").picture
    w = measures.weight(R.astype(float))
    methods = {
        name: mi.load_dict({"type": kind} | given) for name, (kind, given) in METHODS.items()
    }
    found = {name: [] for name in methods}
    for integrator in methods.values():
        rendered(session, integrator, spp, FIRST)
    for run in range(RUNS):
        for k, (name, integrator) in enumerate(methods.items()):
            found[name].append(rendered(session, integrator, spp, MEASURED, k, run))
    result = {}
    for name, made in found.items():
        pictures = np.array([each.picture for each in made], float)
        error = (pictures - pictures.mean(axis=0)) ** 2 * w * RUNS / (RUNS - 1)
        seconds = float(np.median([each.cpu for each in made]))
        result[name] = error.mean(axis=(1, 2, 3)), seconds, pictures.mean() / R.mean()
    return result


def gains(result):
    """By method: logarithm of the efficiency over that of its base, and its standard error."""
    found = {}
    for name, (error, seconds, _) in result.items():
        base, base_seconds, _ = result[BASES.get(name, next(iter(METHODS)))]
        relative = [x.std(ddof=1) / np.sqrt(len(x)) / x.mean() for x in (error, base)]
        value = np.log(base.mean() * base_seconds / (error.mean() * seconds))
        found[name] = float(value), float(np.hypot(*relative)) if error is not base else 0.0
    return found


def mean(found):
    """The mean of independent values, and its standard error."""
    values, errors = np.transpose(found)
    return float(values.mean()), float(np.sqrt(np.sum(errors**2)) / len(errors))


def row(title, found, means=None):
    """A line of the table."""
    cells = [title]
    for name, (value, error) in found.items():
        gain = np.exp(value)
        within = f" ± {gain * 1.96 * error:.2f}" if error else ""
        cells.append(f"{gain:.2f}{within}" + (f" ({means[name]:.3f})" if means else ""))
    return f"| {' | '.join(cells)} |"


def run(given):
    files = {name: given.corpus / f"{file}.txt" for name, file in SCENES.items() if given.corpus}
    print(f"| scene | {' | '.join(METHODS)} |\n|{'---|' * (len(METHODS) + 1)}", flush=True)
    every = {}
    for name, path in (files | ROOMS).items():
        if given.only and name not in given.only:
            continue
        options = RenderOptions(size=SIZE, asset_path=given.asset_path, stand_ins=True)
        with open_session(translated(path, options), options) as session:
            register()
            result = measured(session, SPP.get(name, USUAL_SPP))
        every[name] = gains(result)
        print(row(name, every[name], {n: found[2] for n, found in result.items()}), flush=True)
    for title, scenes in {"geometric mean of the charts": SCENES, "of all": every}.items():
        of = [every[name] for name in scenes if name in every]
        if of:
            print(row(title, {method: mean([found[method] for found in of]) for method in METHODS}))
