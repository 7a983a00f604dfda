"""Light that reaches a camera: where on the film, and how densely rays of the camera go there.

A pinhole at c maps the film's position (p, q), each in [0, 1], to the direction
D = A + p B + q C. Of rays with positions uniform on the film the density per solid angle is
|D|³ / |det(A, B, C)|, as dω = |det(A, B, C)| / |D|³ dp dq.

A point c + x of a lens sends the same position to D - x (k·D), where k is a constant vector across
the lens, x·k = 0: all of them meet at c + τ D where τ k·D = 1. Of a thin lens k is its axis over
the distance of the focus plane. The map has the determinant 1 and is undone by d + x (k·d), so the
density for a point of the lens has the same det(A, B, C). Connections choose points of the lens as
densely as rays of the camera do: that density drops out of all weights.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from relume.parameters import plain

TOLERANCE = 0.02
"""By how many pixels a sensor may differ from the pinhole that it is taken for."""


def sensor_rays(
    sensor: mi.Sensor, positions: np.ndarray, aperture: tuple[float, float] = (0.5, 0.5)
) -> tuple[np.ndarray, ...]:
    """Origins and directions (n, 3) of a sensor's rays, and how far they reach.

    Args:
        sensor: the sensor.
        positions: (n, 2), on the film.
        aperture: the variates of the lens.
    """
    p, q = (mi.Float(x.astype(np.float32)) for x in positions.T)
    time = sensor.shutter_open()
    ray, _ = sensor.sample_ray(time, 0.5, mi.Point2f(p, q), mi.Point2f(*aperture))
    n = len(positions)
    o, d = (np.array([np.broadcast_to(x.numpy(), n) for x in v], float).T for v in (ray.o, ray.d))
    return o, d, np.broadcast_to(ray.maxt.numpy(), n).astype(float)


@dataclass(frozen=True)
class Lens:
    """A lens in the place of a hole.

    Attributes:
        edges: (2, 3), from its centre to its edge.
        k: (3,), see above.
    """

    edges: np.ndarray
    k: np.ndarray

    @classmethod
    def candidates(
        cls, sensor: mi.Sensor, matrix: np.ndarray, ahead: np.ndarray
    ) -> Iterator[Lens]:
        """The lenses that a sensor may have, by its parameters: across its film or the world's Z.

        Args:
            sensor: the sensor.
            matrix: (3, 3), columns A, B, C.
            ahead: a direction that it sees.
        """
        known = mi.traverse(sensor)
        if "aperture_radius" not in known or "focus_distance" not in known:
            return
        radius, focus = (plain(known[x]) for x in ("aperture_radius", "focus_distance"))
        left, up = -(matrix / np.linalg.norm(matrix, axis=0)).T[1:]
        for x, y, z in ((left, up, np.cross(left, up)), np.eye(3)):
            yield cls(radius * np.array([x, y]), z * np.sign(z @ ahead) / focus)

    def offset(self, aperture: tuple[float, float]) -> np.ndarray:
        """The point (3,) that variates choose, from the centre."""
        disk = mi.warp.square_to_uniform_disk_concentric(mi.Point2f(*aperture))
        return np.array(disk, float).ravel() @ self.edges


@dataclass(frozen=True)
class Pinhole:
    """A sensor that is a pinhole, or has a lens.

    Attributes:
        center: (3,), the hole c.
        matrix: (3, 3), columns A, B, C.
        near, far: rays begin at c + near D and end at c + far D.
        lens: `Lens`, or None.
    """

    center: np.ndarray
    matrix: np.ndarray
    near: float
    far: float
    lens: Lens | None = None

    @classmethod
    def of(cls, sensor: mi.Sensor, size: tuple[int, int]) -> Pinhole | None:
        """The pinhole that a sensor is; None if it is none.

        Args:
            sensor: the sensor.
            size: columns and rows of its film.
        """
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
        s = (np.linalg.inv(matrix) @ d.T)[0]
        near = np.median(np.sum((o - center) * d, 1) * s)
        found = cls(center, matrix, float(near), float(np.median(near + reach * s)))
        if not found.leads_back(o, d, positions, size, np.zeros(3)):
            return None
        if not sensor.needs_aperture_sample():
            return found
        for lens in Lens.candidates(sensor, matrix, d[len(d) // 2]):
            with_lens = dataclasses.replace(found, lens=lens)
            agree = []
            for x in ((0.95, 0.4), (0.3, 0.9), (0.1, 0.2)):
                o, d, _ = sensor_rays(sensor, positions, x)
                agree.append(with_lens.leads_back(o, d, positions, size, lens.offset(x)))
            if all(agree):
                return with_lens
        return None

    def leads_back(
        self,
        o: np.ndarray,
        d: np.ndarray,
        positions: np.ndarray,
        size: tuple[int, int],
        offset: np.ndarray,
    ) -> bool:
        """Whether rays lead through a point and back to their positions.

        Args:
            o: (n, 3), origins of the rays.
            d: (n, 3), their directions.
            positions: (n, 2), on the film.
            size: columns and rows of the film.
            offset: (3,), of the point from the hole.
        """
        start = self.center + offset
        if self.lens is not None:
            d = d + np.outer(d @ self.lens.k, offset)
            o = o + np.outer((o - start) @ self.lens.k, offset)
        d = d / np.linalg.norm(d, axis=1)[:, None]
        past = np.linalg.norm(np.cross(o - start, d), axis=1)
        s, *back = np.linalg.inv(self.matrix) @ d.T
        error = np.abs(np.array(back).T / s[:, None] - positions) * size
        scale = 1 + np.abs(start).max()
        return bool(error.max() < TOLERANCE and past.max() < 1e-5 * scale)

    def prepared(self) -> PinholeOnDevice:
        """What a kernel needs of it."""
        inverse, det = np.linalg.inv(self.matrix), abs(np.linalg.det(self.matrix))
        numbers = [*inverse.ravel(), *self.center, det, self.near, min(self.far, 1e30)]
        x = [dr.opaque(mi.Float, float(number)) for number in numbers]
        lens = None
        if self.lens is not None:
            vectors = (*self.lens.edges, self.lens.k)
            lens = [mi.Vector3f(*(dr.opaque(mi.Float, float(y)) for y in v)) for v in vectors]
        return PinholeOnDevice(
            [mi.Vector3f(*x[i : i + 3]) for i in (0, 3, 6)],
            mi.Point3f(*x[9:12]),
            x[12],
            x[13],
            x[14],
            lens,
        )


@dataclass
class SensorConnection:
    """A point as a point of a camera's lens, or its pinhole, sees it.

    Attributes:
        d: ``mi.Vector3f``, unit direction from the point to the camera.
        end: ``mi.Point3f``, where rays of the camera in that direction begin.
        squared_distance: of the camera.
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
        lens: list[mi.Vector3f] | None,
    ) -> None:
        self.rows, self.center, self.det, self.near, self.far = rows, center, det, near, far
        self.lens = lens

    def start(self, ray: mi.Ray3f) -> mi.Point3f:
        """Where a ray of the camera comes from: the hole, or a point of the lens."""
        if self.lens is None:
            return self.center
        k = self.lens[2]
        return ray.o - ray.d * (dr.dot(k, ray.o - self.center) / dr.dot(k, ray.d))

    def through_hole(self, v: mi.Vector3f, start: mi.Point3f) -> mi.Vector3f:
        """What leads from the hole to the same position as `v` from a point of the lens."""
        if self.lens is None:
            return v
        return v + (start - self.center) * dr.dot(self.lens[2], v)

    def pdf(self, d: mi.Vector3f, start: mi.Point3f) -> mi.Float:
        """Density of the camera's rays with unit direction d from where they start [1/sr]."""
        s = dr.dot(self.rows[0], self.through_hole(d, start))  # 1/|D|
        return dr.select(s > 0, dr.rcp(s * s * s * self.det), 0)

    def connect(self, p: mi.Point3f, aperture: mi.Point2f | None = None) -> SensorConnection:
        """How the camera sees a point.

        Args:
            p: the point.
            aperture: variates of the point of the lens, if there is one.
        """
        start = self.center
        if self.lens is not None:
            disk = mi.warp.square_to_uniform_disk_concentric(aperture)
            start = start + self.lens[0] * disk.x + self.lens[1] * disk.y
        offset = p - start
        d2 = dr.squared_norm(offset)
        at_hole = self.through_hole(offset, start)
        τ = dr.dot(self.rows[0], at_hole)  # p = start + τ D
        inverse = dr.rcp(τ)
        position = mi.Point2f(*(dr.dot(row, at_hole) * inverse for row in self.rows[1:]))
        d = offset * dr.rsqrt(d2)
        return SensorConnection(
            d=-d,
            end=start + offset * (self.near * inverse),
            squared_distance=d2,
            position=position,
            pdf=self.pdf(d, start),
            active=(self.near < τ) & (self.far > τ) & (τ > 0),
        )
