"""`relume check`: what every line of scene files becomes, as a table or as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from relume import translator
from relume.mitsuba_files import is_mitsuba_file
from relume.translator.diagnostics import LineReport, Problem, SceneError
from relume.translator.outcomes import OUTCOMES, UnknownCode, explanation
from relume.translator.source_text import read_lines

EXIT = {"ok": 0, "error": 1, "unsupported": 3}
"""Exit status of each status; of several files the errors count first."""

STYLES = {"translated": "", "approximated": "yellow", "ignored": "dim", "unsupported": "red"}


Result: TypeAlias = dict[str, Any]
"""What `check_file` returns."""


def check_file(
    path: str | Path,
    dialect: str = "manual",
    asset_path: Iterable[str | Path] = (),
    environ: Mapping[str, str] | None = None,
    stand_ins: bool = False,
) -> Result:
    """Check one scene file.

    Args:
        path: the file.
        dialect: `manual` or `prender`.
        asset_path: folders in which files that the scene names are looked for.
        environ: environment variables that override the file; by default those of the process.
        stand_ins: whether something is shown in the place of missing pictures.

    Returns:
        A dictionary with `file`, `status` (`ok`, `error` or `unsupported`), `errors`, `lines`,
        `notes` on the picture as a whole, of `code` and `note`, and `plan` (None where there are
        errors that forbid one). Each of the lines has `line`, `keyword`, `outcome`, `note` and
        `codes`.
    """
    problems: list[Problem] = []
    reports: list[LineReport] = []
    notes: list[dict[str, str]] = []
    plan, status = None, "ok"
    try:
        if is_mitsuba_file(path):
            what = "a Mitsuba scene, of which there is nothing to translate: relume render takes it"
            raise SceneError(path, [Problem(0, 0, what, "file")])
        document, problems = translator.parse(read_lines(path), path, environ)
        reports = document.lines.all
        # Of a document with errors, a camera that looks nowhere is told once, not again by numpy.
        with np.errstate(all="ignore" if problems else None):
            translation = translator.translate(document, dialect, asset_path, stand_ins)
        reports, status = translation.document.lines.all, translation.status()
        plan = translation.plan.as_dict()
        notes = [{"code": n.code, "note": n.text} for n in translation.picture_notes()]
    except SceneError as error:
        problems = sorted({*problems, *error.problems})
    except Exception as error:
        # A document with errors need not be translatable; without errors it must be.
        if not problems:
            message = f"cannot be translated: {type(error).__name__}: {error}"
            problems = [Problem(0, 0, message, "scene")]
    return {
        "file": str(path),
        "status": "error" if problems else status,
        "errors": [asdict(problem) for problem in problems],
        "lines": [report.as_dict() for report in sorted(reports, key=lambda report: report.line)],
        "notes": [] if problems else notes,
        "plan": None if problems else plan,
    }


def files_below(paths: Iterable[str | Path]) -> Iterator[Path]:
    """The files named, and for folders the `.txt` files below them, in order."""
    for path in map(Path, paths):
        if path.is_dir():
            yield from (file for file in sorted(path.rglob("*.txt")) if file.is_file())
        else:
            yield path


def has_folder(paths: Iterable[str | Path]) -> bool:
    """Whether one of the paths is a folder."""
    return any(Path(path).is_dir() for path in paths)


def exit_status(results: Iterable[Result]) -> int:
    """Exit status for a list of results: 1 for any error, else 3 for anything unsupported."""
    found = {result["status"] for result in results}
    return next((EXIT[status] for status in ("error", "unsupported") if status in found), 0)


def explained(code: str) -> str:
    """An outcome's code explained, as in docs/outcomes.md.

    Raises:
        UnknownCode: there is none; the message suggests codes spelt alike, and lists all.
    """
    try:
        return f"{code}\n\n{explanation(code)}"
    except UnknownCode as error:
        raise UnknownCode(f"{error}\nOutcomes: {', '.join(sorted(OUTCOMES))}") from None


def print_results(results: Sequence[Result], console: Console, *, every_line: bool = True) -> None:
    """Print results as tables.

    Args:
        results: what `check_file` returned for each file.
        console: where to print.
        every_line: whether lines that are simply translated are listed, too.
    """
    for result in results:
        console.print(_headline(result))
        for error in result["errors"]:
            place = f"{error['line']}:{error['column']}: " if error["line"] else ""
            console.print(f"  [red]{place}[/]{escape(error['message'])} [dim]({error['kind']})[/]")
        _print_lines(result, console, every_line)
        for note in result["notes"]:
            text = escape(f"{note['note']} [{note['code']}]")
            console.print(f"  [yellow]{text}[/]", highlight=False)
        if result["plan"]:
            _print_plan(result["plan"], console)
    if any(line["codes"] for r in results for line in r["lines"]) or any(
        result["notes"] for result in results
    ):
        console.print("[dim]relume check --explain CODE tells more of a note[/]")
    if len(results) > 1:
        print_counts(results, console)


def print_overview(results: Sequence[Result], console: Console) -> None:
    """Print a line for each file, and how many are fine.

    Args:
        results: what `check_file` returned for each file.
        console: where to print.
    """
    for result in results:
        found = result["errors"] or [x for x in result["lines"] if x["outcome"] == "unsupported"]
        said = f": {_place(found[0])}" if found else ""
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        console.print(f"{_headline(result)}{escape(said)}[dim]{more}[/]")
    print_counts(results, console)


def print_counts(results: Sequence[Result], console: Console) -> None:
    """Print how many files are of each status."""
    counts = {s: sum(result["status"] == s for result in results) for s in EXIT}
    console.print(f"{len(results)} files: " + ", ".join(f"{n} {s}" for s, n in counts.items()))


def _headline(result: Result) -> str:
    style = {"ok": "green", "error": "red", "unsupported": "yellow"}[result["status"]]
    return f"[bold]{escape(result['file'])}[/]: [{style}]{result['status']}[/]"


def _place(found: dict[str, Any]) -> str:
    """An error, or a line that is unsupported, in words."""
    if "message" in found:
        place = f"{found['line']}:{found['column']}: " if found["line"] else ""
        return f"{place}{found['message']}"
    return f"line {found['line']}, {found['keyword']}: {found['note']}"


def _print_lines(result: Result, console: Console, every_line: bool) -> None:
    lines = [
        line
        for line in result["lines"]
        if every_line or line["note"] or line["outcome"] != "translated"
    ]
    if not lines:
        return
    table = Table(box=None, pad_edge=True, header_style="dim")
    for heading in ("line", "keyword", "outcome", "note"):
        table.add_column(
            heading,
            justify="right" if heading == "line" else "left",
            overflow="fold",
            no_wrap=heading in ("line", "outcome"),
        )
    for line in lines:
        style = STYLES[line["outcome"]]
        table.add_row(
            str(line["line"]),
            escape(line["keyword"]),
            line["outcome"],
            _note(line),
            style=style,
        )
    console.print(table)


def _note(line: dict[str, Any]) -> str:
    """A line's notes with their codes, but for those that begin with them."""
    note, codes = line["note"], line["codes"]
    unsaid = ", ".join(code for code in codes if f"{code}: " not in note)
    return escape(f"{note} [{unsaid}]") if unsaid else escape(note)


def _print_plan(plan: dict[str, Any], console: Console) -> None:
    reasons = plan["reasons"]
    console.print(
        f"  plan: {plan['width']}x{plan['height']}, {plan['spp']} spp ({escape(reasons['spp'])})\n"
        f"    variant    {plan['variant']}: {escape(reasons['variant'])}\n"
        f"    integrator {plan['integrator']}: {escape(reasons['integrator'])}\n"
        f"    candidates {', '.join(plan['candidates'])}: {escape(reasons['candidates'])}\n"
        f"    sensor     {plan['sensor']}: {escape(reasons['sensor'])}\n"
        f"    plugins    {', '.join(plan['plugins']) or 'none of relume'}"
    )
