"""Kinds of pictures and meshes that readers get wrong: relume now and before, and other readers.

The pictures are those of tests/translator/test_picture_kinds.py, whose values follow from the
formats' definitions. Prints the tables of docs/files.md; readers that are not installed
(imagecodecs, tinyobjloader) are left out, and so is an earlier relume without its history.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import io
import math
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from relume.translator.images import read_image
from relume.translator.obj import read_obj
from studies import ROOT

BEFORE = "6f3b84d"
"""The last commit whose pictures were all read by Pillow, and whose polygons were all fans."""

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
ARROW = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\n"
VT = "vt 0 0\nvt 1 0\nvt 1 1\n"
FRAME = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\n"

MESHES = {
    "faces before vertices": ("f 1 2 3\n" + SQUARE, 0.5, 0),
    "`f 1//1` without any `vn`": (SQUARE + "f 1//1 2//1 3//1\n", 0.5, 0),
    "`vn 0 0 0`": (SQUARE + "vn 0 0 0\nf 1//1 2//1 3//1\n", 0.5, 0),
    "`vn nan nan nan`": (SQUARE + "vn nan nan nan\nf 1//1 2//1 3//1\n", 0.5, 0),
    "`vn` of length 1e200": (SQUARE + "vn 0 0 1e200\nf 1//1 2//1 3//1\n", 0.5, 0),
    "`vt` with one number": (SQUARE + "vt 0.5\nf 1/1 2/1 3/1\n", 0.5, 1),
    "`vt nan 0`": (SQUARE + "vt nan 0\nf 1/1 2/1 3/1\n", 0.5, 1),
    "one corner without `vt`": (SQUARE + VT + "f 1/1 2/2 3/3\nf 1/1 3 4/3\n", 1.0, 1),
    "a face of two corners": (SQUARE + "f 1 2\nf 1 2 3\n", 0.5, 0),
    "a vertex colour `nan`": (SQUARE + "v 2 2 2 nan 0 0\nf 1 2 3\n", 0.5, 0),
    "concave, area 10": (ARROW + "f 1 2 3 4 5\n", 10.0, 0),
    "concave, from another corner": (ARROW + "f 3 4 5 1 2\n", 10.0, 0),
    "a corner named twice": (ARROW + "f 1 2 3 4 4 5\n", 10.0, 0),
    "a hole with a bridge, area 12": (FRAME + "f 1 2 3 4 1 5 6 7 8 5\n", 12.0, 0),
    "negative indices": (SQUARE + "f -4 -3 -2\nv 9 9 9\nf -5 -3 -2\n", 1.0, 0),
    "line ends of CR alone": ((SQUARE + "f 1 2 3\n").replace("\n", "\r"), 0.5, 0),
    "a comment behind a face": (SQUARE + "f 1 2 3 # four\n", 0.5, 0),
    "a face that a backslash continues": (SQUARE + "f 1 2 \\\n3\n", 0.5, 0),
}
"""Text, area and number of triangles with texture coordinates at all corners, by kind."""

Found = tuple[float, int]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options."""
    parser.add_argument("--before", default=BEFORE, help=f"a commit to compare with ({BEFORE})")


def run(options: argparse.Namespace) -> int:
    """Print both tables.

    Returns:
        The number of kinds that are not read rightly now.
    """
    warnings.simplefilter("ignore")
    with earlier(options.before) as module, tempfile.TemporaryDirectory() as folder:
        readers: dict[str, Callable[[Path], Any]] = {}
        if module is not None:
            readers["before"] = pictures_by(module("images"))
        readers |= {"relume": by_relume, "Pillow": by_pillow, "OpenImageIO": by_openimageio}
        if importlib.util.find_spec("imagecodecs"):
            readers["imagecodecs"] = by_imagecodecs
        wrong = table(readers, picture_rows(Path(folder)))
        print()
        readers = {} if module is None else {"before": mesh_by(module("obj").read_obj)}
        readers |= {"relume": mesh_by(read_obj), "trimesh": by_trimesh}
        if importlib.util.find_spec("tinyobjloader"):
            readers["tinyobjloader"] = by_tinyobjloader
        return wrong + table(readers, mesh_rows(Path(folder)))


