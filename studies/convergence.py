"""Convergence of each material under three lights: docs/convergence.md and its pictures.

    python -m studies convergence               # all of them
    python -m studies convergence glass ibl     # of these materials and lights again

A cell is a ball of one material on a grey floor, in the language of the scene files. Figures are
kept in docs/convergence/cells.json; the page and its charts are made from them.
"""

import json

import numpy as np

from relume import translator
from relume.loading import open_session, resized, variant_and_threads
from relume.options import RenderOptions
from relume.workbench import charting, measures, methods, references, renders
from studies import DOCS, SCENES
from studies.convergence_page import TAIL, write_page

FOLDER = DOCS / "convergence"
SIZE = (32, 32)
LEVELS = [4, 8, 16, 32, 64, 128, 256]
RUNS = 8
REFERENCE_SPP = 128
SHOWN_SIZE, SHOWN_SPP = (72, 72), 64
SEED = 3

ROOM = """\
DEPTH
5
CAMERA_POS
0 8 30
TARGET_POS
0 3.5 0
SCREEN
12 12 30

OBJECT
{ball}

OBJECT
plane 0 0 0
normal 0 1 0
{floor}

OBJECT
{light}
"""

FOG = """\
participatingMedia
1
SCATTERING
0.03
0.02 0.03 0.04
ABSORBING
0.004
0.004 0.004 0.004
PAHASE
0.3
"""

FLOOR = "color 0.5 0.5 0.5\nreflection diffuse"
BALL = "sphere 0 4 0 4\n"

LIGHTS = {
    "area": "uvplane -9 13 0\nU 5 0 0\nV 0 0 5\nemission 16 15 13\ncolor 0 0 0\nreflection diffuse",
    "ibl": "sphere 0 0 0 400\nemission 0 0 0\ncolor 0 0 0\nreflection diffuse\n"
    "ibl_texture assets/sky.hdr\nibl_texture_coef 0.9\npanoramic_map 1\nnormal -1",
    "spot": "sphere -8 15 9 0.5\nemission 450 420 380\ncolor 0 0 0\nreflection diffuse\n"
    "spot_light 1\nspot_light_dir 8 -12 -9\nspot_light_angle 30 12\nspot_light_falloff 1\n"
    "spot_attenuation 0 0 1",
}

WARD = "color 0.6 0.2 0.1\nspecular 0.9 0.85 0.8\nreflection ward_brdf\nward_brdf"
MATERIALS = {
    "diffuse": "color 0.6 0.4 0.25\nreflection diffuse",
    "roughness 0.5": "color 0.85 0.6 0.3\nreflection diffuse\nroughness 0.5",
    "mirror": "color 0.9 0.85 0.7\nreflection specular",
    "glass": "color 1 1 1\nreflection reflection\nrefractive_index 1.5",
    "dispersive glass": "color 1 1 1\nreflection reflection1\n"
    "2.2718929 -1.0108077E-2 1.0592509E-2 2.0816965E-4 -7.6472538E-6 4.9240991E-7",
    "ward": f"{WARD} 0.5 0.4 0.15 0.15",
    "ward, brushed": f"{WARD} 0.2 0.6 0.4 0.08",
    "phong": "color 0.6 0.2 0.1\nspecular 0.9 0.85 0.8\nreflection phong_brdf\n"
    "phong_brdf 0.5 0.4 50",
    "texture": "color 0 0 0\nreflection diffuse\ntexture assets/tiles_opaque.png\nrepeat 2",
    "bump": "color 0.7 0.7 0.7\nreflection diffuse\nbump_texture assets/waves.png",
    "holes": "color 0 0 0\nreflection diffuse\ntexture assets/tiles.png\nrepeat 2",
    "random walk": "color 1 1 1\nreflection reflection\nrefractive_index 1.3\n"
    "reflection Subsurface_Scattering\nMATERIAL_SYMBOL\nSkimmilk\nMATERIAL_SCALE\n0.5\nBSSRDF\n0",
    "dipole": "color 1 1 1\nreflection reflection\nrefractive_index 1.3\n"
    "reflection Subsurface_Scattering\nMATERIAL_SYMBOL\nSkimmilk\nMATERIAL_SCALE\n2\nBSSRDF\n1",
    "in fog": "color 0.6 0.4 0.25\nreflection diffuse",
    "shadow catcher": "color 0.6 0.4 0.25\nreflection diffuse",
}


