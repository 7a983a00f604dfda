"""The user's cache folder: what lies there may be deleted at any time."""

from __future__ import annotations

from pathlib import Path


def folder() -> Path:
    """The folder of relume in the cache of the user, as the system has it; it need not exist.

    `~/.cache/relume` or below `XDG_CACHE_HOME`, on macOS `~/Library/Caches/relume`, on Windows
    `%LOCALAPPDATA%\\relume\\Cache`.
    """
    import platformdirs  # here, as most starts need no cache

    return platformdirs.user_cache_path("relume", appauthor=False)
