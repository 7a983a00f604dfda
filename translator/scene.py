"""Document to scene: the passes of a translation, each a function of the results before it.

::

    document   a copy, in which all notes are made; its files found, its keywords reported
      -> placed(document)              where the objects are, moved if single precision asks for it
      -> translate_objects(scene)      shapes and emitters, with the media and profiles they need
      -> surroundings(scene, objects)  background, and the medium around all objects
      -> plan                          integrator, variant and plugins, with reasons

docs/dev/translation.md tells more.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relume.translator import (
    camera,
    curved_space,
    dense_media,
    dipole_error,
    environment_maps,
    lights,
    line_outcomes,
    materials,
    media,
    plan,
    precision,
)
from relume.translator.assets import Assets, Find, existing
from relume.translator.candidates import candidates
from relume.translator.darkness import empty_picture_notes
from relume.translator.diagnostics import Problem, SceneError
from relume.translator.dialects import DIALECTS
from relume.translator.document import Document
from relume.translator.enclosures import medium_at_camera
from relume.translator.file_problems import picture_problem
from relume.translator.images import ImageError
from relume.translator.meshes import Meshes
from relume.translator.object_entries import Contents, PlacedScene, translate_objects
from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note
from relume.translator.recentering import recentering
from relume.translator.scene_geometry import SceneGeometry, measure
from relume.translator.scene_values import Entry, resolved, rgb, to_mitsuba
from relume.translator.shapes import MeshFile, Sphere
from relume.translator.source_text import FileName
from relume.translator.stand_ins import Workshop

OWN_PLUGINS = {
    "ward": "bsdf",
    "phong": "bsdf",
    "schlickglass": "bsdf",
    "subsurface": "bsdf",
    "shadowcatcher": "bsdf",
    "apparentlamp": "emitter",
    "domesun": "emitter",
    "parallelbeam": "emitter",
    "falloffspot": "emitter",
    "twosidedarea": "emitter",
    "ibldome": "emitter",
    "bdpt": "integrator",
    "curvedspace": "integrator",
    "dipole": "integrator",
    "dopplershift": "integrator",
    "erpt": "integrator",
    "pssmlt": "integrator",
    "randomwalk": "integrator",
    "samplescale": "integrator",
    "shadowcatching": "integrator",
    "surfacepath": "integrator",
    "hgrgb": "phase function",
    "owen": "sampler",
    "relativisticcamera": "sensor",
    "screencamera": "sensor",
    "accretiondisk": "texture",
    "spheremap": "texture",
}
"""Plugins that relume brings to Mitsuba, with the kind of each."""


PROGRAM_CUTOFF = 0.025
"""The program's own default of `luminance_cutoff` (decisions, row luminance-cutoff)."""


@dataclass(frozen=True)
class Translation:
    """A translated document.

    Attributes:
        document: copy of the document; its `lines.all` tells what each line became.
        scene: the scene as plain values; `dictionary()` is what Mitsuba takes.
        plan: how it is rendered.
        stand_ins: names of the missing files in whose places others are shown.
    """

    document: Document
    scene: Entry
    plan: plan.RenderPlan
    stand_ins: tuple[str, ...] = ()

    def dictionary(self) -> dict[str, Any]:
        """The dictionary for `mi.load_dict`; a variant must be set.

        Its `sensor` holds the medium around all objects, if there is one, as a Mitsuba object.
        """
        return to_mitsuba(resolved(self.scene, media.AROUND))

    def picture_notes(self) -> tuple[Note, ...]:
        """What is to be said of the picture as a whole: that it will be black or empty."""
        apart = ("sensor", "integrator", media.AROUND)
        entries = [
            entry
            for name, entry in self.scene.items()
            if isinstance(entry, dict) and name not in apart
        ]
        beyond = curved_space.beyond(self.scene["integrator"])
        notes = empty_picture_notes([*entries, *beyond])
        # Where space bends, the background alone is a picture, too.
        bends = "curvedspace" in self.plan.plugins
        shown = [note for note in notes if not (bends and note.code == "no-surface")]
        return (*missing_variables(self.document), *shown)

    def path_traced(self) -> Translation:
        """The translation with notes on the light that only `bdpt` would find.

        For renders by another integrator, and for what is made of the scene's dictionary.
        """
        document = copy.deepcopy(self.document)
        shapes = (entry for entry in self.scene.values() if isinstance(entry, dict))
        lights.report_point_like(document, shapes)
        return dataclasses.replace(self, document=document)

    def status(self) -> str:
        """`ok`, or `unsupported` if any line is."""
        outcomes = {report.outcome for report in self.document.lines.all}
        return "unsupported" if "unsupported" in outcomes else "ok"


