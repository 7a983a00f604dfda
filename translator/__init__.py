"""Scene language to Mitsuba: text, typed document, dictionary of plain values.

Nothing here knows the application above it, and only `neutral.to_mitsuba` touches Mitsuba.
"""

from translator.document import Document
from translator.parser import parse, read, read_text
from translator.scene import Translation, translate

__all__ = ["Document", "Translation", "parse", "read", "read_text", "translate"]
