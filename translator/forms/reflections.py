"""How a surface reflects: what the `reflection` lines of an object say (spec section 8)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from relume.translator.cursor import Cursor
from relume.translator.diagnostics import LineReport
from relume.translator.expressions import clip
from relume.translator.forms.base import Form, assign
from relume.translator.forms.numbers import number_text
from relume.translator.keywords import Keyword

REFLECTIONS = {
    "diffuse": ("diffuse", "Lambert's diffuse reflection; sets `roughness` to 1."),
    "specular": ("specular", "Perfect mirror; sets `roughness` to 0."),
    "reflection": ("glass", "Smooth glass: reflection and refraction."),
    "ward_brdf": ("ward", "Ward's glossy reflection."),
    "phong_brdf": ("phong", "Phong's glossy reflection."),
    "Subsurface_Scattering": ("subsurface",
                              "Subsurface scattering behind the surface named before."),
    "reflection1": ("glass",
                    "Glass with the index of formula 1; six coefficients on the next line."),
    "reflection2": ("glass",
                    "Glass with the index of formula 2; six coefficients on the next line."),
    "reflection99": ("glass", "Glass with the index 1.4 + 50 / (lambda - 230), lambda in nm."),
}
"""What may follow `reflection`: the kind of surface and the sentence that documents it."""

DISPERSION = {"reflection1": "cauchy6", "reflection2": "sellmeier3", "reflection99": "formula99"}
"""Dispersion formulas of the glasses that have one."""

SIX_COEFFICIENTS = ("cauchy6", "sellmeier3")
"""Dispersion formulas whose coefficients the file gives."""

IMPLIED_ROUGHNESS = {"diffuse": 1.0, "specular": 0.0}
"""What a `reflection` line sets `roughness` to (spec section 8.1)."""


@dataclass(frozen=True)
class Reflection:
    """How a surface reflects: what the `reflection` lines of an object add up to.

    Attributes:
        kind: `diffuse`, `specular`, `glass`, `ward` or `phong`; None where no line says.
        subsurface: whether light scatters below that surface.
        dispersion: None, `cauchy6`, `sellmeier3` (wavelengths in micrometres) or `formula99` (nm).
        coefficients: the six coefficients of the dispersion formula; empty for `formula99`.
    """

    kind: str | None = None
    subsurface: bool = False
    dispersion: str | None = None
    coefficients: tuple[float, ...] = ()

    @property
    def lets_pass(self) -> bool:
        """Whether light crosses the surface."""
        return self.kind == "glass" or self.subsurface


class ReflectionLines(Form):
    """A model beside the keyword, for some below it six coefficients; lines of an object add up."""

    def read(self, row: Keyword, cursor: Cursor, word: str, target: Any) -> None:
        values = cursor.beside()
        model = values.text.strip()
        if model not in REFLECTIONS:
            close = cursor.nearest(model, REFLECTIONS)
            hint = (
                f"; did you mean '{close}'?" if close else f"; models are {', '.join(REFLECTIONS)}"
            )
            raise values.error(f"unknown reflection '{clip(model)}'{hint}", "keyword")
        reports = [cursor.report(word)]
        coefficients = self._coefficients(model, cursor, word, reports)
        lines = target.lines
        if model == "Subsurface_Scattering":
            target.reflection = dataclasses.replace(target.reflection, subsurface=True)
            lines.reports["subsurface"] = reports
            return
        kind = REFLECTIONS[model][0]
        # `reflection reflection` after a dispersive line or before it keeps the dispersion (8.7).
        value = Reflection(kind, False, DISPERSION.get(model), coefficients)
        assign(target, row.field, value, reports)
        lines.reports.pop("subsurface", None)
        if kind in IMPLIED_ROUGHNESS:
            target.roughness = IMPLIED_ROUGHNESS[kind]
            for old in lines.reports.pop("roughness", ()):
                old.becomes("roughness-set-by-reflection", kind=kind, line=cursor.number)

    def _coefficients(
        self, model: str, cursor: Cursor, word: str, reports: list[LineReport]
    ) -> tuple[float, ...]:
        """The six coefficients below `reflection1` and `reflection2`; missing ones are 0."""
        if DISPERSION.get(model) not in SIX_COEFFICIENTS:
            return ()
        values = cursor.below(word, "six coefficients").numbers(*range(1, 7))
        reports.append(cursor.report(word))
        if len(values) < 6:
            reports[-1].remark("missing-coefficients")
        return (*values, *[0.0] * (6 - len(values)))

    def lines(self, row: Keyword, value: Reflection) -> list[str]:
        lines = []
        surface = Reflection(value.kind, False, value.dispersion, value.coefficients)
        if surface != Reflection():
            lines.append(f"{row.name} {_model(value)}")
            lines += [number_text(value.coefficients)] if value.coefficients else []
        return lines + ([f"{row.name} Subsurface_Scattering"] if value.subsurface else [])

    def description(self, row: Keyword) -> str:
        return "a word, see Reflections"


def _model(value: Reflection) -> str:
    coefficients = 6 if value.dispersion in SIX_COEFFICIENTS else 0
    for model, (kind, _) in REFLECTIONS.items():
        same = kind == value.kind and DISPERSION.get(model) == value.dispersion
        if same and len(value.coefficients) == coefficients:
            return model
    raise ValueError(f"no reflection of the language is {value}")


REFLECTION_LINES = ReflectionLines()
