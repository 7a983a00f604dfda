"""The files of `relume chart`: a figure and its data for each scene, and an overview of several."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from relume.loading import translated_with_inputs
from relume.options import RenderOptions
from relume.output import check_writable, replacing
from relume.progress import interruptible
from relume.session import CannotRender
from relume.workbench import chart_figure, chart_table
from relume.workbench.charting import Chart, chart

KINDS = (".svg", ".png")


def run(
    scenes: Sequence[str | Path], out: str | Path, console: Console, **arguments: Any
) -> tuple[list[Chart], list[Path], dict[str | Path, str]]:
    """Chart scenes with progress, writing each as soon as it is measured.

    Args:
        scenes: scene files.
        out: folder for the figures and data; it is made.
        console: for the progress bar.
        arguments: as `charting.chart`.

    Returns:
        The `Chart` of each scene, the paths written, and why scenes have no chart, by scene.

    Raises:
        SceneError: a scene file has errors; nothing was rendered then.
        OutputError: the folder cannot be written, or a file that a scene reads lies at the place of
            a figure.
    """
    options = RenderOptions(
        dialect=arguments.get("dialect", "manual"),
        asset_path=arguments.get("asset_path", ()),
        stand_ins=arguments.get("stand_ins", False),
    )
    for scene in scenes:
        translated_with_inputs(scene, options)[1].refuse(*chart_paths(scenes, Path(out)))
    check_writable(Path(out) / "methods.csv")
    charts: list[Chart] = []
    written: list[Path] = []
    failed: dict[str | Path, str] = {}
    columns = (
        TextColumn("{task.description}"),
        MofNCompleteColumn(),
        BarColumn(),
        TimeRemainingColumn(),
    )
    quiet = not console.is_terminal
    with (
        Progress(*columns, console=console, transient=True, disable=quiet) as bar,
        interruptible() as stop,
    ):
        for scene, name in zip(scenes, unique_names(scenes), strict=True):
            task = bar.add_task(f"{name}: warm-up", total=None)

            def progress(what: str, done: int, of: int, task: Any = task, name: str = name) -> bool:
                bar.update(task, description=f"{name}: {what}", completed=done, total=of)
                return bool(stop)

            try:
                made = chart(scene, progress=progress, **arguments)
            except CannotRender as error:
                failed[scene] = str(error)
            else:
                charts.append(made)
                written += write_chart(made, Path(out) / name)
            bar.remove_task(task)
            if stop:
                break
    return charts, written + write_overview(charts, Path(out)), failed


def unique_names(scenes: Sequence[str | Path]) -> list[str]:
    """A file name for each scene: its own without extension, numbered where two are the same."""
    taken: list[str] = []
    for scene in scenes:
        name = stem = Path(scene).stem
        number = 1
        while name in taken:
            number += 1
            name = f"{stem}-{number}"
        taken.append(name)
    return taken


def chart_paths(scenes: Sequence[str | Path], folder: Path) -> list[Path]:
    """Paths of all files that may be written."""
    names = [*unique_names(scenes), "overview"]
    files = [folder / f"{name}{kind}" for name in names for kind in (*KINDS, ".csv")]
    return [*files, folder / "methods.csv"]


def write_chart(made: Chart, path: Path) -> list[Path]:
    """Write the figure and the points of a chart; returns the paths.

    Args:
        made: what was measured.
        path: of the files, without extension.
    """
    figure = chart_figure.chart_figure(made)
    files = [path.with_name(path.name + kind) for kind in KINDS]
    for file in files:
        chart_figure.save(figure, file, made.settings["command"])
    points = path.with_name(path.name + ".csv")
    write_text(points, chart_table.as_csv(chart_table.POINTS, chart_table.points(made)))
    return [*files, points]


def write_overview(charts: Sequence[Chart], folder: Path) -> list[Path]:
    """Write the table of all methods, and the overview if there are several charts."""
    if not charts:
        return []
    rows = [row for made in charts for row in chart_table.summary(made)]
    table = folder / "methods.csv"
    write_text(table, chart_table.as_csv(rows[0], [row.values() for row in rows]))
    if len(charts) == 1:
        return [table]
    figure = chart_figure.overview_figure(charts)
    files = [folder / f"overview{kind}" for kind in KINDS]
    for file in files:
        commands = "\n".join(made.settings["command"] for made in charts)
        chart_figure.save(figure, file, commands)
    return [*files, table]


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
