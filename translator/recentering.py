"""Scenes too small or too far from the origin for single precision, moved to where it serves.

Mitsuba computes in single precision and starts a ray off its surface by 8.9e-5 (1 + m), m being the
largest coordinate of its origin. Measured in a closed room, 1 % of the light is lost where that is
a twentieth of the room, and 15 % where it is half of it. The scene language has no such limits, so
a scene whose numbers are unfortunate is moved to the origin and enlarged: radiance does not change
under a similarity if attenuations by distance, given by length, are changed with it.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from relume.translator.camera import view
from relume.translator.forms.transforms import Transform
from relume.translator.shapes import InfinityLight

WORST = 10.0
"""Largest 1 + m over the size of a scene that is left where it is: rays start off their surface by
1e-3 of the size at most."""

SIZE = 100.0
"""About the size that a scene is enlarged to [scene unit]."""


@dataclass(frozen=True)
class Placement:
    """The similarity x -> scale (x - center); `center` is (3,) in scene units."""

    center: np.ndarray
    scale: float

    def note(self):
        """What is done, for the report."""
        done = "rendered about ({:g}, {:g}, {:g})".format(*self.center)
        return done if self.scale == 1 else f"{done}, {self.scale:g} times as large"

    def place(self, document, dialect):
        """Move the objects and the camera of a document, with a note at the first object."""
        document.objects[0].lines.remark("", f"{self.note()}: there rays keep their digits")
        seen = view(document, dialect)
        document.camera_pos = tuple(self.scale * (seen.origin - self.center))
        document.camera_dir = tuple(seen.direction)
        document.target_pos, document.camera_matrix = None, []
        document.lens = tuple(self.scale * x for x in document.lens)
        for field in ("scattering", "absorbing"):
            setattr(document, field, tuple(x / self.scale for x in getattr(document, field)))
        document.objects = [self.placed(block) for block in document.objects]

    def placed(self, block):
        """An object, moved."""
        if isinstance(block.shape, InfinityLight):
            return block
        a, b, c = block.spot_attenuation
        return dataclasses.replace(
            block,
            transforms=[
                *block.transforms,
                Transform("translate", tuple(-self.center)),
                Transform("scale", (self.scale,) * 3),
            ],
            spot_attenuation=(a, b / self.scale, c / self.scale**2),
            # It multiplies all coefficients; the search radius goes with their root (10.2).
            material_scale=block.material_scale / self.scale,
            material_r_max=block.material_r_max * math.sqrt(self.scale),
        )


def needed(center, size):
    """The `Placement` for what a scene shows, or None if it is well where it is.

    Args:
        center: its middle, (3,).
        size: its diameter [scene unit]; 0 where nothing tells it.
    """
    if not size > 0:
        return None
    reach = 1 + float(np.max(np.abs(center))) + size / 2
    if reach <= WORST * size:
        return None
    scale = 10.0 ** round(math.log10(SIZE / size)) if size < 1 else 1.0
    return Placement(np.asarray(center, float), scale)
