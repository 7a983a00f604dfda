"""The parallelbeam emitter against closed forms, shapes at its own place and particle tracing."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

ORIGIN, U, V = np.array([-1.0, 4.0, -1.0]), np.array([2.0, 0.0, 0.5]), np.array([0.0, 0.0, 2.0])
SLANT = np.array([0.3, -1.0, 0.1])


def beam(**parameters):
    return {
        "type": "parallelbeam",
        "origin": ORIGIN.tolist(),
        "edge_u": U.tolist(),
        "edge_v": V.tolist(),
        "direction": SLANT.tolist(),
        "irradiance": {"type": "rgb", "value": [3.0, 2.0, 1.0]},
        **parameters,
    }


def in_beam(s, t, tau, direction=SLANT):
    return ORIGIN + s * U + t * V + tau * direction / np.linalg.norm(direction)


def received(emitter, points):
    it = dr.zeros(mi.SurfaceInteraction3f, len(points))
    it.p = mi.Point3f(np.asarray(points, dtype=np.float32).T)
    ds, value = emitter.sample_direction(it, mi.Point2f(0.5))
    return ds, np.array(value).T


def plate(at, normal, size=0.1, rho=0.5):
    """Lambert rectangle around `at` that faces `normal`."""
    to_world = mi.ScalarTransform4f().look_at(
        origin=list(at), target=list(np.add(at, normal)), up=[0.1, 0.2, 0.97]
    )
    return {
        "type": "rectangle",
        "to_world": to_world @ mi.ScalarTransform4f().scale(size),
        "bsdf": {"type": "diffuse", "reflectance": rho},
    }


def test_footprint_and_distance():
    """Full irradiance anywhere in the swept parallelogram, none beside or behind it."""
    emitter = mi.load_dict(beam())
    lit = [(0.01, 0.01, 0.1), (0.99, 0.99, 5.0), (0.5, 0.5, 300.0), (0.01, 0.99, 1.0)]
    dark = [(-0.01, 0.5, 1), (1.01, 0.5, 1), (0.5, -0.01, 1), (0.5, 1.01, 1), (0.5, 0.5, -1)]
    ds, value = received(emitter, [in_beam(*x) for x in lit + dark])
    expected = np.zeros((9, 3))
    expected[:4] = [3, 2, 1]
    np.testing.assert_allclose(value, expected, rtol=1e-6)
    np.testing.assert_array_equal(np.array(ds.pdf), [1] * 4 + [0] * 5)
    np.testing.assert_allclose(np.array(ds.dist)[:4], [x[2] for x in lit], rtol=1e-4)
    feet = np.array(ds.p).T[[0, 1, 3]]
    np.testing.assert_allclose(feet, [in_beam(*lit[i][:2], 0) for i in (0, 1, 3)], atol=1e-5)


@pytest.mark.parametrize("tilt", [0.0, 35.0, 70.0])
def test_tilted_plate(tilt, measure, spot_meter):
    """L = rho / pi E cos(tilt) on a Lambert plate turned by `tilt` from the beam, without noise."""
    at = in_beam(0.4, 0.6, 3.0)
    d = -SLANT / np.linalg.norm(SLANT)
    side = np.cross(d, [0, 0, 1])
    side /= np.linalg.norm(side)
    normal = np.cos(np.radians(tilt)) * d + np.sin(np.radians(tilt)) * side
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "beam": beam(irradiance=4.0),
            "plate": plate(at, normal),
            "sensor": spot_meter(at + 2 * normal, at),
        }
    )
    expected = 0.5 / np.pi * 4.0 * np.cos(np.radians(tilt))
    np.testing.assert_allclose(measure(scene, spp=4, runs=2).mean, expected, rtol=5e-4)


def test_default_direction_is_the_normal():
    """Without `direction` light leaves along U x V; to_world carries the whole beam along."""
    parameters = beam(to_world=mi.ScalarTransform4f().rotate([0, 0, 1], 180))
    del parameters["direction"]
    emitter = mi.load_dict(parameters)
    normal = np.cross(U, V) / np.linalg.norm(np.cross(U, V))
    turn = np.array([-1, -1, 1])
    points = [(ORIGIN + 0.5 * U + 0.5 * V + tau * normal) * turn for tau in (2.0, -2.0)]
    ds, value = received(emitter, points)
    np.testing.assert_allclose(value[:, 0], [3, 0])
    np.testing.assert_allclose(np.array(ds.d).T[0], -normal * turn, atol=1e-6)


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize("integrator", ["path", "volpath", "ptracer"])
@pytest.mark.parametrize("shift", [0.0, 10.0])
def test_rectangle_at_the_same_place(integrator, shift, measure, spot_meter, chance):
    """A shape exactly on the parallelogram neither blocks the beam nor is lit by it.

    The floor sees L = rho / pi E cos with and without the rectangle, near the origin of the world
    and far from it (where the ray offset of the stock ptracer tilts its connection to the camera by
    up to 0.5 %); the back of the rectangle stays black.
    """
    offset = np.array([shift, shift, 0.0])
    centre = ORIGIN + 0.5 * (U + V) + offset
    d = SLANT / np.linalg.norm(SLANT)
    to_world = np.eye(4)
    to_world[:3, 0], to_world[:3, 1] = U / 2, V / 2
    to_world[:3, 2], to_world[:3, 3] = np.cross(U, V), centre
    rectangle = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f(to_world),
        "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.5}},
    }
    for tau in (0.3, 4.0):
        at = centre + tau * d
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 2},
                "beam": beam(irradiance=4.0, origin=(ORIGIN + offset).tolist()),
                "rectangle": rectangle,
                "floor": plate(at, [0, 1, 0], size=0.2),
                "sensor": spot_meter(np.add(at, [0, 0.2, 0.2]), at, fov=20),
                "back": spot_meter(np.add(centre, [0, 2, 0.1]), centre, fov=20),
            }
        )
        runs = mi.load_dict({"type": integrator, "max_depth": 2})
        # few particles hit the small plate; the two others have no variance
        spp = 50000 if integrator == "ptracer" else 16
        measured = measure(scene, spp=spp, runs=16, integrator=runs)
        chance.equal(measured, 0.5 / np.pi * 4.0 * -d[1], allowed=5e-3, precision=0.02, of=2)
        back = np.array(mi.render(scene, sensor=1, spp=64, integrator=runs))
        assert back.max() == 0.0


def test_blockers_cast_sharp_shadows(measure, spot_meter):
    """Whatever lies in the beam occludes it fully."""
    at = in_beam(0.5, 0.5, 3.0)
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "beam": beam(),
        "floor": plate(at, [0, 1, 0]),
        "ball": {"type": "sphere", "center": in_beam(0.5, 0.5, 1.0).tolist(), "radius": 0.3},
        "sensor": spot_meter(np.add(at, [1.0, 0.5, 0]), at),
    }
    assert np.array(mi.render(mi.load_dict(scene), spp=16)).max() == 0.0


def room(integrator, light):
    """The beam on a floor and a wall, seen by a camera."""
    t = mi.ScalarTransform4f()
    return {
        "type": "scene",
        "integrator": integrator,
        "light": light,
        "floor": {
            "type": "rectangle",
            "to_world": t.rotate([1, 0, 0], -90).scale(3),
            "bsdf": {"type": "diffuse", "reflectance": 0.7},
        },
        "wall": {
            "type": "rectangle",
            "to_world": t.translate([0, 2, -1.2]).scale(3),
            "bsdf": {"type": "diffuse", "reflectance": 0.5},
        },
        "sensor": {
            "type": "perspective",
            "fov": 50,
            "to_world": t.look_at(origin=[0, 3, 7], target=[0, 0.7, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
        },
    }


@pytest.mark.false_alarms(1e-3)
def test_particles_and_paths_make_the_same_picture(measure, chance):
    """ptracer against path, three bounces."""
    scene = mi.load_dict(room({"type": "path", "max_depth": 4}, beam()))
    particles = mi.load_dict({"type": "ptracer", "max_depth": 4})
    measured = measure(scene, spp=768, runs=32, integrator=particles)
    chance.equal(measured, measure(scene, spp=512, runs=32), precision=4e-3)


def test_power_of_the_particles():
    """Every particle carries irradiance times the cross-section |(U x V) . D|, along D."""
    emitter = mi.load_dict(beam())
    ray, weight = emitter.sample_ray(
        mi.Float(0), mi.Float(0.5), mi.Point2f([0.2, 0.9], [0.4, 0.1]), mi.Point2f(0.5)
    )
    d = SLANT / np.linalg.norm(SLANT)
    np.testing.assert_allclose(np.array(weight).T[0, 0], 3 * abs(np.cross(U, V) @ d), rtol=1e-6)
    np.testing.assert_allclose(np.array(ray.d).ravel(), d, rtol=1e-6)
    expected = [in_beam(0.2, 0.4, 0), in_beam(0.9, 0.1, 0)]
    np.testing.assert_allclose(np.array(ray.o).T, expected, atol=1e-3)


@pytest.mark.false_alarms(1e-3)
def test_fog_attenuates_by_beer_lambert(measure, agrees, spot_meter):
    """An absorbing medium leaves exp(-sigma_t (tau + s)) over the beam tau and the view s."""
    sigma_t, tau = 0.3, 3.0
    at = in_beam(0.5, 0.5, tau)
    eye = np.add(at, [0, 1.5, 0])
    fog = {"type": "homogeneous", "albedo": 0.0, "sigma_t": sigma_t}
    walls = {
        "type": "cube",
        "to_world": mi.ScalarTransform4f().scale(20),
        "bsdf": {"type": "null"},
        "interior": {"type": "ref", "id": "fog"},
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            "fog": {**fog, "id": "fog"},
            "integrator": {"type": "volpath", "max_depth": 3},
            "beam": beam(irradiance=4.0),
            "walls": walls,
            "floor": plate(at, [0, 1, 0]),
            "sensor": {
                **spot_meter(eye, at),
                "near_clip": 1e-4,  # no medium is seen before the near plane
                "medium": {"type": "ref", "id": "fog"},
            },
        }
    )
    cos = -SLANT[1] / np.linalg.norm(SLANT)
    expected = 0.5 / np.pi * 4.0 * cos * np.exp(-sigma_t * (tau + 1.5))
    agrees(measure(scene, spp=4096, runs=32), expected)


def test_texture_is_projected_like_a_slide():
    """u runs along U and v along V: the two texels of a row light the two halves along U."""
    slide = mi.Bitmap(np.array([[[1.0, 1, 1], [5.0, 5, 5]]], dtype=np.float32))
    texture = {"type": "bitmap", "bitmap": slide, "raw": True, "filter_type": "nearest"}
    emitter = mi.load_dict(beam(irradiance=texture))
    _, value = received(emitter, [in_beam(0.2, 0.7, 2.0), in_beam(0.8, 0.7, 2.0)])
    np.testing.assert_allclose(value[:, 0], [1.0, 5.0])


def test_parameters_follow_traverse():
    """Corner, edges, direction and irradiance can be changed after loading."""
    emitter = mi.load_dict({"type": "parallelbeam"})
    params = mi.traverse(emitter)
    params["origin"] = [0, 0, 1]
    params["edge_u"] = [0, 3, 0]
    params["edge_v"] = [3, 0, 0]
    params["irradiance.value"] = 7.0
    params.update()
    _, value = received(emitter, [[2, 2, 0], [2, 2, 2]])
    np.testing.assert_allclose(value[:, 0], [7, 0])
    params["direction"] = [0, 0, 9]
    params.update()
    _, value = received(emitter, [[2, 2, 0], [2, 2, 2]])
    np.testing.assert_allclose(value[:, 0], [0, 7])


def test_xml():
    """Corner, edges and direction are ordinary XML points and vectors."""
    emitter = mi.load_string(
        """<emitter version="3.0.0" type="parallelbeam">
             <point name="origin" value="-1, 4, -1"/>
             <vector name="edge_u" value="2, 0, 0"/> <vector name="edge_v" value="0, 0, 2"/>
             <vector name="direction" value="0, -1, 0"/> <rgb name="irradiance" value="3, 2, 1"/>
           </emitter>"""
    )
    _, value = received(emitter, [[0, 0, 0]])
    np.testing.assert_allclose(value[0], [3, 2, 1])


@pytest.mark.parametrize(
    "parameters",
    [{"direction": [1, 0, 0]}, {"direction": [0, 0, 0]}, {"edge_v": [0, 0, 0]}],
)
def test_flat_beams_are_refused(parameters):
    """A direction in the plane, or no plane at all."""
    edges = {"edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}
    with pytest.raises(Exception, match=r"parallelbeam|direction"):
        mi.load_dict(beam(**{**edges, **parameters}))


@pytest.mark.false_alarms(1e-3)
def test_spectral_variant_gives_the_same_colours(measure, chance):
    """A grey floor in a coloured beam: the spectral picture is the RGB one to 0.5 %."""
    means = []
    for variant in ("llvm_ad_rgb", "llvm_ad_spectral"):
        mi.set_variant(variant)
        light = beam(irradiance={"type": "rgb", "value": [0.9, 0.6, 0.3]})
        for integrator in ("path", "ptracer"):
            scene = mi.load_dict(room({"type": integrator, "max_depth": 2}, light))
            means.append(measure(scene, spp=2048, runs=16))
    for other in means[1:]:
        chance.equal(other, means[0], allowed=5e-3, precision=8e-3, of=3)
