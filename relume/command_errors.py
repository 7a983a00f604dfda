"""Errors of users as messages of the command line."""

from __future__ import annotations

from typing import Any, Literal

import click


class readable_errors:
    """Context that turns expected failures into messages and exit status 1."""

    def __enter__(self) -> readable_errors:
        return self

    def __exit__(self, _kind: Any, error: Any, _trace: Any) -> Literal[False]:
        from relume.output import OutputError
        from relume.session import CannotRender
        from relume.translator.diagnostics import SceneError

        if isinstance(error, SceneError):
            for line in error.described():
                click.echo(line, err=True)
            raise SystemExit(1)
        if isinstance(error, OSError) and error.strerror:
            error = f"{error.filename}: {error.strerror}"
        if isinstance(error, CannotRender | OutputError | ValueError | OSError | str):
            click.echo(f"relume: {error}", err=True)
            raise SystemExit(1)
        return False
