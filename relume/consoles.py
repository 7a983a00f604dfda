"""Consoles of the command line: plain lines where nobody looks at a terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console

UNWRAPPED = 100_000
"""Width of what is piped [columns]: a line stays a line, for programs that read it."""


class Piped(Console):
    """A console of a pipe or file: lines are neither wrapped nor filled up with blanks."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(highlight=False, width=UNWRAPPED, **settings)

    def print(self, *objects: Any, **settings: Any) -> None:
        """Print as `rich.console.Console.print`."""
        with self.capture() as printed:
            super().print(*objects, **settings)
        lines = printed.get().split("\n")
        self.file.write("\n".join(line.rstrip() for line in lines))
        self.file.flush()


def console(*, stderr: bool = False) -> Console:
    """The console of a command.

    Numbers are not coloured: `320x140` would be shown as a hexadecimal one.

    Args:
        stderr: whether it is that of standard error.
    """
    made = Console(stderr=stderr, highlight=False)
    return made if made.is_terminal else Piped(stderr=stderr)
