"""Tables of `docs/calibration.md`: rows are kept in CSV files, so that studies run in parts."""

import csv

from studies import DOCS

PAGE = DOCS / "calibration.md"


def merge(name, rows, order):
    """Put rows into `docs/calibration/NAME.csv` in the place of those with the same first value.

    Args:
        name: of the table.
        rows: dictionaries of strings with the same keys.
        order: function from a row to its sort key.

    Returns:
        All rows of the table.
    """
    path = DOCS / "calibration" / f"{name}.csv"
    key = next(iter(rows[0]))
    kept = {row[key]: row for row in (read(path) if path.exists() else [])}
    merged = sorted((kept | {row[key]: row for row in rows}).values(), key=order)
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(merged)
    put(name, merged)
    return merged


def read(path):
    """The rows of a CSV file as dictionaries."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def put(name, rows):
    """Replace the table between the marks `<!-- NAME -->` and `<!-- end -->` of the page."""
    header = list(rows[0])
    lines = [header, ["---"] * len(header), *([row[key] for key in header] for row in rows)]
    table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    text = PAGE.read_text(encoding="utf-8")
    mark = f"<!-- {name} -->\n"
    before, after = text.split(mark)
    after = after[after.index("<!-- end -->") :]
    PAGE.write_text(f"{before}{mark}{table}\n{after}", encoding="utf-8")
