"""Which test finds an error of 2 %: each mutation of the program is tested by itself.

    python -m studies error-injection [WORD ...]      those whose file or text holds a word

A mutation replaces a text of one file, in a copy of the tree in a temporary folder. The tests that
it names run there, up to the first that fails.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from studies import ROOT
from studies.calibration_page import merge
from studies.injected_errors import MUTATIONS

LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv", "__pycache__", ".*_cache", "out", "docs", "build"
)
NOT_PACKAGES = ("relume", "studies", "tests")


@dataclass(frozen=True)
class Copy:
    """A copy of the tree in which files are changed for a while."""

    root: Path

    @classmethod
    def of(cls, root, folder):
        """A copy of a checkout in a folder.

        Packages of relume that stand at the top of the checkout are linked into `relume` there:
        else Python takes those of the installed checkout.
        """
        tree = Path(shutil.copytree(root, folder / "tree", ignore=LEFT_OUT))
        for package in tree.glob("*/__init__.py"):
            if package.parent.name not in NOT_PACKAGES:
                link = tree / "relume" / package.parent.name
                link.symlink_to(package.parent, target_is_directory=True)
        return cls(tree)

    def finds(self, file, old, new, tests):
        """The first of `tests` to fail while `old` is replaced by `new` in a file, or None.

        Raises:
            ValueError: the file does not hold `old` exactly once, or the tests do not run.
        """
        path = self.root / file
        text = path.read_text(encoding="utf-8")
        if text.count(old) != 1:
            raise ValueError(f"{file} holds {old!r} {text.count(old)} times")
        path.write_text(text.replace(old, new), encoding="utf-8")
        try:
            return self.first_failure(tests)
        finally:
            path.write_text(text, encoding="utf-8")

    def first_failure(self, tests):
        """The first test to fail, or None if all pass."""
        command = [sys.executable, "-m", "pytest", "-x", "--tb=no", "-p", "no:cacheprovider"]
        environment = os.environ | {"PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(
            [*command, *tests], cwd=self.root, env=environment, capture_output=True, text=True
        )
        if done.returncode == 0:
            return None
        failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
        if not failed:
            raise ValueError(f"{tests}: {done.stdout[-500:]}{done.stderr[-500:]}")
        return failed[1].removeprefix("tests/").partition("[")[0]


def add_arguments(parser):
    parser.add_argument("words", nargs="*", metavar="WORD", help="of the file or the text")


def run(options):
    words = options.words
    chosen = [m for m in MUTATIONS if not words or any(w in f"{m.file} {m.says}" for w in words)]
    survivors = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy.of(ROOT, Path(folder))
        for m in chosen:
            found = copy.finds(m.file, m.old, m.new, [f"tests/{name}" for name in m.tests])
            print(f"{m.file}: {m.says}: {found}", flush=True)
            if not found and not m.equivalent:
                survivors.append(m.says)
            by = f"`{found}`" if found else f"none: {m.equivalent or 'a gap'}"
            row = {"error": m.says, "in": m.file, "found by": by}
            merge("mutations", [row], order)
    return f"not found: {'; '.join(survivors)}" if survivors else 0


def order(row):
    """Place of a row of the table: that of the mutation in the list."""
    return next((k for k, m in enumerate(MUTATIONS) if m.says == row["error"]), len(MUTATIONS))

