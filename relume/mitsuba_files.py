"""Mitsuba scenes (XML) as a source beside the scene files of the old language.

An XML file becomes the same plain dictionary as a translated scene, so that sessions, fingerprints,
clusters and the workbench treat both alike. What it leaves out has Mitsuba's defaults.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mitsuba as mi

from relume.fingerprint import FILE_KEY
from relume.options import RenderOptions
from relume.session import CannotRender, reason, set_variant
from relume.translator import Document, Translation, files_read
from relume.translator.outcome_rows import Note
from relume.translator.plan import METROPOLIS, RGB, SPECTRAL, RenderPlan, plugin_types
from relume.translator.scene import OWN_PLUGINS
from relume.translator.scene_values import Entry, Matrix

SUFFIX = ".xml"

DEFAULTS: dict[str, dict[str, Any]] = {
    "scene": {"integrator": {"type": "path"}},
    "sensor": {"film": {"type": "hdrfilm"}, "sampler": {"type": "independent"}},
}
"""What Mitsuba takes where a scene or a sensor has none."""

SIZE, SAMPLES = (768, 576), 4
"""Mitsuba's defaults of a film and a sampler."""


@dataclass(frozen=True)
class MitsubaFile:
    """A Mitsuba scene that was read.

    Attributes:
        path: the file.
        scene: its plain dictionary, with the entries `integrator` and `sensor`, and these with all
            that rendering changes (`film`, `sampler`).
        dispersive: whether it has glass whose index depends on the wavelength.
    """

    path: str
    scene: Entry
    dispersive: bool

    @property
    def image(self) -> tuple[int, int]:
        """Width and height of the picture [pixel]: of the film's crop window, if it has one."""
        film = self.scene["sensor"]["film"]
        width, height = (
            film.get(f"crop_{side}", film.get(side, default))
            for side, default in zip(("width", "height"), SIZE, strict=True)
        )
        return int(width), int(height)

    @property
    def spp(self) -> int:
        """Samples of a pixel."""
        return int(self.scene["sensor"]["sampler"].get("sample_count", SAMPLES))

    def resized(self, size: tuple[int, int] | None, spp: int | None) -> MitsubaFile:
        """The scene with another size of picture and number of samples, where they are not None.

        Raises:
            CannotRender: another size, and the film has a crop window.
        """
        sensor = self.scene["sensor"]
        film, sampler = dict(sensor["film"]), dict(sensor["sampler"])
        if size is not None and size != self.image:
            if any(key.startswith("crop_") for key in film):
                raise CannotRender(f"{self.path}: a film with a crop window has no other size")
            film |= {"width": size[0], "height": size[1]}
        if spp is not None:
            sampler["sample_count"] = spp
        scene = self.scene | {"sensor": sensor | {"film": film, "sampler": sampler}}
        return dataclasses.replace(self, scene=scene)

    def translation(self, options: RenderOptions) -> Translation:
        """The scene as what a translated scene file is.

        Its document has no objects; it tells the path, size, samples and name of the picture.

        Raises:
            ValueError: a dialect other than the manual's.
        """
        if options.dialect != RenderOptions().dialect:
            raise ValueError(f"dialect {options.dialect!r}: a Mitsuba scene has none")
        document = Document(
            path=self.path,
            image=self.image,
            sampling=self.spp,
            supersampling=1,
            output=f"{Path(self.path).stem}.exr",
        )
        return MitsubaTranslation(document, self.scene, plan_of(self))


class MitsubaTranslation(Translation):
    """A Mitsuba scene as what a translated scene file is."""

    def picture_notes(self) -> tuple[Note, ...]:
        """None: of Mitsuba's emitters only the loaded scene tells whether they are there."""
        return ()


def is_mitsuba_file(path: str | os.PathLike[str]) -> bool:
    """Whether a path is that of a Mitsuba scene, by its name."""
    return Path(path).suffix.lower() == SUFFIX


def plan_of(source: MitsubaFile) -> RenderPlan:
    """The plan of a scene: the variant that its plugins need, and what the file says."""
    width, height = source.image
    return RenderPlan(
        variant=_variant(source.dispersive),
        integrator=source.scene["integrator"]["type"],
        sensor=source.scene["sensor"]["type"],
        width=width,
        height=height,
        spp=source.spp,
        plugins=tuple(sorted(plugin_types(source.scene) & set(OWN_PLUGINS))),
        candidates=(source.scene["integrator"]["type"],),
        reasons={
            "variant": "glass with dispersion" if source.dispersive else "no wavelengths matter",
            "integrator": "the scene's",
            "candidates": "the scene's",
            "sensor": "the scene's",
            "spp": "its sample_count",
        },
    )


def _variant(dispersive: bool) -> str:
    return SPECTRAL if dispersive else RGB


# ---- reading


def read(
    path: str | os.PathLike[str], folders: Sequence[str | os.PathLike[str]] = ()
) -> MitsubaFile:
    """Read a Mitsuba scene.

    Args:
        path: the XML file.
        folders: in which files that it names are looked for after its own.

    Raises:
        CannotRender: it cannot be read, names a file that is not there, or has no sensor.
    """
    path = os.fspath(path)
    if not Path(path).is_file():
        raise CannotRender(f"{path}: no such file")
    with _resolving(Path(path).parent, *map(Path, folders)) as resolver:
        config = mi.parser.ParserConfig(mi.variant() or RGB)
        try:
            state = mi.parser.parse_file(config, path)
            mi.parser.transform_upgrade(config, state)
            mi.parser.transform_resolve_references(config, state)
        except RuntimeError as error:
            raise CannotRender(f"{path}: {reason(error)}") from None
        dispersive = any(_disperses(node.props) for node in state.nodes)
        _set_some_variant(_variant(dispersive))
        scene = _Reader(state, path, resolver).scene()
        documents = [Path(str(file)) for file in state.files]
        named = [found for file in documents for found in _named(file, resolver)]
    for file in (*documents, *named):
        files_read.record(file)
    return MitsubaFile(path, scene, dispersive)


