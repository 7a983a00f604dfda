"""Legacy scene files, lit again: an old keyword scene language rendered by Mitsuba 3.

Importing relume chooses the LLVM library that Dr.Jit uses and registers relume's plugins under
every Mitsuba variant that gets set, before or after::

    import relume

    document = relume.read("room.txt")
    picture = relume.render(document, spp=64)        # (height, width, 3) float32, linear RGB
    scene = relume.translate(document)               # for mi.load_dict
    found = relume.compare("room.txt", with_="volpath")           # found.verdict(), found.report()
    measured = relume.chart("room.txt", seconds=30)               # measured.curves
"""

from relume import llvm

llvm.check_versions()
llvm.install()

from relume import plugins  # noqa: E402, F401
from relume.application import read, render, translate  # noqa: E402
from relume.workbench.charting import chart  # noqa: E402
from relume.workbench.comparing import compare  # noqa: E402
from translator.diagnostics import SceneError  # noqa: E402

__all__ = ["SceneError", "chart", "compare", "read", "render", "translate"]
