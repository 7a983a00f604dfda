"""Random numbers, spread evenly or not: relMSE at equal samples, docs/samplers.md.

    python -m studies samplers [CORPUS --asset-path FOLDER] [--only SCENE]

Each row has the relMSE of independent numbers, and how many times lower are those of the stock
sampler `multijitter` and of relume's own renders by `owen`. With CORPUS four of its scenes are
measured against references of many independent samples and other seeds, whose own noise is
subtracted. Of the example scenes the squared error is the variance between runs, for all samplers
are unbiased; it is divided by the squared mean of the runs of all of them. Below is the processor
time of a render, `owen` over independent numbers in turn.
"""

import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.loading import open_session, translated
from relume.options import RenderOptions
from relume.sensors.pixelsamples import sample_pixels
from relume.session import Session
from relume.workbench import measures, renders
from studies import SCENES

CORPUS = {
    "diffuse room": "CornellBox_拡散反射",
    "Ward's reflection": "CornellBox_金属1",
    "glass room": "CornellBox_ガラス1",
    "image-based light": "texture_test5",
}
SIZES = {"corpus": (32, 24), "examples": (16, 12)}
SPP = {"corpus": (16, 64, 256), "examples": (16, 256)}
RUNS = {"corpus": 8, "examples": 8}
REFERENCE_SPP = 8192
TIMED = 5
REFERENCE, MEASURED, TIME = range(3)
"""Purposes of seeds."""


def add_arguments(parser):
    parser.add_argument("corpus", type=Path, nargs="?", help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, action="append", default=[])
    parser.add_argument("--only", help="one scene")


def multijittered(session, spp, seed):
    """The picture by `multijitter`, whose samples of a pixel are one pattern."""
    width, height = session.width, session.height
    sampler = mi.load_dict({"type": "multijitter", "sample_count": spp})
    sampler.set_samples_per_wavefront(spp)
    sampler.seed(seed % 2**32, width * height * spp)
    pixel = dr.arange(mi.UInt32, width * height * spp) // dr.opaque(mi.UInt32, spp)
    y = pixel // dr.opaque(mi.UInt32, width)
    corner = mi.Point2f(pixel - y * dr.opaque(mi.UInt32, width), y)
    size = mi.Vector2f(dr.opaque(mi.Float, width), dr.opaque(mi.Float, height))
    color = sample_pixels(
        session.scene, session.sensor, session.integrator, sampler, corner, sampler.next_2d(), size
    )
    dr.eval(color)
    sums = [dr.block_sum(channel, spp).numpy() for channel in color]
    return np.stack(sums, axis=-1).reshape(height, width, 3) / spp


def picture(session, sampler, spp, seed):
    if sampler == "multijitter":
        return multijittered(session, spp, seed)
    return renders.render(session.scene, session.integrator, spp, seed, sampler).picture


def pictures(session, spp, runs):
    """By sampler: (runs, height, width, 3)."""
    return {
        sampler: np.array(
            [
                picture(session, sampler, spp, renders.own_seed(0, MEASURED, i, spp, run))
                for run in range(runs)
            ],
            float,
        )
        for i, sampler in enumerate(("independent", "multijitter", "owen"))
    }


def against_reference(session, spps, runs):
    """By number of samples: by sampler, the squared error of each run over the reference's."""
    seed = renders.own_seed(0, REFERENCE)
    reference = Session(session.scene, REFERENCE_SPP, seed, sampler="independent")
    for _ in reference.run():
        pass
    R, V = reference.image().astype(float), reference.accumulator.variance()
    w = measures.weight(R)
    return {
        spp: {
            sampler: ((made - R) ** 2 * w - V * w).mean(axis=(1, 2, 3))
            for sampler, made in pictures(session, spp, runs).items()
        }
        for spp in spps
    }


def between_runs(session, spps, runs):
    """As `against_reference`, without one: squared deviations from the mean of the runs."""
    found = {}
    for spp in spps:
        made = pictures(session, spp, runs)
        w = measures.weight(np.mean([each.mean(axis=0) for each in made.values()], axis=0))
        found[spp] = {
            sampler: ((each - each.mean(axis=0)) ** 2 * w).mean(axis=(1, 2, 3)) * runs / (runs - 1)
            for sampler, each in made.items()
        }
    return found


def ratio(above, below):
    """Ratio of two means in words, with its standard error."""
    value = above.mean() / below.mean()
    relative = [x.std(ddof=1) / np.sqrt(len(x)) / x.mean() for x in (above, below)]
    return f"{value:.2g} ± {value * np.hypot(*relative):.1g}"


def cost(session, spp):
    """Processor time of a render by `owen` over that by independent numbers; median of ratios."""
    ratios = []
    for run in range(-1, TIMED):
        seconds = []
        for sampler in ("independent", "owen"):
            start = time.process_time()
            picture(session, sampler, spp, renders.own_seed(0, TIME, run + 1))
            seconds.append(time.process_time() - start)
        ratios.append(seconds[1] / seconds[0])
    return float(np.median(ratios[1:]))


def rows(path, name, kind, options):
    """The rows of a scene, and its cost if it is one of the corpus."""
    errors = against_reference if kind == "corpus" else between_runs
    with open_session(translated(path, options), options) as session:
        for spp, found in errors(session, SPP[kind], RUNS[kind]).items():
            independent = found["independent"]
            if not independent.mean() > 0:
                continue
            gains = [ratio(independent, found[s]) for s in ("multijitter", "owen")]
            print("|", " | ".join([name, str(spp), f"{independent.mean():.2g}", *gains]), "|")
        if kind == "corpus":
            print(f"cost of {name}: {cost(session, 256):.3f}", flush=True)


def run(given):
    print("| scene | samples | relMSE, independent | multijitter | owen |\n|---|---|---|---|---|")
    if given.corpus:
        for name, file in CORPUS.items():
            options = RenderOptions(size=SIZES["corpus"], asset_path=given.asset_path)
            if given.only in (None, name):
                rows(given.corpus / f"{file}.txt", name, "corpus", options)
    for path in sorted(SCENES.glob("*.txt")):
        if given.only in (None, path.stem):
            rows(path, path.stem, "examples", RenderOptions(size=SIZES["examples"]))
