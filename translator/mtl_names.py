"""Names in OBJ and MTL files, which may hold blanks and what looks like a comment."""

import re
from collections.abc import Callable


def spellings(name: str) -> list[str]:
    """What a name may mean, most literal first: as written, with its blanks no longer escaped, and
    both without what follows a ``#``.
    """
    bare = without_comment(name)
    return list(dict.fromkeys((name, name.replace("\\ ", " "), bare, bare.replace("\\ ", " "))))


def library_names(text: str, exists: Callable[[str], bool]) -> list[str]:
    """The files that the rest of a ``mtllib`` line names.

    Args:
        text: one name that may hold blanks, or several names between blanks, in which a blank of a
            name is escaped by a backslash.
        exists: whether there is a file of a name.
    """
    for spelling in spellings(text):
        if exists(spelling):
            return [spelling]
    words = re.split(r"(?<!\\)\s+", without_comment(text))
    return [word.replace("\\ ", " ") for word in words] if len(words) > 1 else [text]


def without_comment(name: str) -> str:
    """A name without what follows a ``#``."""
    return name.partition(" #")[0].rstrip()
