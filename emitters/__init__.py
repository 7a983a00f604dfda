"""Importing this package registers its plugins with Mitsuba, under every variant that gets set."""

from relume.emitters import falloffspot, ibldome, parallelbeam, twosidedarea  # noqa: F401
