"""Scenes with holes: a sheet of all, and the original's pictures against ours.

    make study-gravity CORPUS="folder of scene files" REFERENCES="folder of scenes and pictures"

Writes docs/gallery/gravity.md and gravity.png. Missing pictures have stand-ins. The references are
compared at their own sample points: the middles of SUPERSAMPLING x SUPERSAMPLING parts of a pixel.
Skies are looked up as the original did, at the nearest texel, in the direction that the light came
from.
"""

import dataclasses
import json
import os
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from PIL import Image

import relume
from relume.loading import open_session, translated
from relume.options import RenderOptions
from relume.translator import curved_space
from relume.translator.camera import view
from relume.translator.environment_maps import BLACK, nearest
from relume.translator.gravity import WormHole
from relume.translator.images import read_image
from relume.translator.scene_values import Picture
from studies import DOCS
from studies.gallery import SIZE, Tile, contact_sheet

FOLDER = DOCS / "gallery"
EQUAL = 0.01
"""Largest difference of a channel of pixels that count as equal."""

ROWS = 1024
TURN = (np.arange(2 * ROWS) + 0.5) / ROWS * np.pi
STEP = 1.9
"""Length of the original's steps far from a black hole; the first ones are shorter."""

HERE, THERE = 2.0, 6.0
"""What is added to the directions of either sky, so that they can be told apart."""

VARIABLES = {
    "blackHole003": {"XX": "30"},
    "blackHole005": {
        "XX": "215", "YY": "45", "ZZ": "55", "XXX": "-1", "ZZZ": "-0.1", "UPZ": "1", "VX": "-0.5",
    },
    "wormHole002": {"XX": "30"},
    "wormHole002a": {"XX": "8", "TT": "180"},
    "wormHole002aa": {"XX": "8", "TT": "180"},
}  # fmt: skip
"""What is set for files that take variables; others take 0, as in the original."""


def add_arguments(parser):
    parser.add_argument("references", type=Path, help="folder of scenes and pictures")
    parser.add_argument("corpus", type=Path, help="folder of scene files")
    parser.add_argument("--spp", type=int, default=64, help="samples of a pixel of the sheet")
    parser.add_argument("--only", default="", help="part of the names of the scenes to take")


# ---- the original's pictures


def program_camera(document):
    """A document whose camera is where the original has it (row wormhole-start), or None.

    It is nearer to the mouth by the length of the throat; a place within it has no equal.
    """
    block = curved_space.curvature(document)
    if not isinstance(block, WormHole):
        return document
    seen = view(document, "prender")
    mouth = np.array(block.entrance or seen.origin + block.dist * seen.direction)
    away = seen.origin - mouth
    m = block.w / 1.42953
    x = np.concatenate([[0], np.geomspace(1e-6, 1e6, 100_000)])
    r = block.rho + m * (x * np.arctan(x) - 0.5 * np.log1p(x**2))
    outside = x * np.pi * m / 2
    nearer = np.interp(np.linalg.norm(away), r, outside) - 2 * block.a
    if nearer < 0:
        return None
    away *= np.interp(nearer, outside, r) / np.linalg.norm(away)
    return dataclasses.replace(document, camera_pos=tuple(mouth + away))


def coded(entry, offset=HERE):
    """An entry whose environment maps show the directions themselves, by `offset`."""
    if not isinstance(entry, dict):
        return entry
    if entry.get("type") == "envmap":
        v, u = np.meshgrid(np.linspace(0, np.pi, ROWS), TURN, indexing="ij")
        n = np.stack([np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)], axis=-1)
        return entry | {"picture": Picture(n + offset), "scale": 1.0}
    beyond = ("sky2", "other")
    return {key: coded(x, THERE if key in beyond else offset) for key, x in entry.items()}


def sphere(block):
    """A sphere around a black hole that shows the directions of its points from the hole.

    The original looks its sky up where a ray has used up its steps of 2 units, not at infinity.
    """
    v, u = np.meshgrid((np.arange(ROWS) + 0.5) / ROWS * np.pi, TURN, indexing="ij")
    n = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1)
    return {
        "type": "sphere",
        "center": list(block.position),
        "radius": STEP * block.geodesics_max_length,
        "flip_normals": True,
        "bsdf": BLACK,
        "emitter": {
            "type": "area",
            "radiance": {"type": "bitmap", "raw": True, "picture": Picture(n + HERE)},
        },
    }


def looked_up(found, document, folder):
    """Radiance of coded directions, from the pictures of the skies; black stays black."""
    block = curved_space.curvature(document)
    if isinstance(block, WormHole):
        skies = [
            (getattr(block, f"background_texture{k}"), getattr(block, f"map_coef{k}"),
             getattr(block, f"coef{k}")) for k in (1, 2)
        ]  # fmt: skip
    else:
        skies = [(document.background_texture, document.map_coef, document.coef)]
    result = np.zeros_like(found)
    for offset, (name, (a, b, c, d), coef) in zip((HERE, THERE), skies, strict=False):
        n = found - offset
        here = np.abs(np.linalg.norm(n, axis=-1) - 1) < 0.1
        theta = np.arccos(np.clip(n[..., 2], -1, 1))
        phi = np.mod(np.arctan2(n[..., 1], n[..., 0]), 2 * np.pi)
        theta = np.abs(np.fmod(a * theta + b, np.pi))
        phi = np.mod(np.fmod(c * phi + d, 2 * np.pi), 2 * np.pi)
        pixels = read_image(folder / name).rgb
        h, w = pixels.shape[:2]
        u, v = phi / (2 * np.pi) * w / (w - 1), theta / np.pi * h / (h - 1)
        result[here] = coef * nearest(pixels, u, v)[here]
    return result


