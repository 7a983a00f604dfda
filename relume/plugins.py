"""Importing this module registers relume's plugins under every variant, set before or after."""

from relume import bsdfs, emitters, integrators, phasefunctions, sensors

PACKAGES = (bsdfs, emitters, integrators, phasefunctions, sensors)
