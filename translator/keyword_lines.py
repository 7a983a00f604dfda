"""Reading the lines of one keyword into the field that its row declares."""

from relume.translator.expressions import clip
from relume.translator.keywords import NEXT_LINE, TEXTS
from relume.translator.outcomes import make_note

BOTH_FORMS = ("phase", "ambient")
"""Kinds of row whose values may stand on the same or on the next line."""


def read_keyword(cursor, row, word, target, source):
    """Read the keyword in the current line, set its field and report its lines.

    Args:
        cursor: stands in the line of the keyword; left in the last line that belongs to it.
        row: the keyword's row.
        word: the keyword as spelt in the file.
        target: document, object or block whose field is set.
        source: its `LineReports`.
    """
    _, rest, _ = cursor.keyword_text()
    both_forms = row.kind in BOTH_FORMS
    if row.form == NEXT_LINE and rest and not both_forms:
        found = f"found '{clip(rest.rstrip())}' behind it"
        cursor.error(len(word) + 2, f"{word} takes its values on the next line, {found}")
        return
    reports = [cursor.described(word)]
    if word != row.name:
        reports[0].remark("other-spelling", name=row.name)
    _dummies(cursor, row, word, reports)
    below = not rest if both_forms else row.form == NEXT_LINE
    read = _below(cursor, row, word, reports) if below else _beside(cursor, row, word)
    if read is None:
        return
    value, notes = read
    for note in notes:
        reports[0].add(note)
    cursor.reports += reports
    assign(target, source, row.field, value, reports)


def assign(target, source, field, value, reports):
    """Set a field; the lines that set it before are reported as overridden."""
    setattr(target, field, value)
    for old in source.reports.get(field, ()):
        old.becomes("set-again", line=reports[0].line)
    source.reports[field] = reports


def _dummies(cursor, row, word, reports):
    for _ in range(row.dummies):
        if cursor.value_line(word, "a mean and below it three values") is None:
            return
        reports.append(cursor.described(word, "unused-mean"))


def _below(cursor, row, word, reports):
    line = cursor.value_line(word, "its value")
    if line is None:
        return None
    offset = len(line) - len(line.lstrip(" \t"))
    reports.append(cursor.described(word))
    if row.kind == "phase":
        return _phase(cursor, row, line[offset:], offset, 1)
    if line[offset] == "%" and row.arity == 1 and row.kind not in TEXTS:
        return _from_environment(cursor, row, line, offset)
    return cursor.values.typed(row, line[offset:], cursor.number, offset, word)


def _beside(cursor, row, word):
    _, rest, offset = cursor.keyword_text()
    if row.kind == "phase":
        return _phase(cursor, row, rest, offset, 3)
    return cursor.values.typed(row, rest, cursor.number, offset, word)


def _from_environment(cursor, row, line, offset):
    read = cursor.values.environment_value(line, cursor.number, offset)
    if read is None or not cursor.values.in_range(row, [(read[0], offset + 1)], cursor.number):
        return None
    value = read[0]
    if row.kind == "integer" and value != int(value):
        message = f"{row.name} expects a whole number, found {value:g}"
        cursor.error(offset + 1, message, "value")
        return None
    return {"integer": int, "flag": bool}.get(row.kind, float)(value), read[1]


def _phase(cursor, row, text, offset, count):
    """Mean cosines of the three channels; beyond -1 and 1 a channel is isotropic (section 10.1)."""
    read = cursor.values.numbers(row.name, text, cursor.number, offset, (count,))
    if read is None:
        return None
    g = [value for value, _ in read[0]]
    notes = read[1] + ([make_note("isotropic-channel")] if any(abs(x) > 1 for x in g) else [])
    g = tuple(x if abs(x) <= 1 else 0.0 for x in g)
    return (g * 3 if count == 1 else g), notes
