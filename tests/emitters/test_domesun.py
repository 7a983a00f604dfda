"""`domesun` against closed forms: a sun that shines through the dome around the scene."""

import mitsuba as mi
import numpy as np
import pytest

from relume import integrators  # noqa: F401  registers the plugins

ALBEDO, SKY, SUN = 0.6, 0.7, 3.0
CENTRE, RADIUS = (2.0, -1.0, 4.0), 30.0
UNIFORM = np.full((4, 8, 3), SKY)


def sun(direction, **parameters):
    return {
        "type": "domesun",
        "direction": list(direction),
        "center": list(CENTRE),
        "radius": RADIUS,
        "irradiance": {"type": "rgb", "value": SUN},
    } | parameters


def floor(side=1.0):
    """A square in the XY plane that faces +Z."""
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().scale(side),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": ALBEDO}},
    }


def ball(center, radius):
    return {
        "type": "sphere",
        "center": list(center),
        "radius": radius,
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
    }


def scene(sensor, **things):
    path = {"type": "surfacepath", "max_depth": 2}
    return mi.load_dict({"type": "scene", "integrator": path, "sensor": sensor, **things})


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("direction", [(0, 0, -2), (3, 1, -2), (-0.5, 4, -1)])
@pytest.mark.parametrize("domed", [False, True])
def test_irradiance(direction, domed, measure, agrees, spot_meter, dome):
    """ρ (E cos θ / π + L) below a sun of irradiance E in a dome of radiance L."""
    cos = -direction[2] / np.linalg.norm(direction)
    around = {"dome": dome(UNIFORM, CENTRE, RADIUS)} if domed else {}
    things = {"sun": sun(direction), "floor": floor(), **around}
    found = measure(scene(spot_meter((1, -3, 4), (0.2, 0.3, 0), (0, 0, 1)), **things), 1024)
    agrees(found, ALBEDO * (SUN * cos / np.pi + (SKY if domed else 0)))


DIRECTION = np.array([2.0, 1.0, -2.0]) / 3
PLACE = np.array([0.5, -0.2, 0.0])


@pytest.mark.parametrize(
    ("distance", "lit"),
    [(5.0, 0), (-5.0, 1), (26.0, 0), (33.0, 1), (45.0, 1)],
    ids=["before", "behind", "inside the ball", "on its edge", "outside"],
)
def test_what_casts_a_shadow(distance, lit, spot_meter):
    """Balls on the line from a point of the floor to the sun, which meets the sphere 31.7 away."""
    x = PLACE - CENTRE
    b = x @ -DIRECTION
    assert -b + np.sqrt(b * b + RADIUS**2 - x @ x) == pytest.approx(31.68, abs=0.01)
    blocker = ball(PLACE - distance * DIRECTION, 1.0)
    sensor = spot_meter((1, -3, 6), PLACE, (0, 0, 1))
    made = scene(sensor, sun=sun(DIRECTION), floor=floor(), blocker=blocker)
    found = np.array(mi.render(made, spp=16, seed=1)).mean()
    assert found == pytest.approx(lit * ALBEDO * SUN * 2 / 3 / np.pi, rel=1e-3)


def test_points_outside_are_not_lit(spot_meter):
    """A floor that is cut by the ball is lit within it alone: a disk of the known radius."""
    rim = np.sqrt(RADIUS**2 - CENTRE[2] ** 2)
    for distance, lit in ((rim - 0.5, 1), (rim + 0.5, 0)):
        place = np.array([CENTRE[0] - distance, CENTRE[1], 0])
        sensor = spot_meter(np.add(place, (1, 1, 5)), place, (0, 1, 0))
        made = scene(sensor, sun=sun((0, 0, -1)), floor=floor(100.0))
        found = np.array(mi.render(made, spp=16, seed=1)).mean()
        assert found == pytest.approx(lit * ALBEDO * SUN / np.pi, rel=1e-3)


@pytest.mark.false_alarms(1e-3)
def test_particles_and_paths_make_the_same_picture(measure, camera, chance):
    """What leaves the inside of the sphere lights a plate that turns away from the axes."""
    plate = floor() | {"to_world": mi.ScalarTransform4f().rotate([1, 2, 0], 30).scale(2)}
    sensor = camera((0, -4, 6), (0, 0, 0), fov=50)
    small = {"radius": 4.0, "center": [0.5, 0, 0.5]}
    made = scene(sensor, sun=sun(DIRECTION, **small), plate=plate)
    particles = {"type": "ptracer", "max_depth": 2, "hide_emitters": True}
    traced = measure(made, 2048, integrator=mi.load_dict(particles))
    chance.equal(traced, measure(made, 64), allowed=2e-3, precision=1e-2)


def test_spectral_variant_and_box(spot_meter):
    """The colour of the irradiance by wavelength; the box is that of the ball."""
    mi.set_variant("llvm_ad_spectral")
    colour = sun((0, 0, -1), irradiance={"type": "rgb", "value": [1.0, 0.5, 0.25]})
    sensor = spot_meter((1, -3, 6), PLACE, (0, 0, 1), size=8)
    made = scene(sensor, sun=colour, floor=floor())
    found = np.array(mi.render(made, spp=512, seed=1)).mean((0, 1)) * np.pi / ALBEDO
    assert found == pytest.approx([1.0, 0.5, 0.25], rel=0.03)
    mi.set_variant("llvm_ad_rgb")
    box = mi.load_dict(sun((0, 0, -1))).bbox()
    assert np.allclose([box.min, box.max], np.add(CENTRE, [[-RADIUS], [RADIUS]]))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"direction": [0, 0, 0]}, "direction must be a finite vector that is not zero"),
        ({"radius": 0.0}, "radius is 0.0, but must be above 0"),
        ({"radius": float("nan")}, "radius is nan, but must be above 0"),
    ],
)
def test_errors(wrong, said):
    with pytest.raises(RuntimeError, match=said):
        mi.load_dict(sun((0, 0, -1)) | wrong)
