"""What commands print is for people at a terminal, and for programs at a pipe."""

import io
import os
import subprocess
import sys

import pytest
from rich.console import Console
from rich.table import Table

from relume.consoles import Piped, console

LONG = "word " * 100


def test_piped_lines_are_neither_wrapped_nor_filled_up():
    shown = io.StringIO()
    piped = Piped(file=shown)
    piped.print(LONG + "end")
    table = Table(box=None)
    table.add_column("name")
    table.add_column("text")
    table.add_row("a", LONG + "end")
    table.add_row("b", "short")
    piped.print(table)
    lines = shown.getvalue().splitlines()
    assert lines[0] == LONG + "end" and len(lines) == 4
    assert lines[2].endswith("end") and lines[3].strip() == "b     short"
    assert all(line == line.rstrip() for line in lines)


def test_sizes_are_not_coloured_as_numbers(monkeypatch):
    """rich takes the 0x140 of 320x140 for a hexadecimal number."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    made = console()
    assert isinstance(made, Console) and not isinstance(made, Piped) and made.is_terminal
    with made.capture() as shown:
        made.print("plan: 320x140, 128 spp")
    assert shown.get() == "plan: 320x140, 128 spp\n"


@pytest.mark.parametrize("columns", ["40", "200"])
def test_a_pipe_has_no_width(room, columns):
    """Whatever the width of the terminal that began the pipe."""
    path = room("BLACKHOLE 0 0 0\n\nparticipatingMedia\n1")
    code = "from relume.cli import main; main()"
    words = [sys.executable, "-c", code, "check", str(path)]
    environment = os.environ | {"COLUMNS": columns}
    run = subprocess.run(words, capture_output=True, text=True, env=environment)
    lines = run.stdout.splitlines()
    assert lines[0] == f"{path}: unsupported"
    heads = [line for line in lines if "participatingMedia" in line]
    assert len(heads) == 2 and all("where space bends there are no media" in line for line in heads)


def test_what_is_piped_is_there_at_once():
    """So that it stands before what the other stream says next."""

    class File(io.StringIO):
        flushed = ""

        def flush(self):
            self.flushed = self.getvalue()

    shown = File()
    Piped(file=shown).print("first")
    assert shown.flushed == "first\n"
