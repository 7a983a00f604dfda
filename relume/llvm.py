"""Choose the LLVM library that Dr.Jit compiles with, before anything imports drjit."""

import importlib.metadata
import os
import re


def install():
    """Point Dr.Jit at the library of the wheel karellen-llvm-core, unless the user chose one."""
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return
    files = importlib.metadata.distribution("karellen-llvm-core").files or ()
    for file in files:
        if re.fullmatch(r"libLLVM\.so\.\d[\d.]*", file.name):
            os.environ["DRJIT_LIBLLVM_PATH"] = str(file.locate().resolve())
