"""Contact sheets of a folder of scene files: docs/gallery/lights.png, materials.png and media.png.

    python -m studies gallery FOLDER --asset-path FOLDER [--spp 256]

The scenes are rendered as `relume render FOLDER --stand-ins` does, into the folder that `--renders`
names; a call that was interrupted goes on there. Scenes with media or subsurface scattering are on
the third sheet, those with lamps of special kinds, surroundings or next event estimation on the
first, all others on the second. Scenes with holes have a sheet of their own (`gravity.py`).
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from rich.console import Console

import relume
from relume import developing, metadata
from relume.folders import render_folder
from relume.options import RenderOptions
from relume.rendering import PassOptions
from relume.tone import AUTO, Look
from relume.translator.diagnostics import SceneError
from relume.translator.shapes import Disk, InfinityLight, MeshFile, Plane, Sphere, UVPlane
from studies import DOCS

FOLDER = DOCS / "gallery"
SIZE = (160, 120)
COLUMNS = 6
CAPTION = 13
SHEETS = {
    "lights": "Lights and surroundings",
    "materials": "Materials, textures and meshes",
    "media": "Media and subsurface scattering",
}
LETTERS = {"lights": "L", "materials": "M", "media": "S"}


def add_arguments(parser):
    parser.add_argument("corpus", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, action="append", default=[])
    parser.add_argument("--spp", type=int, default=256, help="samples of a pixel")
    parser.add_argument("--out", type=Path, default=FOLDER)
    parser.add_argument("--renders", type=Path, default=Path("out/gallery"))
    parser.add_argument("--only", default="", help="part of the names of the scenes to show")


def sheet(document):
    """Name of the sheet that a scene belongs on, or None."""
    if document.gravity:
        return None
    objects = document.objects
    if document.participating_media or any(b.reflection.subsurface for b in objects):
        return "media"
    if any(map(special_lamp, objects)) or any(document.background):
        return "lights"
    if document.next_event_estimation or any(b.texture and any(b.emission) for b in objects):
        return "lights"
    return "materials"


def special_lamp(block):
    """Whether an object is a lamp other than an ordinary sphere."""
    flat = any(block.emission) and isinstance(block.shape, UVPlane | Plane | Disk | MeshFile)
    spot = block.spot_light and isinstance(block.shape, Sphere)
    return bool(flat or spot or block.ibl_texture or isinstance(block.shape, InfinityLight))


@dataclass
class Tile:
    """One scene on a sheet: its picture, gamma applied, and remarks for the list."""

    name: str
    picture: np.ndarray | None
    remarks: list = field(default_factory=list)


def tile(row, renders):
    """A scene that was rendered; those whose own picture is linear get an exposure."""
    if row.error:
        return Tile(row.scene.stem, None, [row.error])
    found = developing.read(renders / row.linear)
    linear = relume.read(row.scene, {}).output.lower().endswith(".hdr")
    look = Look(AUTO if linear else 0.0)
    comment = found.facts.get(metadata.COMMENT, "")
    remarks = [comment.split(": ", 1)[1]] if comment else []
    remarks += [loss.split(": ", 1)[1] for loss in row.losses if loss.startswith("unsupported")]
    remarks += [look.described(found.image)] if linear else []
    return Tile(row.scene.stem, np.clip(look.applied(found.image), 0, 1) ** (1 / 2.2), remarks)


def contact_sheet(tiles, letter):
    """The sheet's picture, of 256 colours: rows of tiles with their numbers below."""
    width, height = SIZE[0] + 4, SIZE[1] + CAPTION + 2
    rows = -(-len(tiles) // COLUMNS)
    image = Image.new("RGB", (COLUMNS * width, rows * height), "white")
    draw = ImageDraw.Draw(image)
    for index, shown in enumerate(tiles):
        x, y = index % COLUMNS * width + 2, index // COLUMNS * height + 2
        pixels = Image.fromarray((shown.picture * 255 + 0.5).astype(np.uint8))
        image.paste(pixels, (x, y))
        draw.text((x + 2, y + SIZE[1]), f"{letter}{index + 1}", fill="black")
    # Rare colours count as much as the many greys; dithering needs the palette at hand.
    palette = image.quantize(256, method=Image.Quantize.MAXCOVERAGE)
    return image.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)


def listing(sheets, spp):
    """The text of README.md."""
    lines = [
        "# Gallery",
        "",
        "Scene files of the original renderer, translated and rendered at "
        f"{SIZE[0]}x{SIZE[1]}, {spp} samples a pixel:",
        "",
        "    make study-gallery CORPUS=folder ASSETS=folder",
        "",
        "They are rendered as `relume render FOLDER --stand-ins` does. Scenes whose output is",
        "`.hdr` have the exposure of `--exposure auto`. Stand-ins are named in the remarks.",
    ]
    for name, tiles in sheets.items():
        lines += ["", f"## {SHEETS[name]}", "", f"![{name}]({name}.png)", ""]
        lines += ["| | scene | remarks |", "|---|---|---|"]
        shown = [t for t in tiles if t.picture is not None]
        for index, t in enumerate(shown):
            lines.append(f"| {LETTERS[name]}{index + 1} | {t.name} | {'; '.join(t.remarks)} |")
        for t in tiles:
            if t.picture is None:
                lines.append(f"| - | {t.name} | {'; '.join(t.remarks)} |")
    return "\n".join(lines) + "\n"


def sheets(corpus, only):
    """Scene files by sheet, of which those that cannot be read are told."""
    found = {name: [] for name in SHEETS}
    for path in sorted(corpus.rglob("*.txt")):
        try:
            name = sheet(relume.read(path, {})) if only in path.name else None
        except SceneError as error:
            print(f"{path.stem}: {error}", flush=True)
            continue
        if name:
            found[name].append(path)
    return found


def run(given):
    options = RenderOptions(
        size=SIZE, spp=given.spp, asset_path=tuple(given.asset_path), stand_ins=True
    )
    tiles = {}
    for name, paths in sheets(given.corpus, given.only).items():
        renders = given.renders / name
        renders.mkdir(parents=True, exist_ok=True)
        rows = render_folder(
            paths, renders, options, passes=PassOptions(resume=True), console=Console()
        )
        tiles[name] = [tile(row, renders) for row in rows]
        shown = [t for t in tiles[name] if t.picture is not None]
        if shown and not given.only:
            file = given.out / f"{name}.png"
            contact_sheet(shown, LETTERS[name]).save(file, optimize=True)
            print(f"{file.name}: {len(shown)} scenes, {file.stat().st_size // 1000} kB")
    if not given.only:
        (given.out / "README.md").write_text(listing(tiles, given.spp), encoding="utf-8")
