"""Lights through scene text, each against a closed form that stands beside it.

A spot meter looks at a point of a surface. Where only delta lights shine the result has no noise:
float32 and the size of the spot are granted 3e-4. A lamp of radiance `emission` that is seen from
a Lambert surface of colour rho with the form factor F gives the radiance
rho F emission; lamps of parallel light have the irradiance pi emission, spots the intensity
pi emission, so that pi cancels against that of rho / pi.
"""

import math

import mitsuba as mi
import numpy as np
import pytest

from relume.translator import read_text, translate
from relume.workbench.statistics import Level

FLOOR = "OBJECT\nplane 0 0 0\nnormal 0 1 0\ncolor 0.5 0.4 0.3\nreflection diffuse\n\n"
RHO = np.array([0.5, 0.4, 0.3])
LAMP = "color 0 0 0\nreflection diffuse\n"


@pytest.fixture
def floor(view):
    """Scene text: the floor as seen at `target` from a point above, then some objects."""

    def text(*objects, target=(0, 0, 0), eye=(0.3, 2.0, 0.7)):
        eye = np.array(target) + eye
        return view(eye, target) + FLOOR + "".join(f"OBJECT\n{o}\n" for o in objects)

    return text


@pytest.mark.parametrize("degrees", [0, 60])
def test_beam_irradiance(floor, measure, degrees):
    """E = pi emission cos(theta), whatever the distance; zero outside the swept parallelogram."""
    s, c = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    beam = (
        f"uvplane -1 9 -1\nU 2 0 0\nV 0 0 2\nemission 2 3 4\n{LAMP}parallel_light 1\n"
        f"parallel_light_dir {3 * s:.9f} {-3 * c:.9f} 0\n"
    )
    hit = 9 * s / c
    inside = measure(floor(beam, target=(hit + 0.9, 0, -0.9)), spp=4, runs=2)
    np.testing.assert_allclose(inside.mean, RHO * np.array([2, 3, 4]) * c, rtol=3e-4)
    outside = measure(floor(beam, target=(hit + 1.1, 0, -0.9)), spp=4, runs=2)
    assert np.all(outside.mean == 0)


@pytest.mark.parametrize(("normal", "lit"), [("", False), ("normal -1\n", True)])
def test_beam_follows_the_normal(floor, measure, normal, lit):
    """Without a direction the light travels along U x V, here +Y, or against it with normal -1."""
    beam = f"uvplane -1 5 -1\nU 0 0 2\nV 2 0 0\nemission 1 1 1\n{LAMP}parallel_light 1\n{normal}"
    measured = measure(floor(beam), spp=4, runs=2)
    assert np.allclose(measured.mean, RHO * lit, rtol=2e-4)


NEE = "nextEventEstimation\n1\n\n"
"""Without it the rectangle is a lamp, too, in dialect `prender`."""


@pytest.mark.parametrize(("dialect", "u", "v"), [("manual", 2.0, 1.5), ("prender", 4.0, 2.25)])
def test_beam_footprint(view, load, dialect, u, v):
    """The lit patch begins at the corner and is |U| x |V|; in the program both lengths are squared.

    A picture of 10 x 10 units has pixels of 0.1: the edges are found to half a pixel. It is taken
    from below the lamp, whose rectangle dialect `prender` shows.
    """
    text = view((0, 2, 0), (0, 0, 0), width=5, size=(100, 100), up=(0, 0, -1)) + FLOOR + NEE
    text += f"OBJECT\nuvplane -1 3 -2\nU 2 0 0\nV 0 0 1.5\nemission 1 1 1\n{LAMP}"
    text += "parallel_light 1\nparallel_light_dir 0 -1 0\n\n"
    lit = np.array(mi.render(load(text, dialect), spp=16))[..., 0] / 0.5
    # Columns run along +X, rows along +Z.
    x, z = lit.sum(axis=1).max() / 10, lit.sum(axis=0).max() / 10
    assert (x, z) == (pytest.approx(u, abs=0.05), pytest.approx(v, abs=0.05))
    rows, columns = np.nonzero(lit > 0.5)
    assert columns.min() / 10 - 5 == pytest.approx(-1, abs=0.06)
    assert rows.min() / 10 - 5 == pytest.approx(-2, abs=0.06)


