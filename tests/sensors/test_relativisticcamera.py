"""A camera that moves, and one that sees the whole sphere."""

import mitsuba as mi
import numpy as np
import pytest

from relume import sensors  # noqa: F401  registers the plugins

FILM = {"type": "hdrfilm", "width": 32, "height": 16}


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


def pose():
    return mi.ScalarTransform4f().look_at(origin=[1, 2, 3], target=[0, 1.5, -1], up=[0.2, 1, 0])


def rays(positions, lens=(0.3, 0.8), **entry):
    """Origins, directions, and weights at film positions (2, n)."""
    camera = mi.load_dict({"to_world": pose(), "film": FILM} | entry)
    positions = np.asarray(positions, float)
    ray, weight = camera.sample_ray(0, 0.5, mi.Point2f(*positions), mi.Point2f(*lens))
    n = positions.shape[1]
    weight = np.broadcast_to(np.array(weight).T, (n, 3))
    return np.broadcast_to(np.array(ray.o).T, (n, 3)), np.array(ray.d).T, weight


def grid(n=12):
    return np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2)).reshape(2, -1)


@pytest.mark.parametrize("lens", [{}, {"aperture_radius": 0.2, "focus_distance": 4.0}])
def test_at_rest_it_is_the_screen_camera(lens):
    entry = {"width": 1.2, "height": 0.5} | lens
    ours = rays(grid(), type="relativisticcamera", **entry)
    for a, b in zip(ours, rays(grid(), type="screencamera", **entry), strict=True):
        assert np.allclose(a, b, atol=1e-6)


@pytest.mark.parametrize("velocity", [[0.5, -0.2, 0.3], [0, 0, -0.99], [1e-4, 0, 0]])
def test_aberration(velocity):
    """cos θ' = (cos θ - β) / (1 - β cos θ) against the motion; the azimuth stays."""
    entry = {"type": "relativisticcamera", "width": 6.0, "height": 6.0}
    _, seen, _ = rays(grid(), **entry)
    _, world, _ = rays(grid(), velocity=velocity, **entry)
    beta = np.linalg.norm(velocity)
    e = np.array(velocity) / beta
    mu = seen @ e
    assert np.allclose(world @ e, (mu - beta) / (1 - beta * mu), atol=2e-6 / (1 - beta))
    across = np.cross(seen, world)
    assert np.abs(across @ e).max() < 1e-5
    assert ((world - np.outer(world @ e, e)) * (seen - np.outer(mu, e))).sum(1).min() > -1e-6
    assert (world @ e < mu + 1e-6).all()  # stars crowd ahead


def test_mollweide_names_directions():
    camera = {"type": "relativisticcamera", "projection": "mollweide", "to_world": pose()}
    axes = np.array(pose().matrix)[:3, :3]
    left, up, forward = axes.T
    p = np.array([[0.5, 0.5], [0.75, 0.5], [0.25, 0.5], [0.999999, 0.5], [0.5, 1e-6]]).T
    _, d, weight = rays(p, **camera)
    assert np.allclose(d, [forward, -left, left, -forward, up], atol=3e-3)
    assert (weight == 1).all()
    _, _, weight = rays([[0.01, 0.99, 0.9], [0.01, 0.5, 0.9]], **camera)
    assert weight[:, 0].tolist() == [0, 1, 0]


def test_mollweide_keeps_areas():
    """A pixel of any place has the same solid angle: 4π over the area of the ellipse."""
    h = 1e-3
    p = 0.5 + 0.45 * (grid(8) - 0.5) * 2 / np.sqrt(2)
    camera = {"type": "relativisticcamera", "projection": "mollweide"}
    d = [rays(p + h * np.array([[i], [j]]), **camera)[1] for i, j in ((0, 0), (1, 0), (0, 1))]
    area = np.linalg.norm(np.cross(d[1] - d[0], d[2] - d[0]), axis=1) / h**2
    assert np.allclose(area, 4 * np.pi / (np.pi / 4), rtol=0.02)


def test_motion_follows_the_projection():
    """Mollweide's directions are those in the frame of the camera, which aberration turns."""
    camera = {"type": "relativisticcamera", "projection": "mollweide"}
    _, at_rest, _ = rays(0.25 + grid() / 2, **camera)
    _, moving, _ = rays(0.25 + grid() / 2, velocity=[0, 0.5, 0], **camera)
    mu = at_rest[:, 1]
    assert np.allclose(moving[:, 1], (mu - 0.5) / (1 - 0.5 * mu), atol=1e-5)


@pytest.mark.parametrize(
    ("parameter", "message"),
    [({"velocity": [1, 0, 0]}, "velocity is"), ({"projection": "fisheye"}, "projection is")],
)
def test_bad_parameters(parameter, message):
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "relativisticcamera"} | parameter)
