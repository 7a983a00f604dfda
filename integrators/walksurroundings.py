"""What walks through media have to reckon with in a scene."""

from __future__ import annotations

import mitsuba as mi

from relume.integrators.boundaries import KnownSurfaces
from relume.integrators.clearances import Clearances
from relume.integrators.flightlights import Lamps
from relume.integrators.seethrough import Surfaces
from relume.integrators.walkmedia import Media

FOLLOWED = 40.0
"""Reduced mean free paths across a scene up to which walks are followed step by step."""

OUT = 2.0
"""Radii of the scene at which walks end that an open surface has let out of it."""


class Surroundings(Surfaces):
    """What walks have to reckon with in a scene, as it is now.

    Args:
        scene: `mi.Scene`.
        camera: the medium that the sensor is in, or None.

    Attributes:
        media: `Media`.
        known: `KnownSurfaces`.
        lamps_inside: whether a lamp may be inside a medium.
        lit: whether lamps are looked for from inside media.
        center, radius: the ball out of which walks end that an open surface has let out.
    """

    def __init__(self, scene: mi.Scene, camera: mi.Medium | None) -> None:
        super().__init__(scene)
        self.media = Media(scene, camera)
        self.known = KnownSurfaces(scene)
        self.lamps_inside = self.media.exist and lamps_inside(scene)
        self.see_through |= self.lamps_inside
        self.lit = self.see_through and self.media.emitters_sampled
        self.lamps = Lamps(scene)
        sphere = scene.bbox().bounding_sphere()
        across = 2 * float(sphere.radius)
        self.clearances = Clearances(scene, across * self.media.densest > FOLLOWED)
        self.leaps = self.clearances.known and self.media.similar and self.known.white
        self.center, self.radius = mi.Point3f(sphere.center), mi.Float(OUT * sphere.radius)


def lamps_inside(scene: mi.Scene) -> bool:
    """Whether the box around some lamp meets that around a shape with a medium inside."""
    boxes = [s.bbox() for s in scene.shapes() if s.interior_medium() is not None]
    lamps = [emitter for emitter in scene.emitters() if not emitter.is_environment()]
    around = [lamp.bbox() for lamp in lamps]
    return any(lamp.valid() and lamp.overlaps(box) for lamp in around for box in boxes)
