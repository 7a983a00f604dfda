"""Importing this module registers relume's plugins under every variant, set before or after."""

import bsdfs
import emitters
import integrators
import phasefunctions
import sensors

PACKAGES = (bsdfs, emitters, integrators, phasefunctions, sensors)
