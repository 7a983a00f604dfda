"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from . import phong, schlickglass, shadowcatcher, subsurface, ward  # noqa: F401
