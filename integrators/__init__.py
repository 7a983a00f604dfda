"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from . import (  # noqa: F401
    dipole,
    dispersivepath,
    erpt,
    pssmlt,
    samplescale,
    shadowcatching,
    surfacepath,
)
