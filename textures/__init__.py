"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from relume.registration import register_plugins

PLUGINS = ("accretiondisk", "spheremap")
"""Ids of the plugins; each has a module of its name."""

register_plugins("texture", __name__, PLUGINS)
