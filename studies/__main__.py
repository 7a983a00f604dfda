"""The entry point of all studies: `python -m studies NAME [options]`."""

from __future__ import annotations

import argparse
import ast
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path


def sentences() -> dict[str, str]:
    """The first line of each study's docstring, by name: what defines `run` is a study."""
    found = {}
    for file in sorted(Path(__file__).parent.glob("[a-z]*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "run" for node in tree.body):
            found[file.stem.replace("_", "-")] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return found


def parsed(name: str, words: Sequence[str]) -> argparse.Namespace:
    """The options of a study; its `study` is the module.

    Args:
        name: as `sentences` lists it.
        words: of the command line.
    """
    module = importlib.import_module(f"studies.{name.replace('-', '_')}")
    parser = argparse.ArgumentParser(
        prog=f"python -m studies {name}",
        description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    module.add_arguments(parser)
    return parser.parse_args(words, argparse.Namespace(study=module))


def main(words: Sequence[str]) -> int | str | None:
    """Run the study that the first word names; without one, list all.

    Returns:
        The exit status, or a message for status 1.
    """
    known = sentences()
    if not words or words[0] in ("-h", "--help"):
        print("usage: python -m studies NAME [options]\n")
        width = max(map(len, known))
        print("\n".join(f"  {name:{width}}  {sentence}" for name, sentence in known.items()))
        return 0
    if words[0] not in known:
        return f"no study '{words[0]}'; there are {', '.join(known)}"
    options = parsed(words[0], words[1:])
    return options.study.run(options)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
