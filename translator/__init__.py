"""Scene language to Mitsuba: text, typed document, dictionary of plain values.

Nothing here knows the application above it, and only `scene_values.to_mitsuba` touches Mitsuba.
"""

from relume.translator.document import Document
from relume.translator.parser import parse, read, read_text
from relume.translator.scene import Translation, translate

__all__ = ["Document", "Translation", "parse", "read", "read_text", "translate"]