def translate(
    document: Document,
    dialect: str = "manual",
    asset_path: Iterable[FileName] = (),
    stand_ins: bool = False,
) -> Translation:
    """Translate a document.

    Args:
        document: the `Document`; left as it is.
        dialect: `manual` (default) or `prender`, to match an old picture (see `dialects`).
        asset_path: folders in which files that a scene names are looked for.
        stand_ins: whether something is shown in the place of missing pictures (see `stand_ins`).

    Returns:
        The `Translation`.

    Raises:
        ValueError: unknown dialect.
        SceneError: with every file that is missing or broken (kind `asset`) and every object that
            lacks what its surface needs.
    """
    if dialect not in DIALECTS:
        raise ValueError(f"unknown dialect {dialect!r}, expected one of {', '.join(DIALECTS)}")
    document = working_copy(document, dialect)
    if not stand_ins:
        return with_assets(document, dialect, Assets(document, asset_path))
    with tempfile.TemporaryDirectory() as folder:
        assets = Assets(document, asset_path, Workshop(Path(folder)))
        made = with_assets(document, dialect, assets)
    return dataclasses.replace(made, stand_ins=tuple(assets.stand_ins))


def with_assets(document: Document, dialect: str, assets: Assets) -> Translation:
    """The translation of a working copy whose files are found; arguments and errors as
    `translate`."""
    if problems := assets.problems() + materials.missing_parameters(document):
        raise SceneError(document.path, problems)
    line_outcomes.report_keywords(document, dialect)
    camera.report_camera(document, dialect)
    curved_space.report_bending(document, dialect)
    sides = [
        placed(side, dialect, assets.path) for side in curved_space.sides(document, dialect)
    ]
    translated = [translate_objects(side) for side in sides]
    problems = [problem for _, found in translated for problem in found]
    contents = [
        (objects, translate_surroundings(side, objects, problems))
        for side, (objects, _) in zip(sides, translated, strict=True)
    ]
    if len(sides) == 1:
        return assembled(sides[0], *contents[0])
    found = contents[1][0].entries | contents[1][1].entries
    apart = curved_space.other_side(document, sides[1].document, found, dialect)
    seen = sides[apart.get("start_side", 1) - 1].document
    return assembled(sides[0], *contents[0], seen, apart)


def missing_variables(document: Document) -> list[Note]:
    """A note on the variables that a file takes by `%NAME%`, if any of them is not set."""
    missing = [name for name, is_set in document.taken.items() if not is_set]
    if not missing:
        return []
    names = ", ".join(document.taken)
    return [make_note("variables-taken", names=names, missing=", ".join(missing))]


def working_copy(document: Document, dialect: str) -> Document:
    """A copy of a document for notes on its lines, with the defaults of the dialect."""
    document = copy.deepcopy(document)
    curved_space.settle(document, dialect)
    if dialect == "prender" and not document.lines.is_set("luminance_cutoff"):
        document.luminance_cutoff = document.luminance_cutoff or PROGRAM_CUTOFF
    return document


def placed(document: Document, dialect: str, find: Find) -> PlacedScene:
    """A document where single precision serves it, with all that its objects are made from.

    Args:
        document: the document.
        dialect: `manual` or `prender`.
        find: function from the name of a file to its path.
    """
    spectral = dialect == "manual" and any(b.reflection.dispersion for b in document.objects)
    meshes = Meshes(find, spectral)
    geometry = measure(document, dialect, meshes, find)
    flat = curved_space.curvature(document) is None
    if move := recentering(geometry.inner.center, geometry.shown, enlarge=flat):
        document = move.apply(document, dialect)
        geometry = measure(document, dialect, meshes, find)
    precision.report_thin_glass(document, geometry.matrices)
    precision.report_small_lamps(document, geometry.matrices)
    errors = dipole_errors(document, geometry, meshes, find, dialect)
    why = obstacle_to_dipole(document, geometry, meshes, find, spectral)
    return PlacedScene(
        document=document,
        dialect=dialect,
        spectral=spectral,
        find=find,
        meshes=meshes,
        geometry=geometry,
        medium=media.surrounding_medium(document),
        domes_by_direction=environment_maps.domes_by_direction(document, geometry),
        obstacle_to_dipole=why or dipole_error.obstacle(document, errors),
        dipole_errors=errors,
    )


def dipole_errors(
    document: Document, geometry: SceneGeometry, meshes: Meshes, find: Find, dialect: str
) -> dict[int, dipole_error.DipoleError]:
    """How far the dipole is off in the objects that it may render, by their index.

    Empty in the dialect `prender`, where the picture of the program's own dipole is wanted.
    """
    found = {}
    for index, block in enumerate(document.objects if dialect == "manual" else ()):
        if not (block.reflection.subsurface and media.uses_dipole(block)):
            continue
        matrix, radius = geometry.matrices[index], math.inf
        if isinstance(block.shape, Sphere):
            radius = dipole_error.ball_radius(block.shape.radius, matrix[:3, :3])
        elif isinstance(block.shape, MeshFile):
            surfaces = meshes.surfaces(existing(find, block.shape.file), matrix)
            radius = dipole_error.mesh_radius(surfaces)
        if (error := dipole_error.error_of(block, radius)) is not None:
            found[index] = error
    return found


