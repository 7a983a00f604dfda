"""Environment variables that override a scene file: environment > file > default (section 3)."""

from relume.translator.diagnostics import Problem
from relume.translator.document import Document
from relume.translator.expressions import ExpressionError, clip, evaluate
from relume.translator.keywords import TEXTS, rows
from relume.translator.objects import SceneObject

ALIASES = {"LUMINANCE_CUTTOFF": "LUMINANCE_CUTOFF", "PRESAMPLE": "MLTSAMPLE"}
"""Other spellings: of the Japanese manual, and of the program."""


def override(document, environ):
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
    problems = []
    for row in rows(Document):
        _override(document, row, given, problems)
    for row in rows(SceneObject):
        for block in document.objects:
            _override(block, row, given, problems)
    return problems


def _override(target, row, given, problems):
    for k, name in enumerate(row.environment):
        if name not in given:
            continue
        spelling, text = given[name]
        value = _value(row, spelling, text, problems)
        if value is None:
            continue
        if row.arity == 1:
            setattr(target, row.field, value)
        else:
            values = list(getattr(target, row.field))
            values[k] = value
            setattr(target, row.field, tuple(values))
        # An empty list says that the value is set, though by no line.
        target.lines.reports.setdefault(row.field, [])
        target.lines.remark(row.field, "overridden-by-variable", name=spelling)


def _value(row, name, text, problems):
    if row.kind in TEXTS:
        return text
    if name == "OMP_NUM_THREADS":
        # OpenMP takes a list, one number for each level of nesting.
        text = text.partition(",")[0]
    try:
        values, _ = evaluate(text)
    except ExpressionError as error:
        problems.append(Problem(0, 0, f"environment variable {name}: {error}", error.kind))
        return None
    whole = row.kind in ("integer", "flag")
    if len(values) != 1 or (whole and values[0][0] != int(values[0][0])):
        wanted = "one whole number" if whole else "one number"
        message = f"environment variable {name} expects {wanted}, found '{clip(text)}'"
        problems.append(Problem(0, 0, message, "value"))
        return None
    value = values[0][0]
    if not row.contains(value):
        message = f"environment variable {name} must be {row.range_text()}, found {value:g}"
        problems.append(Problem(0, 0, message, "range"))
        return None
    return {"integer": int, "flag": bool}.get(row.kind, float)(value)
