"""The phase function of a medium: its mean cosine (spec section 10.1)."""

from __future__ import annotations

from relume.translator.forms.numbers import Number, Triple
from relume.translator.keywords import Keyword
from relume.translator.outcomes import make_note
from relume.translator.values import ValueReader


class MeanCosine(Number):
    """Mean cosines of the three channels: one number for all below, or one for each beside.

    Beyond -1 and 1 a channel is isotropic.
    """

    either_line = True

    def value(self, row: Keyword, values: ValueReader) -> Triple:
        cosines = values.numbers(1 if values.below else 3)
        if any(abs(g) > 1 for g in cosines):
            values.notes.append(make_note("isotropic-channel"))
        cosines = tuple(g if abs(g) <= 1 else 0.0 for g in cosines)
        red, green, blue = cosines * 3 if len(cosines) == 1 else cosines
        return red, green, blue

    def description(self, row: Keyword) -> str:
        return "1 number below or 3 beside"


MEAN_COSINE = MeanCosine()
