"""Makes `import relume` work in the folder above a checkout that is itself named `relume`.

There Python finds this folder before the installed package. The package is the folder `relume`
below, whose subpackages stand beside it (`package-dir` in pyproject.toml).
"""

import importlib.util
import sys
from pathlib import Path

_root = Path(__file__).parent
if __name__ == "relume":
    _spec = importlib.util.spec_from_file_location(
        __name__,
        _root / "relume" / "__init__.py",
        submodule_search_locations=[str(_root / "relume"), str(_root)],
    )
    sys.modules[__name__] = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(sys.modules[__name__])
