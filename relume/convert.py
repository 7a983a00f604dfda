"""`relume convert`: a scene as Mitsuba XML with its files, or as Python source."""

from __future__ import annotations

import errno
import functools
import shlex
import shutil
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from relume.loading import for_mitsuba, translated, translated_with_inputs, usable_variant
from relume.options import RenderOptions
from relume.output import OutputError, replacing
from relume.session import exr_threads, variant_context
from relume.translator.media import AROUND, REFERENCE
from relume.translator.plan import RenderPlan
from relume.translator.scene import OWN_PLUGINS
from relume.translator.scene_values import Color, Matrix, Mesh, Picture, mitsuba_mesh, to_mitsuba
from relume.version import version

KINDS = {
    "bsdf": "BSDF",
    "emitter": "Emitter",
    "integrator": "Integrator",
    "phase function": "PhaseFunction",
    "sampler": "Sampler",
    "sensor": "Sensor",
    "texture": "Texture",
}
"""Members of `mi.ObjectType` by the kinds of `OWN_PLUGINS`."""

LACKING = (
    "light that glass and mirrors send on from lamps without size is in no picture by the "
    "integrator of the converted scene, nor by Mitsuba's own; the integrator bdpt finds it"
)
"""What is said of scenes that relume renders by `bdpt` alone."""


def write_xml(
    path: str | Path,
    out: str | Path,
    dialect: str = "manual",
    asset_path: Sequence[str | Path] = (),
    stand_ins: bool = False,
    tell: Callable[[str], object] | None = None,
) -> list[Path]:
    """Convert a scene file to XML, which `relume.render` and the command render.

    `mi.load_file` loads it after `import relume`, with `optimize=False`: see `relume.to_dict`.

    Meshes and pictures are written into the folder `<stem>_files` beside the XML, so both can be
    moved together.

    Args:
        path: the scene file.
        out: the XML file.
        dialect: as `RenderOptions`.
        asset_path: as `RenderOptions`.
        stand_ins: as `RenderOptions`.
        tell: gets notes on the converted scene, which stand in the file, too.

    Returns:
        Paths of the files written, the XML first.

    Raises:
        SceneError: errors of the file.
        OutputError: the name does not end with `.xml`, or a file of that name is one that the scene
            reads; nothing was written then.
        OSError: a file cannot be written.
    """
    options = RenderOptions(dialect=dialect, asset_path=asset_path, stand_ins=stand_ins)
    out = Path(out)
    if out.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, expected an XML file", str(out))
    if out.suffix.lower() != ".xml":
        raise OutputError(f"cannot write {out}: the name of an XML file ends with .xml")
    translation, inputs = translated_with_inputs(path, options)
    translation = for_mitsuba(translation)
    files = _Files(out)
    scene = files.externalise(translation.scene)
    inputs.refuse(out, *files.paths)
    out.parent.mkdir(parents=True, exist_ok=True)
    with variant_context(usable_variant(translation.plan)):
        files.write()
        state = mi.parser.parse_dict(mi.parser.ParserConfig(mi.variant()), to_mitsuba(scene))
        name_kinds(state)
        # Of a scene inside another Mitsuba 3.9 writes no type, which its own reader asks for.
        xml = mi.parser.write_string(state).replace("<scene name=", '<scene type="scene" name=')
        text = header(path, out, translation.plan) + xml
        with replacing(out) as temporary:
            temporary.write_text(text, encoding="utf-8")
    if tell:
        for note in notes(translation.plan):
            tell(note)
    return [out, *files.paths]


def notes(plan: RenderPlan) -> list[str]:
    """What is to be said of the converted scene of a plan."""
    return [] if plan.integrator in plan.candidates else [LACKING]


def header(path: str | Path, out: Path, plan: RenderPlan) -> str:
    """The comment at the beginning of an XML file: what it needs, and what renders it."""
    plugins = f"the plugins {', '.join(plan.plugins)} of relume" if plan.plugins else "no plugin"
    text = f"""
  Made of {Path(path).name} by relume {version()}. Needs Mitsuba 3.9, the variant {plan.variant} and
  {plugins}. To render it:

      {render_command(out.name)}

  In Python, import relume before mitsuba, set the variant {plan.variant}, and load it by
  mi.load_file("{out.name}", optimize=False). The command `mitsuba` knows none of relume's plugins.
"""
    for note in notes(plan):
        text += f"\n{textwrap.indent(textwrap.fill(f'Note: {note}.', 96), '  ')}\n"
    # Two hyphens would end the comment.
    return f"<!--{text.replace('--', '- -')}-->\n"


