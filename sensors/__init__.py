"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from relume.registration import register_plugins

PLUGINS = ("relativisticcamera", "screencamera")
"""Ids of the plugins; each has a module of its name."""

register_plugins("sensor", __name__, PLUGINS)
