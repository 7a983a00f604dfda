"""`relume chart` and `relume compare` on seven real scene files: docs/charts and docs/compare.

    python -m studies corpus charts FOLDER --asset-path FOLDER
    python -m studies corpus compare FOLDER --asset-path FOLDER

Charts are timed: nothing else should run. With `--only cornell` and `--keep folder` one scene after
the other can be measured; the last call makes the overview of all. Missing files have stand-ins.
"""

import os
import pickle
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path

from relume.loading import translated
from relume.options import RenderOptions
from relume.workbench import chart_files, chart_table, charting, comparing
from relume.workbench.compare_page import page, write_assets
from studies import DOCS

SCENES = {
    "cornell": "CornellBox",
    "ward": "CornellBox_金属1",
    "phong": "CornellBox_Phong1",
    "glass": "CornellBox_ガラス1",
    "spot": "CornellBox_spot光源",
    "beam": "san-miguel4",
    "ibl": "texture_test5",
}
SIZES = {"charts": (96, 72), "compare": (160, 120)}
GENERATED = "<!-- all below is written by the study -->\n"


def add_arguments(parser):
    parser.add_argument("command", choices=("charts", "compare"))
    parser.add_argument("corpus", type=Path, help="folder of scene files")
    parser.add_argument("--asset-path", type=Path, required=True)
    parser.add_argument("--out", type=Path, help="folder instead of docs/charts or docs/compare")
    parser.add_argument("--only", choices=SCENES, help="one scene")
    parser.add_argument("--keep", type=Path, help="folder of scenes measured before")
    parser.add_argument("--seconds", type=float, default=45.0, help="of each chart")
    parser.add_argument("--spp", type=int, default=256, help="samples of a pixel, of compare")


@contextmanager
def scene_folder(given):
    """Context in a folder with the scenes under plain names; yields what stands in, by scene."""
    remarks = {}
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(given.asset_path.resolve(), Path(folder, "assets"))
        for name, file in SCENES.items():
            shutil.copy(given.corpus / f"{file}.txt", Path(folder, f"{name}.txt"))
        before = Path.cwd()
        os.chdir(folder)
        try:
            for name in SCENES:
                missing = translated(Path(f"{name}.txt"), scene_options(given)).stand_ins
                remarks[name] = [f"stand-ins for {', '.join(missing)}"] if missing else []
            yield remarks
        finally:
            os.chdir(before)


def scene_options(given):
    """How the commands get the scenes."""
    return RenderOptions(size=SIZES[given.command], asset_path=("assets",), stand_ins=True)


def kept(given, name, measure):
    """What `measure` returned for a scene, perhaps in an earlier call; None if it is not wanted."""
    path = given.keep and given.keep / f"{given.command}-{name}.pickle"
    if given.only not in (None, name):
        return pickle.loads(path.read_bytes()) if path and path.exists() else None
    made = measure(f"{name}.txt")
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(made))
    return made


def study_charts(given, remarks):
    """Measure, write a chart for each scene and the overview; returns the text of README.md."""
    charts = []
    for name in SCENES:
        made = kept(
            given,
            name,
            lambda file, name=name: charting.chart(
                file, seconds=given.seconds, options=scene_options(given)
            ),
        )
        if made:
            charts.append(made)
            chart_files.write_chart(made, given.out / name)
            print("\n".join(chart_table.lines(made)), flush=True)
    chart_files.write_overview(charts, given.out)
    lines = ["![overview](overview.svg)", ""]
    for made in charts:
        rows = [chart_table.cells(row) for row in chart_table.summary(made)]
        lines += [f"## {made.name}", "", title(made.name, remarks), ""]
        lines += markdown([head for head, _ in rows[0]], [[text for _, text in r] for r in rows])
        lines += ["", f"{chart_table.explanations(made)[-1]}", ""]
        lines += [f"    {made.settings['command']}", "", f"![{made.name}]({made.name}.svg)", ""]
    versions = charts[0].settings["versions"]
    lines += [f"- {text}" for text in chart_table.explanations(charts[0])[:-1]]
    return [*lines, "", ", ".join(f"{name} {version}" for name, version in versions.items())]


def study_compare(given, remarks):
    """Compare path or what is planned with volpath; returns the text of README.md."""
    write_assets(given.out)
    lines = []
    for name in SCENES:
        found = kept(
            given,
            name,
            lambda file, name=name: comparing.compare(
                file, spp=given.spp, options=scene_options(given)
            ),
        )
        if not found:
            continue
        print(name, found.verdict(), flush=True)
        chart_files.write_text(given.out / f"{name}.html", page(found, linked=True))
        report = found.report()
        first, second = (side["efficiency"] for side in report["sides"])
        mean = max(report["energy"], key=lambda channel: abs(channel["z"]))
        lines.append(
            [
                f"[{name}]({name}.html)",
                title(name, remarks),
                report["integrator"],
                report["verdict"],
                f"{mean['ratio']:.4f} ± {mean['ratio_plus_minus']:.4f}",
                f"{report['rel_mse_debiased']:.2g}",
                f"{report['flip']:.3f}",
                f"{first / second:.2f}",
            ]
        )
    head = ["page", "scene", "method", "verdict", "ratio of means", "relMSE, debiased", "FLIP"]
    return markdown([*head, "efficiency, first over volpath"], lines)


def title(name, remarks):
    """The scene file and what stands in for its missing files."""
    return "; ".join([f"`{SCENES[name]}.txt`", *remarks[name]])


def markdown(head, rows):
    """Lines of a table."""
    lines = [f"| {' | '.join(row)} |" for row in [head, *rows]]
    return [lines[0], "|" + "---|" * len(head), *lines[1:]]


def run(given):
    for name in ("corpus", "keep"):
        if getattr(given, name):
            setattr(given, name, getattr(given, name).resolve())
    given.out = (given.out or DOCS / given.command).resolve()
    given.out.mkdir(parents=True, exist_ok=True)
    with scene_folder(given) as remarks:
        study = study_charts if given.command == "charts" else study_compare
        lines = study(given, remarks)
    readme = given.out / "README.md"
    written = readme.read_text(encoding="utf-8") if readme.exists() else GENERATED
    text = written.partition(GENERATED)[0] + GENERATED + "\n" + "\n".join(lines) + "\n"
    readme.write_text(text, encoding="utf-8")

