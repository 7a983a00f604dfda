"""A cell of `relume stability`, rendered: by as many independent runs as its scatter asks for."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import math
import tempfile
import time
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from relume import translator
from relume.loading import usable_variant
from relume.options import RenderOptions
from relume.pilot import BOTH_ENDS
from relume.session import (
    CannotRender,
    Session,
    exr_threads,
    reason,
    set_thread_count,
    variant_context,
)
from relume.translator import Document, Translation
from relume.translator.diagnostics import SceneError
from relume.workbench import methods
from relume.workbench.cells import Case, Cell
from relume.workbench.renders import MitsubaIntegrator, MitsubaScene
from relume.workbench.stability_verdict import WANTED, Measurement, RunStatistics

RUNS = 16
"""Independent renders of a cell, at least."""

MOST_RUNS = 256
"""Runs of a cell after which none is added."""

LIMITS = {
    "color-near-one",
    "long-walks",
    "no-light-through-glass",
    "small-lamp-behind-glass",
    "surface-unsure",
    "thin-glass",
}
"""Codes of the outcomes that announce a limit of the renderer, besides those unsupported."""


def measure(cell: Cell, seed: int = 0) -> Measurement:
    """Measure one cell.

    Args:
        cell: what to measure.
        seed: non-negative integer; the same seed gives the same measurement.
    """
    with variant_context(Case.variant):
        case = cell.family.make(cell.value)
    render = _rendered_dictionary if isinstance(case.scene, dict) else _rendered_document
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = render(case, cell, (seed, zlib.crc32(cell.name.encode())), caught)
        except (SceneError, CannotRender, ValueError) as error:
            said = error.described() if isinstance(error, SceneError) else [str(error)]
            found = Measurement(said="; ".join(said), refused=True)
    if not case.forbidden:
        return found
    rightly = found.refused and case.forbidden in found.said
    return dataclasses.replace(found, refused=rightly, forbidden=True)


def _rendered_document(
    case: Case, cell: Cell, seed: tuple[int, ...], caught: list[warnings.WarningMessage]
) -> Measurement:
    given = isinstance(case.scene, Document)
    with _translated(case, cell) as (document, translation, options):
        if cell.method not in BOTH_ENDS:
            translation = translation.path_traced()
        notes = [
            report.note
            for report in translation.document.lines.all
            if report.outcome == "unsupported" or LIMITS & set(report.codes)
        ]
        with variant_context(usable_variant(translation.plan, options.variant)):
            set_thread_count(translation.document.thread)
            if given or is_method(cell.method):
                method = methods.find(cell.method)
            else:
                method = methods.planned(translation)
            stage = methods.Stage(document, translation, options)
            return _measured(*stage.load(method), case, seed, notes, caught)


@contextlib.contextmanager
def _translated(case: Case, cell: Cell) -> Iterator[tuple[Document, Translation, RenderOptions]]:
    """A case's document, its translation and the options; what it names lies in a folder."""
    document = _document(case, cell)
    with tempfile.TemporaryDirectory() as folder:
        with exr_threads():
            for name, content in case.files.items():
                if isinstance(content, str):
                    Path(folder, name).write_text(content, encoding="utf-8")
                else:
                    mi.Bitmap(np.asarray(content, np.float32)).write(str(Path(folder, name)))
        folders = (*case.options.asset_path, folder)
        options = dataclasses.replace(case.options, asset_path=folders)
        yield document, translator.translate(document, options.dialect, folders), options


def _document(case: Case, cell: Cell) -> Document:
    if isinstance(case.scene, Document):
        return case.scene
    assert isinstance(case.scene, str), "a dictionary has no document"
    return translator.read_text(case.scene, cell.name, {})


def _rendered_dictionary(
    case: Case, cell: Cell, seed: tuple[int, ...], caught: list[warnings.WarningMessage]
) -> Measurement:
    with variant_context(case.variant):
        set_thread_count(None)
        assert isinstance(case.scene, dict)
        entries: dict[str, Any] = dict(case.scene)
        if is_method(cell.method):
            entries["integrator"] = entries["integrator"] | {"type": cell.method}
        try:
            scene = mi.load_dict(entries)
        except RuntimeError as error:
            raise CannotRender(reason(error)) from error
        return _measured(scene, scene.integrator(), case, seed, [], caught)


MITSUBAS = ("path", "volpath", "volpathmis")
"""Integrators that are none of this product."""


@functools.cache
def is_reference(cell: Cell) -> bool:
    """Whether a cell is measured for an integrator of Mitsuba where the plan of its scene takes one
    of this product; a dictionary has no plan: there, where its family names one."""
    if cell.method not in MITSUBAS:
        return False
    with variant_context(Case.variant):
        case = cell.family.make(cell.value)
        if isinstance(case.scene, dict):
            return any(name not in MITSUBAS for name in cell.family.methods)
        try:
            with _translated(case, cell) as (_, translation, _):
                paths = methods.paths_of(translation.scene["integrator"])
        except SceneError:
            return False
    return methods.innermost(paths)["type"] not in MITSUBAS


def xyz_of_rgb() -> np.ndarray:
    """The matrix from linear sRGB, as Mitsuba has it, to XYZ, (3, 3) float64."""
    rgb_of_xyz = mi.xyz_to_srgb(mi.Color3f(np.eye(3, dtype=np.float32)))
    return np.linalg.inv(np.array(rgb_of_xyz, float))


def is_method(name: str) -> bool:
    """Whether what a cell is measured for is an integrator or another row of `METHODS`."""
    if any(row.name == name for row in methods.METHODS):
        return True
    try:
        return isinstance(mi.load_dict({"type": name}), mi.Integrator)
    except RuntimeError:
        return False


def _measured(
    scene: MitsubaScene,
    integrator: MitsubaIntegrator,
    case: Case,
    seed: tuple[int, ...],
    notes: list[str],
    caught: list[warnings.WarningMessage],
) -> Measurement:
    """The measurement of a loaded scene.

    Args:
        scene: what is rendered.
        integrator: by which.
        case: with the known answer.
        seed: of the cell.
        notes: what the translation said.
        caught: warnings so far; it grows.
    """
    scale = float(np.max(case.expected)) if case.scale is None else case.scale
    runs = RunStatistics(case.expected, scale, xyz_of_rgb() if mi.is_spectral else None)
    start = time.perf_counter()
    wanted = RUNS
    while True:
        for run in range(len(runs.means), wanted):
            own = np.random.SeedSequence((*seed, run)).generate_state(1, np.uint64)
            session = Session(scene, case.spp, int(own[0]), integrator)
            for _ in session.run():
                pass
            runs.add(session.image())
        texts = [*notes, *(str(warning.message) for warning in caught)]
        # A line's note may be several, and lines may share them.
        said = list(dict.fromkeys(part for text in texts for part in text.split("; ")))
        found = runs.measurement(
            samples=len(runs.means) * case.spp * session.width * session.height,
            seconds=time.perf_counter() - start,
            said="; ".join(said),
        )
        if found.sees <= WANTED or wanted == MOST_RUNS or found.not_finite:
            return found
        # The variance of a mean falls with the number of runs.
        ratio = max(1.3, 1.1 * (found.sees / WANTED) ** 2)
        wanted = min(math.ceil(wanted * ratio), MOST_RUNS)
