"""Metropolis light transport against path tracing at equal time: docs/metropolis.

    python -m studies metropolis [CORPUS]

The corpus has the occluded room; without it that room is left out. Times are CPU-seconds, runs of
the methods take turns. All methods are unbiased, so their squared error is the variance between
independent runs; relMSE = mean(variance / (R² + 0.01 mean(R)²)). R is a long render of `path` with
seeds of its own: one from the runs of a method would be bright where they have bright spots, and
hide them.
"""

import json
import time
from pathlib import Path

import matplotlib
import mitsuba as mi
import numpy as np

import relume
from relume import translator
from studies import DOCS

matplotlib.use("svg")
import matplotlib.pyplot as plt

FOLDER = DOCS / "metropolis"
OCCLUDED = "CornellBoxMLT_遮蔽あり.txt"
FILES = {"caustic": "caustic.txt", "door ajar": "door.txt"}
SIZE = (160, 120)
RUNS, PASSES, SPP = 8, 3, 50
REFERENCE_SPP, LAUNCH_SPP = {"occluded room": 12000, "Cornell box": 1000}, 200
USUAL_SPP = 4000
DEPTH = {"max_depth": 9, "rr_depth": 5}
PATHS, TWO_SIDED = {"type": "surfacepath"} | DEPTH, {"type": "bdpt"} | DEPTH
METHODS = {
    "path": {"type": "path"} | DEPTH,
    "pssmlt": {"type": "pssmlt", "paths": PATHS},
    "pssmlt, direct apart": {"type": "pssmlt", "direct_samples": 0.2, "paths": PATHS},
    "erpt": {"type": "erpt", "paths": PATHS},
    "bdpt": TWO_SIDED,
    "pssmlt over bdpt": {"type": "pssmlt", "paths": TWO_SIDED},
    "the same, without fallback": {"type": "pssmlt", "fallback": False, "paths": TWO_SIDED},
    "the same, direct apart": {
        "type": "pssmlt", "fallback": False, "direct_samples": 0.2, "paths": TWO_SIDED,
    },
    "erpt over bdpt": {"type": "erpt", "paths": TWO_SIDED},
}  # fmt: skip
NEVER_HANDED_OVER = {
    "pssmlt, without fallback": {"type": "pssmlt", "fallback": False, "paths": PATHS}
}
"""For the Cornell box, which is."""


def scenes(corpus, size=SIZE):
    """Mitsuba scenes by title."""
    found = {t: of_file(FOLDER / f, size) for t, f in FILES.items()}
    d = mi.cornell_box()
    side = size[0] * 4 // 5
    d["sensor"]["film"] |= {"width": side, "height": side, "rfilter": {"type": "box"}}
    found["Cornell box"] = mi.load_dict(d)
    if corpus and (Path(corpus) / OCCLUDED).is_file():
        found["occluded room"] = of_file(Path(corpus) / OCCLUDED, size)
    return found


def of_file(path, size):
    document = relume.read(path, {})
    scene = translator.translate(document).dictionary()
    scene["sensor"]["film"] |= {"width": size[0], "height": size[1]}
    return mi.load_dict(scene)


def measured(scene, methods):
    """By method: pictures (runs, passes, height, width, 3), CPU-seconds of a pass, report."""
    integrators = {name: mi.load_dict(entry) for name, entry in methods.items()}
    pictures, seconds = {n: [] for n in methods}, {n: [] for n in methods}
    for integrator in integrators.values():
        np.array(mi.render(scene, integrator=integrator, spp=SPP, seed=10**6))
    for run in range(RUNS):
        for name, integrator in integrators.items():
            start = time.process_time()
            passes = [
                np.array(mi.render(scene, integrator=integrator, spp=SPP, seed=1000 * run + k))
                for k in range(PASSES)
            ]
            seconds[name].append((time.process_time() - start) / PASSES)
            pictures[name].append(passes)
    reports = {n: i.report() for n, i in integrators.items() if hasattr(i, "report")}
    return {n: np.array(p) for n, p in pictures.items()}, seconds, reports


