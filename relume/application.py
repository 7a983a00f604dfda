"""What relume does, from Python: read, load, render."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from relume import pilot, translator
from relume.loading import (
    SceneSource,
    for_mitsuba,
    inputs_of,
    load_scene,
    open_session,
    settle_variant,
    translated,
)
from relume.mitsuba_files import is_mitsuba_file
from relume.options import RenderOptions, kind_of
from relume.progress import Tell, TimeLimit, progress_bar
from relume.session import Scene, Session
from relume.translator import Document, Translation
from relume.translator.printer import print_document


def read(path: str | os.PathLike[str], environ: Mapping[str, str] | None = None) -> Document:
    """Read a scene file.

    Args:
        path: the file.
        environ: environment variables that override the file; by default those of the process.

    Returns:
        The typed `relume.translator.document.Document`.

    Raises:
        SceneError: every error in the file, with line and column.
        TypeError: it is no path.
        ValueError: it is that of a Mitsuba scene, which has no document.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"expected the path of a scene file, found {kind_of(path)}")
    if is_mitsuba_file(path):
        raise ValueError(f"{path}: a Mitsuba scene; relume.render, load, compare and chart take it")
    return translator.read(path, environ)


def write(document: Document, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a document as a scene file, from which `read` gets an equal document.

    Values that are the default are left out, and so are comments, which a document does not hold.

    Args:
        document: what `read` returned, changed or not.
        path: the file, written in UTF-8.
        overwrite: whether a file that exists is replaced.

    Raises:
        FileExistsError: there is such a file, and `overwrite` is false; or the document reads it,
            under whatever name.
        ValueError: a value that no scene file can hold; see `translator.printer.print_document`.
    """
    text = print_document(document)
    if overwrite and os.path.exists(path) and (name := inputs_of(document).over(path)) is not None:
        raise FileExistsError(f"cannot write {path}: the scene reads it, as {name}")
    with open(path, "w" if overwrite else "x", encoding="utf-8", newline="\n") as file:
        file.write(text)


def load(scene: SceneSource, options: RenderOptions | None = None, **changes: Any) -> Scene:
    """Load a scene for Mitsuba's own means: `mi.render`, `mi.traverse`, gradients.

    If no variant is set, that which the scene needs is set, and stays so. If one is set, the scene
    is loaded under it, provided that it renders the scene as planned.

    Args:
        scene: a scene file or Mitsuba scene (.xml), or what `read` returned.
        options: how it is rendered where that is not as the scene says. A `variant` in it is set,
            and stays so; `seed` is that of the scene's sampler.
        changes: fields of `RenderOptions`, in place of those of `options`.

    Returns:
        An `mi.Scene`, whose sampler holds the number of samples.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: the variant that is set lacks what the scene needs (the message names the one
            to set), the one asked for or the integrator does not work here, or Mitsuba refuses the
            scene.
        ValueError, TypeError: as `RenderOptions`; and the scene is neither a path nor a document.
    """
    return load_scene(_translated_for_mitsuba(scene, RenderOptions.of(options, **changes)))


def to_dict(
    scene: SceneSource, options: RenderOptions | None = None, **changes: Any
) -> dict[str, Any]:
    """The dictionary of a scene, to be changed and loaded by `mi.load_dict(..., optimize=False)`.

    With `optimize` Mitsuba 3.9 merges rectangles so that lights at infinity shine through them.

    Args:
        scene: as `load`.
        options: as `load`; the variant that is set here must still be set when it is loaded.
        changes: as `load`.

    Returns:
        What `mi.load_dict` takes: plain values, and Mitsuba objects for meshes, pictures and
        transformations.

    Raises:
        SceneError, CannotRender, ValueError, TypeError: as `load`.
    """
    return _translated_for_mitsuba(scene, RenderOptions.of(options, **changes)).dictionary()


def render(
    scene: SceneSource,
    options: RenderOptions | None = None,
    *,
    time_limit: float | None = None,
    progress: bool | Tell | None = None,
    **changes: Any,
) -> np.ndarray:
    """Render a scene.

    The variant that was set before is set again afterwards.

    Args:
        scene: a scene file or Mitsuba scene (.xml), or what `read` returned.
        options: how it is rendered where that is not as the scene says.
        time_limit: seconds of rendering (loading is not counted) after which the picture so far is
            returned, of one pass at least; `progress` tells how many samples it has. The scene's
            own `TIMELIMIT` is for the command line alone, so that the same seed always gives the
            same picture here.
        progress: True shows a bar on standard error; a function is called after each pass with a
            `relume.progress.Progress`.
        changes: fields of `RenderOptions`, in place of those of `options`.

    Returns:
        Linear RGB, array of shape (height, width, 3), float32, top row first.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: the variant or integrator does not work here, or Mitsuba refuses the scene.
        ValueError, TypeError: as `RenderOptions`; the time limit is below 0; the scene is neither a
            path nor a document.
    """
    options = RenderOptions.of(options, **changes)
    limit = TimeLimit(time_limit)
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise TypeError(f"progress: expected True or a function, found {kind_of(progress)}")
    choice = pilot.choice(translated(scene, options), options)
    with open_session(choice.translation, choice.options, scene=choice.scene) as session:
        with _telling(progress, session) as tell:
            for step in session.run():
                tell(step)
                if limit.reached(step):
                    break
        return session.image()


@contextmanager
def _telling(progress: bool | Tell | None, session: Session) -> Iterator[Tell]:
    """Context with the function that gets the progress."""
    if progress is True:
        with progress_bar(session.accumulator) as tell:
            yield tell
    else:
        yield progress or (lambda _: None)


def _translated_for_mitsuba(scene: SceneSource, options: RenderOptions) -> Translation:
    """The translation that `mi.render` renders; its variant is set then."""
    translation = translated(scene, options)
    settle_variant(translation.plan, options.variant)
    return for_mitsuba(translation, options)