def _disperses(props: Any) -> bool:
    """Whether the properties are those of glass whose index depends on the wavelength."""
    glass = props.plugin_name() == "schlickglass"
    return glass and "dispersion" in props and bool(props["dispersion"])


def _set_some_variant(name: str) -> None:
    """Set a variant, unless one is set: without, Mitsuba gives no vectors and transformations."""
    if not mi.variant():
        try:
            set_variant(name)
        except CannotRender:
            set_variant("scalar_rgb")


@contextmanager
def _resolving(*folders: Path) -> Iterator[Any]:
    """Context with Mitsuba's resolver of file names, which looks in these folders first."""
    before = mi.file_resolver()
    resolver = mi.FileResolver(before)
    for folder in reversed(folders):
        resolver.prepend(str(folder.resolve()))
    mi.set_file_resolver(resolver)
    try:
        yield resolver
    finally:
        mi.set_file_resolver(before)


def _named(file: Path, resolver: Any) -> Iterator[Path]:
    """Existing files that the attributes of an XML file name, also those that are read at once."""
    for element in ElementTree.parse(file).iter():
        for value in element.attrib.values():
            if "." in value and len(value) < 1000:
                found = Path(str(resolver.resolve(value)))
                if found.is_file():
                    yield found


ROLES = {"Integrator": "integrator", "Sensor": "sensor", "Film": "film", "Sampler": "sampler"}
"""Names in the dictionary of the first object of a kind, by which all others find it."""


NESTED = dict.fromkeys(METROPOLIS, "paths") | {"curvedspace": "nested"}
"""Names of the integrator inside others, as in translated scenes; `integrator` inside the rest."""

PARTS = {"BSDF": "bsdf", "Emitter": "emitter"}
"""Names of the first part of a kind that has none, as in translated scenes."""


class _Reader:
    """Makes the dictionary of a parsed scene.

    Args:
        state: `mi.parser.ParserState` whose references are resolved.
        path: of its file, for messages.
        resolver: of file names.
    """

    def __init__(self, state: Any, path: str, resolver: Any) -> None:
        self.nodes = list(state.nodes)
        self.path = path
        self.resolver = resolver
        self.top = self._names(0)
        self.made = set(self.top)

    def scene(self) -> Entry:
        """The dictionary of the whole scene.

        Raises:
            CannotRender: there is no sensor, or a file is missing.
        """
        scene: Entry = {"type": "scene"}
        scene |= {name: self.entry(i) for i, name in self.top.items()}
        if "sensor" not in scene:
            raise CannotRender(f"{self.path}: the scene has no sensor")
        sensor: Entry = DEFAULTS["sensor"] | scene["sensor"]
        return DEFAULTS["scene"] | scene | {"sensor": sensor}

    def entry(self, index: int) -> Entry:
        """The dictionary of a node."""
        props = self.nodes[index].props
        result: Entry = {"type": props.plugin_name()}
        if props.id() and index not in self.top:
            result["id"] = props.id()
        names = self._names(index)
        for key in props:
            value = props[key]
            if props.type(key) == mi.Properties.Type.ResolvedReference:
                name = names[value.index()]
                if name == "integrator":
                    name = NESTED.get(result["type"], name)
                result[name] = self._reference(value.index())
            else:
                result[key] = self._value(key, value)
        return result

    def _names(self, index: int) -> dict[int, str]:
        """The names of the objects inside a node, by their index: a role, an id or a parameter."""
        props = self.nodes[index].props
        result: dict[int, str] = {}
        for key in props:
            if props.type(key) == mi.Properties.Type.ResolvedReference:
                inside = props[key].index()
                node = self.nodes[inside]
                role = ROLES.get(node.type.name)
                if index and key.startswith("_arg_"):
                    role = role or PARTS.get(node.type.name)
                if role is None or role in result.values():
                    role = node.props.id() if index == 0 else key
                result[inside] = role or key
        return result

    def _reference(self, index: int) -> Entry:
        """An object inside another: at its first place as it is, elsewhere by its name."""
        if index not in self.made:
            self.made.add(index)
            return self.entry(index)
        return {"type": "ref", "id": self.top.get(index) or self.nodes[index].props.id()}

    def _value(self, key: str, value: Any) -> Any:
        name = type(value).__name__
        if key == FILE_KEY:
            return self._file(value)
        if isinstance(value, bool | int | float | str):
            return value
        if "Transform" in name:
            return Matrix.of(value.matrix)
        if "Color" in name:
            return {"type": "rgb", "value": [float(x) for x in value]}
        if "Array3" in name:
            return [float(x) for x in value]
        if name == "Spectrum":
            return {"type": "spectrum", "value": _spectrum(value)}
        raise CannotRender(f"{self.path}: {key} has a value of an unknown kind, {name}")

    def _file(self, name: str) -> str:
        found = Path(str(self.resolver.resolve(name)))
        if not found.is_file():
            raise CannotRender(f"{self.path}: no such file '{name}'; --asset-path names its folder")
        return str(found)


def _spectrum(value: Any) -> float | list[tuple[float, float]]:
    """The value of a spectrum, or its pairs of a wavelength and a value."""
    if value.is_uniform():
        return float(value.values[0])
    return [(float(w), float(v)) for w, v in zip(value.wavelengths, value.values, strict=True)]
