"""Parameters of Ward's reflection model (spec section 8.5)."""

from __future__ import annotations

from relume.translator.forms.numbers import Number
from relume.translator.keywords import Keyword
from relume.translator.outcomes import make_note
from relume.translator.values import ValueReader

OMITTED = {2: (1.0, 1.0), 3: (1.0,), 4: ()}
"""What the forms of older manuals leave out in front: rho_d and rho_s, or rho_d alone."""


class Ward(Number):
    """rho_d, rho_s, alpha_x and alpha_y; older manuals leave out the first, or the first two."""

    def value(self, row: Keyword, values: ValueReader) -> tuple[float, ...]:
        found = values.numbers(4, 3, 2)
        values.check_range(row, found)
        for alpha, column in zip(found[-2:], values.columns[-2:], strict=True):
            if alpha == 0:
                message = f"{values.name} expects alpha_x and alpha_y above 0"
                raise values.error(message, "range", column)
        if len(found) < 4:
            omitted = "rho_d 1, rho_s 1" if len(found) == 2 else "rho_d 1"
            values.notes.append(make_note("old-ward-form", count=len(found), assumed=omitted))
        return (*OMITTED[len(found)], *found)


WARD = Ward()
