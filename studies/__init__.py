"""Studies: long measurements whose figures and pictures stand in docs.

    python -m studies                     lists them
    python -m studies NAME --help         tells what one measures, and its options

A study is a module here with two functions: `add_arguments(parser)` declares its options, and
`run(options)` measures; what it returns is the exit status. The first line of its docstring is its
entry in the list. Other modules help a study. None is installed with relume.
"""

from pathlib import Path

import relume  # noqa: F401  chooses LLVM before a study imports Mitsuba

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SCENES = ROOT / "scenes"
