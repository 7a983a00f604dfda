"""`relume stability`: every method at the inputs where it may fail, against known answers.

A cell (see `cells`, which says how to add one) is rendered by `RUNS` independent runs; if these
cannot see an error of `stability_verdict.WANTED`, by more, up to `stability_runs.MOST_RUNS`. When
to stop depends on the scatter alone. A failure that nothing announces, neither a note of the
translation nor a warning nor a refusal, is `silent`, and makes the command end with status 4.
"""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Table
from rich.text import Text

from relume import translator
from relume.loading import SceneSource, resized, source_of
from relume.options import RenderOptions
from relume.output import check_writable, replacing
from relume.progress import interruptible
from relume.translator import Document
from relume.version import version
from relume.workbench import methods as method_table
from relume.workbench import pages, stability_page
from relume.workbench.cells import Case, Cell, Family, all_cells
from relume.workbench.comparison import versions
from relume.workbench.scenes import (
    Progress,
    name_of,
    reduced,
    refuse,
    repeated,
)
from relume.workbench.stability_runs import RUNS, is_reference, measure
from relume.workbench.stability_store import Store
from relume.workbench.stability_verdict import Measurement

SPP = 16
"""Samples of a pixel in a run of a given scene."""

GIVEN_BY_CELLS = {
    field.name: "the cells of the grid have their own; name a scene to choose it"
    for field in dataclasses.fields(RenderOptions)
    if field.name != "seed"
}
"""Options that the grid does not take, with the reason."""

PAGE, PICTURE = "stability.md", "stability.png"
"""What is written beside the results."""

MOST_SHOWN = 20
"""Cells that are not exact which a notebook lists."""


@dataclass(frozen=True)
class Stability:
    """What was measured of some cells.

    Attributes:
        results: each cell with its measurement.
        settings: the command and the versions, as JSON values.
    """

    results: tuple[tuple[Cell, Measurement], ...]
    settings: dict[str, Any]

    @property
    def silent(self) -> bool:
        """Whether a cell fails and nothing says so."""
        return any(found.silent for _, found in self.results)

    def report(self) -> dict[str, Any]:
        """All of it as JSON values."""
        return self.settings | {"cells": [report(*result) for result in self.results]}

    def verdict(self) -> str:
        """How many cells have which verdict, in words."""
        counts = stability_page.counted(self.report()["cells"])
        cells = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
        count = len(self.results)
        return f"{count} {'cell' if count == 1 else 'cells'}: {cells}"

    def __repr__(self) -> str:
        return f"<Stability: {self.verdict()}>"

    def _repr_png_(self) -> bytes:
        return stability_page.heat_map(self.report()["cells"])

    def _repr_html_(self) -> str:
        cells = self.report()["cells"]
        table = (stability_page.SUMMARY_HEAD, stability_page.summary(cells))
        departures = [line for line, _ in described(cells)]
        shown, left = departures[:MOST_SHOWN], len(departures) - MOST_SHOWN
        more = [f"and {left} more"] if left > 0 else []
        return pages.summary(
            "Stability", self.verdict(), not self.silent, self._repr_png_(), [table], shown + more
        )


def stability(
    scene: SceneSource | None = None,
    options: RenderOptions | None = None,
    *,
    expected: float | Sequence[float] | None = None,
    methods: Sequence[str] = (),
    cells: Sequence[str] = (),
    out: str | Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    **changes: Any,
) -> Stability:
    """Measure methods against known answers: at the cells of the grid, or in a scene.

    Args:
        scene: a scene file, or what `relume.read` returned; without one, cells of the grid are
            measured (see `cells`).
        options: how the scene is rendered; by default its longer side is at most 160 pixels, with
            `SPP` samples of a pixel in each run. The grid takes `seed` alone. The same seed gives
            the same measurement.
        expected: mean radiance of the scene's picture, one number or one for each channel.
        methods: of a scene, names of methods (see the module `methods`) or plugin ids of
            integrators, by default all that can render it; of the grid, plugin ids that have cells,
            by default all.
        cells: patterns of names of the grid's cells without the method, as `fnmatch` knows them;
            by default all.
        out: of the grid, a folder: its `stability.json` keeps each cell as soon as it is measured,
            and at the end a page and a heat map show all cells that it has, also of earlier calls.
        resume: leave out what the folder has of this version of relume.
        progress: called with the cells done and all cells; True stops, and what is done is kept.
        changes: fields of `options` by name.

    Raises:
        SceneError: errors of the file, and missing files.
        ValueError: an option that has no meaning here, a method without cells, or no cell matches.
        OutputError: the folder cannot be written, or its `stability.json` is something else.
    """
    store = None
    if out is not None:
        if scene is not None:
            raise ValueError("out: a folder keeps cells of the grid, not of a scene")
        check_writable(Path(out, PAGE))
        store = Store(out)
    elif resume:
        raise ValueError("resume: name the folder of the results")
    options = RenderOptions.of(options, **changes)
    if scene is None:
        if expected is not None:
            raise ValueError("expected: name the scene that has this mean radiance")
        refuse(options, GIVEN_BY_CELLS)
        to_measure = chosen(methods, cells)
        if store and resume:
            to_measure = [cell for cell in to_measure if not store.has(cell)]
        words = ["relume", "stability", *repeated("--method", methods), *repeated("--cell", cells)]
        command = shlex.join([*words, "--seed", str(options.seed)])
    else:
        if cells:
            raise ValueError("cells: patterns choose cells of the grid, not of a scene")
        document = source_of(scene, options)
        if not isinstance(document, Document):
            raise ValueError(f"{scene}: stability measures scene files, not Mitsuba scenes")
        to_measure = cells_of(document, options, expected, methods)
        command = f"relume.stability({name_of(document)!r}, expected={expected})"
    results: list[tuple[Cell, Measurement]] = []
    for cell in to_measure:
        results.append((cell, measure(cell, options.seed)))
        if store:
            store.keep(*results[-1])
        if progress and progress(len(results), len(to_measure)):
            break
    settings = {"command": command, "versions": versions()}
    if out is not None and store:
        write_page(Path(out), store, settings)
    return Stability(tuple(results), settings)


