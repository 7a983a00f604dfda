"""Importing this module registers relume's plugins under every variant, set before or after."""

from __future__ import annotations

import mitsuba as mi

from relume import bsdfs, emitters, integrators, phasefunctions, samplers, sensors, textures
from relume.turns import in_turn

PACKAGES = (bsdfs, emitters, integrators, phasefunctions, samplers, sensors, textures)

# Mitsuba switches variants first and calls back then: another thread that sets the same variant
# meanwhile would return at once, and find plugins missing. For the others see `turns`.
for _name in ("set_variant", "load_dict", "load_file", "load_string", "render"):
    setattr(mi, _name, in_turn(getattr(mi, _name), _name.startswith("load")))