def reference_of(title, scene):
    """A long render of `path`: (height, width, 3)."""
    integrator = mi.load_dict(METHODS["path"])
    count = REFERENCE_SPP.get(title, USUAL_SPP) // LAUNCH_SPP
    return np.mean(
        [
            np.array(mi.render(scene, integrator=integrator, spp=LAUNCH_SPP, seed=900000 + k))
            for k in range(count)
        ],
        axis=0,
    )


def curve(pictures, reference):
    """relMSE after each pass."""
    so_far = np.cumsum(pictures, 1) / np.arange(1, PASSES + 1)[:, None, None, None]
    variance = so_far.var(0, ddof=1)
    epsilon = 0.01 * reference.mean() ** 2
    return (variance / (reference**2 + epsilon)).mean((1, 2, 3))


def bright_pixels(pictures, reference):
    """Pixels above 20 times the reference in one run, on average."""
    Y, R = (x @ [0.2126, 0.7152, 0.0722] for x in (pictures.mean(1), reference))
    return (20 * np.maximum(R, 1e-3 * R.mean()) < Y).sum((1, 2)).mean()


def study(title, scene):
    methods = METHODS | (NEVER_HANDED_OVER if title == "Cornell box" else {})
    pictures, seconds, reports = measured(scene, methods)
    reference = reference_of(title, scene)
    result = {}
    for name, found in pictures.items():
        t = float(np.median(seconds[name]))
        errors = curve(found, reference)
        energies = found.mean((1, 2, 3, 4)) / reference.mean()
        result[name] = {
            "seconds": [t * (k + 1) for k in range(PASSES)],
            "relMSE": [float(e) for e in errors],
            "efficiency": float(1 / (errors[-1] * t)),
            "energy": [float(energies.mean()), float(energies.std(ddof=1) / RUNS**0.5)],
            "bright": float(bright_pixels(found, reference)),
            "report": reports.get(name, []),
        }
    for name in result:
        result[name]["gain"] = result[name]["efficiency"] / result["path"]["efficiency"]
        print(f"{title:14s} {name:22s} gain {result[name]['gain']:.2f}", flush=True)
    name = title.replace(" ", "_")
    panels = [pictures[m][0].mean(0) for m in ("path", "pssmlt", "erpt")]
    level = 0.25 / np.median(reference.mean(-1))
    side_by_side = np.hstack([np.clip(level * p, 0, 1) ** (1 / 2.2) for p in panels])
    bitmap = mi.Bitmap((255 * side_by_side + 0.5).astype(np.uint8))
    bitmap.write(str(FOLDER / f"{name}.png"))
    return result


def chart(results):
    """Error over time, one panel for each scene."""
    figure, axes = plt.subplots(1, len(results), figsize=(3.6 * len(results), 3.4))
    for axis, (title, result) in zip(np.atleast_1d(axes), results.items(), strict=True):
        for name, row in result.items():
            axis.loglog(row["seconds"], row["relMSE"], label=name, linewidth=1.3)
        axis.set(title=title, xlabel="CPU-seconds")
        axis.grid(alpha=0.3, which="both")
    np.atleast_1d(axes)[0].set_ylabel("relMSE")
    np.atleast_1d(axes)[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(FOLDER / "error.svg")


def table(results):
    """The figures as text."""
    lines = [
        f"| scene | method | CPU-s for {SPP} samples a pixel | relMSE then | efficiency over path "
        "| energy over the reference's | pixels above 20 R |",
        "|---|---|---|---|---|---|---|",
    ]
    for title, result in results.items():
        for name, row in result.items():
            mean, error = row["energy"]
            lines.append(
                f"| {title} | {name} | {row['seconds'][0]:.2f} | {row['relMSE'][0]:.3g} "
                f"| {row['gain']:.2f} | {mean:.4f} ± {error:.4f} | {row['bright']:.1f} |"
            )
    reports = [
        f"- {title}, {name}: {'; '.join(row['report'])}"
        for title, result in results.items()
        for name, row in result.items()
        if row["report"]
    ]
    return "\n".join([*lines, "", *reports]) + "\n"


def add_arguments(parser):
    parser.add_argument("corpus", nargs="?", help="folder of scene files")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    results = {}
    for title, scene in scenes(options.corpus).items():
        results[title] = study(title, scene)
        (FOLDER / "figures.json").write_text(json.dumps(results, indent=1) + "\n")
        (FOLDER / "figures.md").write_text(table(results))
        chart(results)
