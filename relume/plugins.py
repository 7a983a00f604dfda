"""Importing this module has relume's plugins loaded and defined as soon as a variant is set."""

from __future__ import annotations

import functools
import importlib
from types import ModuleType

import mitsuba as mi

from relume import registration

PACKAGES = ("bsdfs", "emitters", "integrators", "phasefunctions", "sensors")

_set_variant = mi.set_variant


def load() -> list[ModuleType]:
    """The packages of relume's plugins, loaded."""
    return [importlib.import_module(f"relume.{name}") for name in PACKAGES]


@functools.wraps(_set_variant)
def _set_variant_in_turn(*names: str) -> None:
    """Set a variant once no other thread is about to.

    Mitsuba switches first and calls back then: another thread that sets the same variant meanwhile
    would return at once, and find plugins missing.
    """
    load()
    with registration.lock:
        _set_variant(*names)


def _define(_old: str | None, new: str) -> None:
    load()
    registration.define_under(new)


mi.set_variant = _set_variant_in_turn
mi.detail.add_variant_callback(_define)
if mi.variant():
    _define(None, mi.variant())