def at_sample_points(document, size, folder):
    """A picture at the original's sample points, (height, width, 3)."""
    parts, (width, height) = document.supersampling, size
    options = RenderOptions(size=size, spp=1, dialect="prender")
    translation = translated(document, options)
    is_sky = not document.objects
    if is_sky:
        scene = coded(translation.scene)
        if hole := curved_space.hole(document):
            scene["background"] = sphere(hole)
        translation = dataclasses.replace(translation, scene=scene)
    with open_session(translation, options) as session:
        index = dr.arange(mi.UInt32, width * height * parts**2)
        x, y = index % (width * parts), index // (width * parts)
        place = (mi.Point2f(x, y) + 0.5) / mi.Point2f(width * parts, height * parts)
        sampler = session.sensor.sampler().clone()
        sampler.seed(0, width * height * parts**2)
        ray, weight = session.sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
        found, _, _ = session.integrator.sample(session.scene, sampler, ray)
        found = np.array(found * weight).T.astype(float)
    found = found.reshape(height * parts, width * parts, 3)
    if is_sky:
        found = looked_up(found, document, folder)
    return found.reshape(height, parts, width, parts, 3).mean(axis=(1, 3))


def reference_row(scene, pictures):
    """A row of the table: means of both, and how many pixels are equal."""
    about = json.loads((pictures / f"{scene.stem}.json").read_text(encoding="utf-8"))
    theirs = np.load(pictures / f"{scene.stem}.npy").astype(float)
    document = relume.read(scene, {"LUMINANCE_CUTOFF": "0"})
    size = theirs.shape[1], theirs.shape[0]
    exact = about.get("rel_pixel_se") is None
    moved = program_camera(document)
    shares, ours = [], None
    for each in [document] if moved is document else [document, moved]:
        if each is None:
            shares.append("in the throat")
        elif exact:
            ours = at_sample_points(each, size, scene.parent)
            shares.append(f"{(np.abs(ours - theirs).max(axis=2) < EQUAL).mean():.2%}")
        else:
            ours = relume.render(each, size=size, spp=32, dialect="prender")
    means = [" ".join(f"{x:.3f}" for x in image.mean(axis=(0, 1))) for image in (theirs, ours)]
    return (scene.stem, *means, ", ".join(shares) or "noisy")


# ---- the sheet of real scenes


def tile(path, spp):
    """A scene on the sheet, exposed as those of the gallery."""
    environ = dict(os.environ) | VARIABLES.get(path.stem, {})
    document = relume.read(path, environ)
    options = RenderOptions(size=SIZE, spp=spp, stand_ins=True)
    found = translated(document, options)
    remarks = [f"stand-ins for {len(found.stand_ins)}"] if found.stand_ins else []
    remarks += [f"{name}={value}" for name, value in VARIABLES.get(path.stem, {}).items()]
    remarks += [note.text for note in found.picture_notes()]
    picture = relume.render(document, options)
    bright = np.quantile(picture.mean(axis=2), 0.9)
    picture = picture * (0.7 / bright if bright > 0.7 else 1.0)
    return Tile(path.stem, np.clip(picture, 0, 1) ** (1 / 2.2), remarks)


def page(rows, tiles, spp):
    """The text of gravity.md."""
    lines = [
        "# Scenes with holes",
        "",
        "Files of the original renderer with black holes and wormholes, rendered by relume at",
        f"{SIZE[0]}x{SIZE[1]}, {spp} samples a pixel, with stand-ins for missing pictures.",
        "",
        "    make study-gravity CORPUS=folder REFERENCES=folder",
        "",
        "![All scenes](gravity.png)",
        "",
        "| | scene | remarks |",
        "|---|---|---|",
        *(f"| G{k} | {t.name} | {'; '.join(t.remarks)} |" for k, t in enumerate(tiles, 1)),
        "",
        "## The original's pictures",
        "",
        "Pictures of the original program against ours in dialect `prender`, at its own sample",
        f"points. Equal are pixels whose channels differ by less than {EQUAL}. Of wormholes the",
        "second figure is with the camera where the program has it by mistake: nearer by the",
        "length of the throat (row `wormhole-start`).",
        "",
        "| picture | mean, the original | mean, relume | equal |",
        "|---|---|---|---|",
        *(f"| {' | '.join(row)} |" for row in rows),
        "",
        "Where fewer are equal, the program is wrong by a row of [its table](../holes.md): black",
        "streaks along the axis of spin (`hole-poles`, cornell_blackhole_geo), the camera of",
        "wormholes, in wh_sky_long within the throat, light that bounces in a room with mouths",
        "(`wormhole-bounces`, wh_room_self). Noisy pictures with disks have its opacity and, in",
        "bh_disk_temperature, its red colours (`disk-opacity`, `disk-temperature`).",
    ]
    return "\n".join(lines) + "\n"


def run(given):
    rows = []
    for scene in sorted((given.references / "scenes").glob("*.txt")):
        if given.only in scene.stem:
            rows.append(reference_row(scene, given.references / "pictures"))
            print(*rows[-1], sep="  ", flush=True)
    tiles = []
    for path in sorted(given.corpus.rglob("*.txt")):
        if given.only in path.stem:
            tiles.append(tile(path, given.spp))
            print(path.stem, *tiles[-1].remarks, sep="  ", flush=True)
    if given.only:
        return
    contact_sheet(tiles, "G").convert("RGB").quantize(192).save(
        FOLDER / "gravity.png", optimize=True
    )
    assert all(isinstance(t.picture, np.ndarray) for t in tiles)
    (FOLDER / "gravity.md").write_text(page(rows, tiles, given.spp), encoding="utf-8")
    with Image.open(FOLDER / "gravity.png") as sheet:
        print(f"gravity.png: {sheet.size}, {(FOLDER / 'gravity.png').stat().st_size // 1000} kB")
