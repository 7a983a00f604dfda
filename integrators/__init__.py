"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from . import dipole, dispersivepath, erpt, pssmlt, samplescale, shadowcatching  # noqa: F401
