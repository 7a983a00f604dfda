"""`relume convert`: a scene as Mitsuba XML with its files, or as Python source."""

from __future__ import annotations

import errno
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from relume import translator
from relume.application import read
from relume.loading import for_mitsuba, usable_variant
from relume.session import exr_threads, variant_context
from relume.translator.media import AROUND, REFERENCE
from relume.translator.scene import OWN_PLUGINS
from relume.translator.scene_values import Color, Matrix, Mesh, Picture, mitsuba_mesh, to_mitsuba


def write_xml(
    path: str | Path,
    out: str | Path,
    dialect: str = "manual",
    asset_path: Sequence[str | Path] = (),
) -> list[Path]:
    """Convert a scene file to XML that `mi.load_file` loads after `import relume`.

    Load it with `optimize=False`: see `relume.to_dict`.

    Meshes and pictures are written into the folder `<stem>_files` beside the XML, so both can be
    moved together.

    Args:
        path: the scene file.
        out: the XML file.
        dialect: as `RenderOptions`.
        asset_path: as `RenderOptions`.

    Returns:
        Paths of the files written, the XML first.

    Raises:
        SceneError: errors of the file.
        OSError: a file cannot be written.
    """
    translation = _translated(path, dialect, asset_path)
    out = Path(out)
    if out.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, expected an XML file", str(out))
    out.parent.mkdir(parents=True, exist_ok=True)
    with variant_context(usable_variant(translation.plan)):
        files = _Files(out)
        scene = files.externalise(translation.scene)
        state = mi.parser.parse_dict(mi.parser.ParserConfig(mi.variant()), to_mitsuba(scene))
        name_kinds(state)
        out.write_text(mi.parser.write_string(state), encoding="utf-8")
    return [out, *files.written]


def _translated(
    path: str | Path, dialect: str, asset_path: Sequence[str | Path]
) -> translator.Translation:
    return for_mitsuba(translator.translate(read(path), dialect, asset_path))


def name_kinds(state: Any) -> None:
    """Tell Mitsuba's XML writer which kind of object a plugin written in Python is.

    Args:
        state: `mi.parser.ParserState` of the scene.
    """
    kinds = {
        "bsdf": "BSDF",
        "emitter": "Emitter",
        "integrator": "Integrator",
        "phase function": "PhaseFunction",
        "sensor": "Sensor",
    }
    for node in state.nodes:
        kind = OWN_PLUGINS.get(node.props.plugin_name())
        if kind is not None:
            node.type = getattr(mi.ObjectType, kinds[kind])


class _Files:
    """The files that an XML file refers to.

    Args:
        out: the XML file.
    """

    def __init__(self, out: Path) -> None:
        self.out = out
        self.folder = out.with_name(out.stem + "_files")
        self.written: list[Path] = []
        self.copies: dict[str, str] = {}

    def path(self, name: str) -> tuple[Path, str]:
        """A file of the folder, which is made; returns the path and the name for the XML."""
        self.folder.mkdir(exist_ok=True)
        self.written.append(self.folder / name)
        return self.written[-1], f"{self.folder.name}/{name}"

    def externalise(self, value: Any, name: str = "scene") -> Any:
        """The dictionary with meshes and pictures replaced by file names."""
        if not isinstance(value, dict):
            return value
        if isinstance(value.get("mesh"), Mesh):
            rest = {k: v for k, v in value.items() if k not in ("type", "mesh")}
            shape = {"type": "ply", "filename": self.mesh(value["mesh"], name)}
            # Where a file has no normals Mitsuba makes smooth ones unless told not to.
            shape |= {} if value["mesh"].normals is not None else {"face_normals": True}
            return shape | {k: self.externalise(v, f"{name}_{k}") for k, v in rest.items()}
        result: dict[str, Any] = {}
        for key, item in value.items():
            if isinstance(item, Picture):
                result["filename"] = self.picture(item, name)
            elif key == "filename":
                result[key] = self.copied(item)
            else:
                result[key] = self.externalise(item, key if name == "scene" else f"{name}_{key}")
        return result

    def mesh(self, mesh: Mesh, name: str) -> str:
        path, shown = self.path(f"{name}.ply")
        mitsuba_mesh({"mesh": mesh}).write_ply(str(path))
        return shown

    def picture(self, picture: Picture, name: str) -> str:
        path, shown = self.path(f"{name}.exr")
        with exr_threads():
            mi.Bitmap(np.asarray(picture.pixels, np.float32)).write(str(path))
        return shown

    def copied(self, file: str) -> str:
        """A copy of a file that the scene names."""
        if file not in self.copies:
            name = Path(file).name
            taken = {path.name for path in self.written}
            name = f"{len(self.copies)}_{name}" if name in taken else name
            path, self.copies[file] = self.path(name)
            shutil.copyfile(file, path)
        return self.copies[file]


def python_source(
    path: str | Path, dialect: str = "manual", asset_path: Sequence[str | Path] = ()
) -> str:
    """Python source that builds the dictionary of a scene file for `mi.load_dict`.

    Meshes and pictures appear as calls with their arrays.
    """
    translation = _translated(path, dialect, asset_path)
    return (
        "import relume  # first: it sets up LLVM and registers the plugins\n\n"
        "import mitsuba as mi\nimport numpy as np\n\n"
        "from relume.translator.scene_values import Mesh, Picture, mitsuba_mesh\n\n"
        f"mi.set_variant({translation.plan.variant!r})\n\n"
        f"{_medium(translation.scene)}scene = {_source(translation.scene, 0)}\n"
    )


def _medium(scene: dict[str, Any]) -> str:
    """The line that makes the medium around all objects, which meshes take as an object alone."""
    if AROUND not in scene:
        return ""
    return f"{AROUND} = mi.load_dict({_source(scene.pop(AROUND), 0)})\n\n"


def _source(value: Any, depth: int) -> str:
    if value == REFERENCE:
        return AROUND
    if isinstance(value, dict):
        if isinstance(value.get("mesh"), Mesh):
            return f"mitsuba_mesh({_entries(value, depth)})"
        return _entries(value, depth)
    if isinstance(value, Matrix):
        rows = ", ".join(repr(list(row)) for row in value.rows)
        return f"mi.ScalarTransform4f([{rows}])"
    if isinstance(value, Color):
        return f"mi.ScalarColor3f({', '.join(map(repr, value.rgb))})"
    if isinstance(value, Picture):
        return f"mi.Bitmap({_array(np.asarray(value.pixels, np.float32))})"
    if isinstance(value, Mesh):
        fields = ((n, getattr(value, n)) for n in ("vertices", "faces", "normals", "uv", "colors"))
        return f"Mesh({', '.join(f'{n}={_array(a)}' for n, a in fields if a is not None)})"
    return repr(value)


def _entries(value: dict[str, Any], depth: int) -> str:
    inner = "    " * (depth + 1)
    lines = []
    for key, item in value.items():
        key = "bitmap" if isinstance(item, Picture) else key
        lines.append(f"{inner}{key!r}: {_source(item, depth + 1)},\n")
    return "{\n" + "".join(lines) + "    " * depth + "}"


def _array(array: np.ndarray) -> str:
    dtype = ", np.float32" if array.dtype == np.float32 else ""
    return f"np.array({array.tolist()!r}{dtype})"
