"""Rotations, translations and scalings, and the block that holds those of the camera."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from relume.translator.cursor import Cursor
from relume.translator.forms.base import Form, assign
from relume.translator.forms.numbers import Triple, number_text
from relume.translator.keywords import Keyword


@dataclass(frozen=True)
class Transform:
    """One line of a matrix definition (spec sections 5.3 and 6.3).

    Attributes:
        kind: `rotation` (about X, then Y, then Z, right handed), `translate` or `scale`.
        values: three numbers: degrees, scene units or factors.
    """

    kind: str
    values: Triple


TRANSFORMS = {
    "rotation": "Rotate about the world's X, then Y, then Z axis, right handed [degree].",
    "translate": "Move by a vector [scene unit].",
    "scale": "Scale about the world's origin by a factor for each axis.",
}


class TransformBlock(Form):
    """A block of lines, one for each transform."""

    def read(self, row: Keyword, cursor: Cursor, word: str, target: Any) -> None:
        reports = [cursor.report(row.name)]
        transforms = []
        for _ in cursor.block_lines():
            kind = cursor.word
            if kind not in TRANSFORMS:
                cursor.unknown(kind, TRANSFORMS, f"line of {row.name}")
                continue
            with cursor.noting_problems():
                x, y, z = cursor.beside().numbers(3)
                reports.append(cursor.report(kind))
                transforms.append(Transform(kind, (x, y, z)))
        assign(target, row.field, transforms, reports)

    def lines(self, row: Keyword, value: list[Transform]) -> list[str]:
        return [row.name, *transform_lines(value), ""]

    def description(self, row: Keyword) -> str:
        return "lines of a matrix"


def transform_lines(transforms: Iterable[Transform]) -> list[str]:
    """The lines that read back as these transforms."""
    return [f"{each.kind} {number_text(each.values)}" for each in transforms]


TRANSFORM_BLOCK = TransformBlock()
