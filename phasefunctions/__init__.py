"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from . import hgrgb  # noqa: F401
