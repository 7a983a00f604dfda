"""Light that reaches a pinhole: where on the film, and how densely rays of the camera go there.

A pinhole at c maps the film's position (p, q), each in [0, 1], to the direction
D = A + p B + q C. Of rays with positions uniform on the film the density per solid angle is
|D|³ / |det(A, B, C)|, as dω = |det(A, B, C)| / |D|³ dp dq.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

TOLERANCE = 0.02
"""By how many pixels a sensor may differ from the pinhole that it is taken for."""


def sensor_rays(sensor: mi.Sensor, positions: np.ndarray) -> tuple[np.ndarray, ...]:
    """Origins and directions (n, 3) of a sensor's rays, and how far they reach.

    Args:
        sensor: the sensor.
        positions: (n, 2), on the film.
    """
    p, q = (mi.Float(x.astype(np.float32)) for x in positions.T)
    time = sensor.shutter_open()
    ray, _ = sensor.sample_ray(time, 0.5, mi.Point2f(p, q), mi.Point2f(0.5))
    n = len(positions)
    o, d = (np.array([np.broadcast_to(x.numpy(), n) for x in v], float).T for v in (ray.o, ray.d))
    return o, d, np.broadcast_to(ray.maxt.numpy(), n).astype(float)


@dataclass(frozen=True)
class Pinhole:
    """A sensor that is a pinhole.

    Attributes:
        center: (3,), the hole c.
        matrix: (3, 3), columns A, B, C.
        near, far: rays begin at c + near D and end at c + far D.
    """

    center: np.ndarray
    matrix: np.ndarray
    near: float
    far: float

    @classmethod
    def of(cls, sensor: mi.Sensor, size: tuple[int, int]) -> Pinhole | None:
        """The pinhole that a sensor is; None if it is none.

        Args:
            sensor: the sensor.
            size: columns and rows of its film.
        """
        if sensor.needs_aperture_sample():
            return None
        center = np.array(sensor.bbox().min, dtype=float).reshape(3)  # that of a pinhole
        grid = (np.arange(9) + 0.5) / 9
        positions = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)
        o, d, reach = sensor_rays(sensor, positions)
        if not (np.isfinite(o).all() and np.isfinite(d).all()):
            return None
        # d x (A + p B + q C) = 0 for all rays: the null space of a linear system.
        film = np.column_stack([np.ones(len(positions)), positions])
        cross = np.zeros((len(d), 3, 3))
        cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -d[:, 2], d[:, 1], -d[:, 0]
        cross -= cross.transpose(0, 2, 1)
        system = np.einsum("nij,nk->nijk", cross, film).reshape(-1, 9)
        matrix = np.linalg.svd(system, full_matrices=False)[2][-1].reshape(3, 3)
        middle = matrix @ [1, 0.5, 0.5]
        length = np.linalg.norm(middle) * np.sign(middle @ d[len(d) // 2])
        if abs(length) < 1e-30:
            return None
        matrix = matrix / length
        if abs(np.linalg.det(matrix)) < 1e-12:
            return None
        # The rays must lead through the hole, and back to their positions.
        from_hole = np.linalg.norm(np.cross(o - center, d), axis=1)
        s, *back = np.linalg.inv(matrix) @ d.T
        error = np.abs(np.array(back).T / s[:, None] - positions) * size
        scale = 1 + np.abs(center).max()
        if not (error.max() < TOLERANCE and from_hole.max() < 1e-5 * scale):
            return None
        near = np.median(np.sum((o - center) * d, 1) * s)
        return cls(center, matrix, float(near), float(np.median(near + reach * s)))

    def prepared(self) -> PinholeOnDevice:
        """What a kernel needs of it."""
        inverse, det = np.linalg.inv(self.matrix), abs(np.linalg.det(self.matrix))
        numbers = [*inverse.ravel(), *self.center, det, self.near, min(self.far, 1e30)]
        x = [dr.opaque(mi.Float, float(number)) for number in numbers]
        return PinholeOnDevice(
            [mi.Vector3f(*x[i : i + 3]) for i in (0, 3, 6)], mi.Point3f(*x[9:12]), *x[12:]
        )


@dataclass
class SensorConnection:
    """A point as a pinhole sees it.

    Attributes:
        d: ``mi.Vector3f``, unit direction from the point to the hole.
        end: ``mi.Point3f``, where rays of the camera in that direction begin.
        squared_distance: of the hole.
        position: ``mi.Point2f`` on the film, [0, 1] inside.
        pdf: density of the camera's rays to the point [1/sr].
        active: whether rays of the camera can reach it, if nothing is in between.
    """

    d: mi.Vector3f
    end: mi.Point3f
    squared_distance: mi.Float
    position: mi.Point2f
    pdf: mi.Float
    active: mi.Bool


class PinholeOnDevice:
    """A `Pinhole` in a kernel's numbers."""

    def __init__(
        self,
        rows: list[mi.Vector3f],
        center: mi.Point3f,
        det: mi.Float,
        near: mi.Float,
        far: mi.Float,
    ) -> None:
        self.rows, self.center, self.det, self.near, self.far = rows, center, det, near, far

    def pdf(self, d: mi.Vector3f) -> mi.Float:
        """Density of the camera's rays with unit direction d [1/sr]."""
        s = dr.dot(self.rows[0], d)  # 1/|D|
        return dr.select(s > 0, dr.rcp(s * s * s * self.det), 0)

    def connect(self, p: mi.Point3f) -> SensorConnection:
        """How the camera sees a point."""
        offset = p - self.center
        d2 = dr.squared_norm(offset)
        τ = dr.dot(self.rows[0], offset)  # p = c + τ D
        inverse = dr.rcp(τ)
        position = mi.Point2f(*(dr.dot(row, offset) * inverse for row in self.rows[1:]))
        d = offset * dr.rsqrt(d2)
        return SensorConnection(
            d=-d,
            end=self.center + offset * (self.near * inverse),
            squared_distance=d2,
            position=position,
            pdf=self.pdf(d),
            active=(self.near < τ) & (self.far > τ) & (τ > 0),
        )
