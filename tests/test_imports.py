"""Imports run one way: relume uses translator, the plugins know neither."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLUGINS = {"bsdfs", "emitters", "integrators", "phasefunctions", "sensors"}
FORBIDDEN = {package: {"relume", "translator"} for package in PLUGINS} | {
    "translator": {"relume", *PLUGINS},
    "registration.py": {"relume", "translator", *PLUGINS},
}


def imported(file):
    """Names of the packages that a file imports anywhere, with the line."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name.partition(".")[0], node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.partition(".")[0], node.lineno


@pytest.mark.parametrize("package", FORBIDDEN)
def test_imports_run_one_way(package):
    files = sorted((ROOT / package).rglob("*.py")) or [ROOT / package]
    assert files[0].exists()
    found = [
        f"{file.relative_to(ROOT)}:{line} imports {name}"
        for file in files
        for name, line in imported(file)
        if name in FORBIDDEN[package]
    ]
    assert found == []


@pytest.mark.parametrize("package", sorted(PLUGINS))
def test_every_plugin_file_registers_by_its_last_line(package):
    """One file for each plugin, named after it; helpers register nothing."""
    for file in (ROOT / package).glob("*.py"):
        text = file.read_text(encoding="utf-8")
        if "mi.register_" in text:
            assert f'("{file.stem}", ' in text
            assert text.rstrip().endswith("on_every_variant(define)"), file
