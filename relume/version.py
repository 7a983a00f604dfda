"""The version of relume itself."""

import importlib.metadata
import re
from pathlib import Path


def version() -> str:
    """The version that is installed; of a checkout that is not, the one that it will have."""
    try:
        return importlib.metadata.version("relume")
    except importlib.metadata.PackageNotFoundError:
        return _of_checkout(Path(__file__).parents[1])


def _of_checkout(folder: Path) -> str:
    try:
        found = re.search(r'^version = "(.+)"', (folder / "pyproject.toml").read_text(), re.M)
    except OSError:
        found = None
    return f"{found[1]}+checkout" if found else "0+unknown"
