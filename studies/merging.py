"""What merging vertices gains in bidirectional path tracing: docs/bdpt/merging.md.

    python -m studies merging [CORPUS] [--only NAME ...]

The corpus has the scene files; without it the rooms of docs/bdpt and docs/metropolis are measured.
Runs of the methods take turns, times are CPU-seconds of the process. relMSE is the mean over pixels
and channels of the variance between independent runs over R² + 0.01 mean(R)². Merging is biased.
Where the lamp is wide, R is a long render of `surfacepath`, in two halves: the mean product of what
is above each of them is the square of the bias. Lamps as small as those of the files leave nothing
to compare with but paths that merge in a smaller radius.
"""

import dataclasses
import json
import tempfile
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

import relume
from relume import translator
from relume.loading import load_scene
from studies import DOCS

FOLDER = DOCS / "bdpt"
SIZE, RUNS = (80, 60), 8
SPP = {"path": 64, "bdpt": 32}
DEPTH = {"max_depth": 9, "rr_depth": 5}
TAIL = 0.005
"""Share of the pixels that are looked at for the largest errors."""

RADII = (0.25, 0.5, 1.0, 2.0)
"""Merge radii [pixel]."""

MERGING = {
    "pool, wide lamp": ("pool.txt", 4),
    "pool": ("pool.txt", 1),
    "mirror, wide lamp": ("mirror.txt", 4),
    "mirror": ("mirror.txt", 1),
    "caustic": ("../metropolis/caustic.txt", 1),
    "glass": ("CornellBox_ガラス1.txt", None),
    "diffuse box": ("CornellBox_拡散反射.txt", None),
}
"""Files, in the folder of the page or of the corpus, and radii of their lamps."""

WIDE_SPP, LONG_SPP, LONG_LAUNCH = 8192, 1024, 256
SMALL_LAMP = "sphere 50 75 60 1\ncolor 0 0 0\nemission 2000 2000 2000"


def widened(text, radius):
    """A scene file whose lamp has another radius, and the same power."""
    lamp = SMALL_LAMP.replace("60 1", f"60 {radius}").replace("2000", f"{2000 / radius**2:g}")
    return text.replace(SMALL_LAMP, lamp)


def loaded(path, radius=None):
    """The scene of a file in the size of the study, without participating media."""
    document = relume.read(path)
    if radius:
        with tempfile.TemporaryDirectory() as folder:
            changed = Path(folder) / path.name
            changed.write_text(widened(path.read_text(encoding="utf-8"), radius), encoding="utf-8")
            document = relume.read(changed)
    translation = translator.translate(document)
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


def rendered(scene, name, spp, seed, **parameters):
    """A picture: (height, width, 3)."""
    integrator = mi.load_dict({"type": name} | DEPTH | parameters)
    return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), float)[..., :3]


def long_render(scene, name, spp, seed, **parameters):
    """The mean of launches with seeds from `seed` on."""
    n = spp // LONG_LAUNCH
    pictures = (rendered(scene, name, LONG_LAUNCH, seed + k, **parameters) for k in range(n))
    return sum(pictures) / n


def measured(title, scene):
    """The figures of all radii in a scene, and of both methods without merging."""
    methods = {"path": ("path", {}), "bdpt": ("bdpt", {})}
    methods |= {str(r): ("bdpt", {"merge_radius": r}) for r in RADII}
    by, spp, parameters = "bdpt", LONG_SPP, {"merge_radius": 0.1}
    if title.endswith("wide lamp"):
        by, spp, parameters = "surfacepath", WIDE_SPP, {}
    halves = [long_render(scene, by, spp, seed, **parameters) for seed in (500000, 900000)]
    R = np.mean(halves, axis=0)
    weight = 1 / (R**2 + 0.01 * R.mean() ** 2)
    rows = {}
    for name, (kind, parameters) in methods.items():
        pictures, seconds = [], []
        rendered(scene, kind, SPP[kind], 10**6, **parameters)
        for run in range(RUNS):
            start = time.process_time()
            pictures.append(rendered(scene, kind, SPP[kind], 1000 * run, **parameters))
            seconds.append(time.process_time() - start)
        error = (np.var(pictures, axis=0, ddof=1) * weight).mean(-1).ravel()
        above = [np.mean(pictures[i::2], axis=0) - half for i, half in enumerate(halves)]
        bias2, cpu = float((above[0] * above[1] * weight).mean()), float(np.median(seconds))
        largest = np.sort(error)[::-1]
        rest = largest[max(1, round(TAIL * error.size)) :]
        rows[name] = {
            "cpu": cpu,
            "relMSE": float(error.mean()),
            "bias2": bias2,
            "efficiency": float(1 / (cpu * error.mean())),
            "bulk": float(1 / (cpu * rest.mean())),
            "median": float(1 / (cpu * np.median(error[error > 0]))),
            "energy": float(np.mean(pictures) / R.mean()),
        }
    return rows


def table(results):
    """The figures of merging as text: efficiencies over `path`."""
    lines = [
        "| scene | radius | CPU-s | relMSE | squared bias | energy | efficiency over `path` "
        "| without 0.5 % of the pixels | of the median pixel |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for title, rows in results.items():
        a = rows["path"]
        for name, b in rows.items():
            told = {"path": "`path`", "bdpt": "0"}.get(name, name)
            gains = " | ".join(f"{b[k] / a[k]:.2g}" for k in ("efficiency", "bulk", "median"))
            each = f"{b['cpu']:.2f} | {b['relMSE']:.3g} | {b['bias2']:.1g} | {b['energy']:.3f}"
            lines.append(f"| {title} | {told} | {each} | {gains} |")
    return "\n".join(lines) + "\n"


def add_arguments(parser):
    parser.add_argument("corpus", nargs="?", type=Path, help="folder of scene files")
    parser.add_argument("--only", nargs="*", help="titles of scenes; default: all")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    store = FOLDER / "merging.json"
    known = json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}
    for title, (file, radius) in MERGING.items():
        folder = FOLDER if radius else options.corpus
        if folder is None or (options.only and title not in options.only):
            continue
        known[title] = measured(title, loaded(folder / file, radius))
        print(table({title: known[title]}), flush=True)
        ordered = {t: known[t] for t in MERGING if t in known}
        store.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
        (FOLDER / "merging.md").write_text(table(ordered), encoding="utf-8")
