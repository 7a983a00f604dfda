"""How relume's plugins are registered under every Mitsuba variant.

Mitsuba resolves ``mi.BSDF``, ``mi.Emitter`` and the like to the classes of the variant in use, so
a plugin class can only be defined while a variant is set, and once for each variant. A plugin file
therefore defines its class in a function `define`. Nothing is imported or defined before a scene
uses the plugin, so that a change of variant costs next to nothing.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any

import mitsuba as mi

_DEFINING = threading.RLock()
"""Mitsuba loads the objects of a scene in several threads; each class is to be defined once."""


def on_every_variant(define: Callable[[], None]) -> None:
    """Call `define()` once under each variant: now, if one is set, and whenever a new one gets set.

    Args:
        define: function without arguments that registers plugins.
    """
    defined = set()

    def visit(_old: str | None, new: str) -> None:
        if new not in defined:
            defined.add(new)
            define()

    mi.detail.add_variant_callback(visit)
    if mi.variant():
        visit(None, mi.variant())


def register_plugins(kind: str, package: str, names: tuple[str, ...]) -> None:
    """Register the plugins of a package under every variant that is or gets set.

    Args:
        kind: as in ``mi.register_bsdf``, ``mi.register_emitter`` and the like.
        package: dotted name of the package.
        names: ids of the plugins; each is defined by a module of that name, whose `define()`
            returns the class for the variant in use.
    """

    def register() -> None:
        add = getattr(mi, f"register_{kind}")
        for name in names:
            add(name, functools.partial(_make, f"{package}.{name}", mi.variant()))

    on_every_variant(register)


def _make(module: str, variant: str, props: Any) -> Any:
    with _DEFINING:
        plugin = _plugin_class(module, variant)
    return plugin(props)


@functools.cache
def _plugin_class(module: str, _variant: str) -> Any:
    return import_module(module).define()
