"""Where a scene names a picture that cannot be read."""

from __future__ import annotations

from relume.translator.assets import Find
from relume.translator.diagnostics import Problem
from relume.translator.document import Document
from relume.translator.images import ImageError
from relume.translator.objects import SceneObject

PICTURES = ("texture", "bump_texture", "ibl_texture", "background_texture")
"""Keywords that name a picture."""


def picture_problem(owner: Document | SceneObject, find: Find, error: ImageError) -> Problem:
    """The problem of a picture, at the line that names it.

    Args:
        owner: the object that uses it, or the document, for the background.
        find: function from the name of a file to its path.
        error: says which picture it is, and what is wrong.

    Returns:
        A problem of kind `asset`; at the name of the mesh file where one of its materials names the
        picture.
    """
    for field in PICTURES:
        name = getattr(owner, field, None)
        if name is not None and find(name) == error.path:
            return Problem(owner.lines.line(field), len(field) + 2, str(error), "asset")
    return Problem(owner.lines.line() + 1, 1, str(error), "asset")
