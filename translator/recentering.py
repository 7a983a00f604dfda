"""Scenes too small or too far from the origin for single precision, moved to where it serves.

Mitsuba computes in single precision and starts a ray off its surface by 8.9e-5 (1 + m), m being the
largest coordinate of its origin. Measured in a closed room, 1 % of the light is lost where that is
a twentieth of the room, and 15 % where it is half of it. The scene language has no such limits, so
a scene whose numbers are unfortunate is moved to the origin and enlarged: radiance does not change
under a similarity if attenuations by distance, given by length, are changed with it.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from relume.translator.camera import view
from relume.translator.document import Document
from relume.translator.forms.numbers import Triple
from relume.translator.forms.transforms import Transform
from relume.translator.gravity import BlackHole, WormHole
from relume.translator.objects import SceneObject
from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note
from relume.translator.shapes import InfinityLight

WORST = 10.0
"""Largest 1 + m over the size of a scene that is left where it is: rays start off their surface by
1e-3 of the size at most."""

SIZE = 100.0
"""About the size that a scene is enlarged to [scene unit]."""


@dataclass(frozen=True, eq=False)
class Recentering:
    """The similarity x -> scale (x - center); `center` is (3,) in scene units."""

    center: np.ndarray
    scale: float

    def note(self) -> Note:
        """What is done, for the report."""
        x, y, z = self.center
        if self.scale == 1:
            return make_note("recentred", x=x, y=y, z=z)
        return make_note("recentred-and-scaled", x=x, y=y, z=z, scale=self.scale)

    def apply(self, document: Document, dialect: str) -> Document:
        """The document with objects, camera and medium moved; its first object says so.

        Args:
            document: the document, which shares its line reports with the result.
            dialect: `manual` or `prender`, for the camera.
        """
        document.objects[0].lines.add("", self.note())
        seen = view(document, dialect)
        radius, focus = document.lens
        return dataclasses.replace(
            document,
            camera_pos=tuple(self.scale * (seen.origin - self.center)),
            camera_dir=tuple(seen.direction),
            target_pos=None,
            camera_matrix=[],
            lens=(self.scale * radius, self.scale * focus),
            scattering=self.diluted(document.scattering),
            absorbing=self.diluted(document.absorbing),
            objects=[self.moved(block) for block in document.objects],
            gravity=[self.moved_hole(block) for block in document.gravity],
        )

    def moved_hole(self, block: BlackHole | WormHole) -> BlackHole | WormHole:
        """A block that bends space, whose scene is moved and never enlarged."""

        def moved(point: Triple | None) -> Triple | None:
            if point is None:
                return None
            x, y, z = (float(c) for c in np.array(point) - self.center)
            return x, y, z

        if isinstance(block, BlackHole):
            return dataclasses.replace(block, position=moved(block.position))
        return dataclasses.replace(
            block, entrance=moved(block.entrance), exit=moved(block.exit)
        )

    def diluted(self, coefficients: Triple) -> Triple:
        """Coefficients of a medium [1/scene unit] that is enlarged as the scene is."""
        red, green, blue = coefficients
        return red / self.scale, green / self.scale, blue / self.scale

    def moved(self, block: SceneObject) -> SceneObject:
        """An object, moved."""
        if isinstance(block.shape, InfinityLight):
            return block
        x, y, z = -self.center
        a, b, c = block.spot_attenuation
        return dataclasses.replace(
            block,
            transforms=[
                *block.transforms,
                Transform("translate", (x, y, z)),
                Transform("scale", (self.scale, self.scale, self.scale)),
            ],
            spot_attenuation=(a, b / self.scale, c / self.scale**2),
            # It multiplies all coefficients; the search radius goes with their root (10.2).
            material_scale=block.material_scale / self.scale,
            material_r_max=block.material_r_max * math.sqrt(self.scale),
        )


def recentering(center: np.ndarray, size: float, enlarge: bool = True) -> Recentering | None:
    """How to move a scene, or None if it is well where it is.

    Args:
        center: middle of what it shows, (3,).
        size: its diameter [scene unit]; 0 where nothing tells it.
        enlarge: whether it may be enlarged, too: lengths around a hole are those of its mass.
    """
    if not size > 0:
        return None
    reach = 1 + float(np.max(np.abs(center))) + size / 2
    if reach <= WORST * size:
        return None
    scale = 10.0 ** round(math.log10(SIZE / size)) if size < 1 and enlarge else 1.0
    return Recentering(np.asarray(center, float), scale)
