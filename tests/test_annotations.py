"""Everything public states its types; `make lint` has mypy check that they are true.

Plugin classes are defined inside functions, and Mitsuba calls them: they are not looked at.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = (
    "relume",
    "translator",
    "bsdfs",
    "emitters",
    "integrators",
    "phasefunctions",
    "samplers",
    "sensors",
    "textures",
)
FILES = [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.py"))]


def unannotated(body, owner=""):
    """Names of public functions, and methods of public classes, that lack a type, with the line."""
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from unannotated(node.body, f"{node.name}.")
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if node.name.startswith("_") and node.name != "__init__":
            continue
        args = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        args += [arg for arg in (node.args.vararg, node.args.kwarg) if arg]
        bound = owner and not any(
            isinstance(d, ast.Name) and d.id == "staticmethod" for d in node.decorator_list
        )
        missing = [arg.arg for arg in args[1 if bound else 0 :] if arg.annotation is None]
        if node.returns is None:
            missing.append("return")
        if missing:
            yield f"line {node.lineno}: {owner}{node.name}: {', '.join(missing)}"


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_all_that_is_public_states_its_types(file):
    assert list(unannotated(ast.parse(file.read_text(encoding="utf-8")).body)) == []
