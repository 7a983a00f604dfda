"""How a scene is rendered where that is not as the scene says: one record for all entry points."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class RenderOptions:
    """What to change of a scene's own settings.

    Attributes:
        size: (width, height) in pixels instead of the scene's.
        spp: samples of a pixel instead of the scene's.
        seed: non-negative integer; the same seed gives the same picture, bit for bit.
        integrator: plugin id of an integrator instead of the planned one.
        variant: Mitsuba variant instead of the planned one.
        dialect: `manual`, or `prender` to match an old picture.
        asset_path: folders in which files that the scene names are looked for.
    """

    size: tuple[int, int] | None = None
    spp: int | None = None
    seed: int = 0
    integrator: str | None = None
    variant: str | None = None
    dialect: str = "manual"
    asset_path: Sequence[str | Path] = ()

    @classmethod
    def of(cls, options: RenderOptions | None = None, **changes: Any) -> RenderOptions:
        """`options`, or the defaults, with some fields changed.

        Raises:
            TypeError: a change that is no field.
        """
        return dataclasses.replace(options or cls(), **changes)
