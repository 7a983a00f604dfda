"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from relume.registration import register_plugins

PLUGINS = ("owen",)
"""Ids of the plugins; each has a module of its name."""

register_plugins("sampler", __name__, PLUGINS)
