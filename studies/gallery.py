"""Contact sheets of a folder of scene files: docs/gallery/lights.png and materials.png.

    python -m studies gallery FOLDER --asset-path FOLDER [--spp 256]

Scenes with lamps of special kinds, surroundings or next event estimation are on the first sheet,
the other scenes with materials, textures or meshes on the second. What needs a medium, subsurface
scattering or gravity to be itself is left out, except lamps in a medium. Missing meshes and
pictures are replaced by stand-ins (see `stand_ins.py`); the list of scenes,
docs/gallery/README.md, says where.
"""

import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import relume
from relume import translator
from relume.loading import resized
from relume.translator.assets import Assets
from relume.translator.diagnostics import SceneError
from relume.translator.shapes import Disk, InfinityLight, MeshFile, Plane, Sphere, UVPlane
from studies import DOCS, stand_ins

FOLDER = DOCS / "gallery"
SIZE = (160, 120)
COLUMNS = 6
CAPTION = 13
SHEETS = {"lights": "Lights and surroundings", "materials": "Materials, textures and meshes"}


def add_arguments(parser):
    parser.add_argument("corpus", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, action="append", default=[])
    parser.add_argument("--spp", type=int, default=256, help="samples of a pixel")
    parser.add_argument("--out", type=Path, default=FOLDER)
    parser.add_argument("--only", default="", help="part of the names of the scenes to show")


def sheet(document):
    """Name of the sheet that a scene belongs on, or None."""
    objects = document.objects
    if document.gravity or any(b.reflection.subsurface for b in objects):
        return None
    if any(map(special_lamp, objects)) or any(document.background):
        return "lights"
    if document.participating_media:
        return None
    if document.next_event_estimation or any(b.texture and any(b.emission) for b in objects):
        return "lights"
    plain = (None, "diffuse")
    special = any(
        b.reflection.kind not in plain or b.texture or b.bump_texture or is_mesh(b) for b in objects
    )
    return "materials" if special else None


def is_mesh(block):
    return isinstance(block.shape, MeshFile)


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


def tile(path, document, asset_path, spp):
    """Render a scene; missing files are made first."""
    remarks, missing = [], []
    with tempfile.TemporaryDirectory() as folder:
        found = Assets(document, asset_path).found
        for name in (name for name, file in found.items() if file is None):
            made = stand_ins.make(name, Path(folder))
            (remarks if made else missing).append(made or name)
        if missing:
            return Tile(path.stem, None, ["not shown, missing: " + ", ".join(missing)])
        folders = [*asset_path, folder]
        document = resized(document, SIZE, spp)
        translation = translator.translate(document, asset_path=folders)
        lines = translation.document.lines.all
        remarks += sorted({r.note.split("; ")[-1] for r in lines if r.outcome == "unsupported"})
        picture = relume.render(document, asset_path=folders)
    if document.output.lower().endswith(".hdr"):
        bright = np.quantile(picture.mean(axis=2), 0.8)
        factor = 0.6 / bright if bright > 0 else 1.0
        remarks.append(f"exposure x {factor:.2g}")
        picture = picture * factor
    return Tile(path.stem, np.clip(picture, 0, 1) ** (1 / 2.2), remarks)


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
        "Scenes whose output is `.hdr` are exposed so that four fifths of the picture are below",
        "0.6. Meshes and pictures that are not at hand are replaced by stand-ins.",
    ]
    for name, tiles in sheets.items():
        lines += ["", f"## {SHEETS[name]}", "", f"![{name}]({name}.png)", ""]
        lines += ["| | scene | remarks |", "|---|---|---|"]
        shown = [t for t in tiles if t.picture is not None]
        for index, t in enumerate(shown):
            lines.append(f"| {name[0].upper()}{index + 1} | {t.name} | {'; '.join(t.remarks)} |")
        for t in tiles:
            if t.picture is None:
                lines.append(f"| - | {t.name} | {'; '.join(t.remarks)} |")
    return "\n".join(lines) + "\n"


def run(given):
    sheets = {name: [] for name in SHEETS}
    for path in sorted(given.corpus.rglob("*.txt")):
        if given.only not in path.name:
            continue
        try:
            document = relume.read(path, {})
            name = sheet(document)
            if name:
                print(name, path.stem, flush=True)
                sheets[name].append(tile(path, document, given.asset_path, given.spp))
        except SceneError as error:
            print(f"{path.stem}: {error}", flush=True)
    given.out.mkdir(parents=True, exist_ok=True)
    for name, tiles in sheets.items():
        shown = [t for t in tiles if t.picture is not None]
        if shown:
            file = given.out / f"{name}.png"
            contact_sheet(shown, name[0].upper()).save(file, optimize=True)
            print(f"{file.name}: {len(shown)} scenes, {file.stat().st_size // 1000} kB")
    (given.out / "README.md").write_text(listing(sheets, given.spp), encoding="utf-8")

