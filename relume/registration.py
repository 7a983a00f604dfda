"""How a plugin file registers itself under every Mitsuba variant.

Mitsuba resolves ``mi.BSDF``, ``mi.Emitter`` and the like to the classes of the variant in use, so
a plugin class can only be defined while a variant is set, and once for each variant. A plugin file
therefore wraps its class in a function and ends with ``on_every_variant(that_function)``.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import mitsuba as mi

lock = threading.RLock()
"""Held while a variant is set and plugins are defined; who holds it imports no module of relume."""

_definitions: list[tuple[Callable[[], object], set[str]]] = []


def on_every_variant(define: Callable[[], object]) -> None:
    """Call `define()` once under each variant: now, if one is set, and whenever a new one gets set.

    Args:
        define: function without arguments that defines and registers a plugin class; it imports
            no module of relume.
    """
    _definitions.append((define, set()))
    if mi.variant():
        define_under(mi.variant())


def define_under(variant: str) -> None:
    """Define all plugins that are not defined under a variant yet.

    Args:
        variant: the one that is set.
    """
    with lock:
        for define, defined in list(_definitions):
            if variant not in defined:
                define()
                defined.add(variant)
