"""Giant spheres: the triangles that replace them, and a room of them against double precision."""

import math

import mitsuba as mi
import numpy as np
import pytest

from relume.translator import read_text, translate
from relume.translator.giant_spheres import (
    FAR_TOLERANCE,
    GIANT_RATIO,
    TOLERANCE,
    Ball,
    Surroundings,
    flat_patch,
    is_giant,
    rings,
    sphere_distance,
)
from relume.workbench.statistics import Level

BALL = Ball(np.array([1e5 + 1.0, 40.8, 81.6]), 1e5)
POLE = np.array([-1.0, 0.0, 0.0])
EXTENT = 300.0


def distances(ball, points):
    """Signed distances of points from a sphere, positive outside."""
    return np.linalg.norm(points - ball.center, axis=-1) - ball.radius


def samples(mesh):
    """Centroids and midpoints of all edges, shape (4, F, 3): a facet is deepest at one of them or
    at its circumcentre, which for the halves of a rectangle is the midpoint of the diagonal."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.stack([(a + b + c) / 3, (a + b) / 2, (b + c) / 2, (c + a) / 2])


@pytest.mark.parametrize("reach", [300.0, 5e4, None])
def test_vertices_lie_on_the_sphere(reach):
    """To the rounding of double precision, 1e-11 of the radius."""
    mesh = rings(BALL, POLE, EXTENT, reach)
    assert np.abs(distances(BALL, mesh.vertices)).max() < 1e-11 * BALL.radius


@pytest.mark.parametrize("reach", [300.0, 5e4, None])
def test_triangles_keep_to_the_tolerance(reach):
    """Within TOLERANCE extents of the sphere up to two extents from the pole; further away by
    FAR_TOLERANCE of what lies beyond more. Never outside."""
    mesh = rings(BALL, POLE, EXTENT, reach)
    points = samples(mesh)
    off = distances(BALL, points)
    arc = np.linalg.norm(mesh.vertices[mesh.faces] - (BALL.center + BALL.radius * POLE), axis=-1)
    allowed = TOLERANCE * EXTENT + FAR_TOLERANCE * np.maximum(0, arc.max(axis=1) - 2 * EXTENT)
    assert np.all(off < 1e-6)
    assert np.all(-off <= allowed * 1.001)


@pytest.mark.parametrize("reach", [300.0, 5e4, None])
def test_triangles_face_outwards(reach):
    """Counter-clockwise from outside, all but the degenerate ones at the far pole."""
    mesh = rings(BALL, POLE, EXTENT, reach)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    n = np.cross(b - a, c - a)
    area = np.linalg.norm(n, axis=1)
    outwards = np.einsum("ij,ij->i", n, (a + b + c) / 3 - BALL.center)
    whole = area > 1e-9 * area.max()
    assert np.all(outwards[whole] > 0)
    assert whole.mean() > 0.9


def boundary(mesh):
    """Directed edges without an opposite edge, (N, 2)."""
    a, b, c = mesh.faces.T
    edges = np.concatenate([np.stack(e, axis=1) for e in ((a, b), (b, c), (c, a))])
    opposite = {tuple(e) for e in edges[:, ::-1].tolist()}
    assert len({tuple(e) for e in edges.tolist()}) == len(edges)
    return np.array([e for e in edges.tolist() if tuple(e) not in opposite])


def test_a_closed_sphere_has_no_hole():
    """Each edge has its opposite but for those around the far pole, which is one point."""
    mesh = rings(BALL, POLE, EXTENT, None)
    rim = mesh.vertices[np.unique(boundary(mesh))]
    far = BALL.center - BALL.radius * POLE
    assert np.linalg.norm(rim - far, axis=1).max() < 1e-9 * BALL.radius


def test_a_cap_ends_at_its_reach():
    """Its only boundary is the circle at that distance along the sphere."""
    mesh = rings(BALL, POLE, EXTENT, 300.0)
    rim = mesh.vertices[np.unique(boundary(mesh))]
    chord = 2 * BALL.radius * np.sin(300.0 / BALL.radius / 2)
    pole = BALL.center + BALL.radius * POLE
    assert np.linalg.norm(rim - pole, axis=1) == pytest.approx(chord, rel=1e-9)


def test_area_of_a_closed_sphere():
    """4 pi R², from below; a facet that is off by d loses d / R of its area, 1e-3 at most here."""
    mesh = rings(BALL, POLE, EXTENT, None)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert 0.99 < area / (4 * np.pi * BALL.radius**2) < 1


def test_flat_patch():
    """Two triangles that touch the sphere at its pole and face outwards."""
    mesh = flat_patch(BALL, POLE, 10.0)
    assert len(mesh.faces) == 2
    assert mesh.vertices.mean(axis=0) == pytest.approx(BALL.center + BALL.radius * POLE)
    assert mesh.vertices[:, 0] == pytest.approx(1.0)
    a, b, c = mesh.vertices[mesh.faces[0]]
    assert np.cross(b - a, c - a) @ POLE > 0
    assert np.ptp(mesh.vertices[:, 1]) == pytest.approx(20.0)


def room(radius):
    """Six spheres around a box of 98 x 81.6 x 180, as `Ball`s."""
    r = radius
    centers = [(1 - r, 40.8, 90), (99 + r, 40.8, 90), (50, 40.8, -r), (50, 40.8, 180 + r),
               (50, -r, 90), (50, 81.6 + r, 90)]
    return [Ball(np.array(center, float), float(r)) for center in centers]


CAMERA = np.array([50.0, 40.0, 110.0])


def test_flat_where_the_sagitta_allows():
    """A patch is flat where its sagitta reach² / 2R stays within TOLERANCE of the extent."""
    for radius in (1e5, 1e9):
        around = Surroundings(room(radius), [], CAMERA, EXTENT)
        assert all(reach is not None for reach in around.reach)
        for k, reach in enumerate(around.reach):
            mesh, note = around.patch(k)
            flat = reach**2 / (2 * radius) <= TOLERANCE * around.extent
            assert (len(mesh.faces) == 2) == flat == (note.code == "giant-sphere-flat")
        assert flat == (radius == 1e9)


def test_a_closed_room_shows_parts_of_its_walls():
    """What is made of a wall reaches beyond every point of it that the room has."""
    around = Surroundings(room(1e5), [], CAMERA, EXTENT)
    corners = np.stack(np.meshgrid([1, 99], [0, 81.6], [0, 180]), axis=-1).reshape(-1, 3)
    for ball, reach in zip(around.giants, around.reach, strict=True):
        offset = CAMERA - ball.center
        pole = ball.center + ball.radius * offset / np.linalg.norm(offset)
        on_wall = np.abs(np.linalg.norm(corners - ball.center, axis=1) - ball.radius) < 1
        assert on_wall.sum() == 4
        assert np.linalg.norm(corners[on_wall] - pole, axis=1).max() < reach < 2000


def test_an_open_scene_shows_whole_spheres():
    """A floor alone: its horizon belongs to the picture."""
    floor = room(1e5)[4]
    around = Surroundings([floor], [], CAMERA, EXTENT)
    assert around.reach == [None]
    mesh, note = around.patch(0)
    assert np.linalg.norm(mesh.vertices - floor.center, axis=1).max() == pytest.approx(1e5)
    assert np.ptp(mesh.vertices[:, 1]) == pytest.approx(2e5)
    assert note.code == "giant-sphere-whole"


def test_what_is_giant():
    """By the radius against the coordinates of the nearest point, where rays are offset."""
    assert is_giant(BALL, CAMERA)
    assert not is_giant(Ball(np.array([50.0, 40.0, 0.0]), 100.0), CAMERA)
    edge = GIANT_RATIO * (1 + 100)
    for factor, giant in ((0.99, False), (1.01, True)):
        radius = factor * edge
        assert is_giant(Ball(np.array([100 + radius, 0, 0]), radius), np.zeros(3)) == giant


def test_distance_to_a_giant_sphere():
    """The quadratic is solved without cancellation: hits lie on the sphere to 1e-6 units."""
    random = np.random.default_rng(1)
    d = random.normal(size=(1000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = np.broadcast_to(CAMERA, d.shape)
    wall = room(1e5)[0]
    t = sphere_distance(o, d, wall)
    hit = np.isfinite(t)
    assert 0.3 < hit.mean() < 0.6
    assert np.abs(distances(wall, o[hit] + t[hit, None] * d[hit])).max() < 1e-6


# -- the room, rendered ---------------------------------------------------------------------------

ALBEDO = {0: (0.75, 0.25, 0.25), 1: (0.25, 0.25, 0.75)}
GREY = (0.75, 0.75, 0.75)
LAMP = Ball(np.array([50.0, 41.0, 150.0]), 15.0)
RADIANCE = 10.0
DEPTH = 6
"""Longest paths: emission reaches the camera by at most DEPTH - 1 reflections."""

SIZE = (64, 48)


def room_text():
    """The scene: six diffuse walls, a lamp behind the camera."""
    lines = [f"IMAGE\n{SIZE[0]} {SIZE[1]}\nCAMERA_POS\n50 40 110\nCAMERA_DIR\n0 0 -1\n"]
    for k, wall in enumerate(room(1e5)):
        x, y, z = wall.center
        r, g, b = ALBEDO.get(k, GREY)
        lines.append(f"OBJECT\nsphere {x} {y} {z} {wall.radius}\ncolor {r} {g} {b}\n"
                     "reflection diffuse\n")
    x, y, z = LAMP.center
    lines.append(f"OBJECT\nsphere {x} {y} {z} {LAMP.radius}\n"
                 f"emission {RADIANCE} {RADIANCE} {RADIANCE}\nreflection diffuse\n")
    return "\n".join(lines)


def first_hit(o, d):
    """Distance to and index of the nearest sphere, in double precision; 6 is the lamp."""
    distance, index = np.full(len(o), np.inf), np.full(len(o), -1)
    for k, ball in enumerate([*room(1e5), LAMP]):
        f = o - ball.center
        b = np.einsum("ij,ij->i", f, d)
        length = np.linalg.norm(f, axis=1)
        discriminant = b * b - (length - ball.radius) * (length + ball.radius)
        root = np.sqrt(np.maximum(discriminant, 0))
        # Walls are seen from outside, so the nearer root counts; 1e-4 keeps off the origin.
        t = (length - ball.radius) * (length + ball.radius) / np.where(b < 0, root - b, np.inf)
        t = np.where((discriminant > 0) & (t > 1e-4), t, np.inf)
        nearer = t < distance
        distance[nearer], index[nearer] = t[nearer], k
    return distance, index


def tangents(n):
    """Two unit vectors at right angles to each other and to n, (N, 3) each."""
    helper = np.where(np.abs(n[:, :1]) > 0.5, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    s = np.cross(n, helper)
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    return s, np.cross(n, s)


def around(axis, cosine, phi):
    """Unit vectors at an angle to an axis."""
    s, t = tangents(axis)
    sine = np.sqrt(np.maximum(0, 1 - cosine**2))
    return (sine * np.cos(phi))[:, None] * s + (sine * np.sin(phi))[:, None] * t + (
        cosine[:, None] * axis)


def trace(columns, rows, seed):
    """Path tracing with the true spheres: cosine sampling and next event estimation by the lamp's
    solid angle, one path for each cell of a grid over the film.

    Returns:
        Radiance of the paths, (rows, columns, 3), top row first.
    """
    random = np.random.default_rng(seed)
    count = rows * columns
    q, p = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    p = (p.ravel() + random.random(count)) / columns
    q = (q.ravel() + random.random(count)) / rows
    d = np.stack([40 * (p - 0.5), 30 * (0.5 - q), np.full(count, -40.0)], axis=1)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = np.broadcast_to(CAMERA, d.shape)
    colors = np.array([ALBEDO.get(k, GREY) for k in range(6)])
    centers = np.array([ball.center for ball in room(1e5)])
    result, throughput, at = np.zeros((count, 3)), np.ones((count, 3)), np.arange(count)
    for _ in range(DEPTH - 1):
        t, wall = first_hit(o, d)
        kept = wall < 6  # what hits the lamp has been counted by next event estimation
        o, d, wall, at, throughput = (x[kept] for x in (o, d, wall, at, throughput))
        o = o + t[kept, None] * d
        n = o - centers[wall]
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        throughput = throughput * colors[wall]
        # Next event estimation: a direction in the lamp's cone.
        to_lamp = LAMP.center - o
        away = np.linalg.norm(to_lamp, axis=1)
        cosine_max = np.sqrt(1 - (LAMP.radius / away) ** 2)
        u = random.random((4, len(o)))
        cosine = 1 - u[0] * (1 - cosine_max)
        w = around(to_lamp / away[:, None], cosine, 2 * np.pi * u[1])
        lit = np.maximum(0, np.einsum("ij,ij->i", w, n)) * (first_hit(o, w)[1] == 6)
        solid_angle = 2 * np.pi * (1 - cosine_max)
        result[at] += throughput * (RADIANCE * solid_angle * lit / np.pi)[:, None]
        d = around(n, np.sqrt(u[2]), 2 * np.pi * u[3])
    return result.reshape(rows, columns, 3)


def blocks(picture):
    """The pixels of 4 x 3 blocks: (12, pixels, 3)."""
    h, w, _ = picture.shape
    return picture.reshape(3, h // 3, 4, w // 4, 3).swapaxes(1, 2).reshape(12, -1, 3)


def paths_mean(paths, axis):
    """The `Level` of the mean of paths as if each were independent: they are stratified."""
    n = np.prod([paths.shape[k] for k in np.atleast_1d(axis)])
    mean, variance = paths.mean(axis=axis), paths.var(axis=axis) / n
    return Level(mean, variance, np.full(mean.shape, n - 1.0))


@pytest.mark.false_alarms(1e-3, reduced=4)
def test_a_room_of_giant_spheres(chance, level):
    """Mean radiance within 0.5 % of double precision; stock spheres are far off (30 % too dark).

    The reference takes 1360 x 1020 paths, which gives the mean of each channel to 0.1 %, so that
    chance alone exceeds the bound in one of 100 000. It is an upper limit of the error, as are
    those of the 12 blocks, by which these are judged: the paths are stratified over the film.
    """
    mi.set_variant("llvm_ad_rgb")
    n = math.isqrt(chance.reduced)
    reference = trace(1360 // n, 1020 // n, seed=chance.seed())
    translation = translate(read_text(room_text(), environ={}))
    ours = translation.dictionary()
    depth = {"type": "path", "max_depth": DEPTH, "rr_depth": 1000}
    ours["integrator"] = depth
    pictures = chance.runs(mi.load_dict(ours), 256, runs=8)
    whole = paths_mean(reference, (0, 1))
    assert np.all(np.sqrt(whole.variance) < 0.0011 * n * whole.mean)
    off = pictures.mean((0, 1, 2)) / whole.mean - 1
    assert np.abs(off).max() < 0.005 * n
    parts = level([blocks(picture).mean(1) for picture in pictures])
    chance.equal(parts, paths_mean(blocks(reference), 1))

    stock = dict(ours)
    walls = [name for name, entry in translation.scene.items()
             if name.startswith("object_") and entry["type"] == "mesh"]
    for k, (name, wall) in enumerate(zip(walls, room(1e5), strict=True)):
        sphere = {"type": "sphere", "center": wall.center.tolist(), "radius": wall.radius}
        stock[name] = sphere | {"bsdf": translation.scene[name]["bsdf"]}
        assert translation.scene[name]["bsdf"]["bsdf"]["reflectance"]["value"] == pytest.approx(
            list(ALBEDO.get(k, GREY)))
    picture = np.array(mi.render(mi.load_dict(stock), spp=64, seed=2))
    assert (picture.mean(axis=(0, 1)) / whole.mean - 1).max() < -0.1
