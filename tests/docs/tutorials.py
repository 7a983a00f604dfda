"""Runs the pages that teach, from top to bottom, as their reader would.

    python tests/docs/tutorials.py docs/start.md                   # renews the page's pictures
    python tests/docs/tutorials.py --check docs/start.md FOLDER    # holds them against the page

In a folder that holds the scene files beside the page, the text files that the page shows with a
caption, and the folder `scenes`, it

- executes the blocks marked ``python``, in one process and one namespace; an ``output`` block
  behind one says what it prints;
- executes the lines of ``console`` blocks that start with ``$ relume``; what stands below says what
  they print. A command ends with status 0, unless the next line is ``$ echo $?``.

In expected output ``...`` stands for anything, and blanks are all alike. Pictures that the page
shows from its folder ``images`` are those that its blocks write under the same name.
"""

import contextlib
import doctest
import io
import os
import re
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

import relume  # noqa: F401  isort: skip  first: it points Dr.Jit at a usable LLVM

import numpy as np
from click.testing import CliRunner
from PIL import Image

from relume.cli import main

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^```(python|output|console)\n(.*?)^```$", re.M | re.DOTALL)
FILE = re.compile(r"^```\{code-block\} text\n:caption: (\S+)\n\n(.*?)^```$", re.M | re.DOTALL)
PICTURE = re.compile(r"!\[[^\]]*\]\((images/[^)]+)\)")
MATCH = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
TOLERANCE = 4
"""Mean difference of two pictures of one scene by two machines, of 255."""


class Mismatch(Exception):
    """A page says something else than what happens."""


@contextlib.contextmanager
def inside(folder):
    """Make a folder the working directory for the time of the block."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def blocks(text):
    """The blocks of a page: their kind, their text and the line they start at."""
    for found in FENCE.finditer(text):
        yield found[1], found[2], text.count("\n", 0, found.start()) + 1


def expect(wanted, got, where):
    """Hold what was printed against what the page says.

    Raises:
        Mismatch: they differ.
    """
    if not doctest.OutputChecker().check_output(wanted.rstrip() + "\n", got.rstrip() + "\n", MATCH):
        raise Mismatch(f"{where}: expected\n{wanted}\nfound\n{got}")


def run_console(text, where):
    """Execute the commands of a console block."""
    status = None
    text = text.replace("\\\n", "")
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, wanted = part.partition("\n")
        if command == "echo $?":
            expect(wanted, str(status), where)
            status = None
            continue
        if status:
            raise Mismatch(f"{where}: exit status {status} of the command before `{command}`")
        name, *arguments = shlex.split(command)
        if name != "relume":
            raise Mismatch(f"{where}: `{name}` is not run, mark the block `sh`")
        result = CliRunner().invoke(main, arguments, env={"COLUMNS": "80"})
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        status = result.exit_code
        expect(wanted, result.output, f"{where}: {command}")
    if status:
        raise Mismatch(f"{where}: exit status {status}")


def run(page):
    """Run a page in the working directory.

    Raises:
        Mismatch: something is not as the page says.
    """
    namespace, printed = {"__name__": "tutorial"}, ""
    for kind, text, line in blocks(page.read_text(encoding="utf-8")):
        where = f"{page.name}:{line}"
        if kind == "console":
            run_console(text, where)
        elif kind == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile("\n" * line + text, str(page), "exec"), namespace)
            printed = out.getvalue()
        else:
            expect(text, printed, where)


def pictures(page):
    """The pictures that a page shows and its blocks write: of the page, and as written now."""
    for name in PICTURE.findall(page.read_text(encoding="utf-8")):
        written = Path(Path(name).name)
        if written.exists():
            yield page.parent / name, written


def same_picture(shown, written):
    """Whether two pictures show the same, but for the last digits of another machine."""
    a, b = (np.asarray(Image.open(file).convert("RGB"), np.float64) for file in (shown, written))
    return a.shape == b.shape and np.abs(a - b).mean() < TOLERANCE


def prepare(page, folder):
    """Put what a page needs into a folder."""
    for file in page.parent.glob("*.txt"):
        shutil.copy(file, folder)
    for name, text in FILE.findall(page.read_text(encoding="utf-8")):
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "scenes").symlink_to(ROOT / "scenes")


def run_in(page, folder):
    """Run a page in a folder and hold its pictures against what it shows.

    Raises:
        Mismatch: something is not as the page says.
    """
    prepare(page, folder)
    with inside(folder):
        run(page)
        for shown, written in pictures(page):
            if not same_picture(shown, written):
                raise Mismatch(f"{page.name}: {shown.name} is not what the page makes")


def renew(page):
    """Run a page and take its pictures over."""
    with tempfile.TemporaryDirectory() as folder:
        prepare(page, Path(folder))
        with inside(folder):
            run(page)
            for shown, written in pictures(page):
                shown.parent.mkdir(exist_ok=True)
                shutil.copy(written, shown)
                print(shown)


if __name__ == "__main__":
    if sys.argv[1] == "--check":
        run_in(Path(sys.argv[2]).resolve(), Path(sys.argv[3]))
    else:
        for name in sys.argv[1:]:
            renew(Path(name).resolve())
