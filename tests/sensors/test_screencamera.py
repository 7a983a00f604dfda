"""The screen camera: rays, weights, and the stock camera's picture where both can serve."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume import sensors  # noqa: F401  registers the plugin


@pytest.fixture(autouse=True)
def rgb():
    mi.set_variant("llvm_ad_rgb")


FILM = {"type": "hdrfilm", "width": 32, "height": 24, "pixel_format": "rgb",
        "rfilter": {"type": "box"}}


def pose():
    return mi.ScalarTransform4f().look_at(origin=[1, 2, 3], target=[0, 1.5, -1], up=[0.2, 1, 0])


def screencamera(**parameters):
    return {"type": "screencamera", "width": 1.2, "height": 0.5, "to_world": pose(), "film": FILM,
            } | parameters


def sample(entry, count=256, seed=0):
    """Film positions (from the top left), ray origins and directions, and the weights."""
    random = np.random.default_rng(seed)
    position, aperture = random.random((2, 2, count)).astype(np.float32)
    sensor = mi.load_dict(entry)
    ray, weight = sensor.sample_ray(0.25, 0.5, mi.Point2f(position), mi.Point2f(aperture))
    return position, np.array(ray.o).T, np.array(ray.d).T, weight


def test_pinhole_rays():
    """d + W (p - 1/2) r + H (1/2 - q) u with the axes of the pose, in double precision."""
    (p, q), o, d, weight = sample(screencamera())
    matrix = np.array(pose().matrix, float)
    right, up, forward = -matrix[:3, 0], matrix[:3, 1], matrix[:3, 2]
    wanted = forward + 1.2 * (p[:, None] - 0.5) * right + 0.5 * (0.5 - q[:, None]) * up
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    np.testing.assert_allclose(d, wanted, atol=1e-6)
    np.testing.assert_allclose(o, np.broadcast_to([1, 2, 3], o.shape), atol=1e-6)
    assert dr.allclose(weight, 1)


def test_lens_rays():
    """Origins on a disk in the world's XY plane; all rays of a film position meet in its focus."""
    _, _, pinhole, _ = sample(screencamera())
    _, o, d, _ = sample(screencamera(aperture_radius=0.3, focus_distance=7.0))
    lens = o - [1, 2, 3]
    assert np.abs(lens[:, 2]).max() < 1e-6
    assert 0.25 < np.linalg.norm(lens, axis=1).max() <= 0.3 + 1e-6
    focus = np.array([1, 2, 3]) + pinhole * np.abs(7.0 / pinhole[:, 2:])
    assert np.linalg.norm(np.cross(focus - o, d), axis=1).max() < 1e-5


def test_a_lens_that_focuses_far_away():
    """Rays of a film position are parallel, those beside the world's Z axis in every case."""
    _, _, pinhole, _ = sample(screencamera())
    _, _, d, _ = sample(screencamera(aperture_radius=0.3, focus_distance=1e30))
    np.testing.assert_allclose(d, pinhole, atol=1e-6)
    aside = mi.ScalarTransform4f().look_at(origin=[0, 0, 0], target=[1, 0, 0], up=[0, 1, 0])
    sensor = mi.load_dict(screencamera(aperture_radius=0.3, to_world=aside))
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(0.5), mi.Point2f(0.2, 0.6))
    np.testing.assert_allclose(np.array(ray.d).T, [[1, 0, 0]], atol=1e-6)


@pytest.mark.parametrize(
    "wrong",
    [{"width": 0.0}, {"height": float("nan")}, {"focus_distance": 0.0, "aperture_radius": 1.0}],
)
def test_sizes_are_above_0(wrong):
    with pytest.raises(RuntimeError, match=f"{next(iter(wrong))} is .*, but must be above 0"):
        mi.load_dict(screencamera(**wrong))


def test_lens_of_radius_0_is_a_pinhole():
    """No difference to the default, and no aperture sample is asked for."""
    assert not mi.load_dict(screencamera()).needs_aperture_sample()
    assert mi.load_dict(screencamera(aperture_radius=0.1)).needs_aperture_sample()
    _, o, d, _ = sample(screencamera(aperture_radius=0.0, focus_distance=7.0))
    _, o2, d2, _ = sample(screencamera())
    np.testing.assert_array_equal(o, o2)
    np.testing.assert_array_equal(d, d2)


