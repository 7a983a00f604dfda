"""Importing this module registers relume's plugins under every variant, set before or after."""

from __future__ import annotations

import functools
import threading

import mitsuba as mi

from relume import bsdfs, emitters, integrators, phasefunctions, samplers, sensors, textures

PACKAGES = (bsdfs, emitters, integrators, phasefunctions, samplers, sensors, textures)

_set_variant = mi.set_variant
_setting = threading.RLock()


@functools.wraps(_set_variant)
def _set_variant_in_turn(*names: str) -> None:
    """Set a variant when no other thread is about to.

    Mitsuba switches first and calls back then: another thread that sets the same variant meanwhile
    would return at once, and find plugins missing.
    """
    with _setting:
        _set_variant(*names)


mi.set_variant = _set_variant_in_turn