def obstacle_to_dipole(
    document: Document, geometry: SceneGeometry, meshes: Meshes, find: Find, spectral: bool
) -> str | None:
    """Code of the reason why objects that ask for the dipole are simulated; None if they are not.

    Args:
        document: the document.
        geometry: where its objects are.
        meshes: reads the files of mesh objects.
        find: function from the name of a file to its path.
        spectral: whether the scene is rendered by wavelength.
    """
    if (reason := media.obstacle_to_dipole(document, spectral)) is not None:
        return reason
    for block, matrix in zip(document.objects, geometry.matrices, strict=True):
        if not (block.reflection.subsurface and media.uses_dipole(block)):
            continue
        if isinstance(block.shape, MeshFile):
            file = existing(find, block.shape.file)
            inside = meshes.enclose(file, matrix, geometry.camera)
        else:
            inside = isinstance(block.shape, Sphere) and lights.encloses(
                block.shape, matrix, geometry.camera
            )
        if inside:
            return "simulated-around-camera"
    return None


def translate_surroundings(
    scene: PlacedScene, objects: Contents, problems: Sequence[Problem]
) -> Contents:
    """The background and the shape that ends the medium around all objects.

    Args:
        scene: the scene.
        objects: what its objects became.
        problems: what is wrong with their files.

    Raises:
        SceneError: with these problems, and that of the picture of the background.
    """
    document = scene.document
    try:
        background = environment_maps.background(document, scene.find)
    except ImageError as error:
        problems = [*problems, picture_problem(document, scene.find, error)]
    if problems:
        raise SceneError(document.path, problems)
    background = background or lights.background(document)
    entries: dict[str, Entry] = {}
    if background is not None and scene.domes_by_direction:
        document.lines.becomes("background", "background-hidden")
        document.lines.becomes("background_texture", "background-texture-hidden")
    elif background is not None:
        entries["background"] = background
    elif objects.entries and not has_lights_to_sample(objects.entries.values()):
        # Mitsuba refuses scenes whose lights all have the weight 0, as ambient light has.
        entries["background"] = {"type": "constant", "radiance": rgb((0, 0, 0))}
    if scene.medium is None:
        return Contents(entries)
    ball = scene.geometry.medium_ball()
    entries[media.BOUNDARY] = media.boundary(ball, document)
    dense_media.report_long_walks(
        document.lines, "participating_media", scene.medium, ball.radius, document.depth
    )
    return Contents(entries, (scene.medium,))


def has_lights_to_sample(entries: Iterable[Entry]) -> bool:
    """Whether there is a light besides the ambient one, or no ambient one either."""
    # Entries without a BSDF are lights themselves.
    shown = [entry for entry in entries if "emitter" in entry or "bsdf" not in entry]
    emitters = [entry.get("emitter", entry) for entry in shown]
    return not emitters or any(emitter.get("sampling_weight") != 0 for emitter in emitters)


def assembled(
    scene: PlacedScene,
    objects: Contents,
    surroundings: Contents,
    seen: Document | None = None,
    apart: Entry | None = None,
) -> Translation:
    """The translation: sensor, integrator, objects and surroundings, and the plan to render it.

    Args:
        scene: the scene, on this side of a wormhole.
        objects: what its objects became.
        surroundings: what is around them.
        seen: the document of the side that the camera is on; None for that of the scene.
        apart: parameters of `curvedspace` that tell what is on the other side, if there is one.
    """
    document, dialect = scene.document, scene.dialect
    contents = Contents.of_all([objects, surroundings])
    profile = media.PROFILES[dialect] if contents.dipole else None
    types = plan.plugin_types(contents.entries)
    wrapped = functools.partial(curved_space.wrapped, document, dialect, apart or {})
    followed = dense_media.why_followed(
        scene.medium,
        scene.geometry.medium_ball().radius,
        document.depth,
        contents.entries.values(),
    )
    integrator, reason = plan.integrator(
        document,
        dialect,
        scene.spectral,
        types,
        contents.media,
        profile,
        wrapped,
        inside=bool(objects.media),
        followed=followed,
    )
    may_render = candidates(integrator, contents.entries.values())
    if "bdpt" not in may_render.names:
        lights.report_point_like(document, contents.entries.values())
    sensor = camera.sensor(seen or document, dialect)
    around: Entry = {}
    if scene.medium is not None:
        around = {media.AROUND: scene.medium.entry()}
    at_camera = medium_at_camera(objects.enclosures, scene.medium)
    if at_camera is not None:
        around_too = at_camera is scene.medium
        sensor["medium"] = media.REFERENCE if around_too else at_camera.entry()
    entries = {"type": "scene", **around, "integrator": integrator, "sensor": sensor}
    if contents.media and "randomwalk" not in plan.plugin_types(integrator):
        # The stock integrators for media let lamps shine where they are not.
        entries |= {k: lights.dimmed(e, scene.spectral) for k, e in contents.entries.items()}
    else:
        entries |= contents.entries
    render_plan = plan.render_plan(
        document, entries, OWN_PLUGINS, scene.spectral, reason, may_render
    )
    return Translation(document, entries, render_plan)
