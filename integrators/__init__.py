"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from relume.registration import register_plugins

PLUGINS = (
    "bdpt",
    "curvedspace",
    "dipole",
    "dopplershift",
    "erpt",
    "pssmlt",
    "randomwalk",
    "samplescale",
    "shadowcatching",
    "surfacepath",
)
"""Ids of the plugins; each has a module of its name."""

register_plugins("integrator", __name__, PLUGINS)