def write_page(folder: Path, store: Store, settings: dict[str, Any]) -> None:
    """Write the page and the heat map of all cells that a store has.

    Raises:
        OutputError: the folder cannot be written.
    """
    cells = [
        report(cell, stored.found)
        | {"earlier": stored.earlier, "version": stored.version, "date": stored.date}
        for cell, stored in store.results()
    ]
    missing = [cell.name for cell in store.missing()]
    page = stability_page.markdown(settings | {"cells": cells, "missing": missing}, PICTURE)
    picture = stability_page.heat_map(cells)
    with replacing(folder / PICTURE) as temporary:
        temporary.write_bytes(picture)
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(page, "utf-8")


def chosen(methods: Sequence[str] = (), patterns: Sequence[str] = ()) -> list[Cell]:
    """The cells of the given methods whose name matches one of the patterns.

    Args:
        methods: plugin ids; all if none is given.
        patterns: of a cell's name without the method, as `fnmatch` knows them; all if none.

    Raises:
        ValueError: a method without cells, or nothing matches.
    """
    cells = all_cells()
    known = {cell.method for cell in cells}
    if unknown := sorted(set(methods) - known):
        raise ValueError(
            f"method '{unknown[0]}' has no cells; those that have: {', '.join(sorted(known))}"
        )
    found = [
        cell
        for cell in cells
        if (not methods or cell.method in methods)
        and (not patterns or any(fnmatchcase(f"{cell.family.name}/{cell.at}", p) for p in patterns))
    ]
    if not found:
        raise ValueError(f"no cell matches {', '.join(patterns)}")
    return found


def cells_of(
    document: Document,
    options: RenderOptions,
    expected: float | Sequence[float] | None,
    methods: Sequence[str],
) -> list[Cell]:
    """A cell for each method that renders a given scene.

    Raises:
        ValueError: `expected` is missing or no radiance, or an integrator is among the options.
    """
    answer = np.asarray(np.nan if expected is None else expected, float)
    if answer.shape not in ((), (3,)) or not (np.isfinite(answer) & (answer >= 0)).all():
        raise ValueError(
            f"expected {expected}: the mean radiance of the picture, one number or three"
        )
    refuse(options, {"integrator": "the integrators are the methods"})
    spp = SPP if options.spp is None else options.spp
    given = resized(document, options.size or reduced(document.image), spp * RUNS)
    assert isinstance(given, Document)
    document = given
    translation = translator.translate(
        document, options.dialect, options.asset_path, options.stand_ins
    )
    case = Case(document, answer.tolist(), answer.max() or 1.0, spp=spp, options=options)
    names = tuple(method.name for method in method_table.chosen(translation, methods))
    name = Path(name_of(document)).stem
    row = Family(name, "", "As it was given.", lambda _: case, ("as given",), names)
    return [Cell(row, value, method) for method in names for value in row.values]


def report(cell: Cell, found: Measurement) -> dict[str, Any]:
    """A cell and its measurement as JSON values."""
    return {
        "method": cell.method,
        "family": cell.family.name,
        "quantity": cell.family.quantity,
        "at": cell.at,
        "answer": cell.family.answer,
        "why": cell.family.why,
        "reference": is_reference(cell),
        "verdict": found.verdict,
        "text": found.text(),
        "silent": found.silent,
        "said": found.said,
        "error": found.error,
        "half_width": found.half_width,
        "sees": found.sees,
        "not_finite": found.not_finite,
        "negative": found.negative,
        "firefly": found.firefly,
        "samples": found.samples,
        "seconds": found.seconds,
        "version": version(),
        "date": "",
        "earlier": False,
    }


def run(console: Console, **arguments: Any) -> Stability:
    """Measure with a progress bar; Ctrl-C keeps the cells measured so far.

    Args:
        console: for the progress bar.
        arguments: as `stability`, which tells what is raised.
    """
    columns = (TextColumn("cell"), MofNCompleteColumn(), BarColumn(), TimeRemainingColumn())
    quiet = not console.is_terminal
    with (
        Bar(*columns, console=console, transient=True, disable=quiet) as bar,
        interruptible() as stop,
    ):
        task = bar.add_task("stability", total=None)

        def progress(done: int, of: int) -> bool:
            bar.update(task, completed=done, total=of)
            return bool(stop)

        return stability(progress=progress, **arguments)


def described(cells: Sequence[dict[str, Any]]) -> list[tuple[str, bool]]:
    """Of every cell that is not exact, what was found in words, and whether it fails silently."""
    lines = []
    for cell in cells:
        if cell["verdict"] not in stability_page.RIGHT:
            name = f"{cell['method']}/{cell['family']}/{cell['at']}"
            said = f" ({cell['said']})" if cell["said"] else ""
            lines.append((f"{name}: {cell['text']}{said}", cell["silent"]))
    return lines


def print_report(found: Stability, console: Console) -> None:
    """Print the count of verdicts of each method, and every cell that is not exact."""
    cells = found.report()["cells"]
    table = Table(box=None, padding=(0, 2), header_style="bold")
    for column, name in enumerate(stability_page.SUMMARY_HEAD):
        table.add_column(name, justify="right" if column else "left")
    for row in stability_page.summary(cells):
        table.add_row(*row)
    console.print(table)
    for line, silent in described(cells):
        console.print(Text(line, style="red" if silent else ""), soft_wrap=True)
