"""Pictures of the original program against ours in dialect `prender`: docs/references.md.

    python -m studies peer-corpus REFERENCES CORPUS ASSETS [PICTURE ...]

REFERENCES holds linear pictures NAME.exr, each with NAME.json: `scene`, the file's name in CORPUS,
and `environment`, the variables it was rendered with. Of each the energy ratio is measured, and
again with the known cause of its difference isolated (`CAUSES`). The pictures are not copied.
Figures are kept in docs/references.json; the table is made from them.
"""

import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from relume import translator
from relume.loading import variant_and_threads
from relume.options import RenderOptions
from relume.workbench import comparing, estimates, measures, methods, renders, statistics
from relume.workbench.comparison import CONFIDENCE, FALSE_ALARMS, Comparison, Side
from studies import DOCS, peer_light
from studies.peer_table import table

FIGURES = DOCS / "references.json"
RUNS, SPP = 16, 8
SEED = 4


@dataclass(frozen=True)
class Case:
    """A picture of the program: its name, the text of its scene, the environment, our folders."""

    name: str
    text: str
    environment: dict
    asset_path: tuple
    picture: np.ndarray

    def staged(self, edit=lambda text: text):
        """The edited document and its translation."""
        document = translator.read_text(edit(self.text), self.name, self.environment)
        return document, translator.translate(document, "prender", self.asset_path)

    def rendered(self, parts):
        """The `Estimate` of a weighted sum of pictures.

        Args:
            parts: (weight, edit of the text, integrator): the latter a function of the document and
                the planned integrator's dictionary.
        """
        total = [0] * RUNS
        for part, (weight, edit, integrator) in enumerate(parts):
            document, translation = self.staged(edit)
            with variant_and_threads(translation):
                options = RenderOptions(dialect="prender", asset_path=self.asset_path)
                stage = methods.Stage(document, translation, options)
                scene, planned = stage.load(methods.planned(translation))
                own = integrator(document, translation.scene["integrator"]) or planned
                for run in range(RUNS):
                    seed = renders.own_seed(SEED, renders.COMPARE, part, run)
                    total[run] = total[run] + weight * renders.render(scene, own, SPP, seed).picture
        runs = estimates.Runs()
        for picture in total:
            runs.add(picture)
        return runs.estimate()

    def compared(self, estimate):
        """The figures of an estimate against the picture, as JSON values."""
        ours = Side("ours", estimate, RUNS, (), 0, 0)
        theirs = comparing.picture_side(self.name, self.picture, None, estimate)
        scores = statistics.all_levels(ours.estimate, theirs.estimate, FALSE_ALARMS)
        flip = measures.flip(estimate.pixels.mean, self.picture)
        return figures(Comparison((ours, theirs), scores, flip, {}))


def figures(comparison):
    """Ratios, FLIP, tests of blocks that fail and the verdict of a comparison."""
    blocks = comparison.scores["blocks"]
    return {
        "ratio": [round(c["ratio"], 4) for c in comparison.energy()],
        "plus_minus": [round(c["ratio_plus_minus"], 4) for c in comparison.energy()],
        "flip": round(comparison.flip[1], 4),
        "blocks": blocks.rejected,
        "of_blocks": blocks.z.size,
        "agree": comparison.agree,
    }


def on_and_off(case, estimate):
    """Energy ratios on the scattering ball and elsewhere, with 95 % intervals, as JSON values."""
    document, translation = case.staged()
    ball = next(b.shape for b in document.objects if b.reflection.subsurface)
    with variant_and_threads(translation):
        scene, _ = methods.Stage(document, translation).load(methods.planned(translation))
        height, width = case.picture.shape[:2]
        index = dr.arange(mi.UInt32, width * height)
        y, x = index // width, index % width
        middle = mi.Point2f((x + 0.5) / width, (y + 0.5) / height)
        ray, _ = scene.sensors()[0].sample_ray(0, 0, middle, mi.Point2f(0.5))
        si = scene.ray_intersect(ray)
        near = abs(dr.norm(si.p - mi.Point3f(*ball.center)) - ball.radius) < 0.01 * ball.radius
        on = np.array(si.is_valid() & near).reshape(height, width)
    theirs = comparing.picture_side(case.name, case.picture, None, estimate).estimate.pixels
    return {
        "on": ratio_within(estimate.pixels, theirs, on),
        "off": ratio_within(estimate.pixels, theirs, ~on),
    }


def ratio_within(a, b, mask):
    """Ratio of the means of two levels over a mask, and half-width, for each channel."""
    means = (
        estimates.Level(
            level.mean[mask].mean(axis=0),
            level.variance[mask].sum(axis=0) / mask.sum() ** 2,
            level.dof[mask].sum(axis=0),
        )
        for level in (a, b)
    )
    ratio, half = statistics.ratio(*means, CONFIDENCE)
    return [ratio.round(3).tolist(), half.round(3).tolist()]


# ---- causes


def as_it_is(text):
    """No edit."""
    return text


def as_planned(document, planned):
    """No other integrator."""


def no_light_after_depth(case):
    """A lamp hit after DEPTH bounces counts 1 / max(emission): the survivors of the program's
    roulette are divided by the emission though none was stopped."""
    document, _ = case.staged()
    brightest = max(max(block.emission) for block in document.objects)

    def short(document, planned):
        depth = int(document.depth) + 1
        return mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 10**6})

    return case.rendered(
        [(1 - 1 / brightest, as_it_is, short), (1 / brightest, as_it_is, as_planned)]
    )


