"""Bidirectional path tracing against path tracing at equal CPU time: docs/bdpt.

    python -m studies bdpt [CORPUS] [--only NAME ...]

The corpus has the scene files; without it two rooms of docs/metropolis are measured. Runs of the
methods take turns, times are CPU-seconds of the process. Both are free of bias in the light that
they find, so their squared error is the variance between independent runs; relMSE = mean(variance /
(R² + 0.01 mean(R)²)). R is a long render of `path` with seeds of its own; where lamps have no size
`path` lacks light, and R is a long render of light tracing and connections with other seeds. What a
method lacks of R is the column *energy*.
"""

import dataclasses
import json
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

import relume
from relume import translator
from relume.loading import load_scene
from studies import DOCS

FOLDER = DOCS / "bdpt"
ROOMS = {
    "caustic": DOCS / "metropolis" / "caustic.txt",
    "door ajar": DOCS / "metropolis" / "door.txt",
}
FILES = {
    "occluded room": "CornellBoxMLT_遮蔽あり.txt",
    "direct light": "CornellBox_直接光源テスト_yama.txt",
    "beam": "CornellBox平行光源_関与媒質あり.txt",
    "spot": "CornellBox_spot光源.txt",
    "diffuse box": "CornellBox_拡散反射.txt",
    "glass": "CornellBox_ガラス1.txt",
    "Ward": "CornellBox_金属1.txt",
}
WITHOUT_SIZE = ("beam", "spot")
"""Scenes whose lamps have none."""

SIZE, RUNS = (80, 60), 8
SPP = {"path": 64, "bdpt": 32}
REFERENCE_SPP, LAUNCH_SPP = 2000, 200
DEPTH = {"max_depth": 9, "rr_depth": 5}
TAIL = 0.005
"""Share of the pixels that are looked at for the largest errors."""


def loaded(path):
    """The scene of a file in the size of the study, without participating media."""
    translation = translator.translate(relume.read(path))
    scene = without_media(translation.scene)
    scene["sensor"]["film"] |= {"width": SIZE[0], "height": SIZE[1]}
    scene["integrator"] = {"type": "path"}
    return load_scene(dataclasses.replace(translation, scene=scene))


def without_media(entry):
    """A dictionary without media inside and around its shapes and camera."""
    if not isinstance(entry, dict):
        return entry
    media = ("interior", "exterior", "medium")
    return {key: without_media(value) for key, value in entry.items() if key not in media}


def rendered(scene, name, spp, seed):
    """A picture: (height, width, 3)."""
    integrator = mi.load_dict({"type": name} | DEPTH)
    return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), float)[..., :3]


def measured(title, scene):
    """The figures of both methods in a scene, as JSON values."""
    by = "bdpt" if title in WITHOUT_SIZE else "path"
    passes = range(REFERENCE_SPP // LAUNCH_SPP)
    R = np.mean([rendered(scene, by, LAUNCH_SPP, 900000 + k) for k in passes], axis=0)
    pictures, seconds = {name: [] for name in SPP}, {name: [] for name in SPP}
    for name, spp in SPP.items():
        rendered(scene, name, spp, 10**6)
    for run in range(RUNS):
        for name, spp in SPP.items():
            start = time.process_time()
            pictures[name].append(rendered(scene, name, spp, 1000 * run))
            seconds[name].append(time.process_time() - start)
    rows = {}
    for name, found in pictures.items():
        weight = 1 / (R**2 + 0.01 * R.mean() ** 2)
        error = (np.var(found, axis=0, ddof=1) * weight).mean(-1).ravel()
        cpu, largest = float(np.median(seconds[name])), np.sort(error)[::-1]
        rows[name] = {
            "cpu": cpu,
            "relMSE": float(error.mean()),
            "efficiency": float(1 / (cpu * error.mean())),
            "median": float(1 / (cpu * np.median(error[error > 0]))),
            "tail": float(largest[: max(1, round(TAIL * error.size))].sum() / error.sum()),
            "energy": float(np.mean(found) / R.mean()),
        }
    return rows


def table(results):
    """The figures as text."""
    lines = [
        "| scene | `path`: CPU-s, relMSE, energy | `bdpt`: CPU-s, relMSE, energy "
        "| efficiency over `path` | of the median pixel | error in 0.5 % of the pixels |",
        "|---|---|---|---|---|---|",
    ]
    for title, rows in results.items():
        a, b = rows["path"], rows["bdpt"]
        each = " | ".join(f"{x['cpu']:.2f}, {x['relMSE']:.3g}, {x['energy']:.3f}" for x in (a, b))
        gain, median = (b[key] / a[key] for key in ("efficiency", "median"))
        tails = f"{a['tail']:.0%}, {b['tail']:.0%}"
        lines.append(f"| {title} | {each} | {gain:.2g} | {median:.2g} | {tails} |")
    return "\n".join(lines) + "\n"


def add_arguments(parser):
    parser.add_argument("corpus", nargs="?", help="folder of scene files")
    parser.add_argument("--only", nargs="*", help="titles of scenes; default: all")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    files = ROOMS | {t: Path(options.corpus) / f for t, f in FILES.items() if options.corpus}
    FOLDER.mkdir(exist_ok=True)
    store = FOLDER / "figures.json"
    known = json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}
    for title, path in files.items():
        if path.is_file() and (not options.only or title in options.only):
            known[title] = measured(title, loaded(path))
            print(table({title: known[title]}).splitlines()[-1], flush=True)
            ordered = {t: known[t] for t in (*ROOMS, *FILES) if t in known}
            store.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
            (FOLDER / "figures.md").write_text(table(ordered), encoding="utf-8")