def render_command(out: str | Path) -> str:
    """The command that renders a converted scene."""
    return shlex.join(["relume", "render", str(out), "-o", str(Path(out).with_suffix(".exr"))])


def name_kinds(state: Any) -> None:
    """Tell Mitsuba's XML writer which kind of object a plugin written in Python is.

    Args:
        state: `mi.parser.ParserState` of the scene.
    """
    for node in state.nodes:
        kind = OWN_PLUGINS.get(node.props.plugin_name())
        if kind is not None:
            node.type = getattr(mi.ObjectType, KINDS[kind])


class _Files:
    """The files that an XML file refers to.

    Args:
        out: the XML file.
    """

    def __init__(self, out: Path) -> None:
        self.folder = out.with_name(out.stem + "_files")
        self._writers: dict[str, Callable[[Path], object]] = {}
        self._copies: dict[str, str] = {}

    @property
    def paths(self) -> list[Path]:
        """Paths of the files."""
        return [self.folder / name for name in self._writers]

    def write(self) -> None:
        """Write them; the folder is made."""
        for path, write in zip(self.paths, self._writers.values(), strict=True):
            path.parent.mkdir(exist_ok=True)
            write(path)

    def _named(self, name: str, write: Callable[[Path], object]) -> str:
        """A file that `write` is to write; returns its name for the XML."""
        stem, extension, number = Path(name).stem, Path(name).suffix, 1
        taken = {name.casefold() for name in self._writers}
        while name.casefold() in taken:
            number += 1
            name = f"{stem}-{number}{extension}"
        self._writers[name] = write
        return f"{self.folder.name}/{name}"

    def externalise(self, value: Any, name: str = "scene") -> Any:
        """The dictionary with meshes and pictures replaced by file names."""
        if not isinstance(value, dict):
            return value
        if isinstance(value.get("mesh"), Mesh):
            rest = {k: v for k, v in value.items() if k not in ("type", "mesh")}
            shape: dict[str, Any] = {"type": "ply", "filename": self.mesh(value["mesh"], name)}
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
        """A PLY file of a mesh."""
        return self._named(
            f"{name}.ply", lambda path: mitsuba_mesh({"mesh": mesh}).write_ply(str(path))
        )

    def picture(self, picture: Picture, name: str) -> str:
        """An EXR file of the pixels of a texture."""

        def write(path: Path) -> None:
            with exr_threads():
                mi.Bitmap(np.asarray(picture.pixels, np.float32)).write(str(path))

        return self._named(f"{name}.exr", write)

    def copied(self, file: str) -> str:
        """A copy of a file that the scene names."""
        if file not in self._copies:
            write = functools.partial(shutil.copyfile, file)
            self._copies[file] = self._named(Path(file).name, write)
        return self._copies[file]


def python_source(
    path: str | Path,
    dialect: str = "manual",
    asset_path: Sequence[str | Path] = (),
    stand_ins: bool = False,
    tell: Callable[[str], object] | None = None,
) -> str:
    """Python source that builds the dictionary of a scene file for `mi.load_dict`.

    Meshes and pictures appear as calls with their arrays. Arguments are those of `write_xml`.
    """
    options = RenderOptions(dialect=dialect, asset_path=asset_path, stand_ins=stand_ins)
    translation = for_mitsuba(translated(path, options))
    said = notes(translation.plan)
    if tell:
        for note in said:
            tell(note)
    comments = "".join(f"{textwrap.indent(textwrap.fill(note, 96), '# ')}\n\n" for note in said)
    return (
        "import relume  # first: it sets up LLVM and registers the plugins\n\n"
        "import mitsuba as mi\nimport numpy as np\n\n"
        "from relume.translator.scene_values import Mesh, Picture, mitsuba_mesh\n\n"
        f"mi.set_variant({translation.plan.variant!r})\n\n{comments}"
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
