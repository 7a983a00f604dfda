"""Scene language to Mitsuba: text, typed document, dictionary."""