@pytest.mark.parametrize(
    ("attenuation", "t"),
    [("0 0 1", 25), ("0 1 0", 5), ("1 2 3", 86), ("0 0 0", 1), (None, 25)],
)
def test_spot_attenuation(floor, measure, attenuation, t):
    """L = rho emission / (a + b d + c d²) below the lamp at d = 5; t = 0 means 1, default 0 0 1."""
    line = f"spot_attenuation {attenuation}\n" if attenuation else ""
    lamp = f"sphere 0 5 0 0.2\nemission 20 30 40\n{LAMP}spot_light 1\n{line}"
    measured = measure(floor(lamp), spp=4, runs=2)
    np.testing.assert_allclose(measured.mean, RHO * np.array([20, 30, 40]) / t, rtol=3e-4)


@pytest.mark.parametrize("degrees", [10, 19, 22, 25, 29, 31])
def test_spot_ramp(floor, measure, degrees):
    """1 within w - f, ((cos - cos w) / (cos(w - f) - cos w))^p up to w, 0 beyond; w 30, f 10, p 3.

    On the floor at the angle a, d = 5 / cos a and the light falls in under a:
    L = rho emission ramp cos a / d².
    """
    c, outer, inner = (math.cos(math.radians(x)) for x in (degrees, 30, 20))
    ramp = min(max((c - outer) / (inner - outer), 0.0), 1.0) ** 3
    lamp = f"sphere 0 5 0 0.2\nemission 100 100 100\n{LAMP}spot_light 1\n"
    lamp += "spot_light_dir 0 -2 0\nspot_light_angle 30 10\nspot_light_falloff 3\n"
    target = 5 * math.tan(math.radians(degrees)), 0, 0
    mean = measure(floor(lamp, target=target), spp=64, runs=2).mean
    expected = RHO * 100 * ramp * c / (5 / c) ** 2
    # The spot has a width of 4e-3 of its distance, across which the ramp is not linear.
    assert np.allclose(mean, expected, rtol=3e-3, atol=0)


@pytest.mark.parametrize(("dialect", "factor"), [("manual", 1), ("prender", 2.5)])
def test_infinity_light(floor, measure, dialect, factor):
    """L = rho emission cos(theta); the length of the vector counts in the dialect prender alone."""
    sun = f"infinity_light 1.5 -2 0\nemission 2 3 4\n{LAMP}"
    measured = measure(floor(sun), spp=4, runs=2, dialect=dialect)
    expected = RHO * np.array([2, 3, 4]) * 0.8 * factor
    np.testing.assert_allclose(measured.mean, expected, rtol=3e-4)


def test_infinity_light_is_occluded(floor, measure):
    """What stands in the way of the parallel light makes a shadow."""
    ball = "sphere 0 3 0 1\ncolor 0 0 0\nreflection diffuse\n"
    text = floor(f"infinity_light 0 -1 0\nemission 1 1 1\n{LAMP}", ball)
    assert np.all(measure(text, spp=4, runs=2).mean == 0)


@pytest.mark.false_alarms(1e-3)
def test_lamps_add_up(floor, measure, agrees):
    """Two balls of light: L = rho sum of emission (R / d)² cos(theta), whole above the horizon.

    The program averages them (row several-lights).
    """
    lamps = (
        f"sphere 0 4 0 1\nemission 3 3 3\n{LAMP}",
        f"sphere 4 3 0 2\nemission 1 1 1\n{LAMP}",
    )
    expected = RHO * (3 / 16 + 4 / 25 * 0.6)
    agrees(measure(floor(*lamps, eye=(-1, 1, 2)), spp=1024), expected)


