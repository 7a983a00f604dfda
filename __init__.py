"""Makes `import relume` work in the folder above a checkout that is itself named `relume`.

There Python finds this folder before the installed package, which is the folder `relume` below.
"""

import importlib.util
import sys
from pathlib import Path

if __name__ == "relume":
    _spec = importlib.util.spec_from_file_location(
        __name__, Path(__file__).parent / "relume" / "__init__.py"
    )
    sys.modules[__name__] = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(sys.modules[__name__])