OTHERS = {"surfacepath": "volpath", "path": "volpath"}


def cells():
    """All (material, light)."""
    return [
        (material, light)
        for light in LIGHTS
        for material in MATERIALS
        # Without an image around the scene there is no catching of shadows.
        if material != "shadow catcher" or light == "ibl"
    ]


def document(material, light):
    """The document of a cell."""
    floor = FLOOR
    if material == "shadow catcher":
        floor = "color 0.2 0.2 0.2\nreflection diffuse\nshadow 1"
    room = FOG + ROOM if material == "in fog" else ROOM
    text = room.format(ball=BALL + MATERIALS[material], floor=floor, light=LIGHTS[light])
    return translator.read_text(text, f"{material} {light}.txt", {})


def translation(cell, size):
    """The document of a cell in that size, and its translation."""
    made = resized(document(*cell), size, 64)
    return made, translator.translate(made, asset_path=[SCENES])


def reference_method(planned):
    """The method of the reference: another one where it is unbiased and no noisier by far."""
    return methods.find(OTHERS.get(planned.name, planned.name))


def measured(cell):
    """The figures of a cell, as JSON values."""
    made, translated = translation(cell, SIZE)
    with variant_and_threads(translated):
        # By independent numbers an error has a law to be held to.
        options = RenderOptions(asset_path=[SCENES], sampler="independent")
        stage = methods.Stage(made, translated, options)
        method = methods.planned(translated)
        by = reference_method(method)
        reference = references.rendered(stage, by, REFERENCE_SPP, SEED).estimate
        racer = charting.Racer(method, stage)
        racer.spp = LEVELS
        charting.race([racer], RUNS, SEED)
    curve = racer.curve(reference)
    slope, half = curve.slope()
    last = np.array([pictures[-1].picture for pictures in racer.rounds])
    R = reference.pixels.mean
    return {
        "material": cell[0],
        "light": cell[1],
        "method": method.name,
        "reference": by.name,
        "spp": LEVELS,
        "errors": [[float(f"{e:.4g}") for e in np.diagonal(gram)] for gram in curve.gram],
        "slope": slope,
        "slope_plus_minus": half,
        "tail": share_of_largest(measures.weight(R) * (last - R) ** 2),
    }


def share_of_largest(squares):
    """Part of a sum that the largest `TAIL` of its terms carry."""
    terms = np.sort(squares, axis=None)[::-1]
    return float(terms[: max(1, round(TAIL * terms.size))].sum() / terms.sum())


def shown(cell):
    """The picture of a cell."""
    _, translated = translation(cell, SHOWN_SIZE)
    with open_session(translated) as session:
        return renders.render(session.scene, session.integrator, SHOWN_SPP, SEED).picture


def add_arguments(parser):
    parser.add_argument("only", nargs="*", help="names of materials or lights; default: all")


def run(options):
    only = options.only
    FOLDER.mkdir(parents=True, exist_ok=True)
    store = FOLDER / "cells.json"
    known = json.loads(store.read_text()) if store.is_file() else []
    known = {(cell["material"], cell["light"]): cell for cell in known}
    for cell in cells():
        if only and not set(cell) & set(only):
            continue
        known[cell] = measured(cell)
        print(*cell, "{slope:.3f} ± {slope_plus_minus:.3f}".format(**known[cell]), flush=True)
        rows = [known[cell] for cell in cells() if cell in known]
        store.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n", encoding="utf-8")
    pictures = {cell: shown(cell) for cell in cells() if cell in known}
    write_page(FOLDER, [known[cell] for cell in pictures], pictures)

