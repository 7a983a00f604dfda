"""Legacy scene files, lit again: an old keyword scene language rendered by Mitsuba 3.

Importing relume, or any module of it, chooses the LLVM library that Dr.Jit uses and registers
relume's plugins under every Mitsuba variant that gets set, before or after::

    import relume

    document = relume.read("room.txt")
    picture = relume.render(document, spp=64)        # (height, width, 3) float32, linear RGB
    scene = relume.translate(document)               # for mi.load_dict
    found = relume.compare("room.txt", with_="volpath")           # found.verdict(), found.report()
    measured = relume.chart("room.txt", seconds=30)               # measured.curves
    tested = relume.stability("furnace.txt", expected=1.0)        # tested.verdict()

What a name needs is loaded when it is used first, so that importing relume costs little more than
importing Mitsuba.
"""

import importlib

from relume import llvm

llvm.check_versions()
llvm.install()

from relume import plugins  # noqa: E402, F401

_HOMES = {
    "SceneError": "relume.translator.diagnostics",
    "chart": "relume.workbench.charting",
    "compare": "relume.workbench.comparing",
    "read": "relume.application",
    "render": "relume.application",
    "stability": "relume.workbench.stability",
    "translate": "relume.application",
}
__all__ = sorted(_HOMES)


def __getattr__(name):
    if name not in _HOMES:
        raise AttributeError(f"module 'relume' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__():
    return sorted({*globals(), *__all__})
