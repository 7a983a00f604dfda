"""How much noise each method leaves after equal time, and what the plan chooses: docs/efficiency.

    python -m studies efficiency [CORPUS] [--asset-path FOLDER] [--scenes NAME ...] [--seconds T]

The corpus has the scene files; without it the two rooms of docs/metropolis are measured. Figures
are kept scene by scene: what is measured again replaces what was there. Runs of the methods take
turns, each of about T CPU-seconds. All methods are free of bias in the light that they find, so
their squared error is the variance between independent runs; relMSE = mean(variance / (R² + 0.01
mean(R)²)). R is the mean of long renders by `path` and by `bdpt` with seeds of their own; where
lamps have no size `path` lacks light, and R is that of `bdpt` alone. The mean of a method over that
of R is its *energy*.
"""

import dataclasses
import json
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

import relume
from relume import pilot
from relume.loading import load_integrator, load_scene, translated
from relume.options import RenderOptions
from relume.session import Session
from studies import DOCS, efficiency_page

FOLDER = DOCS / "efficiency"
ROOMS = {
    "door ajar": DOCS / "metropolis" / "door.txt",
    "caustic": DOCS / "metropolis" / "caustic.txt",
}
CORPUS = {
    "Cornell box": "CornellBox",
    "Ward": "CornellBox_金属1",
    "Phong": "CornellBox_Phong1",
    "glass": "CornellBox_ガラス1",
    "spot": "CornellBox_spot光源",
    "courtyard": "san-miguel4",
    "image-based light": "texture_test5",
    "area light": "CornellBox面光源",
    "occluded room": "CornellBoxMLT_遮蔽あり",
    "direct light": "CornellBox_直接光源テスト_yama",
    "beam": "CornellBox平行光源_関与媒質あり",
}
METHODS = {
    "path": ("path", None),
    "surfacepath": ("surfacepath", "owen"),
    "bdpt": ("bdpt", "owen"),
    "pssmlt": ("pssmlt", "owen"),
    "erpt": ("erpt", "owen"),
    "pssmlt-bdpt": ("pssmlt", "owen"),
    "erpt-bdpt": ("erpt", "owen"),
}
"""Integrator and sampler of each method; None for Mitsuba's own render. Another one is a row.
Chains whose names end in `-bdpt` take their paths from it."""

SIZE, RUNS, CHOICES = (80, 60), 8, 10
SECONDS = 1.0
REFERENCE = 12.0
"""Time of each long render, over that of a run."""

TAIL = 0.005
"""Share of the pixels that are looked at for the largest errors."""


def document_of(path):
    """A scene file as path tracers see it: without Metropolis transport and fog."""
    document = relume.read(path, {})
    plain = {"metropolis": False, "erpt": False, "participating_media": False}
    return dataclasses.replace(document, **plain)


def render(scene, planned, method, spp, seed):
    """A picture by a method: (height, width, 3) float64."""
    kind, sampler = METHODS[method]
    paths = planned | {"type": "bdpt"} if method.endswith("-bdpt") else planned
    integrator = load_integrator(kind, paths)
    if sampler is None:
        return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), float)[..., :3]
    session = Session(scene, spp, seed, integrator, sampler=sampler)
    for _ in session.run():
        pass
    return session.image().astype(float)


def timed(*arguments):
    """A picture as `render`, and its CPU-seconds."""
    start = time.process_time()
    picture = render(*arguments)
    return picture, time.process_time() - start


def samples_in(scene, planned, method, seconds):
    """Samples of a pixel that take about so long; kernels are compiled by then."""
    spp = 8
    render(scene, planned, method, spp, 10**6)
    while (took := timed(scene, planned, method, spp, 10**6 + spp)[1]) < 0.2 * seconds:
        spp *= 2
    return max(1, round(spp * seconds / took))


def reference_of(scene, planned, candidates, spp):
    """R (see above): (height, width, 3)."""
    names = ["bdpt"] if candidates == ("bdpt",) else ["path", "bdpt"]
    count = round(REFERENCE)
    found = [
        np.mean([render(scene, planned, name, spp[name], 900000 + k) for k in range(count)], axis=0)
        for name in names
    ]
    return np.mean(found, axis=0)


