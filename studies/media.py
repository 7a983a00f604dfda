"""Media against closed forms, at the ends of their ranges, and in a folder of scene files.

    python -m studies media [CORPUS --asset-path ASSETS]

prints the tables of `docs/media.md`. All numbers are of picture means with their standard errors
over eight runs; scenes of the folder that have a medium or subsurface scattering are rendered both
ways, by the dipole and by simulation, at 64x48 with 64 samples a pixel, or as many as `PATIENCE`
allows.
"""

import time
from pathlib import Path

import mitsuba as mi
import numpy as np

import relume
from relume.loading import open_session, resized
from relume.session import Session
from relume.translator import read_text, translate
from relume.translator.diagnostics import SceneError
from relume.translator.media import with_method

RUNS = 8
SAMPLES = 8
"""Samples of a pixel in each of the runs by which scenes of a folder are rendered."""

PATIENCE = 60
"""No run of such a scene is begun after so much time [s]."""

BALL = "OBJECT\nsphere 0 0 0 1\ncolor 1 1 1\nreflection reflection\n"
SSS = BALL + "reflection Subsurface_Scattering\n"
SKY = "BACKGROUND\n1 1 1\n"
WALL = "OBJECT\nuvplane -50 -50 -10\nU 100 0 0\nV 0 100 0\nemission 2 2 2\nreflection diffuse\n"
BEAM = (
    "OBJECT\nuvplane -1 3 -1\nU 2 0 0\nV 0 0 2\nemission 5 5 5\nparallel_light 1\n"
    "parallel_light_dir 0 -1 0\nreflection diffuse\n"
)


def view(position, target, width=0.002):
    """Scene text of a camera of 8x8 pixels."""
    position, target = (" ".join(map(str, p)) for p in (position, target))
    return (
        f"IMAGE\n8 8\nSCREEN\n{width} {width} 1\n"
        f"CAMERA_POS\n{position}\nTARGET_POS\n{target}\n"
    )


def coefficients(s, a, g):
    """Lines of a medium: three scattering and absorption coefficients and mean cosines."""
    s, a, g = (" ".join(f"{x:.9g}" for x in np.broadcast_to(v, 3)) for v in (s, a, g))
    return f"SCATTERING\n0\n{s}\nABSORBING\n0\n{a}\nPAHASE {g}\n"


def mean(text, spp, integrator=None):
    """Mean and standard error over the runs, (3,) each; True if all is finite."""
    translation = translate(read_text(text, environ={}))
    with open_session(translation) as session:
        other = mi.load_dict(integrator) if integrator else session.integrator
        pictures = []
        for seed in range(RUNS):
            run = Session(session.scene, spp, seed, other)
            list(run.run())
            pictures.append(run.image())
    means = np.array([picture.mean(axis=(0, 1)) for picture in pictures], float)
    finite = bool(np.isfinite(pictures).all())
    return means.mean(axis=0), means.std(axis=0, ddof=1) / RUNS**0.5, finite


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def head(*cells):
    print()
    row(*cells)
    row(*("---" for _ in cells))


def triple(values, digits=4):
    return " ".join(f"{x:.{digits}f}" for x in np.broadcast_to(values, 3))


def closed_forms():
    """Beer and Lambert, single scattering, furnaces."""
    head("scene", "expected", "found", "standard error [%]")

    def compare(name, text, spp, expected, integrator=None):
        found, error, _ = mean(text, spp, integrator)
        worst = 100 * np.max(error / expected)
        row(name, triple(expected), triple(found), f"{worst:.2f}")

    fog = "participatingMedia\n1\n"
    for a in (0.05, 0.2, (0, 0.1, 0.3)):
        text = view((0, 0, -2), (0, 0, -10)) + fog + coefficients(0, a, 0) + "\n" + WALL
        name = f"slab, absorption {a} over 8 units"
        compare(name, text, 2**11, 2 * np.exp(-8 * np.broadcast_to(a, 3)))
    for g in (0.0, 0.6, -0.5, 0.99):
        s, a, w = 0.06, 0.03, 1.0
        text = view((0, 0, 4), (0, 0, 0)) + fog + coefficients(s, a, g) + "\n" + BEAM
        phase = (1 - g * g) / (4 * np.pi * (1 + g * g) ** 1.5)
        along = 2 * np.sinh((s + a) * w) / (s + a)
        expected = s * phase * np.pi * 5 * np.exp(-7 * (s + a)) * along * np.ones(3)
        once = {"type": "volpath", "max_depth": 2}
        compare(f"beam, scattered once, g = {g}", text, 2**10, expected, once)
    for g in (0, 0.9, 0.99, 1, -0.99, -1, (0.9, 0.85, 0.8)):
        text = view((0, 0, 3), (0, 0, 0)) + SKY + "DEPTH\n200\n" + fog
        text += coefficients((0.3, 0.2, 0.4), 0, g) + "\n" + BALL
        compare(f"furnace, fog, g = {g}", text, 2**9, np.ones(3))
    for eta in (1, 1.3, 2):
        text = view((0, 0, 9), (0.3, 0.2, 0)) + SKY + "DEPTH\n5000\n\n" + SSS
        text += f"BSSRDF\n0\nrefractive_index {eta}\n" + coefficients(5, 0, 0)
        compare(f"furnace, simulated ball, eta = {eta}", text, 2**7, np.ones(3))


