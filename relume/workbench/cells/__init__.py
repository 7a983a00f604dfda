"""The families of cells of `relume stability`, one file for each theme."""

from relume.workbench.cells import sizes

__all__ = ["sizes"]