@pytest.mark.false_alarms(1e-3)
def test_equal_lamps_add_up(floor, measure, chance):
    """Two lamps that differ in nothing but their place are two lamps.

    Two hemispheres of radiance 1 share the form factor of one ball; see above.
    """
    dome = f"emission 2 2 2\n{LAMP}"
    text = floor(*(f"hemisphere {x} 2 0 1\n{dome}" for x in (-3, 3)), eye=(0, 1, 3))
    one = measure(floor(f"hemisphere -3 2 0 1\n{dome}", eye=(0, 1, 3)), spp=2048)
    twice = Level(2 * one.mean, 4 * one.variance, one.dof)
    chance.equal(measure(text, spp=2048), twice, precision=5e-3)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("normal", ["", "normal -1\n"])
def test_sphere_around_the_camera_emits_inwards(view, measure, agrees, normal):
    """A furnace: under the radiance 0.8 from everywhere a convex ball shows rho 0.8."""
    text = view((0, 0, 3), (0, 0, 1)) + f"OBJECT\nsphere 0 0 0 9\nemission 0.8 0.8 0.8\n{LAMP}"
    text += f"{normal}\nOBJECT\nsphere 0 0 0 1\ncolor 0.5 0.4 0.3\nreflection diffuse\n\n"
    agrees(measure(text), RHO * 0.8)


H = 2.0  # height of the lamps below, and their half side or radius is 1
A = 1 / H
SQUARE = 4 / math.pi * A / math.sqrt(1 + A * A) * math.atan(A / math.sqrt(1 + A * A))
"""Form factor of a square of half side a = A h seen from h below its centre (Siegel and Howell,
configuration B-4: four equal quarters, X = Y = A)."""

FLAT = {
    # pi r² / (pi (r² + h²)), the nadir of a disk
    "disk": ("disk 0 2 0 1\nnormal 0 -1 0\n", 1 / (1 + H * H)),
    "disk, turned by its normal": ("disk 0 2 0 1\nnormal 0 1 0\nnormal -1\n", 1 / (1 + H * H)),
    "disk, from behind": ("disk 0 2 0 1\nnormal 0 1 0\n", 1 / (1 + H * H)),
    "ring": ("disk2 0 2 0 1 0.5\nnormal 0 -1 0\n", 1 / (1 + H * H) - 0.25 / (0.25 + H * H)),
    "uvplane": ("uvplane -1 2 -1\nU 2 0 0\nV 0 0 2\n", SQUARE),
    "uvplane, from behind": ("uvplane -1 2 -1\nU 0 0 2\nV 2 0 0\n", 0),
    "mesh": ("objfile square.obj\nscale 1 1 1\n", SQUARE),
    "mesh, from behind": ("objfile square.obj\nnormal -1\n", SQUARE),
    # all that lies above the horizon
    "plane": ("plane 0 2 0\nnormal 0 -1 0\n", 1),
    "plane, from behind": ("plane 0 2 0\nnormal 0 1 0\n", 1),
    "hemisphere": ("hemisphere 0 0 0 5\n", 1),
    "hemisphere, turned": ("hemisphere 0 0 0 5\nnormal -1\n", 1),
    "sphere": ("sphere 0 2 0 1\n", 1 / H**2),
}


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("name", FLAT)
def test_shapes_that_shine(floor, measure, agrees, tmp_path, name):
    """Radiance rho F emission for each shape; finite planes that are lamps shine to one side alone.

    The infinite plane is a finite square here, hundreds of times its height wide: 1e-4 is missing.
    """
    square = "v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\nf 1 2 3 4\n"
    (tmp_path / "square.obj").write_text(square)
    lamp, factor = FLAT[name]
    measured = measure(floor(f"{lamp}emission 2 3 4\n{LAMP}", eye=(0.9, 0.5, 1.2)), spp=1024)
    if factor == 0:
        assert np.all(measured.mean == 0)
    else:
        agrees(measured, RHO * np.array([2, 3, 4]) * factor)


