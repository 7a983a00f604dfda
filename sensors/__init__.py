"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from relume.sensors import screencamera  # noqa: F401