def two_lamps(kind, edit=as_it_is):
    """A rectangle seen in its squared extents, sampled as it is written."""

    def cause(case):
        def integrator(document, planned):
            lamp = next(b for b in document.objects if hasattr(b.shape, "u") and any(b.emission))
            light = kind(lamp.shape, lamp.emission)
            return peer_light.define()(light, document.depth)

        return case.rendered([(1, edit, integrator)])

    return cause


def edited(edit):
    """The scene with other text."""
    return lambda case: case.rendered([(1, edit, as_planned)])


def substituted(pattern, replacement):
    """An edit of whole lines."""
    return lambda text: re.sub(rf"^{pattern}$", replacement, text, flags=re.MULTILINE)


def shining(text):
    """The beam's rectangle as a lamp, which rays see."""
    return substituted(r"parallel_light.*", "")(text)


@dataclass(frozen=True)
class Cause:
    """Why a picture differs: rows of the table of dialects, words, and the isolated cause."""

    rows: tuple
    words: str
    isolated: Callable | None = None


CAUSES = {
    "cornell_pt": Cause(
        ("roulette",),
        "lamp hits after DEPTH bounces counted 1/36, as the program's roulette leaves them",
        no_light_after_depth,
    ),
    "area": Cause(
        ("uvplane-extent",),
        "the lamp seen 400 x 400, sampled 20 x 20; seen in mirrors and glass without Fresnel's "
        "weights; what is left lies along the lamp's edge, where the program has four fixed points "
        "a pixel",
        two_lamps(peer_light.Lamp),
    ),
    "mltscene_pt": Cause(
        ("uvplane-extent",),
        "the lamp seen 25 x 25, sampled 5 x 5, behind the panel; the picture is noisy (0.38 of its "
        "mean)",
        two_lamps(peer_light.Lamp),
    ),
    "ward_metal1": Cause(
        ("ward-diffuse",),
        "`ward_brdf 1 1 0.5 0.5`: the program takes both weights as 1 and blends",
        edited(substituted("ward_brdf .*", "ward_brdf 1 1 0.5 0.5")),
    ),
    "parallel": Cause(
        ("uvplane-extent",),
        "the beam's rectangle seen 25 x 25 by the camera, in mirrors and glass",
        two_lamps(peer_light.Beam, shining),
    ),
    "parallel_media": Cause(
        ("uvplane-extent", "medium-phase"),
        "the beam's rectangle is seen, as in `parallel`; light scattered in the medium is too "
        "bright in the program (not isolated)",
    ),
    "sss_cream_bssrdf0": Cause(("sss-simulation",), "the program's walk loses energy"),
    "sss_cream_bssrdf1": Cause(("sss-dipole",), "the program's dipole is too bright"),
}

STAND_INS = {
    "parallel": ("parallel_media", substituted("participatingMedia\n1", "participatingMedia\n0")),
}
"""Scenes that are not in the corpus, as an edit of another picture's."""


# ---- measurements


def compared_as_users_do(case, path, scene):
    """`relume compare SCENE --with PICTURE --dialect prender` under the picture's environment."""
    before = dict(os.environ)
    os.environ.update(case.environment)
    try:
        found = comparing.compare(
            scene,
            with_=str(path),
            spp=RUNS * SPP,
            runs=RUNS,
            seed=SEED,
            dialect="prender",
            asset_path=case.asset_path,
        )
    finally:
        os.environ.clear()
        os.environ.update(before)
    return figures(found)


def measured(path, corpus, assets):
    """The figures of a picture, as JSON values."""
    settings = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    name, edit = path.stem, as_it_is
    scene = corpus / settings["scene"]
    if name in STAND_INS and not scene.is_file():
        other, edit = STAND_INS[name]
        stored = json.loads(path.with_name(f"{other}.json").read_text(encoding="utf-8"))
        scene = corpus / stored["scene"]
    result = {"name": name, "scene": scene.stem, "spp": settings["samples_per_pixel"]}
    if not scene.is_file():
        return result | {"missing": True}
    picture, _ = comparing.load_picture(path)
    # Their comments are in several encodings; what matters is ASCII.
    text = edit(scene.read_bytes().decode("latin-1").replace("\r\n", "\n"))
    case = Case(name, text, settings["environment"], (assets,), picture)
    if edit is as_it_is:
        result["as_it_is"] = compared_as_users_do(case, path, scene)
    else:
        estimate = case.rendered([(1, as_it_is, as_planned)])
        result |= {"as_it_is": case.compared(estimate), "stand_in": True}
    cause = CAUSES.get(name)
    if cause:
        result |= {"rows": cause.rows, "words": cause.words}
        if cause.isolated:
            result["isolated"] = case.compared(cause.isolated(case))
        if any(row.startswith("sss") for row in cause.rows):
            result["places"] = on_and_off(case, case.rendered([(1, as_it_is, as_planned)]))
    return result


def add_arguments(parser):
    parser.add_argument("references", type=Path)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("assets", type=Path)
    parser.add_argument("pictures", nargs="*", help="names of pictures; default: all")


def run(given):
    known = json.loads(FIGURES.read_text()) if FIGURES.is_file() else []
    known = {figures["name"]: figures for figures in known}
    for path in sorted(given.references.glob("*.exr")):
        if given.pictures and path.stem not in given.pictures:
            continue
        known[path.stem] = measured(path, given.corpus, given.assets)
        print(json.dumps(known[path.stem]), flush=True)
        rows = [known[name] for name in sorted(known)]
        FIGURES.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n", encoding="utf-8")
    FIGURES.with_suffix(".md").write_text(table(list(known.values())), encoding="utf-8")

