"""What denoising gains, and where it smears: seven real scene files at 16, 64 and 256 samples.

    python -m studies denoising FOLDER --asset-path FOLDER [--references FOLDER] [--only SCENE...]

Each picture is judged against one of many more samples, of another seed, by FLIP and by relMSE. The
variance of that reference, which is that of the judged picture by the ratio of their samples, is
taken off the latter. Prints the table of docs/denoising.md and draws docs/images/denoising.png.
"""

from pathlib import Path

import numpy as np
from PIL import Image

import relume
from relume import aovs, denoising
from relume.loading import open_session, translated
from relume.options import RenderOptions
from relume.output import encode_display
from relume.tone import Look
from relume.workbench import measures
from studies import DOCS
from studies.corpus import SCENES, scene_folder

SIZE = (96, 72)
SAMPLES = (16, 64, 256)
SHOWN = 16
SEEDS = {"judged": 1, "reference": 77}


def add_arguments(parser):
    parser.add_argument("corpus", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, required=True)
    parser.add_argument("--references", type=Path, help="folder that keeps the references")
    parser.add_argument("--reference-spp", type=int, default=2048)
    parser.add_argument("--only", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--figure", type=Path, default=DOCS / "images" / "denoising.png")


def reference(given, name, options):
    """The reference of a scene, kept in a folder if there is one."""
    path = given.references / f"ref-{name}.npy" if given.references else None
    if path and path.exists():
        return np.load(path).astype(float)
    spp, seed = given.reference_spp, SEEDS["reference"]
    picture = relume.render(f"{name}.txt", options, spp=spp, seed=seed)
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, picture)
    return picture.astype(float)


def rendered(name, options):
    """A picture, its variance, its denoised form with the guides and that without."""
    with open_session(translated(f"{name}.txt", options), options) as session:
        guides = denoising.guides(aovs.render_layers(session, aovs.GUIDES))
        for _ in session.run():
            pass
        image, variance = session.image(), session.accumulator.variance()
    clean = denoising.denoised(image, guides, variance)
    return variance, {"rendered": image, "denoised": clean, "unguided": denoising.denoised(image)}


def errors(picture, R, variance):
    """Debiased relMSE, and FLIP."""
    square = (picture.astype(float) - R) ** 2 - variance
    flip = measures.flip(picture.astype(float), R)
    return float((square * measures.weight(R)).mean()), flip[1]


def run(given):
    given = _absolute(given)
    print("| scene | samples | relMSE | denoised | without guides | FLIP | denoised | without |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    strips = []
    with scene_folder(given) as remarks:
        for name in given.only:
            folders = ("assets", "stand-ins") if remarks[name] else ("assets",)
            options = RenderOptions(size=SIZE, asset_path=folders)
            R = reference(given, name, options)
            for spp in SAMPLES:
                options = RenderOptions.of(options, spp=spp, seed=SEEDS["judged"])
                variance, pictures = rendered(name, options)
                noise = variance * spp / given.reference_spp
                found = [errors(p, R, noise) for p in pictures.values()]
                mse = " | ".join(f"{e:.4f}" for e, _ in found)
                flip = " | ".join(f"{f:.3f}" for _, f in found)
                print(f"| {name} | {spp} | {mse} | {flip} |", flush=True)
                if spp == SHOWN:
                    look = Look(Look("auto").stops(R))
                    row = [pictures["rendered"], pictures["denoised"], R.astype(np.float32)]
                    shown = [encode_display(look.applied(np.maximum(p, 0))) for p in row]
                    strips.append(np.concatenate(shown, axis=1))
    columns = [np.concatenate(strips[k::2], axis=0) for k in range(min(2, len(strips)))]
    rows = max(len(c) for c in columns)
    padded = [np.pad(c, ((0, rows - len(c)), (0, 0), (0, 0))) for c in columns]
    sheet = Image.fromarray(np.concatenate(padded, axis=1))
    sheet.resize((2 * sheet.width, 2 * sheet.height), 0).quantize(256).save(given.figure)


def _absolute(given):
    """Paths that hold in any folder."""
    for name in ("corpus", "asset_path", "references", "figure"):
        path = getattr(given, name)
        setattr(given, name, path and path.resolve())
    return given
