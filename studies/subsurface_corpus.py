"""Scene files with measured materials, by the dipole and by simulation: means and plan; a table.

    python -m studies subsurface-corpus FOLDER --asset-path FOLDER

Every file of the folder with `MATERIAL_SYMBOL` is rendered both ways. Means are those of the pixels
whose centres show a scattering object; `planned` is what the plan takes of its own accord, and why.
"""

from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

import relume
from relume.bsdfs.subsurface import SUBSURFACE
from relume.loading import load_scene, translated, variant_and_threads
from relume.options import RenderOptions
from studies.subsurface import heading, row, triple

SIZE, SPP = (48, 36), 64
REASONS = ("simulated-far-off", "dipole-fits", "dipole-off", "simulated-with-another")


def add_arguments(parser):
    parser.add_argument("corpus", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, action="append", default=[])


def scattering_pixels(translation):
    """Which pixels show an object with subsurface scattering at their centre, (height, width)."""
    with variant_and_threads(translation):
        scene = load_scene(translation)
        width, height = SIZE
        pixel = dr.arange(mi.UInt32, width * height)
        x, y = pixel % width, pixel // width
        place = mi.Point2f((mi.Float(x) + 0.5) / width, (mi.Float(y) + 0.5) / height)
        si = scene.ray_intersect(mi.Ray3f(scene.sensors()[0].sample_ray(0, 0, place, 0.5)[0]))
        seen = si.is_valid() & ((si.bsdf().flags() & SUBSURFACE) != 0)
        return np.array(seen).reshape(height, width)


def figures(path, folders):
    """The row of a scene, and whether all of its pixels are finite."""
    options = {"size": SIZE, "asset_path": folders, "stand_ins": True}
    made = translated(path, RenderOptions(**options))
    notes = [n for line in made.document.lines.all for n in line.notes if n.code in REASONS]
    by_dipole = translated(path, RenderOptions(**options, integrator="dipole"))
    seen = scattering_pixels(by_dipole)
    ways = ("dipole", "randomwalk")
    pictures = [relume.render(path, spp=SPP, integrator=name, **options) for name in ways]
    finite = all(np.isfinite(picture).all() for picture in pictures)
    dipole, walk = (picture[seen].mean(axis=0) for picture in pictures)
    why = "; ".join(dict.fromkeys(note.text for note in notes))
    cells = (triple(dipole), triple(walk), triple(dipole / walk, ".2f"), made.plan.integrator, why)
    return (path.stem, int(seen.sum()), *cells, "yes" if finite else "NO")


def run(options):
    heading("Scene files with MATERIAL_SYMBOL", (
        "scene", "pixels", "dipole", "randomwalk", "ratio", "planned", "why", "finite",
    ))  # fmt: skip
    for path in sorted(options.corpus.glob("*.txt")):
        if b"MATERIAL_SYMBOL" in path.read_bytes():
            row(figures(path, options.asset_path))