SCENE = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 3},
    "ball": {"type": "sphere", "center": [0, 1.5, -1], "radius": 0.8},
    "lamp": {"type": "point", "position": [2, 4, 3], "intensity": 30.0},
}


@pytest.mark.parametrize("lens", [False, True])
def test_same_picture_as_the_stock_camera(lens):
    """Where pixels are square, and the lens looks along Z: equal but for rounding at edges."""
    height = 0.5
    fov = np.degrees(2 * np.arctan(height / 2))
    own = screencamera(width=height * 32 / 24)
    stock = {"type": "thinlens" if lens else "perspective", "fov": fov, "fov_axis": "y",
             "near_clip": 1e-6, "film": FILM, "to_world": pose()}
    if lens:
        target = [0, 1.5, -1]
        straight = mi.ScalarTransform4f().look_at(origin=[0, 1.5, 3], target=target, up=[0, 1, 0])
        own |= {"aperture_radius": 0.2, "focus_distance": 3.0, "to_world": straight}
        stock |= {"aperture_radius": 0.2, "focus_distance": 3.0, "to_world": straight}
    pictures = [np.array(mi.render(mi.load_dict(SCENE | {"sensor": entry}), spp=64, seed=1))
                for entry in (own, stock)]
    assert pictures[0].mean() > 0.02
    different = np.abs(pictures[0] - pictures[1]).max(axis=2) > 1e-3 * pictures[1].max()
    if lens:  # the two map the same random numbers to the lens in their own ways
        assert pictures[0].mean() == pytest.approx(pictures[1].mean(), rel=0.01)
    else:
        assert different.mean() < 0.02


def test_differentials_follow_the_pixels():
    """The base ray is that of `sample_ray`."""
    sensor = mi.load_dict(screencamera())
    position = mi.Point2f([0.2, 0.7], [0.4, 0.9])
    ray, _ = sensor.sample_ray(0.0, 0.5, position, mi.Point2f(0.5))
    same, _ = sensor.sample_ray_differential(0.0, 0.5, position, mi.Point2f(0.5))
    assert dr.allclose(ray.d, same.d) and dr.allclose(ray.o, same.o)


def test_parameters_can_be_changed():
    """`mi.traverse` shows size and lens, and a change acts on the next rays."""
    sensor = mi.load_dict(screencamera())
    parameters = mi.traverse(sensor)
    parameters["width"] = mi.Float(2.4)
    parameters.update()
    wide, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(1.0, 0.5), mi.Point2f(0.5))
    cosine = np.array(wide.d).T @ np.array(pose().matrix)[:3, 2]
    assert cosine == pytest.approx(1 / np.hypot(1, 1.2), abs=1e-6)


def test_spectral_variant():
    """Wavelengths are sampled as the stock cameras do: weights are those of the film's sampling."""
    mi.set_variant("llvm_ad_spectral")
    stock = mi.load_dict({"type": "perspective", "film": FILM, "to_world": pose()})
    own = mi.load_dict(screencamera(to_world=pose()))
    arguments = (0.0, mi.Float(0.1, 0.6), mi.Point2f(0.5), mi.Point2f(0.5))
    (ray, weight), (same, stock_weight) = own.sample_ray(*arguments), stock.sample_ray(*arguments)
    assert dr.allclose(ray.wavelengths, same.wavelengths)
    assert dr.allclose(weight, stock_weight)
    mi.set_variant("llvm_ad_rgb")


def test_box_and_text():
    """The bounding box is the camera's position."""
    sensor = mi.load_dict(screencamera())
    assert dr.allclose(sensor.bbox().min, [1, 2, 3]) and dr.allclose(sensor.bbox().max, [1, 2, 3])
    assert str(sensor).startswith("ScreenCamera[width=")


def test_crop_window():
    """Proves: a crop window shows that part of the whole picture, pixel by pixel."""
    crop = {"crop_offset_x": 10, "crop_offset_y": 4, "crop_width": 12, "crop_height": 9}
    whole, part = (
        np.array(mi.render(mi.load_dict(SCENE | {"sensor": screencamera(film=film)}), spp=256))
        for film in (FILM, FILM | crop)
    )
    part_of_whole = whole[4:13, 10:22]
    assert part.shape == part_of_whole.shape and part_of_whole.std() > 0.5 * part_of_whole.mean()
    assert np.abs(part - part_of_whole).mean() < 0.03 * part_of_whole.mean()
