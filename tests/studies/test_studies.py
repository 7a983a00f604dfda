"""`python -m studies`: every study starts; those that can be made tiny give their figures."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from studies import ROOT, __main__, convergence, false_alarms, scaling, subsurface

NEEDED = {
    "converted": ["folder"],
    "corpus": ["charts", "folder", "--asset-path", "folder"],
    "denoising": ["folder", "--asset-path", "folder"],
    "gallery": ["folder"],
    "gravity": ["references", "folder"],
    "peer": ["references"],
    "subsurface-corpus": ["folder"],
    "peer-corpus": ["references", "corpus", "assets"],
    "scaling": ["units"],
}
"""Words without which a study does not start."""


@pytest.mark.parametrize("name", __main__.sentences())
def test_every_study_is_imported_and_takes_its_options(name, capsys):
    options = __main__.parsed(name, NEEDED.get(name, []))
    assert callable(options.study.run)
    with pytest.raises(SystemExit) as ended:
        __main__.main([name, "--help"])
    assert ended.value.code == 0
    assert __main__.sentences()[name] in capsys.readouterr().out


@pytest.mark.parametrize("file", sorted((ROOT / "studies").glob("*.py")), ids=lambda f: f.stem)
def test_what_studies_name_exists(file):
    """All of them are imported, what helps them, too, and nothing is run by that."""
    if file.stem != "__main__":
        importlib.import_module(f"studies.{file.stem}")


def test_the_command_lists_all_studies_and_refuses_others():
    command = [sys.executable, "-m", "studies"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    lines = [line.split(maxsplit=1) for line in done.stdout.splitlines()[2:]]
    assert {name: sentence for name, sentence in lines} == __main__.sentences()
    assert all(sentence.endswith(".") for _, sentence in lines)
    assert "no study 'nope'; there are bsdf-accuracy, " in __main__.main(["nope"])


def test_targets_of_the_makefile_are_studies():
    words = [
        line.split()[1]
        for line in (ROOT / "Makefile").read_text(encoding="utf-8").splitlines()
        if line.startswith("\t$(STUDY) ")
    ]
    assert set(words) == set(__main__.sentences())


def test_a_cell_of_the_study_of_convergence(tmp_path, monkeypatch, capsys):
    """Its figures, page and chart go where the study's folder is."""
    for name, value in {
        "FOLDER": tmp_path / "convergence",
        "LEVELS": [1, 2, 4],
        "RUNS": 4,
        "REFERENCE_SPP": 1,
        "SIZE": (8, 8),
        "SHOWN_SIZE": (8, 8),
        "SHOWN_SPP": 1,
    }.items():
        monkeypatch.setattr(convergence, name, value)
    monkeypatch.setattr(convergence, "LIGHTS", {"area": convergence.LIGHTS["area"]})
    monkeypatch.setattr(convergence, "MATERIALS", {"diffuse": convergence.MATERIALS["diffuse"]})
    monkeypatch.setattr("studies.convergence_page.error", lambda cell, spp: cell["errors"][0][0])
    __main__.main(["convergence", "diffuse"])
    (cell,) = json.loads((tmp_path / "convergence" / "cells.json").read_text())
    assert cell["method"] == "surfacepath" and cell["reference"] == "volpath"
    assert "| diffuse | surfacepath |" in (tmp_path / "convergence.md").read_text()
    assert (tmp_path / "convergence" / "area.png").stat().st_size > 1000
    assert "diffuse area" in capsys.readouterr().out


def test_the_model_of_the_study_of_scaling(capsys):
    """10 workers of 1e6 samples/s, 65536 pixels: 2e7 (0.001 + 0.0065536) / 65536 = 2.3 samples."""
    __main__.main(["scaling", "model", "0.001", "1e-7", "1e6"])
    assert "| 256x256 | 3 | 24 | 231 |" in capsys.readouterr().out
    assert scaling.SCENE.is_file()


def test_the_materials_of_the_study_of_subsurface_scattering(capsys):
    __main__.main(["subsurface", "materials"])
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    assert len(rows) == 1 + len(subsurface.COLUMN)


def test_counts_of_false_alarms():
    """10 of 200 are too many for a rate of 1 %, and 2 are not; Clopper and Pearson's limit of 2."""
    counts = false_alarms.AlarmCounts(0.01)
    counts.reruns, counts.alarms = 200, 2
    row = counts.row("x")
    assert row["verdict"] == "kept" and row["at most (95 %)"] == "3.1%"
    counts.alarms = 10
    assert counts.row("x")["verdict"] == "broken"
    assert Path(false_alarms.__file__).parent == ROOT / "studies"