@contextmanager
def earlier(commit: str) -> Iterator[Callable[[str], Any] | None]:
    """A function from the name of a module to what it was at a commit; None without such one."""
    files = ("images", "radiance", "obj", "obj_model", "obj_scan", "obj_text")
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / "relume_before"
        package.mkdir()
        (package / "__init__.py").touch()
        for name in files:
            command = ["git", "show", f"{commit}:translator/{name}.py"]
            found = subprocess.run(command, cwd=ROOT, capture_output=True)
            if found.returncode:
                yield None
                return
            (package / f"{name}.py").write_bytes(found.stdout)
        sys.path.insert(0, folder)
        try:
            yield lambda name: importlib.import_module(f"relume_before.{name}")
        finally:
            sys.path.remove(folder)


Row = tuple[str, Path, Callable[[Any], str]]


def table(readers: dict[str, Callable[[Path], Any]], rows: Iterator[Row]) -> int:
    """Print what readers say to files; how many relume does not read rightly."""
    print("| kind | " + " | ".join(readers) + " |")
    print("|---|" + "---|" * len(readers))
    wrong = 0
    for kind, path, judge in rows:
        words = {}
        for name, reader in readers.items():
            try:
                words[name] = judge(reader(path))
            except NotImplementedError:
                words[name] = "–"
            except Exception:  # readers raise anything
                words[name] = "refused"
        wrong += words["relume"] != "right"
        print(f"| {kind} | " + " | ".join(words.values()) + " |", flush=True)
    return wrong


def picture_rows(folder: Path) -> Iterator[Row]:
    """The kinds of pictures."""
    source = ROOT / "tests" / "translator" / "test_picture_kinds.py"
    spec = importlib.util.spec_from_file_location("picture_kinds", source)
    assert spec is not None and spec.loader is not None
    kinds = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(kinds)
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n"
    eight = [(255, 127.5, 63.75)] * 7  # in 255ths, as those of the tests
    last = tuple(x / 128 * 255 for x in (10, 20, 30))
    rows = [*eight, last, *eight, eight[0]]
    mixed = {"Radiance, a flat row, one of runs": (head + kinds.FLAT + kinds.PACKED, rows, None)}
    for name, (data, pixels, alpha) in {**kinds.PICTURES, **mixed}.items():
        start = {b"BM": "bmp", b"\x89P": "png", b"#?": "hdr"}
        ending = start.get(data[:2], "ppm" if data[:1] == b"P" else "tga")
        path = folder / f"picture.{ending}"
        path.write_bytes(data)
        color = np.array([x if isinstance(x, tuple) else (x,) * 3 for x in pixels]) / 255

        def judge(found: Any, color: np.ndarray = color, alpha: Any = alpha) -> str:
            rgb, opacity = found
            if alpha is not None and opacity is None:
                return "opaque"
            error = np.abs(rgb.reshape(-1, 3) - color).max()
            if alpha is not None:
                error = max(error, np.abs(opacity.ravel() - alpha).max())
            return "right" if error < 1e-6 else "8 bits" if error <= 1 / 255 else "wrong"

        yield name, path, judge


def pictures_by(module: Any) -> Callable[[Path], Any]:
    """Reads pictures as a module of relume does."""

    def read(path: Path) -> Any:
        image = module.read_image(path)
        return image.rgb, image.alpha

    return read


def by_relume(path: Path) -> Any:
    """Colours and opacity."""
    image = read_image(path)
    return image.rgb, image.alpha


def by_pillow(path: Path) -> Any:
    """Colours and opacity; words where Pillow keeps them."""
    from PIL import Image

    with Image.open(io.BytesIO(path.read_bytes())) as picture:
        if picture.mode.startswith("I"):
            return np.repeat(np.asarray(picture)[..., None] / 65535, 3, axis=2), None
        pixels = np.asarray(picture.convert("RGBA")) / 255
    return pixels[..., :3], pixels[..., 3]


