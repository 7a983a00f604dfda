"""Environment variables that override a scene file: environment > file > default (section 3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from relume.translator.diagnostics import Problem
from relume.translator.document import Document
from relume.translator.keywords import Keyword, rows
from relume.translator.values import FileContext, ValueProblem, ValueReader

ALIASES = {"LUMINANCE_CUTTOFF": "LUMINANCE_CUTOFF", "PRESAMPLE": "MLTSAMPLE"}
"""Other spellings: of the Japanese manual, and of the program."""


def override(document: Document, environ: Mapping[str, str]) -> list[Problem]:
    """Apply the environment variables to a document that has been read.

    Args:
        document: changed in place.
        environ: mapping of names to texts; values are expressions.

    Returns:
        The problems: a value that is no expression or out of range, at line 0.
    """
    given = {
        ALIASES.get(name, name): (name, text) for name, text in environ.items() if text.strip()
    }
    context = FileContext({}, environ)
    for target in (document, *document.objects, *document.gravity):
        for row in rows(type(target)):
            _override(target, row, given, context)
    return context.problems


def _override(
    target: Any, row: Keyword, given: Mapping[str, tuple[str, str]], context: FileContext
) -> None:
    """Set the field of a row; `given` holds spelling and text of each variable by its name."""
    for k, name in enumerate(row.environment):
        if name not in given:
            continue
        spelling, text = given[name]
        if spelling == "OMP_NUM_THREADS":
            # OpenMP takes a list, one number for each level of nesting.
            text = text.partition(",")[0]
        values = ValueReader(context, f"environment variable {spelling}", text)
        try:
            value = row.form.from_environment(row, values, getattr(target, row.field), k)
        except ValueProblem as error:
            context.problems.append(error.problem)
            continue
        setattr(target, row.field, value)
        # An empty list says that the value is set, though by no line.
        target.lines.reports.setdefault(row.field, [])
        target.lines.remark(row.field, "overridden-by-variable", name=spelling)
