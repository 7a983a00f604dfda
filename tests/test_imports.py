"""Imports run one way: relume uses translator, the plugins know neither; all share a base."""

import ast
import importlib
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
PLUGINS = {"bsdfs", "emitters", "integrators", "phasefunctions", "samplers", "sensors", "textures"}
BASE = {"black_holes", "dome_maps", "hashes", "parameters", "registration"}
"""Modules that plugins build on and that know none of the rest; `black_holes` and `dome_maps` serve
the translator, too: they are formulas alone, and take no Mitsuba to import."""
FORBIDDEN = {package: {"application", "translator"} for package in PLUGINS} | {
    "translator": {"application", "registration", "parameters", *PLUGINS},
    **{f"relume/{name}.py": {"application", "translator", *PLUGINS} for name in sorted(BASE)},
}


def sources():
    """All Python files of the checkout that are ours."""
    parts = ("relume", "translator", "tests", "studies", "scenes", *sorted(PLUGINS))
    return [file for part in parts for file in sorted((ROOT / part).rglob("*.py"))]


def imported(file):
    """Dotted names of all that a file imports anywhere, with the line."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


def part_of(name):
    """The part of relume that a dotted name belongs to; `application` for all without a folder."""
    package, _, rest = name.partition(".")
    if package != "relume":
        return package
    first = rest.partition(".")[0]
    return first if first in {"translator", *BASE, *PLUGINS} else "application"


@pytest.mark.parametrize("package", sorted(FORBIDDEN))
def test_imports_run_one_way(package):
    files = sorted((ROOT / package).rglob("*.py")) or [ROOT / package]
    assert files[0].exists()
    found = [
        f"{file.relative_to(ROOT)}:{line} imports {name}"
        for file in files
        for name, line in imported(file)
        if part_of(name) in FORBIDDEN[package]
    ]
    assert found == []


def test_all_is_imported_as_relume():
    """The folders are packages below relume: by their own names they are found by chance."""
    old = {"translator", *BASE, *PLUGINS}
    found = [
        f"{file.relative_to(ROOT)}:{line} imports {name}"
        for file in sources()
        for name, line in imported(file)
        if name.partition(".")[0] in old
    ]
    assert found == []


def test_every_folder_is_a_package():
    """What setuptools installs is listed by hand: nothing is left out, nothing is invented."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    folders = {
        file.parent.relative_to(ROOT)
        for file in sources()
        if file.name == "__init__.py" and file.parts[len(ROOT.parts)] not in ("tests", "studies")
    }
    names = {".".join(f.parts if f.parts[0] == "relume" else ("relume", *f.parts)) for f in folders}
    assert set(settings["packages"]) == names


@pytest.mark.parametrize("package", sorted(PLUGINS))
def test_every_plugin_file_is_registered(package):
    """One file for each plugin, named after it; helpers define none."""
    defining = {
        file.stem
        for file in (ROOT / package).glob("*.py")
        if "\ndef define()" in file.read_text(encoding="utf-8")
    }
    assert defining == set(importlib.import_module(f"relume.{package}").PLUGINS)
