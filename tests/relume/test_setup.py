"""The set-up: every package pinned, one statement of versions, nothing to do the second time."""

import importlib.metadata
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from relume import llvm

ROOT = Path(__file__).parents[2]


def needed(name, extras=()):
    """Yield the requirements that hold here of a distribution, and of those in turn."""
    for text in importlib.metadata.requires(name) or ():
        requirement = Requirement(text)
        environments = [{"extra": extra} for extra in ("", *extras)]
        marker = requirement.marker
        if marker is None or any(marker.evaluate(environment) for environment in environments):
            yield requirement
            yield from needed(requirement.name)


def test_all_that_is_needed_is_pinned():
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [Requirement(line) for line in lines if line and not line.startswith("#")]
    pinned = {
        canonicalize_name(pin.name): pin.specifier
        for pin in pins
        if pin.marker is None or pin.marker.evaluate()
    }
    names = {canonicalize_name(requirement.name) for requirement in needed("relume", ["test"])}
    names -= {"pip", "relume"}  # the extra of the tests names that of the cluster
    assert names <= pinned.keys()
    for name in names:
        assert importlib.metadata.version(name) in pinned[name], name


def test_the_windows_checked_at_start_are_those_of_the_package():
    declared = {requirement.name: requirement.specifier for requirement in needed("relume")}
    for package, (oldest, end) in llvm.WINDOWS.items():
        assert declared[package] == SpecifierSet(f">={llvm.dotted(oldest)},<{llvm.dotted(end)}")


@pytest.fixture
def checkout(tmp_path):
    """A checkout that looks set up; `PYTHON=false` makes any further set-up fail at once."""
    if not shutil.which("make"):
        pytest.skip("no make")
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "python").symlink_to("/bin/true")
    pins = (tmp_path / "pyproject.toml").read_text() + (tmp_path / "constraints.txt").read_text()
    (tmp_path / ".venv" / ".ready").write_text(f"{tmp_path}\n{pins}")
    return tmp_path


def make_setup(directory):
    command = ["make", "--no-print-directory", "setup", "PYTHON=false"]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MA")}
    return subprocess.run(command, cwd=directory, env=environment, capture_output=True, text=True)


def test_a_second_set_up_does_nothing(checkout):
    run = make_setup(checkout)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


@pytest.mark.parametrize("change", ["pins", "interpreter", "unfinished", "moved"])
def test_what_makes_a_set_up_stale(checkout, change):
    if change == "pins":
        (checkout / "constraints.txt").write_text("numpy==2.0.0\n")
    elif change == "interpreter":
        (checkout / ".venv" / "bin" / "python").unlink()
    elif change == "unfinished":
        (checkout / ".venv" / ".ready").unlink()
    else:
        checkout = checkout.rename(checkout.with_name("elsewhere"))
    assert make_setup(checkout).returncode != 0


def test_the_set_up_tells_each_step_before_it_begins(checkout):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MA")}
    told = {
        "install": ["1 of 3", "-m venv", "2 of 3", "pip install", "3 of 3", "import relume"],
        "demo": ["Rendering an example", "relume render"],
    }
    for target, parts in told.items():
        command = ["make", "--no-print-directory", "--dry-run", target]
        run = subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True)
        places = [run.stdout.find(part) for part in parts]
        assert run.returncode == 0 and -1 not in places and places == sorted(places), run.stdout
