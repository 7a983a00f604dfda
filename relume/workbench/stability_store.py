"""Measured cells of `relume stability` on disk, so that a run may measure some of them or be ended.

The file `stability.json` has an object for each cell, one in a line: `method`, `scene` (the family)
and `at`, which name it, its `verdict`, and what of a `Measurement` differs from its defaults, to
five digits; `version` and `date` tell by which relume it was measured and when. Without them it is
of an earlier version, of which nothing else may be known.
"""

from __future__ import annotations

import dataclasses
import datetime
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relume.output import OutputError, replacing
from relume.version import version
from relume.workbench.cells import Cell, all_cells
from relume.workbench.stability_verdict import Measurement

NAME = "stability.json"
"""The file of a folder."""

DEFAULTS = dataclasses.asdict(Measurement())


@dataclass(frozen=True)
class Stored:
    """A cell's measurement, and of when it is.

    Attributes:
        found: the measurement.
        version: of the relume that measured it; empty if that is not known.
        date: of the measurement, as `2026-11-29`; empty if that is not known.
    """

    found: Measurement
    version: str = ""
    date: str = ""

    @property
    def earlier(self) -> bool:
        """Whether it is of another version than the one that asks."""
        return self.version != version()


class Store:
    """The measured cells of a folder.

    Args:
        folder: of the file `NAME`; it need not exist.

    Raises:
        OutputError: there is a file of that name that is none of these.
    """

    def __init__(self, folder: str | Path) -> None:
        self.path = Path(folder, NAME)
        self._cells = all_cells()
        self._stored: dict[str, Stored] = {}
        if not self.path.exists():
            return
        try:
            for entry in json.loads(self.path.read_text("utf-8"))["cells"]:
                name = "/".join(entry[key] for key in ("method", "scene", "at"))
                known = {key: entry[key] for key in DEFAULTS if key in entry}
                about = (entry.get(key, "") for key in ("version", "date"))
                self._stored[name] = Stored(Measurement(**known), *about)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise OutputError(
                f"{self.path} is not what `relume stability` writes: {error!r}; move it away, or "
                "name another folder"
            ) from error

    def has(self, cell: Cell) -> bool:
        """Whether this version of relume has measured a cell."""
        stored = self._stored.get(cell.name)
        return stored is not None and not stored.earlier

    def keep(self, cell: Cell, found: Measurement) -> None:
        """Take the measurement of a cell of the grid, to five digits, and write the file at once.

        Raises:
            OutputError: the file cannot be written.
        """
        today = datetime.date.today().isoformat()
        self._stored[cell.name] = Stored(rounded(found), version(), today)
        lines = (json.dumps(_entry(*result), ensure_ascii=False) for result in self.results())
        with replacing(self.path) as temporary:
            temporary.write_text('{"cells": [\n' + ",\n".join(lines) + "\n]}\n", "utf-8")

    def results(self) -> list[tuple[Cell, Stored]]:
        """The cells of the grid that have been measured, in their order."""
        stored = self._stored
        return [(cell, stored[cell.name]) for cell in self._cells if cell.name in stored]

    def missing(self) -> list[Cell]:
        """The cells of the grid that have not been measured."""
        return [cell for cell in self._cells if cell.name not in self._stored]


def rounded(found: Measurement) -> Measurement:
    """A measurement to five digits, those that mean something."""
    floats: dict[str, Any] = {
        name: float(f"{value:.5g}") for name, value in vars(found).items() if type(value) is float
    }
    return dataclasses.replace(found, **floats)


def _entry(cell: Cell, stored: Stored) -> dict[str, Any]:
    values = dataclasses.asdict(stored.found)
    entry = {"method": cell.method, "scene": cell.family.name, "at": cell.at}
    entry |= {"verdict": stored.found.verdict}
    entry |= {name: value for name, value in values.items() if value != DEFAULTS[name]}
    about = {"version": stored.version, "date": stored.date}
    return entry | {name: value for name, value in about.items() if value}
