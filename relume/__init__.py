"""Legacy scene files, lit again: an old keyword scene language rendered by Mitsuba 3.

Importing relume, or any module of it, chooses the LLVM library that Dr.Jit uses and registers
relume's plugins under every Mitsuba variant that gets set, before or after::

    import relume

    document = relume.read("room.txt")
    picture = relume.render(document, spp=64)        # (height, width, 3) float32, linear RGB
    scene = relume.load(document)                    # mi.Scene
    found = relume.compare("room.txt", with_="volpath")           # found.verdict(), found.report()
    measured = relume.chart("room.txt", seconds=30)               # measured.curves
    tested = relume.stability("furnace.txt", expected=1.0)        # tested.verdict()

What a name needs is loaded when it is used first, so that importing relume costs little more than
importing Mitsuba.
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

# In a checkout the folders of plugins and the translator stand beside this one, see package-dir in
# pyproject.toml. Where it is imported by its place, they are found there.
_above = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
if os.path.exists(os.path.join(_above, "pyproject.toml")):
    __path__.append(_above)

from relume import llvm  # noqa: E402

llvm.check_versions()
llvm.install()

from relume import plugins  # noqa: E402, F401

if TYPE_CHECKING:
    from relume.application import load, read, render, to_dict, write
    from relume.options import RenderOptions
    from relume.session import CannotRender
    from relume.translator.diagnostics import SceneError
    from relume.translator.document import Document
    from relume.translator.scene import Translation
    from relume.workbench.charting import chart
    from relume.workbench.comparing import compare
    from relume.workbench.stability import stability

    __version__: str

__all__ = [
    "CannotRender",
    "Document",
    "RenderOptions",
    "SceneError",
    "Translation",
    "__version__",
    "chart",
    "compare",
    "load",
    "read",
    "render",
    "stability",
    "to_dict",
    "write",
]

_HOMES = {
    "CannotRender": "relume.session",
    "Document": "relume.translator.document",
    "RenderOptions": "relume.options",
    "SceneError": "relume.translator.diagnostics",
    "Translation": "relume.translator.scene",
    "chart": "relume.workbench.charting",
    "compare": "relume.workbench.comparing",
    "load": "relume.application",
    "read": "relume.application",
    "render": "relume.application",
    "stability": "relume.workbench.stability",
    "to_dict": "relume.application",
    "write": "relume.application",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from relume.version import version

        return version()
    if name not in _HOMES:
        raise AttributeError(f"module 'relume' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
