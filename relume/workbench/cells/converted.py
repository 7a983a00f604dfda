"""Scenes as `relume convert` writes them."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import mitsuba as mi

from relume.convert import python_source, write_xml
from relume.workbench.cells.family import Case, family
from relume.workbench.cells.scenes import diffuse, emission, sphere, text, thing

ROOF = "v -8 0 4\nv 0 0 4\nv 0 0 -4\nv -8 0 -4\nv 4 -6.9282032 4\nv 4 -6.9282032 -4\n"
FACES = "f 1 2 3 4\nf 2 5 6 3\n"


def roof() -> str:
    """A level and a steep face without normals, from above under the sun: radiances 1/2, 1/4."""
    faces = thing("objfile roof.obj", *diffuse(0.5))
    sun = thing("infinity_light 0 -1 0", emission(1), *diffuse(0))
    return text(faces, sun, camera=(0, 100, 0), up=(0, 0, -1), angle=1.5)


def ball() -> str:
    """A ball of albedo 1/2 under a sky of 1."""
    grey = sphere((0, 0, 0), 1, *diffuse(0.5))
    return text(grey, camera=(0, 0, 3), angle=2, BACKGROUND="1 1 1")


SCENES = {"flat faces": (roof, 0.375), "ball": (ball, 0.5)}


def loaded(scene: str, kind: str) -> dict[str, Any]:
    """The dictionary of a scene's text by way of a conversion."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.txt")
        path.write_text(scene, encoding="utf-8")
        Path(folder, "roof.obj").write_text(ROOF + FACES, encoding="utf-8")
        if kind == "python":
            namespace: dict[str, Any] = {}
            exec(compile(python_source(path), "scene.py", "exec"), namespace)
            world = mi.load_dict(namespace["scene"], optimize=False)
        else:
            xml = write_xml(path, Path(folder, "out", "scene.xml"))[0]
            world = mi.load_file(str(xml), optimize=False)
    lights = [light for light in world.emitters() if light.get_shape() is None]
    parts = [*world.shapes(), *lights]
    integrator = {"type": "surfacepath", "rr_depth": 9}
    head = {"type": "scene", "integrator": integrator, "sensor": world.sensors()[0]}
    return head | {f"part{k}": part for k, part in enumerate(parts)}


@family("scene, and what it becomes", ("flat faces, xml", "flat faces, python", "ball, xml",
                                       "ball, python"), "surfacepath")  # fmt: skip
def converted_scenes(which: str) -> Case:
    """Two faces of a mesh without normals, tilted by 0 and 60 degrees and seen in halves under the
    sun, have a mean radiance of 1/2 (1 + 1/2) / 2; a ball under a sky of 1 has 1/2."""
    name, _, kind = which.partition(", ")
    make, expected = SCENES[name]
    return Case(loaded(make(), kind), expected)