def limits():
    """Both ways at the ends of the ranges: mean radiance of a ball of radius 1 under light 1."""
    head("ball", "simulation", "error", "dipole", "error", "finite")
    cases = {
        "Spectralon (sigma_a = 0)": "MATERIAL_SYMBOL\nSpectralon\n",
        "sigma_s = 0, sigma_a = 0.5 1 2": coefficients(0, (0.5, 1, 2), 0),
        "both 0": "",
        "g = 0.99": coefficients(5, 0.1, 0.99),
        "g = 1": coefficients(5, 0.1, 1),
        "g = -0.99": coefficients(5, 0.1, -0.99),
        "g = -1": coefficients(5, 0.1, -1),
        "eta = 1": "refractive_index 1\n" + coefficients(5, 0.1, 0),
        "Coke (sigma_s = 0 in blue)": "MATERIAL_SYMBOL\nCoke\n",
    }
    for scale in ("1e-4", "1e-2", "1", "1e2", "1e4"):
        cases[f"Marble, scale {scale}"] = f"MATERIAL_SYMBOL\nMarble\nMATERIAL_SCALE\n{scale}\n"
    for name, lines in cases.items():
        cells, finite = [], True
        for way in (0, 1):
            text = view((0, 0, 9), (0, 0, 0), 0.25) + SKY + f"\n{SSS}{lines}BSSRDF\n{way}\n"
            found, error, fine = mean(text, 256)
            cells += [triple(found, 3), f"{error.max():.3f}"]
            finite &= fine
        row(name, *cells, "yes" if finite else "NO")


def patient(translation):
    """The picture of a scene by at most `RUNS` runs, and the samples of a pixel that it took."""
    total, runs, start = 0, 0, time.perf_counter()
    with open_session(translation) as session:
        while not runs or (runs < RUNS and time.perf_counter() - start < PATIENCE):
            run = Session(session.scene, SAMPLES, runs, session.integrator)
            list(run.run())
            total, runs = total + run.image(), runs + 1
    return total / runs, runs * SAMPLES


def folder(path, assets):
    """Each scene of a folder with media or subsurface scattering, both ways."""
    head("scene", "way", "integrator", "samples", "mean", "largest / median", "finite")
    for file in sorted(path.rglob("*.txt")):
        try:
            document = resized(relume.read(file, {}), (64, 48), SAMPLES)
        except SceneError:
            continue
        subsurface = any(block.reflection.subsurface for block in document.objects)
        if not (subsurface or document.participating_media):
            continue
        for dipole in (True, False) if subsurface else (False,):
            try:
                translation = translate(with_method(document, dipole), asset_path=assets)
            except SceneError as error:
                row(file.stem, *3 * [""], f"not read: {len(error.problems)} files missing", "", "")
                break
            way = "dipole" if translation.plan.integrator == "dipole" else "simulation"
            if dipole and way != "dipole":
                continue
            picture, spp = patient(translation)
            ratio = picture.max() / max(np.median(picture), 1e-9)
            row(
                file.stem, way, translation.plan.integrator, spp,
                triple(picture.mean(axis=(0, 1)), 3), f"{ratio:.0f}",
                "yes" if np.isfinite(picture).all() else "NO",
            )  # fmt: skip


def add_arguments(parser):
    parser.add_argument("corpus", nargs="?", type=Path)
    parser.add_argument("--asset-path", type=Path, action="append", default=[])


def run(options):
    if options.corpus:
        folder(options.corpus, options.asset_path)
    else:
        closed_forms()
        limits()