def measured(translation, seconds):
    """The figures of all methods in a scene, and what its plan chooses, as JSON values."""
    scene, planned = load_scene(translation), translation.scene["integrator"]
    spp = {name: samples_in(scene, planned, name, seconds) for name in METHODS}
    pictures, times = {name: [] for name in METHODS}, {name: [] for name in METHODS}
    for run in range(RUNS):
        for name in METHODS:
            picture, took = timed(scene, planned, name, spp[name], 1000 * (run + 1))
            pictures[name].append(picture)
            times[name].append(took)
    R = reference_of(scene, planned, translation.plan.candidates, spp)
    weight = 1 / (R**2 + 0.01 * R.mean() ** 2)
    rows = {}
    for name in METHODS:
        found, cpu = np.array(pictures[name]), float(np.median(times[name]))
        error = (found.var(0, ddof=1) * weight).mean(-1).ravel()
        largest = np.sort(error)[::-1]
        rows[name] = {
            "spp": spp[name],
            "cpu": cpu,
            "relMSE": float(error.mean()),
            "efficiency": float(1 / (cpu * error.mean())),
            "median": float(1 / (cpu * np.median(error[error > 0]))),
            "tail": float(largest[: max(1, round(TAIL * error.size))].sum() / error.sum()),
            "energy": float(found.mean() / R.mean()),
            "interval": interval(found, pictures["path"], weight, cpu, times["path"]),
        }
    return {"methods": rows, "choice": choices(scene, translation)}


def interval(found, path, weight, cpu, times):
    """95 % of the efficiency over that of `path`, by resampling the runs of both."""
    rng = np.random.default_rng(1)
    ratios = []
    squares = [np.array(x) * np.sqrt(weight) for x in (path, found)]
    for _ in range(400):
        each = [x[rng.integers(0, RUNS, RUNS)].var(0).mean() for x in squares]
        ratios.append(each[0] * np.median(times) / (each[1] * cpu))
    return [float(x) for x in np.percentile(ratios, [2.5, 97.5])]


def choices(scene, translation):
    """What is chosen for each of the seeds, by how much, and what a pilot costs."""
    names = translation.plan.candidates
    if len(names) == 1:
        return {"chosen": [names[0]] * CHOICES, "reason": translation.plan.reasons["candidates"]}
    chosen, gains, seconds = [], [], []
    for seed in range(CHOICES):
        start = time.process_time()
        times = pilot.measured(scene, translation, RenderOptions(seed=seed))
        seconds.append(time.process_time() - start)
        chosen.append(pilot.decided(times, names)[0])
        gains.append(times["surfacepath"] / times["bdpt"])
    return {"chosen": chosen, "gains": gains, "seconds": float(np.median(seconds))}


def add_arguments(parser):
    parser.add_argument("corpus", nargs="?", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, help="folder of their meshes and pictures")
    parser.add_argument("--scenes", nargs="*", help="titles of scenes; default: all")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="CPU-seconds of a run")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    corpus = options.corpus and options.corpus.resolve()
    folders = (options.asset_path.resolve(),) if options.asset_path else ()
    files = {t: corpus / f"{name}.txt" for t, name in CORPUS.items()} if corpus else {}
    files |= ROOMS
    FOLDER.mkdir(exist_ok=True)
    store = FOLDER / "figures.json"
    known = json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}
    for title, path in files.items():
        if options.scenes and title not in options.scenes:
            continue
        document = document_of(path)
        settings = RenderOptions(size=SIZE, asset_path=folders, stand_ins=True)
        known[title] = measured(translated(document, settings), options.seconds)
        ordered = {t: known[t] for t in (*CORPUS, *ROOMS) if t in known}
        store.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
        (FOLDER / "figures.md").write_text(efficiency_page.text(ordered), encoding="utf-8")
        print(efficiency_page.overview({title: known[title]}).splitlines()[-1], flush=True)
