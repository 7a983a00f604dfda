"""`relume check`: what every line of scene files becomes, as a table or as JSON."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.markup import escape
from rich.table import Table

from relume import translator
from relume.translator.diagnostics import Problem, SceneError
from relume.translator.source_text import read_lines

EXIT = {"ok": 0, "error": 1, "unsupported": 3}
"""Exit status of each status; of several files the errors count first."""

STYLES = {"translated": "", "approximated": "yellow", "ignored": "dim", "unsupported": "red"}


def check_file(path, dialect="manual", asset_path=(), environ=None):
    """Check one scene file.

    Returns:
        A dictionary with `file`, `status` (`ok`, `error` or `unsupported`), `errors`, `lines` and
        `plan` (None where there are errors that forbid one).
    """
    problems, reports, plan, status = [], [], None, "ok"
    try:
        document, problems = translator.parse(read_lines(path), path, environ)
        reports = document.lines.all
        # Of a document with errors, a camera that looks nowhere is told once, not again by numpy.
        with np.errstate(all="ignore" if problems else None):
            translation = translator.translate(document, dialect, asset_path)
        reports, status = translation.document.lines.all, translation.status()
        plan = translation.plan.as_dict()
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
        "lines": [asdict(report) for report in sorted(reports, key=lambda report: report.line)],
        "plan": None if problems else plan,
    }


def files_below(paths):
    """The files named, and for folders the `.txt` files below them, in order."""
    for path in map(Path, paths):
        if path.is_dir():
            yield from (file for file in sorted(path.rglob("*.txt")) if file.is_file())
        else:
            yield path


def exit_status(results):
    """Exit status for a list of results: 1 for any error, else 3 for anything unsupported."""
    found = {result["status"] for result in results}
    return next((EXIT[status] for status in ("error", "unsupported") if status in found), 0)


def print_results(results, console, *, every_line=True):
    """Print results as tables.

    Args:
        results: list of what `check_file` returns.
        console: `rich.console.Console`.
        every_line: whether lines that are simply translated are listed, too.
    """
    for result in results:
        style = {"ok": "green", "error": "red", "unsupported": "yellow"}[result["status"]]
        console.print(f"[bold]{escape(result['file'])}[/]: [{style}]{result['status']}[/]")
        for error in result["errors"]:
            place = f"{error['line']}:{error['column']}: " if error["line"] else ""
            console.print(f"  [red]{place}[/]{escape(error['message'])} [dim]({error['kind']})[/]")
        _print_lines(result, console, every_line)
        if result["plan"]:
            _print_plan(result["plan"], console)
    if len(results) > 1:
        counts = {s: sum(result["status"] == s for result in results) for s in EXIT}
        console.print(f"{len(results)} files: " + ", ".join(f"{n} {s}" for s, n in counts.items()))


def _print_lines(result, console, every_line):
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
            escape(line["note"]),
            style=style,
        )
    console.print(table)


def _print_plan(plan, console):
    reasons = plan["reasons"]
    console.print(
        f"  plan: {plan['width']}x{plan['height']}, {plan['spp']} spp ({escape(reasons['spp'])})\n"
        f"    variant    {plan['variant']}: {escape(reasons['variant'])}\n"
        f"    integrator {plan['integrator']}: {escape(reasons['integrator'])}\n"
        f"    sensor     {plan['sensor']}: {escape(reasons['sensor'])}\n"
        f"    plugins    {', '.join(plan['plugins']) or 'none of relume'}"
    )
