"""References of the example scenes, tests/references/NAME.exr, and what tests against them see.

    python -m studies references                # of every scene, and the table README.md there
    python -m studies references glass.txt      # of one scene

With `--reruns N` it counts false alarms instead: N checks of every scene with seeds of their own.
"""

from pathlib import Path

import numpy as np

from relume.workbench.estimates import BLOCKS
from studies import ROOT, SCENES, regression

FOLDER = ROOT / "tests" / "references"
LOOSE = 0.05
"""Rate of false alarms of the reruns: so high that some are expected."""


def add_arguments(parser):
    parser.add_argument("scene", nargs="*", help="names of scene files; default: all")
    parser.add_argument("--reruns", type=int, default=0, metavar="N")
    parser.add_argument("--table", action="store_true", help="make README.md alone")


def reference(scene):
    return FOLDER / f"{scene.stem}.exr"


def row(scene):
    """What the test of a scene sees, as a row of the table."""
    check = regression.check(scene, reference(scene))
    height, width = check.reference.pixels.mean.shape[:2]
    whole, blocks = check.smallest_errors()
    made = check.about
    return (
        f"| {scene.stem} | {made['method']} | {width}x{height} | {made['runs']} x {made['spp']} "
        f"| {regression.RUNS} x {made['check_spp']} | {100 * whole.max():.1f} % "
        f"| {100 * np.median(blocks):.0f} % |"
    )


def table(scenes):
    """The text of README.md."""
    scenes = [scene for scene in scenes if reference(scene).is_file()]
    together = 1 - (1 - regression.RATE) ** len(scenes)
    return (
        f"""\
# References of the example scenes

Small pictures with the variance of every pixel, block and of the whole, against which
`tests/relume/test_scenes.py` holds what is rendered today. The attribute `relume` of each file
says how it was made. They are made again, as is this table, by

    make study-references                    # all of them
    make study-references SCENE=glass.txt    # one

when a scene or, on purpose, its picture changes; never to make a failing test pass.

A check of an unchanged scene fails in {100 * regression.RATE:.2f} % of cases (other seeds), of all
{len(scenes)} together in {100 * together:.1f} %. The last columns are the errors that a check
finds in {100 * regression.POWER:.0f} of 100 cases: of the whole picture's mean, in the channel
where it sees least, and of one block, {BLOCKS} along the longer side, the
median of all.

| scene | method | size | reference, runs x samples | check | whole | a block |
|---|---|---|---|---|---|---|
"""
        + "\n".join(map(row, scenes))
        + "\n"
    )


def count_alarms(scenes, reruns):
    """Checks that fail at the rate `LOOSE`, of all and by the level that fails."""
    failed = {"any": 0, "whole": 0, "blocks": 0, "pixels": 0}
    for scene in scenes:
        for seed in range(1, reruns + 1):
            scores = regression.check(scene, reference(scene), seed).scores(LOOSE)
            differing = [name for name, level in scores.items() if level.differ]
            for name in [*differing, *(["any"] if differing else [])]:
                failed[name] += 1
        print(scene.stem, failed, flush=True)
    checks = reruns * len(scenes)
    print(f"{failed['any']} of {checks} checks fail; {LOOSE * checks:.0f} are expected")


def run(given):
    every = sorted(SCENES.glob("*.txt"))
    checked = [scene for scene in every if scene.stem not in regression.FOUND_BY_HITS]
    scenes = [SCENES / Path(name).name for name in given.scene] or checked
    if given.reruns:
        count_alarms(scenes, given.reruns)
        return
    FOLDER.mkdir(exist_ok=True)
    if not given.table:
        for scene in scenes:
            print(scene.stem, flush=True)
            regression.make(scene, reference(scene))
    (FOLDER / "README.md").write_text(table(every), encoding="utf-8")
    size = sum(file.stat().st_size for file in FOLDER.iterdir())
    print(f"{FOLDER.relative_to(ROOT)}: {size / 1e6:.2f} MB")

