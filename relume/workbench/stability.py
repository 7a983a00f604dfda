"""`relume stability`: every method at the inputs where it may fail, against known answers.

A cell (see `cells`, which says how to add one) is rendered by `RUNS` independent runs;
if these cannot see an error of `stability_verdict.WANTED`, by more, up to `MOST_RUNS`. When to
stop depends on the scatter alone. A failure that nothing says, neither a note of the translation
nor a warning nor a refusal, is `silent`, and makes the command end with status 4.
"""

import math
import shlex
import tempfile
import time
import warnings
import zlib
from fnmatch import fnmatchcase
from pathlib import Path

import mitsuba as mi
import numpy as np
from relume.translator.diagnostics import SceneError
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from relume import translator
from relume.application import usable_variant
from relume.output import check_writable
from relume.rendering import interruptible
from relume.session import CannotRender, Session, reason, two_threads, use_threads, variant
from relume.workbench import stability_page as page
from relume.workbench.comparison import versions
from relume.workbench.methods import METHODS, Stage, find, planned
from relume.workbench.cells import Case, all_cells
from relume.workbench.stability_verdict import WANTED, Measurement, Tally

RUNS = 16
"""Independent renders of a cell, at least."""

MOST_RUNS = 256
"""Runs of a cell after which none is added."""

LIMITS = ("single precision", "below the horizon", "roulette leaves noise", "roulette ends")
"""Words of notes on translated lines that tell of a limit of the renderer."""


def chosen(methods=(), patterns=()):
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


def measure(cell, seed=0):
    """Measure one cell.

    Args:
        cell: `cells.Cell`.
        seed: non-negative integer; the same seed gives the same measurement.

    Returns:
        `stability_verdict.Measurement`.
    """
    with variant(Case.variant):
        case = cell.family.make(cell.value)
    render = _rendered_text if isinstance(case.scene, str) else _rendered_dictionary
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            return render(case, cell, (seed, zlib.crc32(cell.name.encode())), caught)
        except (SceneError, CannotRender, ValueError) as error:
            said = error.described() if isinstance(error, SceneError) else [str(error)]
            return Measurement(said="; ".join(said), refused=True)


def _rendered_text(case, cell, seed, caught):
    document = translator.read_text(case.scene, cell.name, {})
    with tempfile.TemporaryDirectory() as folder:
        with two_threads():
            for name, pixels in case.files.items():
                mi.Bitmap(np.asarray(pixels, np.float32)).write(str(Path(folder, name)))
        translation = translator.translate(document, asset_path=(folder,))
        notes = [
            report.note
            for report in translation.document.lines.all
            if report.outcome == "unsupported" or any(words in report.note for words in LIMITS)
        ]
        with variant(usable_variant(translation.plan)):
            use_threads(translation.document.thread)
            method = find(cell.method) if renders(cell.method) else planned(translation)
            stage = Stage(document, translation, asset_path=(folder,))
            return _measured(*stage.load(method), case, seed, (notes, caught))


def _rendered_dictionary(case, cell, seed, caught):
    with variant(case.variant):
        use_threads(None)
        entries = dict(case.scene)
        if renders(cell.method):
            entries["integrator"] = entries["integrator"] | {"type": cell.method}
        try:
            scene = mi.load_dict(entries)
        except RuntimeError as error:
            raise CannotRender(reason(error)) from error
        return _measured(scene, scene.integrator(), case, seed, ([], caught))


def renders(method):
    """Whether a cell's method is an integrator or another row of `METHODS`."""
    if any(row.name == method for row in METHODS):
        return True
    try:
        return isinstance(mi.load_dict({"type": method}), mi.Integrator)
    except RuntimeError:
        return False


def _measured(scene, integrator, case, seed, said):
    """The `Measurement` of a loaded scene; `said` are notes and the list of caught warnings."""
    scale = np.max(case.expected) if case.scale is None else case.scale
    tally = Tally(case.expected, scale)
    start = time.perf_counter()
    wanted = RUNS
    while True:
        for run in range(len(tally.means), wanted):
            own = np.random.SeedSequence((*seed, run)).generate_state(1, np.uint64)
            session = Session(scene, case.spp, int(own[0]), integrator)
            for _ in session.run():
                pass
            tally.add(session.image())
        notes, caught = said
        texts = [*notes, *(str(warning.message) for warning in caught)]
        # A line's note may be several, and lines may share them.
        told = list(dict.fromkeys(part for text in texts for part in text.split("; ")))
        if mi.is_spectral and tally.negative:
            told.append("colours that RGB cannot hold")  # as `relume render` says of its picture
        found = tally.measurement(
            samples=len(tally.means) * case.spp * session.width * session.height,
            seconds=time.perf_counter() - start,
            said="; ".join(told),
        )
        if found.sees <= WANTED or wanted == MOST_RUNS or found.not_finite:
            return found
        # The variance of a mean falls with the number of runs.
        ratio = max(1.3, 1.1 * (found.sees / WANTED) ** 2)
        wanted = min(math.ceil(wanted * ratio), MOST_RUNS)


def report(cell, found):
    """A cell and its measurement as JSON values."""
    return {
        "method": cell.method,
        "family": cell.family.name,
        "quantity": cell.family.quantity,
        "at": cell.at,
        "answer": cell.family.answer,
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
    }


def run(console, *, methods=(), patterns=(), out=None, seed=0):
    """Measure cells with progress; Ctrl-C keeps those measured so far.

    Args:
        console: `rich.console.Console` for the progress.
        methods: as `chosen`.
        patterns: as `chosen`.
        out: folder for `stability.md` and `stability.png`, or None.
        seed: as `measure`.

    Returns:
        The report as JSON values.

    Raises:
        ValueError: as `chosen`.
        OutputError: the folder cannot be written.
    """
    cells = chosen(methods, patterns)
    if out is not None:
        check_writable(Path(out, "stability.md"))
    columns = (TextColumn("cell"), MofNCompleteColumn(), BarColumn(), TimeRemainingColumn())
    quiet = not console.is_terminal
    done = []
    with (
        Progress(*columns, console=console, transient=True, disable=quiet) as bar,
        interruptible() as stop,
    ):
        task = bar.add_task("stability", total=len(cells))
        for cell in cells:
            done.append(report(cell, measure(cell, seed)))
            bar.update(task, advance=1)
            if stop:
                break
    words = ["relume", "stability"]
    for option, values in (("--method", methods), ("--cell", patterns)):
        words += [word for value in values for word in (option, value)]
    words += ["--seed", str(seed)]
    found = {"command": shlex.join(words), "versions": versions(), "cells": done}
    if out is not None:
        page.heat_map(done, Path(out, "stability.png"))
        Path(out, "stability.md").write_text(page.markdown(found, "stability.png"), "utf-8")
    return found


def print_report(found, console):
    """Print the count of verdicts of each method, and every cell that is not exact."""
    table = Table(box=None, padding=(0, 2), header_style="bold")
    for column, name in enumerate(page.SUMMARY_HEAD):
        table.add_column(name, justify="right" if column else "left")
    for row in page.summary(found["cells"]):
        table.add_row(*row)
    console.print(table)
    for cell in found["cells"]:
        if cell["verdict"] != "exact":
            name = f"{cell['method']}/{cell['family']}/{cell['at']}"
            said = f" ({cell['said']})" if cell["said"] else ""
            style = "red" if cell["silent"] else ""
            console.print(Text(f"{name}: {cell['text']}{said}", style=style), soft_wrap=True)
