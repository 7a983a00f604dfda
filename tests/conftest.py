"""Importing relume first points Dr.Jit at a usable LLVM before anything imports mitsuba."""

import relume  # noqa: F401
