"""Short Metropolis renders against a long path-traced reference: docs/metropolis/agreement.md.

    python -m studies metropolis-agreement [CORPUS]

The mean of `RUNS` short renders of each method, every one with its own bootstrap and chains, is
compared with `path`: energies by their ratio and its standard error, blocks of 5 x 5 pixels by
Welch's t at 1 % for all blocks together. So is `pssmlt` with 16 to 65536 chains at equal mutations
(docs/metropolis/chains.md), the last of one step each: what b, the weights or the start of chains
do wrong does not average out.
"""

import mitsuba as mi
import numpy as np

from relume.integrators import pssmlt
from relume.workbench.estimates import Runs
from relume.workbench.statistics import equal_means, pooled
from studies import SCENES
from studies.metropolis import DEPTH, FOLDER, PATHS, of_file, scenes

SIZE = (80, 60)
RUNS, SPP, CHAINS_SPP = 64, 32, 16
REFERENCE_RUNS, REFERENCE_SPP = 32, 64
LEVEL = 0.01
CHAINS = (16, 256, 4096, 65536)
PSSMLT = {"type": "pssmlt", "fallback": False, "paths": PATHS}
BRIGHT = {
    "pssmlt, direct apart": PSSMLT | {"direct_samples": 1.0},
    "erpt": {"type": "erpt", "paths": PATHS},
}
"""Methods for the scenes with bright direct light."""

HEAD = [
    "| scene | method | energy over path's [%] | its error [%] | path's [%] "
    "| largest block score | values below 0 per million |",
    "|---|---|---|---|---|---|---|",
]


def estimate(scene, integrator, runs, spp):
    """The `Runs` of an integrator and their `Estimate`."""
    found = Runs()
    integrator = mi.load_dict(integrator)
    for seed in range(runs):
        found.add(np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed)))
    return found, found.estimate()


def energy(found):
    """Mean of a picture and its standard error, from the mean of the three channels."""
    # The channels of a run depend on each other: as if they were one is the careful way.
    return found.whole.mean.mean(), np.sqrt(found.whole.variance).mean()


def row(title, name, runs, found, wanted):
    (a, a_error), (b, b_error) = energy(found), energy(wanted)
    scores = equal_means(pooled(found)[0], pooled(wanted)[0], LEVEL)
    relative = 100 * np.hypot(a_error / a, b_error / b)
    line = (
        f"| {title} | {name} | {100 * (a / b - 1):+.2f} ± {relative:.2f} "
        f"| {100 * a_error / a:.2f} | {100 * b_error / b:.2f} "
        f"| {np.abs(scores.z).max():.2f} of {scores.threshold:.2f} "
        f"| {1e6 * runs.negative / (runs.count * found.pixels.mean.size):.0f} |"
    )
    print(line, flush=True)
    return line


def study(title, scene, methods, spp=SPP):
    """Lines of the table for a scene."""
    _, wanted = estimate(scene, {"type": "path"} | DEPTH, REFERENCE_RUNS, REFERENCE_SPP)
    return [row(title, name, *estimate(scene, m, RUNS, spp), wanted) for name, m in methods.items()]


def study_scenes(corpus):
    """Five scenes; more methods in two of them."""
    found = scenes(corpus, SIZE)
    found["glass"] = of_file(SCENES / "glass.txt", SIZE)
    lines = list(HEAD)
    for title, scene in found.items():
        more = BRIGHT if title in ("caustic", "Cornell box") else {}
        lines += study(title, scene, {"pssmlt": PSSMLT} | more)
        (FOLDER / "agreement.md").write_text("\n".join(lines) + "\n")


def study_chains():
    """The caustic with few long chains and with many short ones."""
    pssmlt.SHORTEST = 1
    many = {f"{n} chains": PSSMLT | {"chains": n} for n in CHAINS}
    lines = HEAD + study("caustic", of_file(FOLDER / "caustic.txt", SIZE), many, CHAINS_SPP)
    (FOLDER / "chains.md").write_text("\n".join(lines) + "\n")


def add_arguments(parser):
    parser.add_argument("corpus", nargs="?", help="folder of scene files")


def run(options):
    mi.set_variant("llvm_ad_rgb")
    study_scenes(options.corpus)
    study_chains()