def by_openimageio(path: Path) -> Any:
    """Colours and opacity as they are stored."""
    import OpenImageIO as oiio

    raw = oiio.ImageSpec()
    raw.attribute("oiio:UnassociatedAlpha", 1)
    raw.attribute("oiio:RawColor", 1)
    file = oiio.ImageInput.open(str(path), raw)
    if file is None:
        raise ValueError(oiio.geterror())
    pixels = file.read_image("float")
    if pixels is None:
        raise ValueError(file.geterror())
    return split(pixels)


def by_imagecodecs(path: Path) -> Any:
    """Colours and opacity of the formats that it has."""
    import imagecodecs

    if path.suffix not in (".bmp", ".png"):
        raise NotImplementedError("no such format")
    pixels = getattr(imagecodecs, f"{path.suffix[1:]}_decode")(path.read_bytes())
    scale = 255 if pixels.dtype == np.uint8 else 65535
    return split(pixels.reshape(*pixels.shape[:2], -1) / scale)


def split(pixels: np.ndarray) -> Any:
    """Colours and opacity of 1 to 4 channels."""
    channels = pixels.shape[2]
    color = pixels[..., :3] if channels > 2 else np.repeat(pixels[..., :1], 3, axis=2)
    return color, pixels[..., -1] if channels in (2, 4) else None


def mesh_rows(folder: Path) -> Iterator[Row]:
    """The kinds of meshes."""
    path = folder / "mesh.obj"
    for name, (text, area, textured) in MESHES.items():
        path.write_bytes(text.encode())

        def judge(found: Found, area: float = area, textured: int = textured) -> str:
            if not math.isclose(found[0], area, rel_tol=1e-6):
                return f"area {found[0]:.3g}"
            return "right" if found[1] == textured else f"{found[1]} textured"

        yield name, path, judge


def area_of(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Total area of triangles."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def mesh_by(read: Callable[[Path], Any]) -> Callable[[Path], Found]:
    """Area and textured triangles as relume reads them; a triangle at (0, 0) has no texture."""

    def found(path: Path) -> Found:
        mesh = read(path)
        groups = [(g.vertices, g.faces, g.uv) for g in mesh.groups]
        area = sum(area_of(v, f) for v, f, _ in groups)
        given = [uv[f] for _, f, uv in groups if uv is not None]
        noted = sum("not all corners name" in str(text) for _, text in mesh.notes)
        normals = [g.normals for g in mesh.groups if g.normals is not None]
        if not all(np.allclose(np.linalg.norm(n, axis=1), 1) for n in normals):
            raise ValueError("normals that are no unit vectors")
        return area, max(sum(len(uv) for uv in given) - noted, 0)

    return found


def by_trimesh(path: Path) -> Found:
    """Area and textured triangles."""
    import trimesh

    mesh = trimesh.load(path, process=False, maintain_order=True, skip_materials=True)
    meshes = list(mesh.geometry.values()) if hasattr(mesh, "geometry") else [mesh]
    area = sum(float(part.area) for part in meshes)
    return area, sum(len(m.faces) for m in meshes if getattr(m.visual, "uv", None) is not None)


def by_tinyobjloader(path: Path) -> Found:
    """Area and textured triangles."""
    import tinyobjloader

    reader = tinyobjloader.ObjReader()
    if not reader.ParseFromFile(str(path), tinyobjloader.ObjReaderConfig()):
        raise ValueError(reader.Error())
    vertices = np.array(reader.GetAttrib().vertices).reshape(-1, 3)
    corners = [
        (corner.vertex_index, corner.texcoord_index)
        for shape in reader.GetShapes()
        for corner in shape.mesh.indices
    ]
    triangles = np.array(corners).reshape(-1, 3, 2)
    return area_of(vertices, triangles[..., 0]), int((triangles[..., 1] >= 0).all(axis=1).sum())
