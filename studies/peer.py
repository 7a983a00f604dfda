"""Pictures of the original program, one feature each, against ours: docs/peer.md.

    python -m studies peer REFERENCES [--scenes NAME ...]

REFERENCES holds scenes/NAME.txt with what they need, pictures/NAME.npy, linear, and table.tsv with
the samples of a pixel and how an earlier version stood to them. Ours are rendered in dialect
`prender`. Figures are kept in docs/peer.json; the page is made from them. Exit status 1 if a scene
neither agrees nor shows a known defect.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from relume.session import CannotRender
from relume.translator.diagnostics import SceneError
from studies import DOCS, peer_pictures
from studies.peer_page import page, verdict

FIGURES = DOCS / "peer.json"
SEED = 15
MOST_SPP = 1024


def measured(folder: Path, row: dict[str, str]) -> dict[str, Any]:
    """The figures of a scene, a row of the table, as JSON values."""
    name, spp = row["scene"], int(row["spp"])
    theirs = np.load(folder / "pictures" / f"{name}.npy").astype(np.float64)
    error = np.array([float(x) for x in row["se_of_mean"].split()])
    try:
        ours = peer_pictures.render(folder / "scenes" / f"{name}.txt", min(spp, MOST_SPP), SEED)
    except (CannotRender, SceneError) as problem:
        return {"name": name, "faults": [f"not rendered: {problem}"]}
    found = peer_pictures.judge(ours, theirs, error)
    return {"name": name} | dataclasses.asdict(found)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    parser.add_argument("references", type=Path)
    parser.add_argument("--scenes", nargs="*", help="names of scenes; default: all")
    parser.add_argument("--figures", type=Path, default=FIGURES, help="file of the figures")


def run(given: argparse.Namespace) -> int:
    """Render and judge; 1 if a scene does not pass."""
    with open(given.references / "table.tsv", encoding="utf-8") as file:
        table = list(csv.DictReader(file, delimiter="\t"))
    known = json.loads(given.figures.read_text()) if given.figures.is_file() else []
    known = {figures["name"]: figures for figures in known}
    for row in table:
        if given.scenes and row["scene"] not in given.scenes:
            continue
        start = time.perf_counter()
        known[row["scene"]] = found = measured(given.references, row)
        print(f"{time.perf_counter() - start:5.1f}", json.dumps(found), row["verdict"], flush=True)
        rows = [known[name] for name in sorted(known)]
        given.figures.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n", "utf-8")
    rows = [known[name] for name in sorted(known)]
    given.figures.with_suffix(".md").write_text(page(rows), "utf-8")
    return int(any("DISAGREE" in verdict(figures) for figures in rows))
