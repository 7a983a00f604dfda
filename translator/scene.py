"""Document to scene: a dictionary of plain values, the plan, and the account of every line."""

import copy
from dataclasses import dataclass

import numpy as np

from translator import account, camera, lights, materials, plan, surfaces
from translator.assets import Assets
from translator.diagnostics import SceneError
from translator.dialects import DIALECTS
from translator.document import Document
from translator.neutral import Picture, to_mitsuba
from translator.shapes import MeshFile

OWN_PLUGINS = {
    "ward": "bsdf",
    "phong": "bsdf",
    "schlickglass": "bsdf",
    "parallelbeam": "emitter",
    "falloffspot": "emitter",
    "twosidedarea": "emitter",
    "ibldome": "emitter",
    "dispersivepath": "integrator",
    "sensorresponse": "integrator",
    "screencamera": "sensor",
}
"""Plugins that relume brings to Mitsuba, with the kind of each."""


@dataclass(frozen=True)
class Translation:
    """A translated document.

    Attributes:
        document: copy of the document; its `source.all` tells what each line became.
        scene: the scene as plain values; `dictionary()` is what Mitsuba takes.
        plan: how it is rendered.
    """

    document: Document
    scene: dict
    plan: plan.Plan

    def dictionary(self):
        """The dictionary for `mi.load_dict`; a variant must be set."""
        return to_mitsuba(self.scene)

    def status(self):
        """`ok`, or `unsupported` if any line is."""
        outcomes = {report.outcome for report in self.document.source.all}
        return "unsupported" if "unsupported" in outcomes else "ok"


def translate(document, dialect="manual", asset_path=()):
    """Translate a document.

    Args:
        document: the `Document`; left as it is.
        dialect: `manual` (default) or `prender`, to match an old picture (see `dialects`).
        asset_path: folders in which files that a scene names are looked for.

    Returns:
        The `Translation`.

    Raises:
        ValueError: unknown dialect.
        SceneError: with every file that is missing (kind `asset`) and every object that lacks what
            its surface needs.
    """
    if dialect not in DIALECTS:
        raise ValueError(f"unknown dialect {dialect!r}, expected one of {', '.join(DIALECTS)}")
    document = _private_copy(document)
    if dialect == "prender" and "luminance_cutoff" not in document.source.reports:
        document.luminance_cutoff = document.luminance_cutoff or 0.025
    assets = Assets(document, asset_path)
    problems = assets.problems() + materials.check(document)
    if problems:
        raise SceneError(document.path, problems)
    account.account(document)
    camera.account(document, dialect)
    dispersive = dialect == "manual" and any(b.reflection.dispersion for b in document.objects)
    spp = document.sampling * document.supersampling**2
    integrator, reason = plan.integrator(document, spp, dispersive)
    scene = {"type": "scene", "integrator": integrator, "sensor": camera.sensor(document, dialect)}
    scene |= _objects(document, dialect)
    if (background := lights.background(document)) is not None:
        scene["background"] = background
    made = plan.plan(document, scene, OWN_PLUGINS, dispersive, reason)
    return Translation(document, scene, made)


def _private_copy(document):
    """A copy whose line reports can be changed; reports of blocks are those of the document."""
    return copy.deepcopy(document)


def _objects(document, dialect):
    """Shapes and emitters of all objects, named by the line of their block."""
    entries = {}
    shapes = surfaces.Shapes(document, camera.view(document, dialect).origin, dialect)
    for index, block in enumerate(document.objects):
        name = f"object_{block.source.line()}"
        matrix = shapes.matrices[index]
        emitters = lights.standalone(block, matrix, dialect)
        for emitter in emitters:
            entries[f"{name}_light"] = emitter
        if not emitters and not left_out(block):
            entries[name] = surface(shapes, index, block, matrix, dialect)
        elif emitters and shapes.shape(index, block) is not None:
            block.source.becomes("", "approximated", "the lamp itself is not shown")
    return entries


def left_out(block):
    """Whether an object is not rendered yet."""
    return isinstance(block.shape, MeshFile) or block.ibl_texture is not None


def surface(shapes, index, block, matrix, dialect):
    """The dictionary of an object's shape with its BSDF and emitter."""
    entry = shapes.shape(index, block)
    bsdf = materials.bsdf(block, dialect)
    materials.account(block)
    if entry.pop("upper_half", False):
        bsdf = {"type": "mask", "opacity": upper_half(), "bsdf": bsdf}
    entry["bsdf"] = bsdf
    if any(block.emission):
        entry = lights.area(block, entry, matrix, shapes.camera)
    return entry


def upper_half():
    """A texture that is 1 on the half of a sphere around its polar axis +Z and 0 elsewhere."""
    picture = Picture(np.array([[1.0], [0.0]], np.float32)[..., None])
    return {"type": "bitmap", "picture": picture, "raw": True, "filter_type": "nearest"}
