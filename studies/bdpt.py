"""Bidirectional path tracing against path tracing at equal CPU time: docs/bdpt.

    python -m studies bdpt [CORPUS] [--only NAME ...]
    python -m studies bdpt --merging [CORPUS] [--only NAME ...]

The corpus has the scene files; without it two rooms of docs/metropolis are measured. Runs of the
methods take turns, times are CPU-seconds of the process. Both are free of bias in the light that
they find, so their squared error is the variance between independent runs; relMSE = mean(variance /
(R² + 0.01 mean(R)²)). R is a long render of `path` with seeds of its own; where lamps have no size
`path` lacks light, and R is a long render of light tracing and connections with other seeds. What a
method lacks of R is the column *energy*.

With `--merging` paths that merge vertices are compared, which are biased. Where the lamp is wide, R
is a long render of `surfacepath`, in two halves: the mean product of what is above each of them is
the square of the bias. Lamps as small as those of the files leave nothing to compare with but paths
that merge in a smaller radius.
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


RADII = (0.25, 0.5, 1.0, 2.0)
"""Merge radii [pixel]."""

MERGING = {
    "pool, wide lamp": ("pool.txt", 4),
    "pool": ("pool.txt", 1),
    "mirror, wide lamp": ("mirror.txt", 4),
    "mirror": ("mirror.txt", 1),
    "caustic": ("../metropolis/caustic.txt", 1),
    "glass": (FILES["glass"], None),
    "diffuse box": (FILES["diffuse box"], None),
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


def long_render(scene, name, spp, seed, **parameters):
    """The mean of launches with seeds from `seed` on."""
    n = spp // LONG_LAUNCH
    pictures = (rendered(scene, name, LONG_LAUNCH, seed + k, **parameters) for k in range(n))
    return sum(pictures) / n


def measured_merging(title, scene):
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


def table_of_merging(results):
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
    parser.add_argument("--merging", action="store_true", help="compare radii of merging")
    parser.add_argument("--only", nargs="*", help="titles of scenes; default: all")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    corpus = Path(options.corpus or "")
    if options.merging:
        places = {t: (FOLDER if r else corpus, f, r) for t, (f, r) in MERGING.items()}
        files = {t: (folder / f, r) for t, (folder, f, r) in places.items() if r or options.corpus}
        stem, measure, write = "merging", measured_merging, table_of_merging
    else:
        own = {t: corpus / f for t, f in FILES.items() if options.corpus}
        files = {t: (path, None) for t, path in (ROOMS | own).items()}
        stem, measure, write = "figures", measured, table
    FOLDER.mkdir(exist_ok=True)
    store = FOLDER / f"{stem}.json"
    known = json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}
    order = MERGING if options.merging else [*ROOMS, *FILES]
    for title, (path, radius) in files.items():
        if path.is_file() and (not options.only or title in options.only):
            known[title] = measure(title, loaded(path, radius))
            print(write({title: known[title]}), flush=True)
            ordered = {t: known[t] for t in order if t in known}
            store.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
            (FOLDER / f"{stem}.md").write_text(write(ordered), encoding="utf-8")