def test_background(view, measure):
    """Rays that meet nothing see BACKGROUND."""
    measured = measure(view((0, 0, 3), (0, 0, 1)) + "BACKGROUND\n0.2 0.4 3\n\n", spp=4, runs=2)
    np.testing.assert_allclose(measured.mean, [0.2, 0.4, 3], rtol=1e-5)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("keyword", ["ENV_LIGHT 0.1 0.2 0.3\n", "ENVLIGHT\n0.1 0.2 0.3\n"])
@pytest.mark.parametrize("reflection", ["diffuse", "specular"])
def test_ambient(view, measure, agrees, keyword, reflection):
    """Light added at every hit: colour 0.5 under a sky of 1 shows 0.5 + 0.1, mirror or not."""
    text = view((0, 0, 3), (0, 0, 1)) + f"BACKGROUND\n1 1 1\n\n{keyword}\nOBJECT\nsphere 0 0 0 1\n"
    text += f"color 0.5 0.5 0.5\nreflection {reflection}\n\n"
    agrees(measure(text, spp=64), [0.6, 0.7, 0.8])


@pytest.mark.false_alarms(1e-3)
def test_ambient_is_added_at_each_bounce(view, measure, agrees):
    """In a hollow ball every hit adds E and reflects rho: L = E / (1 - rho) at every place.

    With the environment variable ENVLIGHT_G the second channel has 0.4 instead.
    """
    text = view((0, 0, 0), (0, 0, 1)) + "DEPTH\n500\n\nENV_LIGHT 0.1 0.1 0.3\n\nOBJECT\n"
    text += "sphere 0 0 0 1\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    agrees(measure(text, spp=64, environ={"ENVLIGHT_G": "0.4"}), [0.2, 0.8, 0.6])


@pytest.mark.false_alarms(1e-3)
def test_ambient_spares_lamps(view, measure, agrees):
    """A lamp that does not reflect shows its emission alone; one that reflects, both."""
    sky = view((0, 0, 3), (0, 0, 1)) + "BACKGROUND\n1 1 1\n\nENV_LIGHT 0.1 0.1 0.1\n\nOBJECT\n"
    lamp = "sphere 0 0 0 1\nemission 2 2 2\nreflection diffuse\n"
    agrees(measure(f"{sky}{lamp}color 0 0 0\n", spp=64), 2, of=2)
    agrees(measure(f"{sky}{lamp}color 0.5 0.5 0.5\n", spp=256), 2.6, of=2)


@pytest.mark.parametrize("radius, kind", [(1.0, "area"), (0.01, "twosidedarea")])
def test_small_lamps_are_sampled_by_our_own_emitter(view, radius, kind):
    """From a hundredth of the scene on: stock sphere lamps of 1e-4 rad give no light."""
    text = view((0, 0, 3), (0, 0, 1)) + f"OBJECT\nsphere 0 3 0 {radius}\nemission 1 1 1\n{LAMP}"
    scene = translate(read_text(text, environ={})).scene
    assert [e["emitter"]["type"] for e in scene.values() if "emitter" in e] == [kind]


def test_spots_without_direction_and_with_wide_falloff(translated):
    """They shine down, the manual's default, and fade from the axis on."""
    spot = "OBJECT\nsphere 0 3 0 1\nemission 1 1 1\nspot_light 1\nspot_light_dir 0 0 0\n"
    found = translated(spot + "spot_light_angle 20 30\n")
    (light,) = (e for e in found.scene.values() if isinstance(e, dict) and "cutoff_angle" in e)
    assert light["direction"] == [0, -1, 0]
    assert (light["cutoff_angle"], light["falloff_angle"]) == (20, 20)
    codes = {code for r in found.document.lines.all for code in r.codes}
    assert {"spot-falloff-whole", "spot-direction-missing"} <= codes
